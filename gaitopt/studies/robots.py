"""Robots of studies: a row belongs to the robot's content, and not to a name or a path."""

from __future__ import annotations

import hashlib
import warnings
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from functools import lru_cache
from typing import TYPE_CHECKING

from gaitopt.errors import GaitoptError, RobotError, RobotWarning

if TYPE_CHECKING:
    from gaitopt.robots.quadruped import Quadruped

_expected: dict[str, str] = {}
"""Contents of the robots of the study that this process works for, by name or path."""


def contents_of(sources: Iterable[str]) -> dict[str, str]:
    """Fingerprint of each robot: URDF with all that was read, and hulls of its meshes.

    Args:
        sources: names or paths, as for :func:`gaitopt.load_robot`. The fingerprint of a robot that
            cannot be loaded is empty: its rows will say why.
    """
    return {source: _content(source) for source in sorted(set(sources))}


@contextmanager
def expecting(contents: Mapping[str, str]) -> Iterator[None]:
    """Inside the block :func:`study_robot` refuses robots with other contents."""
    _expected.update(contents)
    try:
        yield
    finally:
        _expected.clear()


def study_robot(source: str) -> Quadruped:
    """Load a robot of a study; in a study each process loads it once.

    Raises:
        RobotError: it cannot be loaded, or its file was changed since the study began.
    """
    from gaitopt.robots import catalog

    content = _expected.get(source, "")
    return _loaded(source, content) if content else catalog.load_robot(source)


@lru_cache(maxsize=8)
def _loaded(source: str, content: str) -> Quadruped:
    """A robot with a known content."""
    from gaitopt.robots.catalog import load_robot

    with warnings.catch_warnings():
        # The process that began the study has told them.
        warnings.simplefilter("ignore", RobotWarning)
        robot = load_robot(source)
    if _fingerprint(robot) != content:
        raise RobotError(
            f"{source} is another robot here than where the study began: it was changed since "
            "then, or this machine has another file there; run the study again"
        )
    return robot


def _content(source: str) -> str:
    from gaitopt.robots.catalog import load_robot

    try:
        return _fingerprint(load_robot(source))
    except (GaitoptError, OSError):
        return ""


def _fingerprint(robot: Quadruped) -> str:
    """Hash of all that a plan may depend on."""
    text = f"{robot.name}\n{robot.urdf}\n{robot.notes.hulls!r}"
    return hashlib.sha256(text.encode("utf-8", "replace")).hexdigest()
