"""The search for footholds on a map: a beam search over where four feet stand and which leg steps.

In a cycle every leg steps once, each to near its usual place one step length farther along the
course. After each step the states with the least cost are kept. The cost is in units of the body's
height: the ways of body and feet, and penalties of footholds. All states of a layer have made the
same number of steps, so what is left of the way is the same for all, and costs can be compared.
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
from gaitopt.planners.over_terrain.course import Course
from gaitopt.planners.over_terrain.judge import Judge
from gaitopt.planners.over_terrain.last_look import LastLook
from gaitopt.planners.over_terrain.links.limbs import Limbs
from gaitopt.planners.over_terrain.links.rolling import MOST_ROLLED, half_ways, rolled_on
from gaitopt.planners.over_terrain.outlook import Outlook
from gaitopt.planners.over_terrain.pairs import Cause, Pairs
from gaitopt.planners.over_terrain.result import TerrainSearch
from gaitopt.planners.over_terrain.states import Candidate, Found, Kept, Layer
from gaitopt.planners.over_terrain.surfaces import Stands
from gaitopt.terrain.layers import GroundLayers

CHUNK = 48
"""Pairs that are judged at once. Chosen: the cost of a call is then shared well, and few are judged
that are not needed."""
MOST_CHUNKS = 12
"""Most times that further pairs are judged for a layer of the least width; more for wider ones."""
RARE_CHUNKS = 3
"""Times that pairs of a layer are tried in the rare ways, too: the cheapest tell if these help."""
CANDIDATES = 28
"""Most footholds that are tried for a step."""
BLOCK = 0.24
"""Side of the squares of which each gives one foothold to try, as a share of the step's freedom.
Chosen: neighbours on the grid differ too little to try both."""
FREER, FEW = (1.0, 1.5, 2.0), 0.1
"""By what the step's freedom is widened where less than a share of the ground within it is fit to
stand on. Chosen: hollows and flanks of hills that are too steep are as wide as the freedom."""
FROM_USUAL = 0.5
"""Cost of a foothold at the end of the step's freedom; it grows with the square of the distance
from the usual foothold."""
FOOT_WAY, BODY_WAY = 0.15, 1.0
"""Costs of the ways of a foot and of the body, for each body height of them."""
ROLLED = 0.2
"""Cost of a foot that rolls as far on its foothold as it may; it grows with the square
of the way."""
NO_USE_AHEAD = 0.5
"""Cost of a foothold that is of no use when the body has moved on, for each place looked at."""
NO_USE = 2.0
"""Cost of a foothold that would be of no use during the whole stance on it. Chosen: four times that
of one at the end of the freedom; what is of use for half of the stance may do for shorter steps."""
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
    """

    judge: Judge
    stands: Stands
    layers: GroundLayers
    course: Course
    cycles: int
    banned: frozenset[tuple[int, int, int]]
    limbs: Limbs
    last: LastLook

    @property
    def effort(self) -> int:
        """How many tries of steps one search may make."""
        return 4 * self.cycles * EFFORT * self.judge.settings.width_limit

    def without(self, found: TerrainSearch, step: int) -> Search:
        """The search without a step of a way that was found, and without those near to it."""
        leg = LEGS.index(found.order[step])
        place = self.stands.centres[found.stands[step + 1, leg], :2]
        ground, settings = self.judge.surfaces.ground, self.judge.settings
        near = self.stands.near(ground, place, BLOCK * settings.freedom).tolist()
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
            following = self._next(layers[-1], width, refused, tried, end)
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
        late = len(farthest) <= steps and thread_time() >= until
        return Found(tuple(farthest), steps, reasons or dict(refused), numbers, width, work, late)

    def usual(self, leg: int, steps: int) -> FloatArray:
        """Where a leg usually stands after a number of its steps ``(2,)`` [m]."""
        x, y, yaw = self.course.at(self.course.length * steps / max(self.cycles, 1))
        cosine, sine = np.cos(yaw), np.sin(yaw)
        ahead, left = self.judge.usual_feet[leg]
        return np.array([x + cosine * ahead - sine * left, y + sine * ahead + cosine * left])

    @cached_property
    def outlook(self) -> Outlook:
        """What becomes of footholds while feet stand on them."""
        return Outlook(self.judge, self.stands, self.course, self.cycles)

    def _next(
        self, layer: Layer, width: int, refused: Counter[Cause], tried: set[int], until: float
    ) -> Layer | None:
        """The states after one more step; ``None`` where there is none."""
        orders = [self.legs(made) for made in layer.made]
        for choice in range(4):
            legs = np.array([o[choice] if choice < len(o) else -1 for o in orders])
            found = self._expand(layer, legs, width, refused, tried, until)
            if found is not None:
                return found
        return None

    def legs(self, made: np.ndarray) -> list[int]:
        """The legs that may step next, the usual one first."""
        least = int(made.min())
        return [leg for leg in CYCLE if made[leg] == least]

    def _expand(
        self, layer: Layer, legs: np.ndarray, width: int, refused: Counter[Cause],
        tried: set[int], until: float,
    ) -> Layer | None:  # fmt: skip
        """The cheapest states in which given legs ``(N,)`` have stepped; -1 for none."""
        state, stand, cost = self._candidates(layer, legs, refused)
        if not len(state):
            refused[Cause.GROUND] += int((legs >= 0).sum())
            return None
        kept = Kept(width, lambda steps: self.last.kept(layer, steps, refused))
        order = np.argsort(cost, kind="stable")
        most = MOST_CHUNKS * max(width // self.judge.settings.width, 1)
        for number, chunk in enumerate(np.array_split(order, max(len(order) // CHUNK, 1))[:most]):
            for leg in sorted(set(legs[state[chunk]].tolist())):
                own = chunk[legs[state[chunk]] == leg]
                # At a dead end the rare ways cost most; the best pairs tell if they help.
                rare = number < RARE_CHUNKS
                self._judge(layer, leg, state[own], stand[own], cost[own], kept, refused, rare)
            tried.update(stand[chunk].tolist())
            if kept.full:
                kept.settled()
            if kept.full or thread_time() > until:
                break
        return kept.layer(layer)

    def _candidates(
        self, layer: Layer, legs: np.ndarray, refused: Counter[Cause]
    ) -> tuple[np.ndarray, np.ndarray, FloatArray]:
        """States, stands to step to, and their costs, before anything is judged."""
        height = self.judge.settings.body_height
        states, stands, costs = [], [], []
        for leg, made in sorted({(int(k), int(m[k])) for k, m in zip(legs, layer.made, strict=True)
                                 if k >= 0}):  # fmt: skip
            usual = self.usual(leg, made + 1)
            near, own = self._thinned(usual, leg, int(layer.made[0].sum()))
            # All states of a layer have made the same number of steps.
            banned = [
                k for s, other, k in self.banned if (s, other) == (int(layer.made[0].sum()), leg)
            ]
            allowed = ~np.isin(near, banned)
            refused[Cause.PLAN] += int((~allowed).sum())
            near, own = near[allowed], own[allowed]
            if not near.size:
                continue
            for n in np.flatnonzero((legs == leg) & (layer.made[:, leg] == made)):
                way = np.linalg.norm(self.stands.centres[near] - layer.feet[n, leg], axis=1)
                cost = layer.cost[n] + own + FOOT_WAY * way / height
                states.append(np.full(len(near), n))
                stands.append(near)
                costs.append(cost)
        if not states:
            return np.empty(0, int), np.empty(0, int), np.empty(0)
        return np.concatenate(states), np.concatenate(stands), np.concatenate(costs)

    def _thinned(self, usual: FloatArray, leg: int, step: int) -> tuple[np.ndarray, FloatArray]:
        """Some stands near a usual place, spread over it, and what each costs a leg in a step."""
        settings = self.judge.settings
        near = self._near(usual)
        if not near.size:
            return near, np.empty(0)
        away = self.stands.centres[near, :2] - usual
        own = FROM_USUAL * (away**2).sum(axis=1) / settings.freedom**2
        own = own + self.stands.penalties[near] + NO_USE * self.outlook.of(leg, step, near)
        side = max(BLOCK * settings.freedom, self.judge.surfaces.ground.resolution)
        block = np.floor(away / side + 0.5).astype(int)
        order = np.argsort(own, kind="stable")
        _, first = np.unique(block[order], axis=0, return_index=True)
        chosen = order[np.sort(first)][:CANDIDATES]
        return near[chosen], own[chosen]

    def _near(self, usual: FloatArray) -> np.ndarray:
        """The stands within the step's freedom of a usual place, or farther where there are few."""
        ground, freedom = self.judge.surfaces.ground, self.judge.settings.freedom
        near = np.empty(0, dtype=int)
        for times in FREER:
            near = self.stands.near(ground, usual, times * freedom)
            if len(near) >= FEW * np.pi * (freedom / ground.resolution) ** 2:
                break
        return near

    def _judge(
        self, layer: Layer, leg: int, state: np.ndarray, stand: np.ndarray, cost: FloatArray,
        kept: Kept, refused: Counter[Cause], rare: bool,
    ) -> None:  # fmt: skip
        """Judge pairs of one leg, and keep those that are possible."""
        made = layer.made[state].sum(axis=1) + 1
        yaw = self.course.at(self.course.length * made / max(4 * self.cycles, 1))[:, 2]
        pairs = Pairs(layer.feet[state], layer.body[state], self.stands.centres[stand], yaw, leg)
        judged = self.judge.judge(pairs, rare)
        refused.update(judged.refused)
        way = np.linalg.norm(judged.body[:, :3] - layer.body[state, :3], axis=1)
        cost = cost + BODY_WAY * way / self.judge.settings.body_height
        cost = cost + NO_USE_AHEAD * judged.prospects
        possible = np.flatnonzero(judged.possible)
        if not len(possible):
            return
        there, before = pairs.chosen(possible), layer.rolled[state[possible]]
        rolled = rolled_on(self.limbs, there.feet, there.body, judged.body[possible], before)
        shares = half_ways(rolled) / MOST_ROLLED
        refused[Cause.ROLL] += int((shares.max(axis=1) > 1.0).sum())
        # What a foot had rolled before has been counted.
        more = ROLLED * (shares**2 - (half_ways(before) / MOST_ROLLED) ** 2).sum(axis=1)
        # The foot that steps begins anew.
        rolled[:, leg] = 0.0
        for n in np.flatnonzero(shares.max(axis=1) <= 1.0):
            i = possible[n]
            kept.add(Candidate(float(cost[i] + more[n]), int(state[i]), int(stand[i]), leg,
                               pairs.target[i], judged.body[i], float(judged.rise[i]),
                               rolled[n]))  # fmt: skip
