"""What a planner is asked for, as data. A plan carries its settings, so that it can be checked.

Each planner has one class of settings: frozen, validated, printable. Its fields are the keyword
arguments of the planner. The bare defaults are the numbers of the papers' robot;
:meth:`PlanSettings.for_robot` fits lengths to any other robot.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields, is_dataclass, replace
from difflib import get_close_matches
from typing import Any, ClassVar, TypeVar

import numpy as np

from gaitopt.arguments import checked
from gaitopt.conventions import FloatArray
from gaitopt.dynamics.contacts import ForceLimits
from gaitopt.errors import InputError
from gaitopt.inputs import as_text, check_array, check_choice, check_kind, check_number, is_real
from gaitopt.robots.quadruped import Quadruped
from gaitopt.terrain.obstacles import Obstacle

SWING_SHARE = 0.175
"""Swing height as a share of the standing height: the 7 cm at 0.40 m that wang2020 walks with."""
FOLD_SHARE = 0.3
"""Largest such height as a share of what the legs can fold by, for knees that bend little. Chosen:
it lowers the swings of a Bittle, whose legs fold by 17 mm, and of none of example-robot-data's."""
MARGIN_SHARE = 0.05
"""Stability margin and clearance as a share of the standing height: 2 cm at 0.40 m."""

VELOCITY, FORCES = "velocity", "forces"
"""The two timings."""

Kind = TypeVar("Kind", bound="PlanSettings")
LARGEST_ANGLE = 1e6
"""Largest angle that may be meant in degrees."""
FULL_TURN = 2.0 * math.pi
"""[rad]."""


@dataclass(frozen=True)
class PlanSettings:
    """What every plan says of itself, and its certificate holds it to; planners add their own.

    Attributes:
        stability_margin: static stability margin of the body centre while a foot flies [m].
        body_height: height of the hips above the mean height of the footholds [m].
        swing_height: how far a foot rises above the higher end of its swing [m].
        reach_fraction: share of each leg's reach that is used. Walks phase by phase that forces
            time use 0.97 of it where that is enough.
        heading: direction in which the body faces at the start, from the world's x axis [rad].
        acceleration_limit: of every joint [rad/s^2]; ``None`` where nothing is claimed.
        jerk_limit: of every joint [rad/s^3]; ``None`` where nothing is claimed.
        timing: ``"forces"``: as fast as contact forces and joint torques allow; ``"velocity"``: as
            fast as the joints' velocities allow, and nothing is said of forces.
        forces: limits within which contact forces and joint torques must make the motion at every
            instant; with the timing ``"forces"`` those of :class:`gaitopt.ForceLimits` by default.
    """

    planner: ClassVar[str] = ""
    least_support: ClassVar[int] = 3
    """Fewest feet that ever stand."""

    stability_margin: float = 0.02
    body_height: float = 0.40
    swing_height: float = 0.07
    reach_fraction: float = 1.0
    heading: float = 0.0
    acceleration_limit: float | None = None
    jerk_limit: float | None = None
    timing: str = VELOCITY
    forces: ForceLimits | None = None

    def __post_init__(self) -> None:
        self._set_forces()
        set_number(self, "stability_margin", 0.0, 10.0, "m")
        set_number(self, "body_height", 1e-3, 100.0, "m")
        set_number(self, "swing_height", 0.0, 100.0, "m")
        set_number(self, "reach_fraction", 1e-3, 1.0, "")
        self._set_heading()
        for name, unit in (("acceleration_limit", "rad/s^2"), ("jerk_limit", "rad/s^3")):
            if getattr(self, name) is not None:
                set_number(self, name, 1e-9, 1e12, unit)

    def _set_heading(self) -> None:
        """Make the heading a float, when it is within a full turn; more is meant in degrees."""
        given, hint = self.heading, ""
        if is_real(given) and abs(given) < LARGEST_ANGLE:
            hint = f" ({given:g} degrees are {math.radians(given):.4f} rad)"
        set_number(self, "heading", -FULL_TURN, FULL_TURN, "rad", hint)

    @classmethod
    def for_robot(cls: type[Kind], robot: Quadruped, **options: Any) -> Kind:
        """Settings whose lengths fit a robot, save for those that are given.

        Args:
            robot: from :func:`gaitopt.load_robot`.
            options: fields by name; ``None`` leaves a length to be fitted.

        Raises:
            InputError: a field is unknown, or a value is out of range.
        """
        check_kind("robot", robot, Quadruped)
        check_names(cls, options)
        fitted = {k: v for k, v in cls.fitted(robot).items() if options.get(k) is None}
        return cls(**{**options, **fitted})

    @classmethod
    def fitted(cls, robot: Quadruped) -> dict[str, Any]:
        """The fields that depend on the robot's size, by name.

        For wang2020 they are the numbers of [Wang2020] and those chosen for it here.
        """
        height = robot.standing_height
        fold = min(leg.reach - leg.least_reach for leg in robot.legs.values())
        return {
            "stability_margin": round(MARGIN_SHARE * height, 4),
            "body_height": height,
            "swing_height": round(min(SWING_SHARE * height, FOLD_SHARE * fold), 4),
        }

    def joint_accelerations(self, robot: Quadruped) -> FloatArray:
        """Limit of every joint's acceleration ``(nj,)`` [rad/s^2]; infinite where there is none.

        It is the lower one of what is claimed here and of the robot's own.
        """
        check_kind("robot", robot, Quadruped)
        limit = np.inf if self.acceleration_limit is None else self.acceleration_limit
        return np.minimum(limit, robot.acceleration_limits)

    @checked
    def within(self: Kind, robot: Quadruped) -> Kind:
        """The same, where the robot's own limits of accelerations are no lower; or with these."""
        return self

    @property
    def static(self) -> bool:
        """Whether static stability is promised at every instant."""
        return True

    @property
    def obstacles(self) -> tuple[Obstacle, ...]:
        """What is in the way, that the plan keeps clear of."""
        return ()

    @property
    def obstacle_clearance(self) -> float:
        """Distance that every part of the robot keeps from the obstacles [m]."""
        return 0.0

    @property
    def true_com(self) -> bool:
        """Whether the margin is promised of the true centre of mass, and not of the body's."""
        return False

    @property
    def promised_forces(self) -> ForceLimits | None:
        """Limits within which forces and torques are promised to make the motion; or ``None``."""
        return self.forces

    @property
    def usual_forces(self) -> ForceLimits:
        """The limits on forces and torques where none are given."""
        return ForceLimits()

    @checked
    def with_forces(self: Kind, limits: ForceLimits) -> Kind:
        """The settings of the same motion, timed by forces within these limits."""
        return replace(self, timing=FORCES, forces=limits)

    def _set_forces(self) -> None:
        """Check timing and forces, and complete them."""
        check_choice("timing", self.timing, (FORCES, VELOCITY))
        forces = self.forces
        if isinstance(forces, Mapping):
            forces = ForceLimits.from_dict(forces)
        if not isinstance(forces, (ForceLimits, type(None))):
            raise InputError(f"forces must be ForceLimits or None, got {as_text(forces)}")
        if self.timing == VELOCITY and forces is not None:
            raise InputError(
                "forces are limits of the timing 'forces', got forces and the timing 'velocity'; "
                "leave one of them out"
            )
        if self.timing == FORCES and forces is None:
            forces = self.usual_forces
        object.__setattr__(self, "forces", forces)

    @property
    def zmp_margin(self) -> float | None:
        """Margin that the ZMP of the body's centre was asked to keep [m]; ``None`` for none.

        Where none was asked for, a plan may still tell in its ``info`` of one that was found.
        """
        return None

    @checked
    def swing_legs(self, footholds: int | Mapping[str, int]) -> list[str] | None:
        """The legs in the order in which they lift off; ``None`` where any order will do.

        Args:
            footholds: of each leg, or one number for all.
        """
        return None

    def to_dict(self) -> dict[str, Any]:
        """The settings as plain JSON values."""
        return {f.name: _plain(getattr(self, f.name)) for f in fields(self)}


