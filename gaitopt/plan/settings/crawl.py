"""Settings of the walk phase by phase."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Literal

from gaitopt.dynamics.contacts import ForceLimits
from gaitopt.errors import InputError
from gaitopt.inputs import check_choice
from gaitopt.plan.settings.base import set_number
from gaitopt.plan.settings.over_footholds import FootholdSettings
from gaitopt.swing.catalogue import SWINGS

Speed = float | Literal["max"]
FRICTION_OF_MARGIN = 0.3
"""Friction that a walk of the largest margin may use by default, half of the usual one. Its body
moves far while four feet stand. With 0.6 feet that bear little leave their footholds in physics:
15 of 15 walks of anymal_c, anymal and hyq did (12 steps, seeds 0 to 4), and none with 0.3."""


@dataclass(frozen=True)
class CrawlSettings(FootholdSettings):
    """Settings of a walk over given footholds that is planned phase by phase ([Wang2020]).

    Attributes:
        objective: ``"distance"`` moves the body centre as little as possible (the paper's method),
            ``"margin"`` to the largest stability margin (the SSM baseline), by default with half of
            the usual friction, so that its long moves are slower.
        speed: ``"max"`` for the highest speed that the joints allow, or a speed of body and feet
            [m/s], which is still held within the joints' limits.
        swing: shape of the swing: ``"box"``, the shape of another swing curve
            (:data:`gaitopt.SWING_CURVES`), or a way over an obstacle, ``"trapezoid path"`` or
            ``"parabola path"``.

    The other fields are those of :class:`FootholdSettings` and :class:`PlanSettings`:
    ``stability_margin`` is ``S0`` and ``body_height`` is ``h`` of eq. (8). With ``reach_fraction``
    1 a leg may be straight, where the joint velocities that move the foot grow without bound.

    Raises:
        InputError: a value is out of range.
    """

    planner: ClassVar[str] = "crawl"

    objective: str = "distance"
    speed: Speed = "max"
    swing: str = "box"

    @property
    def usual_forces(self) -> ForceLimits:
        """The limits on forces and torques where none are given."""
        cautious = self.objective == "margin"
        return ForceLimits(friction=FRICTION_OF_MARGIN) if cautious else ForceLimits()

    def __post_init__(self) -> None:
        super().__post_init__()
        check_choice("objective", self.objective, ("distance", "margin"))
        check_choice("swing", self.swing, SWINGS)
        if self.speed != "max":
            set_number(self, "speed", 1e-6, 1e3, "m/s", " (or 'max')")
        for name in ("acceleration_limit", "jerk_limit"):
            if getattr(self, name) is not None:
                raise InputError(
                    f"{name} goes with the objective 'time': a walk that is planned phase by phase "
                    "bounds joint velocities only"
                )
