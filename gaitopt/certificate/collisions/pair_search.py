"""The smallest clearance of many pairs of shapes over a whole motion.

Two shapes that are ``d`` apart cannot touch before they have moved by ``d`` together, and how far
they move at most is known from the joints' rates [Mirtich1996]. So one look at the middle of a span
of time settles what of it the shapes have moved less in; the rest is halved. Most looks are at
boxes around the shapes, many at once (:mod:`gaitopt.certificate.collisions.shape_bounds`); coal
computes a distance where these are too near. What is left of single pieces of the path is followed
from its start, from distance to distance. No instant is left out.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
import pinocchio as pin

from gaitopt.certificate.collisions.shape_bounds import RoundedBoxes
from gaitopt.certificate.enclosure import Pieces
from gaitopt.certificate.placements import Placements, configurations
from gaitopt.conventions import FloatArray
from gaitopt.plan.plan import Plan

CONTACT = 1e-4
"""Clearance below which a pair counts as touching [m]. Chosen: far above the errors of coal's
distances, and small against the play of a robot's joints."""
KEPT = 0.5
"""Share of the smallest clearance seen that no pair falls below unseen. Chosen: what conservative
advancement keeps, whose steps are as long as the distance."""
ENOUGH = 0.15
"""Share of the upper bound on a distance from which a lower bound is good enough to go on with.
Chosen: shares of 0.15 to 0.4 take about the same time."""
MOST_ROUNDS = 100_000
"""Most distances of a pair that are computed one after another, at some 20 us each."""


class Pair(NamedTuple):
    """Two shapes.

    Attributes:
        number: of the collision pair in Pinocchio's geometry model.
        name: both shapes.
        shapes: their numbers in the geometry model.
    """

    number: int
    name: str
    shapes: tuple[int, int]


class Nearest(NamedTuple):
    """The smallest clearance that was computed, or that of the first contact.

    Attributes:
        clearance: of two shapes [m].
        when: it was seen [s].
        name: of the two shapes.
    """

    clearance: float
    when: float
    name: str


class _Spans(NamedTuple):
    """Pairs over spans of the path.

    Attributes:
        pair: numbers of the pairs ``(N,)``.
        first, last: numbers of the knots at which the spans begin and end ``(N,)``.
    """

    pair: np.ndarray
    first: np.ndarray
    last: np.ndarray

    def chosen(self, which: np.ndarray) -> _Spans:
        """Some of them."""
        return _Spans(*(part[which] for part in self))


