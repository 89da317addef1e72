"""What a gait by velocity was asked for."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, ClassVar

import numpy as np

from gaitopt.arguments import checked
from gaitopt.conventions import LEGS
from gaitopt.errors import InputError
from gaitopt.gait.gaits import trot
from gaitopt.gait.schedule import CYCLE_TIMES, GaitSchedule
from gaitopt.gait.step_timing import check_cycles, cycles_spanned, swing_events
from gaitopt.inputs import (
    as_text,
    check_array,
    check_choice,
    check_kind,
    check_number,
    check_numbers,
)
from gaitopt.plan.settings.base import (
    FORCES,
    PlanSettings,
    check_names,
    set_flag,
    set_number,
)
from gaitopt.robots.quadruped import Quadruped
from gaitopt.swing.catalogue import SWING_CURVES

WAY = ("distance", "duration", "ramp")
"""What :meth:`GaitSettings.for_robot` takes beside the fields."""
SWING_SHARE = 0.15
"""Swing height as a share of the body's height; chosen here, the papers' gaits differ."""
LONGEST_WALK = 2000
"""Most cycles of a walk, so that a wrong number is refused."""


@dataclass(frozen=True)
class GaitSettings(PlanSettings):
    """Settings of a gait by velocity ([Wang2024], [XiLing]).

    :meth:`for_robot` makes them from a distance or a duration at full speed.

    Attributes:
        schedule: the gait, :func:`gaitopt.trot` for instance.
        velocity: forward and sideways in the body's own axes, or the forward one alone [m/s].
        yaw_rate: turning left is positive [rad/s].
        cycles: swings of each leg.
        cycle_times: duration of each cycle [s].
        plateau: time at full speed [s].
        lead: time on four feet before the first lift-off and after the last touchdown [s].
        swing: swing curve: ``"polynomial"``, ``"cycloid"``, ``"sine arch"``, ``"half-ellipse"``,
            ``"trapezoid"`` or ``"box"``.
        sway: whether the body leaves its straight way. With the timing ``"forces"`` it has to, so
            that contact forces make the motion, and does by default. Otherwise its ZMP then lies
            as deep in the support polygons as the speed allows.
        adapt: gain of the step time's adaptation to the ZMP's margin [1/m] ([XiLing], Section 4):
            each cycle's time becomes ``1 + adapt (mean margin - its margin)`` times as long.

    ``body_height`` is that of the hips above the ground's foot frames. The other fields are those
    of :class:`PlanSettings`.

    Raises:
        InputError: a value is out of range.
    """

    planner: ClassVar[str] = "gait"
    least_support: ClassVar[int] = 0

    timing: str = FORCES
    stability_margin: float = 0.0
    schedule: GaitSchedule = field(default_factory=lambda: trot(0.5))
    velocity: tuple[float, float] = (0.0, 0.0)
    yaw_rate: float = 0.0
    cycles: int = 1
    cycle_times: tuple[float, ...] = ()
    plateau: float = 0.0
    lead: float = 0.0
    swing: str = "polynomial"
    sway: bool | None = None
    adapt: float = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        if isinstance(self.schedule, Mapping):
            object.__setattr__(self, "schedule", GaitSchedule.from_dict(self.schedule))
        if not isinstance(self.schedule, GaitSchedule):
            raise InputError(
                f"schedule must be a GaitSchedule (gaitopt.trot(0.5), for instance), got "
                f"{as_text(self.schedule)}"
            )
        object.__setattr__(self, "velocity", checked_velocity(self.velocity))
        set_number(self, "yaw_rate", -1e3, 1e3, "rad/s")
        object.__setattr__(self, "cycles", check_cycles(self.cycles))
        given = check_numbers("cycle_times", self.cycle_times, *CYCLE_TIMES, "s")
        times = tuple(given.ravel().tolist())
        spanned = max(cycles_spanned(self.schedule, self.cycles), 1)
        object.__setattr__(self, "cycle_times", times or (self.schedule.cycle_time,) * spanned)
        set_number(self, "plateau", 0.0, 1e6, "s")
        set_number(self, "lead", 0.0, 1e6, "s")
        set_number(self, "adapt", 0.0, 1e3, "1/m")
        check_choice("swing", self.swing, tuple(SWING_CURVES))
        if self.sway is None:
            object.__setattr__(self, "sway", self.forces is not None)
        set_flag(self, "sway")

    @classmethod
    def for_robot(cls, robot: Quadruped, **options: Any) -> GaitSettings:
        """Settings that fit a robot and a way, save for those that are given.

        Args:
            robot: from :func:`gaitopt.load_robot`.
            options: fields by name, and three more. ``distance``: way at full speed [m], or
                ``duration``: time at full speed [s]; getting to speed and slowing down come on
                top. One of the two is needed where ``plateau`` is not given. ``ramp``: least time
                to get to speed, and to slow down [s], by default two cycles; it becomes longer so
                that a whole number of cycles is walked. ``lead`` is by default half a cycle for a
                body that sways, which must first get over its feet, and none otherwise. With
                ``timing="velocity"`` a body sways by default where more than half of the cycle is
                stance and the legs can move sideways. The body is as high as the robot stands by
                default, and feet rise by 0.15 of that.

        Raises:
            InputError: a field is unknown or out of range, or the way is not told.
        """
        check_kind("robot", robot, Quadruped)
        check_names(cls, options, *WAY)
        given = {k: v for k, v in options.items() if v is not None and k not in WAY}
        given.setdefault("body_height", robot.standing_height)
        first = ("schedule", "velocity", "timing", "body_height")
        start = cls(**{k: v for k, v in given.items() if k in first})
        given.setdefault("swing_height", round(SWING_SHARE * start.body_height, 3))
        steps_aside = all(leg.has_roll for leg in robot.legs.values())
        by_forces = start.timing == FORCES
        sways = by_forces or (start.schedule.duty_factor > 0.5 and steps_aside)
        sway = given.setdefault("sway", sways)
        given.setdefault("lead", 0.5 * start.schedule.cycle_time if sway else 0.0)
        if "plateau" not in given:
            way = (options.get("distance"), options.get("duration"))
            given["plateau"] = _plateau(start.velocity, *way)
        settings = cls(**given)
        if "cycles" in given:
            return settings
        ramp = options.get("ramp")
        least = 2.0 * start.schedule.cycle_time if ramp is None else ramp
        return replace(settings, cycles=_cycles(settings, least), cycle_times=())

    @property
    def static(self) -> bool:
        """A gait by velocity promises no static margin; its ZMP is judged instead."""
        return False

    @checked
    def swing_legs(self, footholds: int | Mapping[str, int]) -> list[str]:
        """The legs in the order of the schedule's lift-offs."""
        counts = [footholds] * len(LEGS) if isinstance(footholds, int) else footholds.values()
        events = swing_events(self.schedule, self.cycles, self.cycle_times)
        return [event.leg for event in events][: sum(counts) - len(LEGS)]


