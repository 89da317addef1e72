"""What :func:`gaitopt.planners.over_obstacle.planner.plan_stride` was asked for."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any, ClassVar

import numpy as np

from gaitopt.errors import InputError
from gaitopt.gait.crawl import SHAO_SEQUENCE, check_sequence, swing_order
from gaitopt.inputs import check_count
from gaitopt.plan.settings.base import PlanSettings, one_of, set_number
from gaitopt.swing.obstacle_paths import PATTERNS, Pattern
from gaitopt.terrain.obstacles import Obstacle

MOST_CYCLES = 1000


@dataclass(frozen=True)
class StrideSettings(PlanSettings):
    """Settings of a walk over an obstacle; :func:`plan_stride` describes most.

    Attributes:
        obstacles: what is in the way; in the settings' dictionary as plain numbers.
        margin: distance that the ball of a foot keeps from it [m].
        clearance: distance that every part of the robot keeps from it [m].
        approach, leave: cycles before the first leg's stride over it, and after the last one's.
        sequence: order of the legs in a cycle.
        pattern, waypoints: of the paths over it.
        accelerations, jerks: limits of each joint of a leg, from body to foot [rad/s^2],
            [rad/s^3]; empty jerks bound nothing. The base class's limits are the largest of them.
    """

    planner: ClassVar[str] = "stride"

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
        object.__setattr__(self, "obstacles", tuple(_obstacle(o) for o in self.obstacles))
        set_number(self, "margin", 1e-4, 10.0, "m")
        set_number(self, "clearance", 1e-3, 10.0, "m")
        for name in ("approach", "leave"):
            set_count(self, name, 0, MOST_CYCLES)
        object.__setattr__(self, "sequence", check_sequence(self.sequence))
        one_of("pattern", self.pattern, PATTERNS)
        set_count(self, "waypoints", 3, MOST_CYCLES)
        for name in ("accelerations", "jerks"):
            object.__setattr__(self, name, _limits(name, getattr(self, name)))

    def swing_legs(self, footholds: int) -> list[str]:
        """The sequence, over and over."""
        return [leg for leg, _ in swing_order(self.sequence, footholds)]

    def to_dict(self) -> dict[str, Any]:
        """The settings as plain JSON values, each obstacle as a dictionary of its fields."""
        plain = super().to_dict()
        plain["obstacles"] = [_listed(asdict(obstacle)) for obstacle in self.obstacles]
        return plain


def set_count(settings: object, name: str, low: int, high: int) -> None:
    """Refuse a field that is no whole number from ``low`` to ``high``."""
    object.__setattr__(settings, name, check_count(name, getattr(settings, name), low, high))


def _obstacle(given: object) -> Obstacle:
    if isinstance(given, Obstacle):
        return given
    if not isinstance(given, Mapping):
        raise InputError(
            "an obstacle must be an Obstacle (gaitopt.rectangular_obstacle(0.11, 0.04), for "
            f"instance), got {given!r}"
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
        raise InputError(f"{name} must be positive numbers, one for each joint, got {values!r}")
    return limits


def _listed(value: Any) -> Any:
    """Tuples as lists, all the way down: what a file gives back."""
    if isinstance(value, Mapping):
        return {k: _listed(v) for k, v in value.items()}
    if isinstance(value, (tuple, list)):
        return [_listed(v) for v in value]
    return value
