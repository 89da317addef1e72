"""Which footholds a beam search tries for a step, and what they cost before anything is judged."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.planners.over_terrain.course import Course
from gaitopt.planners.over_terrain.judge import Judge
from gaitopt.planners.over_terrain.links.pace import Pace
from gaitopt.planners.over_terrain.outlook import Outlook
from gaitopt.planners.over_terrain.pairs import Cause
from gaitopt.planners.over_terrain.states import Layer
from gaitopt.planners.over_terrain.surfaces import Stands
from gaitopt.planners.over_terrain.ways.fineness import Fineness

FREER, FEW = (1.0, 1.5, 2.0), 0.1
"""By what the step's freedom is widened where less than a share of the ground within it is fit to
stand on. Chosen: hollows and flanks of hills that are too steep are as wide as the freedom."""
FROM_USUAL = 2.5
"""Penalty of a foothold at the end of the step's freedom, in times of usual steps, as all of them;
it grows with the square of the distance from the usual foothold."""
NO_USE = 10.0
"""Penalty of a foothold that would be of no use during the whole stance on it. Chosen: four times
that of one at the end of the freedom; what is of use for half of the stance may do for shorter
steps."""


class Choices(NamedTuple):
    """Pairs of a state and a foothold that may be judged.

    Attributes:
        state: numbers of the states ``(n,)``.
        stand: numbers of the stands to step to ``(n,)``.
        leg: indices of the legs ``(n,)``.
        cost: of the way with the step, as far as it is known before it is judged ``(n,)`` [s].
    """

    state: np.ndarray
    stand: np.ndarray
    leg: np.ndarray
    cost: FloatArray


@dataclass(frozen=True, eq=False)
class Candidates:
    """Finds footholds for the steps of one search.

    Attributes:
        judge: of its steps.
        stands: where feet may stand.
        course: where the body goes.
        cycles: how often each leg steps.
        banned: steps that the planner refused, as (number of the step, leg, number of the stand).
        pace: how long steps take.
        outlook: what becomes of footholds while feet stand on them.
    """

    judge: Judge
    stands: Stands
    course: Course
    cycles: int
    banned: frozenset[tuple[int, int, int]]
    pace: Pace
    outlook: Outlook

    def of(
        self, layer: Layer, legs: Sequence[Sequence[int]], refused: Counter[Cause],
        fineness: Fineness,
    ) -> Choices:  # fmt: skip
        """What may be judged of the steps from a layer; counts those that were banned.

        Args:
            layer: the states.
            legs: that may step next, for each state.
            refused: counts of causes, which grow.
            fineness: how many footholds there are.
        """
        states, stands, stepping, costs = [], [], [], []
        some = {(leg, int(m[leg])) for own, m in zip(legs, layer.made, strict=True) for leg in own}
        for leg, made in sorted(some):
            usual = self.usual(leg, made + 1)
            near, own = self.thinned(usual, leg, int(layer.made[0].sum()), fineness)
            # All states of a layer have made the same number of steps.
            banned = [
                k for s, other, k in self.banned if (s, other) == (int(layer.made[0].sum()), leg)
            ]
            allowed = ~np.isin(near, banned)
            refused[Cause.PLAN] += int((~allowed).sum())
            near, own = near[allowed], own[allowed]
            if not near.size:
                continue
            same = np.flatnonzero(layer.made[:, leg] == made).tolist()
            for n in (n for n in same if leg in legs[n]):
                way = np.linalg.norm(self.stands.centres[near] - layer.feet[n, leg], axis=1)
                cost = layer.cost[n] + self.pace.step * own + self.pace.rough(way)
                states.append(np.full(len(near), n))
                stands.append(near)
                stepping.append(np.full(len(near), leg))
                costs.append(cost)
        if not states:
            none = np.empty(0, int)
            return Choices(none, none, none, np.empty(0))
        return Choices(*(np.concatenate(each) for each in (states, stands, stepping, costs)))

    def usual(self, leg: int, steps: int) -> FloatArray:
        """Where a leg usually stands after a number of its steps ``(2,)`` [m]."""
        x, y, yaw = self.course.at(self.course.after(steps, self.cycles))
        cosine, sine = np.cos(yaw), np.sin(yaw)
        ahead, left = self.judge.usual_feet[leg]
        return np.array([x + cosine * ahead - sine * left, y + sine * ahead + cosine * left])

    def thinned(
        self, usual: FloatArray, leg: int, step: int, fineness: Fineness
    ) -> tuple[np.ndarray, FloatArray]:
        """Some stands near a usual place, spread over it, and what each costs a leg in a step."""
        settings = self.judge.settings
        near = self.near(usual)
        if not near.size:
            return near, np.empty(0)
        away = self.stands.centres[near, :2] - usual
        own = FROM_USUAL * (away**2).sum(axis=1) / settings.freedom**2
        own = own + self.stands.penalties[near] + NO_USE * self.outlook.of(leg, step, near)
        side = max(fineness.block * settings.freedom, self.judge.surfaces.ground.resolution)
        block = np.floor(away / side + 0.5).astype(int)
        order = np.argsort(own, kind="stable")
        _, first = np.unique(block[order], axis=0, return_index=True)
        chosen = order[np.sort(first)][: fineness.candidates]
        return near[chosen], own[chosen]

    def near(self, usual: FloatArray) -> np.ndarray:
        """The stands within the step's freedom of a usual place, or farther where there are few."""
        ground, freedom = self.judge.surfaces.ground, self.judge.settings.freedom
        near = np.empty(0, dtype=int)
        for times in FREER:
            near = self.stands.near(ground, usual, times * freedom)
            if len(near) >= FEW * np.pi * (freedom / ground.resolution) ** 2:
                break
        return near
