"""Robots by name: gaitopt's own, those of example-robot-data, or any URDF file."""

from __future__ import annotations

import math
from collections.abc import Mapping
from importlib import resources
from pathlib import Path
from typing import Final

from gaitopt.errors import MissingPackageError, RobotError
from gaitopt.files import StrPath, read_bounded
from gaitopt.robots.quadruped import Quadruped
from gaitopt.robots.urdf_text import LIMIT as URDF_LIMIT
from gaitopt.robots.urdf_text import with_velocity_limit

OWN_ROBOTS: Final[tuple[str, ...]] = ("wang2020", "frog1")
"""Robots whose URDF is shipped with gaitopt."""

VARIANTS: Final[Mapping[str, tuple[str, float]]] = {"wang2020-fast": ("wang2020", 300.0)}
"""Robots that are others with another velocity limit of their joints [deg/s].

With joints of 17 deg/s wang2020 cannot trot. 300 deg/s is about what the motors of small robots
reach, and lets it trot without a URDF from elsewhere.
"""

EXAMPLE_ROBOTS: Final[tuple[str, ...]] = (
    "a1", "go1", "go2", "b1", "laikago", "anymal", "anymal_c", "hyq", "solo12", "solo8",
    "quadruped",
)  # fmt: skip
"""Quadrupeds of the package ``example-robot-data`` (extra ``robots``)."""


def robot_names() -> tuple[str, ...]:
    """Every name that :func:`load_robot` knows."""
    return OWN_ROBOTS + tuple(VARIANTS) + EXAMPLE_ROBOTS


def load_robot(source: StrPath, knees: Mapping[str, str] | None = None) -> Quadruped:
    """Load a robot by name or from a URDF file.

    Args:
        source: ``"wang2020"``, ``"wang2020-fast"`` (the same with joints of 300 deg/s),
            ``"frog1"``, the name of one of example-robot-data's quadrupeds (see
            :func:`robot_names`), or a path to a URDF file.
        knees: side per leg, ``"forward"`` or ``"backward"``, where the knee's limits leave both
            open; front knees backward and hind knees forward by default.

    Raises:
        RobotError: unknown name, unreadable or malformed URDF, or no quadruped that gaitopt can
            plan for; the message says which joint or leg.
        MissingPackageError: the name is one of example-robot-data's, which is not installed.
    """
    text = str(source)
    if text in OWN_ROBOTS:
        return Quadruped.from_urdf(own_urdf(text).read_text("utf-8"), text, knees)
    if text in VARIANTS:
        name, limit = VARIANTS[text]
        urdf = with_velocity_limit(own_urdf(name).read_text("utf-8"), math.radians(limit))
        return Quadruped.from_urdf(urdf, text, knees)
    if text in EXAMPLE_ROBOTS:
        path = example_urdf(text)
        return Quadruped.from_urdf(path.read_text("utf-8"), text, knees)
    path = Path(source)
    if not _is_file(path):
        if path.suffix or len(path.parts) > 1:
            raise RobotError(f"no URDF file at {path}; give an existing file or a robot's name")
        raise RobotError(
            f"unknown robot {text!r}; known are {', '.join(robot_names())}, or give a path to a "
            "URDF file"
        )
    data = read_bounded(path, URDF_LIMIT, RobotError)
    try:
        urdf = data.decode("utf-8")
    except UnicodeDecodeError as error:
        raise RobotError(f"{path} is no text in UTF-8 (byte {error.start}); a URDF is") from error
    return Quadruped.from_urdf(urdf, path.stem, knees)


def _is_file(path: Path) -> bool:
    """Whether a file is there; false also for what cannot be a path."""
    try:
        return path.is_file()
    except (OSError, ValueError):  # a name too long, a folder that is closed, a null character
        return False


def own_urdf(name: str) -> Path:
    """Path of a URDF shipped with gaitopt: inside the wheel, or in a checkout's ``urdf/``."""
    package = Path(str(resources.files("gaitopt")))
    for folder in (package / "urdf", package.parent / "urdf"):
        if (folder / f"{name}.urdf").is_file():
            return folder / f"{name}.urdf"
    raise RobotError(f"{name}.urdf is missing from this installation of gaitopt; reinstall it")


def example_urdf(name: str) -> Path:
    """Path of an example-robot-data quadruped's URDF."""
    try:
        import pinocchio  # noqa: F401  (puts the folder of cmeel's packages on the path)
        from example_robot_data.robots_loader import ROBOTS, getModelPath
    except ImportError as error:
        raise MissingPackageError(
            f"robot {name!r} needs the packages example-robot-data and -loaders: "
            "pip install 'gaitopt[robots]'"
        ) from error
    loader = ROBOTS[name]
    inside = "/".join((loader.path, loader.urdf_subpath, loader.urdf_filename))
    return Path(getModelPath(inside)) / inside
