"""What a gait by velocity was asked for."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar

from gaitopt.conventions import LEGS
from gaitopt.errors import InputError
from gaitopt.gait.gaits import trot
from gaitopt.gait.schedule import GaitSchedule
from gaitopt.gait.step_timing import check_cycles, cycles_spanned, swing_events
from gaitopt.plan.settings.base import PlanSettings, one_of, set_flag, set_number
from gaitopt.swing.catalogue import SWING_CURVES


@dataclass(frozen=True)
class GaitSettings(PlanSettings):
    """Settings of :func:`gaitopt.plan_gait`, which describes most.

    Attributes:
        schedule: the gait.
        velocity: forward and sideways, in the body's axes [m/s].
        yaw_rate: [rad/s].
        cycles: swings of each leg.
        cycle_times: duration of each cycle [s].
        plateau: how long the body is at speed [s].
        lead: time on four feet before the first lift-off, and after the last touch-down [s].
        swing: name of the swing curve.
        sway: whether the body leaves its straight way for the sake of its ZMP.
        adapt: relative change of a cycle's time for a metre of margin [1/m].
    """

    planner: ClassVar[str] = "gait"
    least_support: ClassVar[int] = 0

    stability_margin: float = 0.0
    schedule: GaitSchedule = field(default_factory=lambda: trot(0.5))
    velocity: tuple[float, float] = (0.0, 0.0)
    yaw_rate: float = 0.0
    cycles: int = 1
    cycle_times: tuple[float, ...] = ()
    plateau: float = 0.0
    lead: float = 0.0
    swing: str = "polynomial"
    sway: bool = False
    adapt: float = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        if isinstance(self.schedule, Mapping):
            object.__setattr__(self, "schedule", GaitSchedule.from_dict(self.schedule))
        if not isinstance(self.schedule, GaitSchedule):
            raise InputError(
                f"schedule must be a GaitSchedule (gaitopt.trot(0.5), for instance), got "
                f"{self.schedule!r}"
            )
        object.__setattr__(self, "velocity", checked_velocity(self.velocity))
        set_number(self, "yaw_rate", -1e3, 1e3, "rad/s")
        object.__setattr__(self, "cycles", check_cycles(self.cycles))
        times = tuple(float(t) for t in self.cycle_times) or (self.schedule.cycle_time,) * max(
            cycles_spanned(self.schedule, self.cycles), 1
        )
        object.__setattr__(self, "cycle_times", times)
        set_number(self, "plateau", 0.0, 1e6, "s")
        set_number(self, "lead", 0.0, 1e6, "s")
        set_number(self, "adapt", 0.0, 1e3, "1/m")
        one_of("swing", self.swing, tuple(SWING_CURVES))
        set_flag(self, "sway")

    @property
    def static(self) -> bool:
        """A gait by velocity promises no static margin; its ZMP is judged instead."""
        return False

    def swing_legs(self, footholds: int) -> list[str]:
        """The legs in the order of the schedule's lift-offs."""
        events = swing_events(self.schedule, self.cycles, self.cycle_times)
        return [event.leg for event in events][: len(LEGS) * (footholds - 1)]


def checked_velocity(velocity: Any) -> tuple[float, float]:
    """``velocity`` as (forward, sideways); a single number is forward.

    Raises:
        InputError: it is neither.
    """
    values = (velocity, 0.0) if isinstance(velocity, (int, float)) else velocity
    try:
        forward, sideways = (float(v) for v in values)
    except (TypeError, ValueError):
        forward = sideways = float("nan")
    if isinstance(velocity, bool) or not (abs(forward) <= 1e3 and abs(sideways) <= 1e3):
        raise InputError(
            f"velocity must be (forward, sideways) in m/s, or the forward one, got {velocity!r}"
        )
    return forward, sideways
