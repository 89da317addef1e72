"""What a search for footholds found, and how far it got."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.planners.over_terrain.beam.ending import Ending
from gaitopt.planners.over_terrain.course import Course
from gaitopt.planners.over_terrain.pairs import Cause
from gaitopt.planners.over_terrain.settings import TerrainSettings
from gaitopt.terrain.footholds import Footholds
from gaitopt.terrain.layers import GroundLayers


@dataclass(frozen=True, eq=False)
class TerrainSearch:
    """A search for footholds over a map.

    Attributes:
        footholds: those of the way that was found; of its first part, where the goal was not
            reached.
        complete: whether the goal was reached.
        settings: what was asked for, with the step length and body height that worked.
        course: the way of the body that was asked for.
        layers: of the ground.
        tried: footholds that were tried ``(n, 3)`` [m].
        width: of the beam that found the way, or that was tried last.
        stands: numbers of the places where the feet stand, at the start and after each step
            ``(S + 1, 4)``.
        steps: steps that lead to the goal.
        next_leg: the leg that was to step next, where the goal was not reached.
        refused: at the first step that no state could make, how many tries were refused for what.
        cost: of the way: an estimate of the time that it takes, and penalties of footholds, steps
            that are of no use later and feet that roll [s].
        estimate: of the time that the way takes, without penalties [s].
        seconds: that the search took [s].
        ended: how it ended; where there were several searches, what is open about any of them.
        fine: whether it looked at steps as finely as there is a way to.
        ways: where the goal was not reached, how many ways of walking were tried: lengths of steps
            and of the stance.
        wall: a place of the course where no pose of the body stands, where nothing leads round it
            ``(2,)`` [m]; else ``None``.
        spread: how far from one another these ended along the course [m].
    """

    footholds: Footholds
    complete: bool
    settings: TerrainSettings
    course: Course
    layers: GroundLayers
    tried: FloatArray
    width: int
    stands: np.ndarray
    steps: int
    next_leg: str
    refused: Mapping[Cause, int]
    cost: float
    estimate: float
    seconds: float
    ended: Ending
    fine: bool = False
    ways: int = 1
    spread: float = 0.0
    wall: FloatArray | None = None

    @property
    def late(self) -> bool:
        """Whether it ended without a way because its time was over."""
        return self.ended is Ending.TIME

    @property
    def metres(self) -> float:
        """Length of the course [m]."""
        return float(np.linalg.norm(np.diff(self.course.poses[:, :2], axis=0), axis=1).sum())

    @property
    def order(self) -> tuple[str, ...]:
        """The legs in the order of their steps."""
        return self.footholds.order or ()

    @property
    def share(self) -> float:
        """Share of the steps to the goal that were found."""
        return self.footholds.steps / max(self.steps, 1)

    def __repr__(self) -> str:
        end = "reached" if self.complete else "not reached"
        return (
            f"TerrainSearch(goal {end}, {self.footholds.steps} steps over {self.metres:.2f} m, "
            f"width {self.width}, {self.seconds:.2f} s)"
        )
