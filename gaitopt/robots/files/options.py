"""What a user says of a robot file, beside the file itself."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from gaitopt.errors import InputError
from gaitopt.files import StrPath
from gaitopt.inputs import as_text, check_array, check_number
from gaitopt.robots.files.notes import (
    FASTEST,
    LARGEST_ACCELERATION,
    LARGEST_INERTIA,
    LARGEST_RADIUS,
    LEAST_ACCELERATION,
)
from gaitopt.robots.leg_names import by_leg

PerJoint = float | Mapping[str, float]
"""A number for all joints of the legs, or numbers by the names of joints."""

SpeedPair = tuple[float, float]
"""Two speeds: up to the first a motor has its whole torque, and at the second none [rad/s]."""
PairPerJoint = SpeedPair | Mapping[str, SpeedPair]

SMALLEST_UNIT, LARGEST_UNIT = 1e-6, 1e4
"""Units of length of a file that are taken for one [m]. Chosen."""
NO_MASSES, FROM_SHAPES, FROM_FILE = "none", "shapes", "file"
"""What ``masses`` may say instead of numbers."""


@dataclass(frozen=True)
class ReadOptions:
    """How a robot file is read, where the file leaves a choice or is wrong.

    Attributes:
        legs: foot link or last joint of every leg, by the leg's name.
        feet: the foot of a leg, by the leg's name: a link, or a link and a place ``(3,)`` in its
            frame [m].
        foot_radius: radius of the feet [m].
        ends_within: radius of balls that hold the ends of the legs [m]: the user does not say it,
            it was found when the file was read before, and is that of the feet.
        pose: positions of joints that belong to no leg, by name [rad, m]; they are locked there.
        masses: of links by name [kg]; ``"shapes"`` to estimate them all from the links' shapes;
            ``"file"`` to take only the inertias from the shapes; or ``"none"`` to do without.
        velocity_limits, effort_limits: of the legs' joints [rad/s], [N m].
        acceleration_limits: of the legs' joints [rad/s^2].
        motor_inertia: of the motors of the legs' joints, seen at the joints [kg m^2].
        torque_line: of the motors of the legs' joints.
        scale: the file's unit of length [m].
        package_folders: folders in which packages with meshes and xacro files lie.
        xacro_arguments: values of a xacro file's arguments, by name.

    Raises:
        InputError: an option is not valid; the message names it.
    """

    legs: Mapping[str, str] | None = None
    feet: Mapping[str, Any] | None = None
    foot_radius: float | None = None
    pose: Mapping[str, float] = field(default_factory=dict)
    masses: Mapping[str, float] | str | None = None
    velocity_limits: PerJoint | None = None
    effort_limits: PerJoint | None = None
    acceleration_limits: PerJoint | None = None
    motor_inertia: PerJoint | None = None
    torque_line: PairPerJoint | None = None
    scale: float | None = None
    package_folders: Sequence[Path] = ()
    xacro_arguments: Mapping[str, str] = field(default_factory=dict)
    ends_within: float | None = None

    def __post_init__(self) -> None:
        for name in ("legs", "feet"):
            given = getattr(self, name)
            if given is not None:
                object.__setattr__(self, name, by_leg(name, given))
        for name in ("pose", "xacro_arguments"):
            if not isinstance(getattr(self, name), Mapping):
                raise InputError(
                    f"{name} must map names to values, got {as_text(getattr(self, name))}"
                )
        for leg, foot in (self.feet or {}).items():
            self._check_foot(leg, foot)
        for leg, end in (self.legs or {}).items():
            if not isinstance(end, str):
                raise InputError(
                    f"legs: {leg}: give the name of a joint or link, got {as_text(end)}"
                )
        if self.foot_radius is not None:
            check_number("foot_radius", self.foot_radius, 0.0, LARGEST_RADIUS, "m")
        if self.scale is not None:
            check_number("scale", self.scale, SMALLEST_UNIT, LARGEST_UNIT, "m")
        for joint, at in self.pose.items():
            check_number(f"pose: {joint}", at, -100.0, 100.0)
        if isinstance(self.masses, Mapping):
            for link, mass in self.masses.items():
                check_number(f"masses: {link}", mass, 1e-9, 1e6, "kg")
        elif str(self.masses) not in ("None", NO_MASSES, FROM_SHAPES, FROM_FILE):
            raise InputError(
                f"masses must be kilograms by link, '{FROM_SHAPES}', '{FROM_FILE}' or "
                f"'{NO_MASSES}', got {as_text(self.masses)}"
            )
        for name, low, high, unit in (
            ("velocity_limits", 1e-6, 1e6, "rad/s"), ("effort_limits", 1e-6, 1e6, "N m"),
            ("acceleration_limits", LEAST_ACCELERATION, LARGEST_ACCELERATION, "rad/s^2"),
            ("motor_inertia", 0.0, LARGEST_INERTIA, "kg m^2"),
        ):  # fmt: skip
            object.__setattr__(self, name, _per_joint(name, getattr(self, name), low, high, unit))

        object.__setattr__(self, "torque_line", _pairs_per_joint(self.torque_line))

    @staticmethod
    def _check_foot(leg: str, foot: Any) -> None:
        """Refuse a foot that is neither a link, nor a link and a place."""
        if isinstance(foot, str):
            return
        try:
            link, place = foot
            numbers = check_array("place", place)
        except (TypeError, ValueError):
            link, numbers = None, np.zeros(0)
        if not isinstance(link, str) or numbers.shape != (3,) or not np.isfinite(numbers).all():
            raise InputError(
                f"feet: {leg}: give the name of a link, or a name and a place (x, y, z) in its "
                f"frame, got {as_text(foot)}"
            )

    @property
    def empty(self) -> bool:
        """Whether nothing is said of the robot."""
        return self == ReadOptions(
            package_folders=self.package_folders, xacro_arguments=self.xacro_arguments
        )


def folder_paths(given: Sequence[StrPath]) -> tuple[Path, ...]:
    """Folders of packages as paths.

    Raises:
        InputError: it is no list of paths, but one path, for example; or a folder is not there.
    """
    try:
        one = isinstance(given, (str, bytes, os.PathLike))
        folders = None if one else tuple(Path(folder) for folder in given)
    except TypeError:
        folders = None
    if folders is None:
        raise InputError(f"package_folders must be a list of folders, got {as_text(given)}")
    for folder in folders:
        if not _is_folder(folder):
            raise InputError(f"package_folders: there is no folder {str(folder)!r}")
    return folders


def _is_folder(path: Path) -> bool:
    """Whether a folder is there; false also for what cannot be a path."""
    try:
        return path.is_dir()
    except (OSError, ValueError):  # a name too long, a folder that is closed, a null character
        return False


def _per_joint(
    name: str, given: PerJoint | None, low: float, high: float, unit: str
) -> PerJoint | None:
    """Values of joints as plain numbers; raises InputError where one is out of range."""
    if given is None:
        return None
    if not isinstance(given, Mapping):
        return check_number(name, given, low, high, unit)
    return {j: check_number(f"{name} {j}", value, low, high, unit) for j, value in given.items()}


def _pairs_per_joint(given: PairPerJoint | None) -> PairPerJoint | None:
    """Torque lines as plain numbers; raises InputError where one is none."""
    if given is None:
        return None
    if isinstance(given, Mapping):
        return {joint: _pair(f"torque_line {joint}", pair) for joint, pair in given.items()}
    return _pair("torque_line", given)


def _pair(name: str, given: SpeedPair) -> SpeedPair:
    """The two speeds of a torque line; raises InputError where they are none."""
    try:
        full, none = given
    except (TypeError, ValueError):
        raise InputError(
            f"{name} must be two speeds in rad/s, up to which the motor has its whole torque and "
            f"at which it has none, got {as_text(given)}"
        ) from None
    low = check_number(f"{name}, speed with the whole torque,", full, 0.0, FASTEST, "rad/s")
    high = check_number(f"{name}, speed without load,", none, 1e-6, FASTEST, "rad/s")
    if not low < high:
        raise InputError(
            f"{name}: the speed without load, {high:g} rad/s, must be above the one with the whole "
            f"torque, {low:g} rad/s"
        )
    return low, high
