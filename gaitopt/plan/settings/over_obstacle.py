"""What :func:`gaitopt.planners.over_obstacle.planner.plan_stride` was asked for."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from typing import Any, ClassVar

import numpy as np

from gaitopt.conventions import LEGS, FloatArray
from gaitopt.errors import InputError
from gaitopt.gait.crawl import SHAO_SEQUENCE, check_sequence, swing_order
from gaitopt.inputs import as_text, check_array, check_choice, check_count, check_tuple
from gaitopt.plan.settings.base import FORCES, PlanSettings, check_names, set_number
from gaitopt.plan.settings.over_footholds import force_margin
from gaitopt.robots.quadruped import Quadruped
from gaitopt.swing.obstacle_paths import PATTERNS, Pattern
from gaitopt.terrain.obstacles import Obstacle

MOST_CYCLES = 1000
"""Most cycles before or after the obstacle, so that a wrong number is refused."""
BODY_HEIGHTS = (0.90, 0.86, 0.82, 0.78, 0.74, 0.70)
"""Heights of the body that are tried, in shares of the legs' reach: higher legs lean less."""
FULL_SPEED = 0.5
"""Time to full speed that accelerations are chosen for, where none are given [s]; chosen here."""
PAPER_HEIGHT = 0.40
"""Standing height of wang2020, for which the margins of a walk over an obstacle were chosen [m]."""


@dataclass(frozen=True)
class StrideSettings(PlanSettings):
    """Settings of a walk over an obstacle ([Shao2011]).

    Attributes:
        obstacles: what is in the way; in the settings' dictionary as plain numbers.
        margin: distance that the ball of a foot keeps from it [m].
        clearance: distance that every part of the robot keeps from it [m].
        approach, leave: cycles before the first leg's stride over it, and after the last one's.
        sequence: order of the legs in a cycle; the paper's by default.
        pattern, waypoints: of the paths over it, see
            :func:`gaitopt.swing.obstacle_paths.obstacle_path`.
        accelerations, jerks: limits of each joint of a leg, from body to foot [rad/s^2],
            [rad/s^3]; empty jerks bound nothing. With jerks, swings start and end without
            acceleration.

    ``acceleration_limit`` and ``jerk_limit`` are the largest of ``accelerations`` and ``jerks``.
    The other fields are those of :class:`PlanSettings`.

    Raises:
        InputError: a value is out of range.
    """

    planner: ClassVar[str] = "stride"

    timing: str = FORCES
    obstacles: tuple[Obstacle, ...] = ()
    margin: float = 0.03
    clearance: float = 0.01
    approach: int = 1
    leave: int = 1
    sequence: tuple[str, ...] = SHAO_SEQUENCE
    pattern: Pattern = "parabola"
    waypoints: int = 13
    accelerations: tuple[float, ...] = ()
    jerks: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        super().__post_init__()
        obstacles = check_tuple("obstacles", self.obstacles)
        object.__setattr__(self, "obstacles", tuple(map(_obstacle, obstacles)))
        set_number(self, "margin", 1e-4, 10.0, "m")
        set_number(self, "clearance", 1e-3, 10.0, "m")
        for name in ("approach", "leave"):
            set_count(self, name, 0, MOST_CYCLES)
        object.__setattr__(self, "sequence", check_sequence(self.sequence))
        check_choice("pattern", self.pattern, PATTERNS)
        set_count(self, "waypoints", 3, MOST_CYCLES)
        for name in ("accelerations", "jerks"):
            object.__setattr__(self, name, _limits(name, getattr(self, name)))
        self._check_agreement()

    def _check_agreement(self) -> None:
        """Refuse a limit for all joints that is not the largest of those of the joints.

        Only those of the joints are kept: another number would promise what nobody keeps.

        Raises:
            InputError: the message names both.
        """
        for limit, joints in (("acceleration_limit", "accelerations"), ("jerk_limit", "jerks")):
            values = getattr(self, joints)
            if values and getattr(self, limit) not in (None, max(values)):
                raise InputError(
                    f"{limit} is {getattr(self, limit):g}, and the largest of {joints} is "
                    f"{max(values):g}: change {joints}, of which it is the largest"
                )

    @classmethod
    def for_robot(cls, robot: Quadruped, **options: Any) -> StrideSettings:
        """Settings that fit a robot, save for those that are given.

        The body is 0.9 of the legs' reach high, feet rise by a tenth of the reach over open ground,
        and each joint gets to its velocity limit in half a second. Margins are those of
        [Shao2011] for robots that stand 0.40 m high or more, and to scale for smaller ones. But
        with the timing ``"forces"`` the stability margin is that of walks over footholds, 0.07 of
        the standing height, so that every standing foot keeps its least normal force.

        Args:
            robot: from :func:`gaitopt.load_robot`.
            options: fields by name; ``acceleration_limit`` and ``jerk_limit`` may be one number
                for all joints, or one for each joint of a leg from body to foot.

        Raises:
            InputError: a field is unknown, or a value is out of range.
        """
        check_names(cls, options)
        given = {k: v for k, v in options.items() if v is not None}
        if given.get("timing", FORCES) == FORCES:
            given.setdefault("stability_margin", force_margin(robot))
        for limit, joints in (("acceleration_limit", "accelerations"), ("jerk_limit", "jerks")):
            if limit in given:
                given[joints] = _leg_values(robot, limit, given[limit])
            if given.get(joints):
                given[limit] = max(given[joints])
        return cls(**{**cls.fitted(robot), **given})

    @classmethod
    def fitted(cls, robot: Quadruped) -> dict[str, Any]:
        """The fields that depend on the robot's size and joints, by name."""
        reach = float(np.mean([leg.reach for leg in robot.legs.values()]))
        scale = min(1.0, robot.standing_height / PAPER_HEIGHT)
        limits = np.array([leg.velocity_limits for leg in robot.legs.values()])
        accelerations = tuple((limits.min(axis=0) / FULL_SPEED).tolist())
        return {
            "stability_margin": round(0.02 * scale, 4), "margin": round(0.03 * scale, 4),
            "clearance": round(0.01 * scale, 4), "body_height": BODY_HEIGHTS[0] * reach,
            "swing_height": round(0.1 * reach, 3), "reach_fraction": 0.98,
            "accelerations": accelerations, "acceleration_limit": max(accelerations),
        }  # fmt: skip

    def joint_accelerations(self, robot: Quadruped) -> FloatArray:
        """Limit of every joint's acceleration ``(nj,)`` [rad/s^2].

        Joints of no leg, which never move, have the largest of the others.
        """
        limits = super().joint_accelerations(robot)
        if self.accelerations:
            for leg in LEGS:
                columns = list(robot.leg_columns[leg])
                limits[columns] = np.minimum(robot.acceleration_limits[columns], self.accelerations)
        return limits

    def within(self, robot: Quadruped) -> StrideSettings:
        """The same, with no joint's limit above the lowest of the robot's joints of its kind."""
        own = np.array([robot.acceleration_limits[list(robot.leg_columns[leg])] for leg in LEGS])
        least = own.min(axis=0)
        if not np.isfinite(least).any():
            return self
        now = self.accelerations or (np.inf,) * len(least)
        accelerations = tuple(np.minimum(least, now).tolist())
        return replace(self, accelerations=accelerations, acceleration_limit=max(accelerations))

    @property
    def obstacle_clearance(self) -> float:
        """Distance that every part of the robot keeps from the obstacles [m]."""
        return self.clearance

    def swing_legs(self, footholds: int | Mapping[str, int]) -> list[str]:
        """The sequence, over and over."""
        return [leg for leg, _ in swing_order(self.sequence, footholds)]

    def to_dict(self) -> dict[str, Any]:
        """The settings as plain JSON values, each obstacle as a dictionary of its fields."""
        plain = super().to_dict()
        plain["obstacles"] = [_listed(asdict(obstacle)) for obstacle in self.obstacles]
        return plain


