"""What the settings of all walks over given footholds share."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from gaitopt.gait.crawl import FREE_ORDER, WANG_SEQUENCE, check_order, swing_order
from gaitopt.plan.settings.base import PlanSettings, check_place, set_flag


@dataclass(frozen=True)
class FootholdSettings(PlanSettings):
    """Settings of a walk over given footholds.

    Attributes:
        sequence: order of the legs in a cycle, or of all steps of the walk, in which every leg
            steps equally often; ``"free"`` searches for the fastest order that is possible, which
            need not be periodic, and the plan's settings name it.
        follow_terrain: keep the body ``body_height`` above the mean of the four feet, instead of
            at a constant height.
        cog_start: where the body centre is at the start ``(2,)`` [m]; by default above the middle
            of the first footholds, or as near to it as the legs reach.
    """

    sequence: tuple[str, ...] | Literal["free"] = WANG_SEQUENCE
    follow_terrain: bool = False
    cog_start: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.sequence != FREE_ORDER:
            object.__setattr__(self, "sequence", check_order(self.sequence))
        set_flag(self, "follow_terrain")
        object.__setattr__(self, "cog_start", check_place("cog_start", self.cog_start))

    @property
    def order(self) -> tuple[str, ...]:
        """The order of the legs; that of [Wang2020] where it is still to be searched for."""
        return WANG_SEQUENCE if self.sequence == FREE_ORDER else tuple(self.sequence)

    def swing_legs(self, footholds: int) -> list[str] | None:
        """The legs in the order in which they lift off; ``None`` where any order will do."""
        if self.sequence == FREE_ORDER:
            return None
        return [leg for leg, _ in swing_order(self.order, footholds)]