def _plateau(velocity: tuple[float, float], distance: object, duration: object) -> float:
    """Time at full speed [s]."""
    if (distance is None) == (duration is None):
        raise InputError(
            "plan_gait needs either distance (in metres at full speed) or duration (in seconds at "
            f"full speed), got {as_text(distance)} and {as_text(duration)}"
        )
    name, value = ("duration", duration) if distance is None else ("distance", distance)
    asked = check_number(name, value, 0.0, 1e6, "s" if distance is None else "m")
    if distance is None:
        return asked
    speed = float(np.hypot(*velocity))
    if not speed > 0:
        raise InputError(
            f"a distance of {asked:g} m is never walked at no speed; give velocity, or a duration "
            "to step in place or turn"
        )
    return asked / speed


def _cycles(settings: GaitSettings, ramp: object) -> int:
    """Swings of each leg, so that the ramps are at least as long as asked for."""
    least = check_number("ramp", ramp, 1e-3, 1e5, "s")
    once = swing_events(settings.schedule, 1)
    first = max(e.touch_down for e in once)
    missing = settings.plateau + 2.0 * least - first
    # A cycle that is missing by rounding alone is not walked.
    cycles = 1 + max(int(np.ceil(missing / settings.schedule.cycle_time - 1e-9)), 0)
    if cycles > LONGEST_WALK:
        raise InputError(
            f"{settings.plateau:.4g} s at full speed take {cycles} cycles of "
            f"{settings.schedule.cycle_time:g} s; at most {LONGEST_WALK} are planned at once"
        )
    return cycles


def checked_velocity(velocity: Any) -> tuple[float, float]:
    """``velocity`` as (forward, sideways); a single number is forward.

    Raises:
        InputError: it is neither.
    """
    try:
        given = np.append(check_array("velocity", velocity).ravel(), [0.0])[:2]
        plain = np.ndim(velocity) == 0 or np.shape(velocity) == (2,)
    except ValueError:
        plain = False
    if isinstance(velocity, bool) or not plain or not (np.abs(given) <= 1e3).all():
        raise InputError(
            "velocity must be (forward, sideways) in m/s, or the forward one, got "
            f"{as_text(velocity)}"
        )
    return float(given[0]), float(given[1])
