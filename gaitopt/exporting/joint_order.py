"""Which joints a file has, in which order, under which names."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from difflib import get_close_matches

import numpy as np

from gaitopt.errors import InputError
from gaitopt.exporting.controller_file import controller_joints
from gaitopt.exporting.names import check_names
from gaitopt.files import StrPath
from gaitopt.inputs import as_text, check_tuple

Joints = StrPath | Iterable[str] | Mapping[str, str] | None
"""What ``joints`` may be: see :func:`joint_order`."""


@dataclass(frozen=True, eq=False)
class JointOrder:
    """Joints of a file.

    Attributes:
        names: of its joints, as they stand in the file.
        columns: of each, its place in the plan's ``joint_names`` ``(n,)``.
        left_out: the plan's joints that the file does not have.
    """

    names: tuple[str, ...]
    columns: np.ndarray
    left_out: tuple[str, ...]

    def __len__(self) -> int:
        return len(self.names)


def joint_order(
    known: tuple[str, ...], joints: Joints = None, prefix: str = "", controller: str | None = None
) -> JointOrder:
    """Joints in the order of a consumer, under its names.

    Args:
        known: the plan's joints.
        joints: what the consumer has: names in its order; new names by the plan's names; or the
            path of a controller's parameter file (YAML of ros2_control), whose list ``joints``
            counts. All of the plan's joints in its order by default.
        prefix: begins every name in the file, for instance ``"robot1_"``; lists and parameter files
            may have it or not.
        controller: the controller in a parameter file that has several.

    Raises:
        InputError: a name is unknown, stands twice or is not safe to write, or the file cannot be
            read.
    """
    if not isinstance(prefix, str):
        raise InputError(f"prefix must be a text, got {as_text(prefix)}")
    renamed = _renamed(known, joints, prefix, controller)
    columns = {name: i for i, name in enumerate(known)}
    names = check_names(renamed.values())
    if not names:
        raise InputError("joints is empty: name the joints of the consumer, in its order")
    return JointOrder(
        names=names,
        columns=np.array([columns[name] for name in renamed]),
        left_out=tuple(name for name in known if name not in renamed),
    )


def _renamed(
    known: tuple[str, ...], joints: Joints, prefix: str, controller: str | None
) -> dict[str, str]:
    """Names in the file by those of the plan, in the order of the file."""
    if joints is None:
        return {name: prefix + name for name in known}
    if isinstance(joints, Mapping):
        for name in joints:
            _known(str(name), known)
        return {str(old): f"{prefix}{new}" for old, new in joints.items()}
    listed: Iterable[str] = (
        controller_joints(joints, controller)
        if isinstance(joints, (str, os.PathLike))
        else check_tuple("joints", joints)
    )
    out: dict[str, str] = {}
    for name in check_names(listed):
        bare = name[len(prefix) :] if name not in known and name.startswith(prefix) else name
        out[_known(bare, known)] = prefix + bare
    return out


def _known(name: str, known: tuple[str, ...]) -> str:
    """A name, if the plan has it."""
    if name in known:
        return name
    near = get_close_matches(name, known, n=1)
    hint = f"did you mean {near[0]}?" if near else f"it has {', '.join(known)}."
    raise InputError(
        f"the plan has no joint {name!a}; {hint} New names: joints={{'old': 'new', ...}}"
    )
