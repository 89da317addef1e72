"""Settings of the walk phase by phase."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Literal

from gaitopt.errors import InputError
from gaitopt.gait.crawl import FREE_ORDER, WANG_SEQUENCE, check_order, swing_order
from gaitopt.plan.settings.base import (
    PlanSettings,
    check_place,
    one_of,
    set_flag,
    set_number,
)
from gaitopt.swing.catalogue import SWINGS

Speed = float | Literal["max"]


@dataclass(frozen=True)
class CrawlSettings(PlanSettings):
    """Settings of a walk over given footholds that is planned phase by phase ([Wang2020]).

    Attributes:
        objective: ``"distance"`` moves the body centre as little as possible (the paper's method),
            ``"margin"`` to the largest stability margin (the SSM baseline).
        speed: ``"max"`` for the highest speed that the joints allow, or a speed of body and feet
            [m/s], which is still held within the joints' limits.
        sequence: order of the legs in a cycle, or of all steps of the walk, in which every leg
            steps equally often; ``"free"`` searches for the fastest order that is possible, which
            need not be periodic, and the plan's settings name it.
        swing: shape of the swing: ``"box"``, the shape of another swing curve
            (:data:`gaitopt.SWING_CURVES`), or a way over an obstacle, ``"trapezoid path"`` or
            ``"parabola path"``.
        follow_terrain: keep the body ``body_height`` above the mean of the four feet, instead of
            at a constant height.
        cog_start: where the body centre is at the start ``(2,)`` [m]; by default above the middle
            of the first footholds, or as near to it as the legs reach.

    The other fields are those of :class:`PlanSettings`: ``stability_margin`` is ``S0`` and
    ``body_height`` is ``h`` of eq. (8); with ``reach_fraction`` 1 a leg may be straight, where the
    joint velocities that move the foot grow without bound.

    Raises:
        InputError: a value is out of range.
    """

    planner: ClassVar[str] = "crawl"

    objective: str = "distance"
    speed: Speed = "max"
    sequence: tuple[str, ...] | Literal["free"] = WANG_SEQUENCE
    swing: str = "box"
    follow_terrain: bool = False
    cog_start: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        one_of("objective", self.objective, ("distance", "margin"))
        one_of("swing", self.swing, SWINGS)
        if self.speed != "max":
            set_number(self, "speed", 1e-6, 1e3, "m/s", " (or 'max')")
        if self.sequence != FREE_ORDER:
            object.__setattr__(self, "sequence", check_order(self.sequence))
        set_flag(self, "follow_terrain")
        object.__setattr__(self, "cog_start", check_place("cog_start", self.cog_start))
        for name in ("acceleration_limit", "jerk_limit"):
            if getattr(self, name) is not None:
                raise InputError(
                    f"{name} goes with the objective 'time': a walk that is planned phase by phase "
                    "bounds joint velocities only"
                )

    @property
    def order(self) -> tuple[str, ...]:
        """The order of the legs; that of [Wang2020] where it is still to be searched for."""
        return WANG_SEQUENCE if self.sequence == FREE_ORDER else tuple(self.sequence)

    def swing_legs(self, footholds: int) -> list[str] | None:
        """The legs in the order in which they lift off; ``None`` where any order will do."""
        if self.sequence == FREE_ORDER:
            return None
        return [leg for leg, _ in swing_order(self.order, footholds)]