@dataclass(eq=False)
class PairSearch:
    """Looks for the smallest clearance of pairs.

    Attributes:
        plan: whose motion it is.
        geometry: Pinocchio's, with the pairs.
        pieces: of the plan's path.
        pairs: that are looked at.
        moved: bound on how far each shape's points have moved relative to the base, at each knot
            ``(S, P + 1)`` [m].
        least: the smallest clearance so far.
        contact: the first contact so far; nothing later than it is looked at.
    """

    plan: Plan
    geometry: Any
    pieces: Pieces
    pairs: Sequence[Pair]
    moved: FloatArray
    least: Nearest = field(default_factory=lambda: Nearest(np.inf, 0.0, ""))
    contact: Nearest | None = None

    def __post_init__(self) -> None:
        self._data = self.plan.robot.model.createData()
        self._placed = self.geometry.createData()
        ends = self.pieces.starts[-1] + self.pieces.lengths[-1]
        self._times = np.append(self.pieces.starts, ends)
        self._values = self.plan.path.evaluate(self._times)
        self._shapes = np.array([pair.shapes for pair in self.pairs]).T

    def run(self) -> tuple[Nearest, bool]:
        """The smallest clearance or the first contact; and whether all was looked at."""
        count, end = len(self.pairs), len(self._times) - 1
        spans = _Spans(np.arange(count), np.zeros(count, dtype=int), np.full(count, end))
        single = []
        while len(spans.pair):
            alone = spans.last - spans.first == 1
            single.append(spans.chosen(alone))
            spans = self._halved(spans.chosen(~alone))
        left = _Spans(*(np.concatenate(parts) for parts in zip(*single, strict=True)))
        finished = self._follow(self._runs(left))
        return self.contact or self.least, finished or self.contact is not None

    def _halved(self, spans: _Spans) -> _Spans:
        """The halves of spans of which one look at their middles does not settle everything."""
        middle = (spans.first + spans.last) // 2
        before = self._travel(spans.pair, spans.first, middle)
        after = self._travel(spans.pair, middle, spans.last)
        first, second = self._shapes[:, spans.pair]
        gap, most = self._boxes.apart(first, second, middle)
        # Comparisons with NaN are false.
        unsettled = ~(gap - np.maximum(before, after) >= self._kept)
        if np.isfinite(self.least.clearance):
            # Distances lie between the bounds. Where these say enough it is cheaper to halve, and
            # so it is where a distance is not likely to settle a half.
            enough = gap - self._kept >= ENOUGH * most
            hopeless = (gap + most) / 2.0 - np.minimum(before, after) < self._kept
            unsettled &= ~(enough | hopeless)
        doubtful = np.flatnonzero(unsettled)
        gap[doubtful] = self._distances(spans.pair[doubtful], middle[doubtful])
        left, right = ~(gap - before >= self._kept), ~(gap - after >= self._kept)
        halves = _Spans(
            np.concatenate([spans.pair[left], spans.pair[right]]),
            np.concatenate([spans.first[left], middle[right]]),
            np.concatenate([middle[left], spans.last[right]]),
        )
        return (
            halves
            if self.contact is None
            else halves.chosen(self._times[halves.first] < self.contact.when)
        )

    @property
    def _kept(self) -> float:
        """Clearance that is shown between looks [m]."""
        return max(KEPT * self.least.clearance, CONTACT / 2.0)

    @cached_property
    def _boxes(self) -> RoundedBoxes:
        placed = Placements.of(self.plan.robot.model, self._values)
        return RoundedBoxes.of(list(self.geometry.geometryObjects), placed)

    def _travel(self, pair: np.ndarray, first: np.ndarray, last: np.ndarray) -> FloatArray:
        """How far pairs move at most between two knots ``(N,)`` [m]."""
        ways = (self.moved[shape[pair], last] - self.moved[shape[pair], first]
                for shape in self._shapes)  # fmt: skip
        return np.asarray(sum(ways))

    def _distances(self, pair: np.ndarray, knots: np.ndarray) -> FloatArray:
        """Distances of pairs at knots ``(N,)`` [m], by coal."""
        found = np.empty(len(pair))
        at, which = np.unique(knots, return_inverse=True)
        order = np.argsort(which, kind="stable")
        ends = np.searchsorted(which[order], np.arange(len(at) + 1))
        q = configurations(self._values[at])
        for k, knot in enumerate(at.tolist()):
            self._place(q[k])
            for n in order[ends[k] : ends[k + 1]].tolist():
                found[n] = self._distance(self.pairs[pair[n]], float(self._times[knot]))
        return found

    def _place(self, q: FloatArray) -> None:
        pin.updateGeometryPlacements(
            self.plan.robot.model, self._data, self.geometry, self._placed, q
        )

    def _distance(self, pair: Pair, when: float) -> float:
        """Distance of a pair where the shapes are placed, which is noted [m]."""
        found = pin.computeDistance(self.geometry, self._placed, pair.number).min_distance
        if found < self.least.clearance:
            self.least = Nearest(found, when, pair.name)
        # A comparison with NaN is false.
        if not found >= CONTACT and (self.contact is None or when < self.contact.when):
            self.contact = Nearest(found, when, pair.name)
        return float(found)

    def _runs(self, single: _Spans) -> _Spans:
        """Single pieces of one pair that follow each other, as one span."""
        order = np.lexsort((single.first, single.pair))
        pair, first, last = single.chosen(order)
        joined = (pair[1:] == pair[:-1]) & (first[1:] == last[:-1])
        begins = np.flatnonzero(np.concatenate([[True], ~joined])[: len(pair)])
        ends = np.append(begins[1:], len(pair)) - 1 if len(begins) else begins
        return _Spans(pair[begins], first[begins], last[ends])

    def _follow(self, spans: _Spans) -> bool:
        """Follow pairs from the starts of spans, from distance to distance; whether to the end."""
        agenda = [
            _Followed(self.pairs[p], self.moved[list(self.pairs[p].shapes)].sum(axis=0), b,
                      float(self._times[a]))
            for p, a, b in zip(*(part.tolist() for part in spans), strict=True)
        ]  # fmt: skip
        for _ in range(MOST_ROUNDS):
            agenda = [f for f in agenda if self.contact is None or f.time < self.contact.when]
            if not agenda:
                return True
            moments = configurations(self.plan.path.evaluate([f.time for f in agenda]))
            ahead = []
            for followed, q in zip(agenda, moments, strict=True):
                self._place(q)
                distance = self._distance(followed.pair, followed.time)
                if distance >= CONTACT:
                    ahead.append(followed.moved_on(distance, self._times))
            agenda = [f for f in ahead if f is not None]
        return False


class _Followed(NamedTuple):
    """A pair that is followed.

    Attributes:
        pair: the two shapes.
        moved: bound on the distance moved, at each knot ``(P + 1,)`` [m].
        last: knot up to which it is followed.
        time: reached [s].
    """

    pair: Pair
    moved: FloatArray
    last: int
    time: float

    def moved_on(self, distance: float, times: FloatArray) -> _Followed | None:
        """At the first time at which the pair may touch; ``None`` beyond the end.

        Half the clearance that counts as contact makes up for rounding.
        """
        here = float(np.interp(self.time, times, self.moved))
        reached = here + distance - CONTACT / 2.0
        if reached >= self.moved[self.last]:
            return None
        i = int(np.searchsorted(self.moved, reached, side="right")) - 1
        share = (reached - self.moved[i]) / (self.moved[i + 1] - self.moved[i])
        return self._replace(time=float(times[i] + share * (times[i + 1] - times[i])))