def _leg_values(robot: Quadruped, name: str, given: Any) -> tuple[float, ...]:
    """One number for each joint of a leg."""
    joints = {len(leg.joints) for leg in robot.legs.values()}
    try:
        values = np.broadcast_to(check_array(name, given), (max(joints),))
    except ValueError:
        values = np.full(1, np.nan)
    if len(joints) > 1 or not ((values > 0.0) & np.isfinite(values)).all():
        raise InputError(
            f"{name} must be a positive number, or {max(joints)}: one for each joint of a leg; got "
            f"{as_text(given)}"
        )
    return tuple(values.tolist())


def set_count(settings: object, name: str, low: int, high: int) -> None:
    """Refuse a field that is no whole number from ``low`` to ``high``."""
    object.__setattr__(settings, name, check_count(name, getattr(settings, name), low, high))


def _obstacle(given: object) -> Obstacle:
    if isinstance(given, Obstacle):
        return given
    if not isinstance(given, Mapping):
        raise InputError(
            "an obstacle must be an Obstacle (gaitopt.rectangular_obstacle(0.11, 0.04), for "
            f"instance), got {as_text(given)}"
        )
    values = dict(given)
    try:
        values["core"] = tuple((float(x), float(z)) for x, z in values["core"])
        return Obstacle(**values)
    except (KeyError, TypeError, ValueError) as error:
        raise InputError(f"an obstacle's fields are not valid: {error}") from error


def _limits(name: str, values: object) -> tuple[float, ...]:
    try:
        limits = tuple(float(v) for v in values)  # type: ignore[attr-defined]
    except (TypeError, ValueError):
        limits = (float("nan"),)
    if not all(0.0 < v < np.inf for v in limits):
        raise InputError(
            f"{name} must be positive numbers, one for each joint, got {as_text(values)}"
        )
    return limits


def _listed(value: Any) -> Any:
    """Tuples as lists, all the way down: what a file gives back."""
    if isinstance(value, Mapping):
        return {k: _listed(v) for k, v in value.items()}
    if isinstance(value, (tuple, list)):
        return [_listed(v) for v in value]
    return value
