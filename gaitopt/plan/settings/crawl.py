"""Settings of the walk phase by phase."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Literal

from gaitopt.gait.crawl import WANG_SEQUENCE, check_order, swing_order
from gaitopt.plan.settings.base import PlanSettings, one_of, set_flag, set_number
from gaitopt.swing.catalogue import SWINGS

Speed = float | Literal["max"]


@dataclass(frozen=True)
class CrawlSettings(PlanSettings):
    """Settings of :func:`gaitopt.plan_crawl`, which describes each."""

    planner: ClassVar[str] = "crawl"

    objective: str = "distance"
    speed: Speed = "max"
    sequence: tuple[str, ...] = WANG_SEQUENCE
    swing: str = "box"
    follow_terrain: bool = False

    def __post_init__(self) -> None:
        super().__post_init__()
        one_of("objective", self.objective, ("distance", "margin"))
        one_of("swing", self.swing, SWINGS)
        if self.speed != "max":
            set_number(self, "speed", 1e-6, 1e3, "m/s", " (or 'max')")
        object.__setattr__(self, "sequence", check_order(self.sequence))
        set_flag(self, "follow_terrain")

    def swing_legs(self, footholds: int) -> list[str]:
        """The sequence, over and over."""
        return [leg for leg, _ in swing_order(self.sequence, footholds)]
