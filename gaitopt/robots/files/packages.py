"""Robots by the names of packages that collect them: robot_descriptions and mujoco_menagerie.

Both packages download a robot's files when it is asked for the first time, and keep them.
"""

from __future__ import annotations

import contextlib
import importlib
import importlib.util
import re
import sys
from collections.abc import Mapping
from pathlib import Path

from gaitopt.errors import MissingPackageError, RobotError

DESCRIPTIONS, MENAGERIE = "robot_descriptions", "mujoco_menagerie"
_DESCRIPTION = re.compile(r"[a-z]\w*_description")


def packaged_robot(name: str) -> tuple[Path, Mapping[str, str]] | None:
    """The file of a robot of one of the two packages, and its xacro arguments.

    Args:
        name: as the packages have it: ``go1_description``, ``go1_mj_description``; ``unitree_go1``.

    Returns:
        ``None`` for a name that neither knows.

    Raises:
        MissingPackageError: the name is one of robot_descriptions', which is not installed.
        RobotError: the files cannot be had.
    """
    if _DESCRIPTION.fullmatch(name):
        return _description(name)
    if importlib.util.find_spec(MENAGERIE) is None:
        return None
    menagerie = importlib.import_module(MENAGERIE)
    if name not in menagerie.names():
        return None
    try:
        robot = menagerie.get(name)
        return Path(robot.xml(robot.default_model)), {}
    except Exception as error:  # whatever downloading raises
        raise _unavailable(name, MENAGERIE, error) from error


def _description(name: str) -> tuple[Path, Mapping[str, str]] | None:
    """The file of a module of robot_descriptions."""
    if importlib.util.find_spec(DESCRIPTIONS) is None:
        raise MissingPackageError(
            f"robot {name!r} needs the package robot_descriptions: pip install robot_descriptions"
        )
    if importlib.util.find_spec(f"{DESCRIPTIONS}.{name}") is None:
        return None
    try:
        # What it says of its downloads is no output of ours.
        with contextlib.redirect_stdout(sys.stderr):
            module = importlib.import_module(f"{DESCRIPTIONS}.{name}")
    except Exception as error:  # the module downloads while it is imported
        raise _unavailable(name, DESCRIPTIONS, error) from error
    kinds = ("URDF_PATH", "MJCF_PATH", "XACRO_PATH")
    # A module that is called after MJCF may name a URDF, too.
    for attribute in sorted(kinds, key="MJCF_PATH".__ne__) if "_mj_" in name else kinds:
        path = getattr(module, attribute, None)
        if path:
            return Path(path), dict(getattr(module, "XACRO_ARGS", {}))
    raise RobotError(f"{name}: this module of {DESCRIPTIONS} names no file of a robot")


def _unavailable(name: str, package: str, error: Exception) -> RobotError:
    words = " ".join(str(error).split())[:300]
    return RobotError(
        f"robot {name!r}: {package} downloads its files at first use, and that failed: "
        f"{type(error).__name__} {words}; connect, or give the path of the robot's own file"
    )
