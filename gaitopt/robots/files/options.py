"""What a user says of a robot file, beside the file itself."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from gaitopt.conventions import LEGS
from gaitopt.errors import InputError
from gaitopt.inputs import check_number
from gaitopt.robots.files.notes import LARGEST_RADIUS
from gaitopt.robots.leg_names import leg_of

PerJoint = float | Mapping[str, float]
"""A number for all joints of the legs, or numbers by the names of joints."""

NO_MASSES, FROM_SHAPES = "none", "shapes"
"""What ``masses`` may say instead of numbers."""


@dataclass(frozen=True)
class ReadOptions:
    """How a robot file is read, where the file leaves a choice or is wrong.

    Attributes:
        legs: foot link or last joint of every leg, by the leg's name.
        feet: the foot of a leg, by the leg's name: a link, or a link and a place ``(3,)`` in its
            frame [m].
        foot_radius: radius of the feet [m].
        pose: positions of joints that belong to no leg, by name [rad, m]; they are locked there.
        masses: of links by name [kg]; ``"shapes"`` to estimate them all from the links' shapes; or
            ``"none"`` to do without.
        velocity_limits, effort_limits: of the legs' joints [rad/s], [N m].
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
    package_folders: Sequence[Path] = ()
    xacro_arguments: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for name in ("legs", "feet"):
            given = getattr(self, name)
            if given is not None:
                object.__setattr__(self, name, by_leg(name, given))
        for leg, foot in (self.feet or {}).items():
            self._check_foot(leg, foot)
        for leg, end in (self.legs or {}).items():
            if not isinstance(end, str):
                raise InputError(f"legs: {leg}: give the name of a joint or link, got {end!r}")
        if self.foot_radius is not None:
            check_number("foot_radius", self.foot_radius, 0.0, LARGEST_RADIUS, "m")
        for joint, at in self.pose.items():
            check_number(f"pose: {joint}", at, -100.0, 100.0)
        if isinstance(self.masses, str) and self.masses not in (NO_MASSES, FROM_SHAPES):
            raise InputError(
                f"masses must be kilograms by link, '{FROM_SHAPES}' or '{NO_MASSES}', got "
                f"{self.masses!r}"
            )
        if isinstance(self.masses, Mapping):
            for link, mass in self.masses.items():
                check_number(f"masses: {link}", mass, 1e-9, 1e6, "kg")
        for name, unit in (("velocity_limits", "rad/s"), ("effort_limits", "N m")):
            given = getattr(self, name)
            for joint, value in given.items() if isinstance(given, Mapping) else [("", given)]:
                if value is not None:
                    check_number(f"{name} {joint}".strip(), value, 1e-6, 1e6, unit)

    @staticmethod
    def _check_foot(leg: str, foot: Any) -> None:
        """Refuse a foot that is neither a link, nor a link and a place."""
        if isinstance(foot, str):
            return
        try:
            link, place = foot
            numbers = np.asarray(place, dtype=np.float64)
        except (TypeError, ValueError):
            link, numbers = None, np.zeros(0)
        if not isinstance(link, str) or numbers.shape != (3,) or not np.isfinite(numbers).all():
            raise InputError(
                f"feet: {leg}: give the name of a link, or a name and a place (x, y, z) in its "
                f"frame, got {foot!r}"
            )

    @property
    def empty(self) -> bool:
        """Whether nothing is said of the robot."""
        return self == ReadOptions(
            package_folders=self.package_folders, xacro_arguments=self.xacro_arguments
        )


def by_leg(what: str, given: Mapping[str, Any]) -> dict[str, Any]:
    """A mapping whose keys are legs under any name, with the names of :data:`gaitopt.LEGS`.

    Raises:
        InputError: it is no mapping, a key names no leg, or two name the same.
    """
    if not isinstance(given, Mapping):
        raise InputError(f"{what} must map legs to values, got {given!r}")
    out: dict[str, Any] = {}
    for key, value in given.items():
        leg = leg_of(str(key))
        if leg is None or leg in out:
            raise InputError(
                f"{what}: {key!r} is no leg, or a second name of one; legs are {', '.join(LEGS)} "
                "(FL, RL, RR, FR and front_left are understood, too)"
            )
        out[leg] = value
    return {leg: out[leg] for leg in LEGS if leg in out}