def check_names(kind: type[Any], options: Mapping[str, Any], *others: str) -> None:
    """Refuse options that are no field of the settings.

    Args:
        kind: the settings.
        options: what was given, by name.
        others: names that are known beside the fields.

    Raises:
        InputError: names the option, and the one that may have been meant; or it is an array
            where the field is a text.
    """
    known = [f.name for f in fields(kind)] + list(others)
    texts = [f.name for f in fields(kind) if f.type in ("str", "str | None")]
    for name in options:
        # An array compares with a text as many times as it has items.
        if name in texts and hasattr(options[name], "__array__"):
            raise InputError(f"{name} must be a text, got {as_text(options[name])}")
        if name not in known:
            of_forces = [f.name for f in fields(ForceLimits)] if "forces" in known else []
            near = get_close_matches(name, [*known, *of_forces], n=1)
            hint = f"; did you mean {near[0]}?" if near else f"; there are {', '.join(known)}"
            if near and near[0] in of_forces:
                hint = f"; forces=gaitopt.ForceLimits({near[0]}=...) sets that limit on forces"
            raise InputError(f"{kind.__name__} has no setting {name!r}{hint}")


def check_place(name: str, given: Any) -> tuple[float, float] | None:
    """A horizontal place as two finite numbers (x, y) in metres, or ``None``.

    Raises:
        InputError: it is neither.
    """
    if given is None:
        return None
    try:
        place = check_array(name, given)
    except InputError:
        place = np.empty(0)
    if place.shape != (2,) or not np.isfinite(place).all():
        raise InputError(
            f"{name} must be two finite numbers (x, y) in metres, got {as_text(given)}"
        )
    return float(place[0]), float(place[1])


def _plain(value: Any) -> Any:
    if hasattr(value, "to_dict"):
        return _plain(value.to_dict())
    if isinstance(value, (tuple, list)):
        return [_plain(v) for v in value]
    if is_dataclass(value) and not isinstance(value, type):
        return _plain(asdict(value))
    if isinstance(value, Mapping):
        return {str(k): _plain(v) for k, v in value.items()}
    return value


def set_number(
    settings: object, name: str, low: float, high: float, unit: str, hint: str = ""
) -> None:
    """Make a field of frozen settings a float, when it is a number from ``low`` to ``high``."""
    value = check_number(name, getattr(settings, name), low, high, unit, hint)
    object.__setattr__(settings, name, value)


def set_flag(settings: object, name: str) -> None:
    """Make a field of frozen settings a bool, when it is true or false."""
    value = getattr(settings, name)
    if not isinstance(value, (bool, np.bool_)):
        raise InputError(f"{name} must be True or False, got {as_text(value)}")
    object.__setattr__(settings, name, bool(value))
