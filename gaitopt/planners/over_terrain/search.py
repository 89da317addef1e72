"""The search for footholds on a map: a beam search over where four feet stand and which leg steps.

In a cycle every leg steps once, each to near its usual place one step length farther along the
course. After each step the states with the least cost are kept. The cost is an estimate of the time
that the walk takes, and penalties of footholds, in times of usual steps. All states of a layer have
made the same number of steps, so what is left of the way is the same for all, and costs can be
compared.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from time import thread_time

import numpy as np

from gaitopt.conventions import LEGS, FloatArray, Progress
from gaitopt.gait.crawl import WANG_SEQUENCE
from gaitopt.planners.over_terrain.beam.candidates import Candidates
from gaitopt.planners.over_terrain.beam.ending import Ending
from gaitopt.planners.over_terrain.course import Course
from gaitopt.planners.over_terrain.judge import Judge
from gaitopt.planners.over_terrain.last_look import LastLook
from gaitopt.planners.over_terrain.links.limbs import Limbs
from gaitopt.planners.over_terrain.links.pace import Pace
from gaitopt.planners.over_terrain.links.rolling import (
    MOST_ROLLED,
    feet_angles,
    half_ways,
    rolled_on,
)
from gaitopt.planners.over_terrain.outlook import Outlook
from gaitopt.planners.over_terrain.pairs import Cause, Pairs
from gaitopt.planners.over_terrain.result import TerrainSearch
from gaitopt.planners.over_terrain.states import Candidate, Found, Kept, Layer
from gaitopt.planners.over_terrain.surfaces import Stands
from gaitopt.planners.over_terrain.ways.fineness import AT_DEAD_ENDS, FINE, USUAL, Fineness
from gaitopt.terrain.layers import GroundLayers

CHUNK = 48
"""Pairs that are judged at once. Chosen: the cost of a call is then shared well, and few are judged
that are not needed."""
ROLLED = 1.0
"""Penalty of a foot that rolls as far on its foothold as it may; it grows with the square
of the way."""
NO_USE_AHEAD = 2.5
"""Penalty of a foothold that is of no use when the body has moved on, for each place looked at."""
BACK, PAST = 2, 4
"""Steps that the search goes back from a dead end for each width of the beam, and steps beyond it
after which the beam is as narrow as before. Chosen: what leads into a dead end is where a foot was
put in the last cycle, or the one before."""
EFFORT = 24
"""Tries of steps for each step of the walk and each state of the widest beam; each place of the
body counts. Chosen: with the usual widest beam the time is over first, on the machines that were
tried."""
WIDER = 4
"""By what the beam is widened at a dead end."""
CYCLE: tuple[int, ...] = tuple(LEGS.index(leg) for leg in WANG_SEQUENCE)


@dataclass(frozen=True, eq=False)
class Search:
    """A search for one robot, map and course.

    Attributes:
        judge: of its steps.
        stands: where feet may stand.
        layers: of the ground.
        course: where the body goes.
        cycles: how often each leg steps.
        banned: steps that the planner refused, as (number of the step, leg, number of the stand).
        limbs: the robot's links over the ground as it is.
        last: the look at what the beam would keep.
        fine: whether steps are looked at as finely as there is a way to.
    """

    judge: Judge
    stands: Stands
    layers: GroundLayers
    course: Course
    cycles: int
    banned: frozenset[tuple[int, int, int]]
    limbs: Limbs
    last: LastLook
    fine: bool = False

    @property
    def effort(self) -> int:
        """How many tries of steps one search may make."""
        return 4 * self.cycles * EFFORT * self.judge.settings.width_limit

    def without(self, found: TerrainSearch, step: int) -> Search:
        """The search without a step of a way that was found, and without those near to it."""
        leg = LEGS.index(found.order[step])
        place = self.stands.centres[found.stands[step + 1, leg], :2]
        ground, settings = self.judge.surfaces.ground, self.judge.settings
        near = self.stands.near(ground, place, USUAL.block * settings.freedom).tolist()
        return replace(self, banned=self.banned | {(step, leg, stand) for stand in near})

    def run(
        self, first: Sequence[Layer], progress: Progress | None = None, most: int | None = None,
        until: float = np.inf,
    ) -> Found:  # fmt: skip
        """Search as far as it gets, from the last of some layers on.

        Where no state can make a further step, the search goes back some steps and on with a wider
        beam, and farther back with a still wider one, until the widest has been tried.

        Args:
            first: layers to begin with.
            progress: called with (steps done, steps in all).
            most: tries after which it ends; by default :attr:`effort`.
            until: processor time from which on it ends at a dead end, by ``time.thread_time`` [s];
                it ends anyway when it has taken twice as long.
        """
        settings = self.judge.settings
        layers, steps = list(first), 4 * self.cycles
        tried: set[int] = set()
        refused: Counter[Cause] = Counter()
        width, stuck, farthest = settings.width, -1, list(first)
        reasons: dict[Cause, int] = {}
        work, most = 0, self.effort if most is None else most
        latest = until + max(until - thread_time(), 0.0)
        while len(layers) <= steps and work <= most:
            # A search that has met no dead end for a while soon has its way.
            advancing = len(layers) == len(farthest) and width == settings.width
            end = latest if advancing else until
            if thread_time() >= end:
                break
            refused = Counter()
            following = self._next(layers[-1], width, refused, tried, end, self._fineness(width))
            work += width + refused.total()
            if following is not None:
                layers.append(following)
                if len(layers) > len(farthest):
                    farthest, reasons = list(layers), {}
                if len(layers) > stuck + PAST:
                    width = settings.width
                if progress is not None:
                    progress(len(farthest) - 1, steps)
                continue
            if len(layers) == len(farthest):
                reasons = dict(refused)
            if width >= settings.width_limit:
                break
            # At another place than before it begins with little once more.
            new = len(layers) > stuck + BACK
            width = min(WIDER * (settings.width if new else width), settings.width_limit)
            stuck = max(len(layers), stuck)
            layers = layers[: max(len(layers) - BACK * width // settings.width, 1)]
        numbers = np.array(sorted(tried), dtype=int)
        ended = Ending.GOAL
        if len(farthest) <= steps:
            # A layer that was cut short by the time is no dead end, wherever the loop ended.
            over, many = thread_time() >= until, work > most
            ended = Ending.TIME if over else Ending.TRIES if many else Ending.EXHAUSTED
        return Found(tuple(farthest), steps, reasons or dict(refused), numbers, width, work, ended)

    def _fineness(self, width: int) -> Fineness:
        """How finely steps are looked at while the beam has a width."""
        if self.fine:
            return FINE
        return AT_DEAD_ENDS if width > self.judge.settings.width else USUAL

    def usual(self, leg: int, steps: int) -> FloatArray:
        """Where a leg usually stands after a number of its steps ``(2,)`` [m]."""
        return self.candidates.usual(leg, steps)

    @cached_property
    def pace(self) -> Pace:
        """How long steps take."""
        return Pace.of(self.judge.limbs, self.judge.settings, self.judge.hips)

    @cached_property
    def candidates(self) -> Candidates:
        """Footholds that are tried."""
        outlook = Outlook(self.judge, self.stands, self.course, self.cycles)
        return Candidates(self.judge, self.stands, self.course, self.cycles, self.banned,
                          self.pace, outlook)  # fmt: skip

    def _next(
        self, layer: Layer, width: int, refused: Counter[Cause], tried: set[int], until: float,
        fineness: Fineness,
    ) -> Layer | None:  # fmt: skip
        """The states after one more step; ``None`` where there is none."""
        orders = [self.legs(made) for made in layer.made]
        choices = [[order[k : k + 1] for order in orders] for k in range(len(LEGS))]
        for legs in [orders] if fineness.all_legs else choices:
            found = self._expand(layer, legs, width, refused, tried, until, fineness)
            if found is not None:
                return found
        return None

    def legs(self, made: np.ndarray) -> list[int]:
        """The legs that may step next, the usual one first."""
        least = int(made.min())
        return [leg for leg in CYCLE if made[leg] == least]

    def _expand(
        self, layer: Layer, legs: Sequence[Sequence[int]], width: int, refused: Counter[Cause],
        tried: set[int], until: float, fineness: Fineness,
    ) -> Layer | None:  # fmt: skip
        """The cheapest states in which one of the legs that are given for each has stepped."""
        state, stand, leg, cost = self.candidates.of(layer, legs, refused, fineness)
        if not len(state):
            refused[Cause.GROUND] += sum(len(own) for own in legs)
            return None
        kept = Kept(width, lambda steps: self.last.kept(layer, steps, refused))
        order = np.argsort(cost, kind="stable")
        most = fineness.chunks * max(width // self.judge.settings.width, 1)
        for number, chunk in enumerate(np.array_split(order, max(len(order) // CHUNK, 1))[:most]):
            for one in sorted(set(leg[chunk].tolist())):
                own = chunk[leg[chunk] == one]
                # At a dead end the rare ways cost most; the best pairs tell if they help.
                how = fineness if number < fineness.rare_chunks else replace(fineness, rare=())
                self._judge(layer, one, state[own], stand[own], cost[own], kept, refused, how)
            tried.update(stand[chunk].tolist())
            if kept.full:
                kept.settled()
            if kept.full or thread_time() > until:
                break
        return kept.layer(layer)

    def _judge(
        self, layer: Layer, leg: int, state: np.ndarray, stand: np.ndarray, cost: FloatArray,
        kept: Kept, refused: Counter[Cause], fineness: Fineness,
    ) -> None:  # fmt: skip
        """Judge pairs of one leg, and keep those that are possible."""
        made = layer.made[state].sum(axis=1) + 1
        yaw = self.course.at(self.course.after(made / 4.0, self.cycles))[:, 2]
        pairs = Pairs(layer.feet[state], layer.body[state], self.stands.centres[stand], yaw, leg)
        judged = self.judge.judge(pairs, fineness)
        refused.update(judged.refused)
        possible = np.flatnonzero(judged.possible)
        if not len(possible):
            return
        there, before = pairs.chosen(possible), layer.rolled[state[possible]]
        body, rise = judged.body[possible], judged.rise[possible]
        angles = feet_angles(self.limbs, there.feet, there.body, body)
        rolled = rolled_on(self.limbs, angles, there.body, body, before)
        penalties = NO_USE_AHEAD * judged.prospects[possible]
        shares = half_ways(rolled) / MOST_ROLLED
        refused[Cause.ROLL] += int((shares.max(axis=1) > 1.0).sum())
        # What a foot had rolled before has been counted.
        penalties += ROLLED * (shares**2 - (half_ways(before) / MOST_ROLLED) ** 2).sum(axis=1)
        seconds = self.pace.of_steps(there, body, rise, angles)
        ways = np.linalg.norm(there.target - there.feet[:, leg], axis=1)
        more = self.pace.step * penalties + seconds - self.pace.rough(ways)
        # The foot that steps begins anew.
        rolled[:, leg] = 0.0
        for n in np.flatnonzero(shares.max(axis=1) <= 1.0):
            i = possible[n]
            kept.add(Candidate(float(cost[i] + more[n]), int(state[i]), int(stand[i]), leg,
                               pairs.target[i], judged.body[i], float(judged.rise[i]),
                               rolled[n], float(seconds[n])))  # fmt: skip
