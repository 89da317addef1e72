"""The joints of a controller in a parameter file of ros2_control."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from gaitopt.errors import InputError, MissingPackageError
from gaitopt.files import StrPath, read_bounded
from gaitopt.robots.xml_text import shown

LARGEST = 1_000_000
"""Largest file that is read [bytes]: parameter files have some kilobytes."""
DEEPEST = 12
"""Most mappings inside one another that are looked into: namespaces, node, parameters."""
MOST = 10_000
"""Most mappings that are looked into: aliases can make a small file endless."""


def controller_joints(path: StrPath, controller: str | None = None) -> tuple[str, ...]:
    """The list ``joints`` of a controller, in its order.

    In such files a node's parameters stand below ``ros__parameters``, and a trajectory controller's
    list of joints is called ``joints``.

    Args:
        path: the YAML file.
        controller: name of the controller, where several have joints.

    Raises:
        InputError: the file cannot be read, is no YAML, or has not one such list.
        MissingPackageError: PyYAML is not installed.
    """
    found = dict(_lists(_loaded(path)))
    if controller is not None:
        if controller not in found:
            raise InputError(
                f"{path} has no controller {shown(controller)!r} with a list of joints; it has "
                f"{', '.join(map(shown, found)) or 'none'}"
            )
        return found[controller]
    if len(found) != 1:
        raise InputError(
            f"{path} has {len(found)} controllers with a list of joints"
            + (f" ({', '.join(map(shown, found))}); name one: controller='...'" if found
               else "; it needs <controller>: ros__parameters: joints: [...]")
        )  # fmt: skip
    return next(iter(found.values()))


def _loaded(path: StrPath) -> Any:
    try:
        import yaml
    except ImportError as error:
        raise MissingPackageError(
            "reading a controller's parameter file needs PyYAML: pip install 'gaitopt[ros]'"
        ) from error
    data = read_bounded(path, LARGEST, InputError)
    try:
        return yaml.safe_load(data)
    except (yaml.YAMLError, ValueError, RecursionError, TypeError) as error:
        raise InputError(f"{path} is no YAML: {shown(' '.join(str(error).split()))}") from error


def _lists(tree: Any) -> Iterator[tuple[str, tuple[str, ...]]]:
    """Names of controllers, each with its joints."""
    waiting: list[tuple[str, Any, int]] = [("", tree, 0)]
    for _ in range(MOST):
        if not waiting:
            return
        name, node, depth = waiting.pop(0)
        if not isinstance(node, dict) or depth > DEEPEST:
            continue
        parameters = node.get("ros__parameters")
        joints = parameters.get("joints") if isinstance(parameters, dict) else None
        if isinstance(joints, list) and all(isinstance(j, str) for j in joints) and joints:
            yield name, tuple(joints)
        waiting += [(str(key), value, depth + 1) for key, value in node.items()]
