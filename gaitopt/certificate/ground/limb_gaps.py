"""The gaps between parts of a robot and the ground, followed along a path.

Most of the walk is settled by boxes: the box around a part of a link, over a piece of the path, is
above the highest ground under it. Where it is not, distances decide: a part that is ``d`` away from
the ground cannot touch it before one of its points has moved by ``d``. How far they move is
measured at samples; between two samples a point leaves its chord by a known bound.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

import numpy as np

from gaitopt.certificate.contacts import SINKING
from gaitopt.certificate.enclosure import Pieces
from gaitopt.certificate.ground.solids import Solid
from gaitopt.certificate.ground.unknown import Footprints
from gaitopt.certificate.placements import Placements, placement_of, samples_last
from gaitopt.conventions import BoolArray, FloatArray
from gaitopt.plan.plan import Plan

CLEAR = 1e-5
"""Least gap that counts as clear [m]: ten times what coal's distances may be off, which its solver
stops at (1e-6 m)."""
NEAR = 5e-3
"""Room between a part's box and the ground from which its distance is not computed [m]. Chosen: the
room is a lower bound, and below this one wants to know the distance itself."""
RESTS = 2.0 * CLEAR
"""A part that is nearer to the ground than this where a plan enters from a state lies on it [m]."""
SHORTEST = 2.0**-14
"""Shortest part of a piece that is looked at, as a share of it. Chosen: a part that moves by 10 mm
on a piece has moved by less than a micrometre on one."""
MOST_DISTANCES = 100_000
"""Most distances that are computed, at some 60 us each; or :data:`MOST_EACH` of every piece of the
path, if these are more. A walk over rough ground of 64 steps takes some 2 000."""
MOST_EACH = 4
"""See :data:`MOST_DISTANCES`."""
STRIDE = 16
"""Pieces that are looked at together; and from one distance to the next where a part is in the
ground, for nothing is left to prove there, and the worst is looked for."""
LONGEST_STRIDE = 1024
"""Most pieces that are looked at together: twice as many each time that all were far enough."""


class Ground(Protocol):
    """What legs and trunk must be clear of."""

    @property
    def top(self) -> float:
        """Height that it nowhere exceeds; infinite where some of it is not known [m]."""

    def highest(self, low: FloatArray, high: FloatArray) -> FloatArray:
        """Upper bound on its height under rectangles; infinite where it is not known."""

    def unknown_under(self, boxes: Footprints) -> BoolArray:
        """Whether some of it under boxes is not known."""

    def gap(self, solid: Solid, rotation: FloatArray, origin: FloatArray) -> float:
        """Distance of a solid to it, negative where it reaches into it [m]."""


@dataclass
class Found:
    """What has been found so far.

    Attributes:
        gap: the least one [m].
        when: at which time [s].
        where: of which part.
        unproven: whether a gap between samples could not be shown.
        left: how many more distances may be computed.
    """

    gap: float = np.inf
    when: float = 0.0
    where: str = ""
    unproven: bool = False
    left: int = 0

    def see(self, gap: float, when: float, where: str) -> None:
        """Keep the least gap."""
        # A comparison with NaN is false.
        if not gap >= self.gap:
            self.gap, self.when, self.where = gap, when, where


class LimbGaps:
    """Follows the parts of a robot along a path.

    Attributes:
        found: what has been found so far.
        resting: names of the parts that rest on the ground where the plan begins.
    """

    def __init__(
        self, plan: Plan, ground: Ground, pieces: Pieces, leaves: dict[int, FloatArray]
    ) -> None:
        self._plan, self._ground, self._pieces, self._leaves = plan, ground, pieces, leaves
        self._places = pieces.places()
        self._placed = Placements.of(plan.robot.model, self._places.values)
        self._data = plan.robot.model.createData()
        self._times = np.zeros(len(self._places.values))
        for ends, times in zip(
            self._places.ends, (pieces.starts, pieces.starts + pieces.lengths), strict=True
        ):
            self._times[ends] = times
        self.found = Found(left=max(MOST_DISTANCES, MOST_EACH * len(pieces.starts)))
        self.resting: list[str] = []
        self._entered = plan.phases[plan.entry - 1].end if plan.entry else 0.0
        self._lift = 0.0

    def follow(self, solid: Solid) -> None:
        """Hold one part against the ground, over the whole path."""
        self._lift = self._rests(solid)
        room = self._room(solid)
        off = np.flatnonzero(np.isneginf(room))
        off = off[self._above_unknown(solid, off)] if off.size else off
        if off.size:
            k = int(off[0])
            where = f"{solid.name} above ground that is unknown or off the map"
            self.found.see(-np.inf, float(self._pieces.starts[k]), where)
            return
        near = ~(room >= NEAR)
        if not near.all():
            k = int(np.where(near, np.inf, room).argmin())
            self.found.see(float(room[k]), float(self._pieces.starts[k]), solid.name)
        edges = np.flatnonzero(np.diff(np.concatenate([[0], near.astype(np.int8), [0]])))
        for first, end in edges.reshape(-1, 2).tolist():
            self._run(solid, first, end)

    def _rests(self, solid: Solid) -> float:
        """By how much the gaps of a part count as larger until the plan has entered [m].

        A robot that lies begins with parts on the ground, which may be a little in it as feet may.
        They are never to be deeper than at the begin, and clear once the plan has entered.
        """
        if not self._entered > 0.0:
            return 0.0
        turn = self._placed.rotations[solid.joint][0]
        origin = self._placed.origins[solid.joint][0]
        gap = self._ground.gap(solid, turn, origin)
        if not -SINKING <= gap < RESTS:
            return 0.0
        self.resting.append(solid.name)
        return RESTS - gap

    def _room(self, solid: Solid) -> FloatArray:
        """How far the box around a part is above the highest ground under it ``(P,)`` [m]."""
        turn, origin = samples_last(self._placed.rotations[solid.joint]), self._placed.origins
        origin = origin[solid.joint].T
        (a, b), leaves = self._places.ends, self._leaves[solid.joint]
        rotation = solid.place[0].T
        bottom = origin[2] + solid.centre @ turn[2]
        bottom = bottom - solid.half @ np.abs(rotation @ turn[2])
        bottom = np.minimum(bottom[a], bottom[b]) - leaves
        room = bottom - self._ground.top
        close = np.flatnonzero(~(room >= NEAR))
        if not close.size:
            return np.asarray(room)
        a, b, extra = a[close], b[close], leaves[close]
        first, end = int(min(a.min(), b.min())), int(max(a.max(), b.max())) + 1
        part, a, b = turn[:2, :, first:end], a - first, b - first
        middle = origin[:2, first:end] + solid.centre @ part
        half = solid.half @ np.abs(rotation @ part)
        low, high = middle - half, middle + half
        low = np.minimum(low[:, a], low[:, b]) - extra
        high = np.maximum(high[:, a], high[:, b]) + extra
        room[close] = bottom[close] - self._ground.highest(low.T, high.T)
        return np.asarray(room)

    def _above_unknown(self, solid: Solid, pieces: np.ndarray) -> BoolArray:
        """Whether the box around a part may be above unknown ground on pieces ``(N,)``.

        On one half of a piece no point of it is farther from its place at the nearer end than half
        of what it moves from end to end, and how far it leaves its chord.
        """
        ends = self._places.ends[:, pieces]
        moved = _moved(self._corners(solid, ends[0]), self._corners(solid, ends[1]))
        margins = moved / 2.0 + self._leaves[solid.joint][pieces]
        above = np.zeros(len(pieces), dtype=np.bool_)
        for samples in ends:
            turn = self._placed.rotations[solid.joint][samples]
            middles = self._placed.origins[solid.joint][samples] + turn @ solid.centre
            axes = (turn @ solid.place[0] * solid.half).mT
            above |= self._ground.unknown_under(Footprints(middles[:, :2], axes[..., :2], margins))
        return above

    def _run(self, solid: Solid, first: int, end: int) -> None:
        """Hold a part against the ground over the pieces from ``first`` to before ``end``."""
        begins, finishes = self._places.ends[:, first:end]
        begin, finish = self._corners(solid, begins), self._corners(solid, finishes)
        leaves, count = self._leaves[solid.joint][first:end], end - first
        k, seen, gap, stride = 0, 0, self._gap_at(solid, begins[0]), STRIDE
        while k < count and self.found.left > 0:
            ahead, from_here = slice(k, min(k + stride, count)), begin[..., seen, None]
            moved = np.maximum(
                _moved(begin[..., ahead], from_here), _moved(finish[..., ahead], from_here)
            )
            late = np.flatnonzero(moved + leaves[ahead] > gap - CLEAR / 2.0)
            if gap < CLEAR or not late.size:
                # Nothing is left to prove, or nothing here needs another distance.
                k = ahead.stop
                if gap >= CLEAR:
                    stride = min(2 * stride, LONGEST_STRIDE)
                    continue
            elif late[0] == 0 and seen == k:
                self._between(solid, first + k, _Sample(gap, begin[..., k]), leaves[k])
                k += 1
            else:
                k += int(late[0])
            if k < count:
                seen, gap, stride = k, self._gap_at(solid, begins[k]), STRIDE
        self.found.unproven |= k < count

    def _between(self, solid: Solid, piece: int, first: _Sample, leaves: float) -> None:
        """Hold a part against the ground on one piece, cut in halves until it is settled.

        Two samples bound the gap between them from below [Shubert1972].
        """
        start, length = self._pieces.starts[piece], self._pieces.lengths[piece]
        agenda = [(start, length, first, self._sample(solid, start + length), leaves)]
        while agenda and self.found.left > 0:
            t, h, a, b, leaves = agenda.pop()
            if min(a.gap, b.gap) < CLEAR:
                return
            if (a.gap + b.gap - _moved(a.corners, b.corners)) / 2.0 - leaves >= CLEAR / 2.0:
                continue
            if h < length * SHORTEST:
                break
            middle = self._sample(solid, t + h / 2.0)
            agenda.append((t, h / 2.0, a, middle, leaves / 4.0))
            agenda.append((t + h / 2.0, h / 2.0, middle, b, leaves / 4.0))
        else:
            self.found.unproven |= bool(agenda)
            return
        self.found.unproven = True

    def _corners(self, solid: Solid, samples: np.ndarray) -> FloatArray:
        """Corners of the box around a part, at samples ``(3, 8, N)`` [m]."""
        turn = samples_last(self._placed.rotations[solid.joint])[..., samples]
        origin = self._placed.origins[solid.joint][samples].T
        return np.asarray(origin[:, None] + solid.corners @ turn)

    def _gap_at(self, solid: Solid, sample: int) -> float:
        """The gap of a part at a sample [m]."""
        placed = self._placed
        return self._gap(
            solid, placed.rotations[solid.joint][sample], placed.origins[solid.joint][sample],
            float(self._times[sample]),
        )  # fmt: skip

    def _sample(self, solid: Solid, time: float) -> _Sample:
        """The gap and the corners of a part at a time [s]."""
        values = self._plan.path.evaluate([time])[0]
        turn, origin = placement_of(self._plan.robot.model, self._data, values, solid.joint)
        gap = self._gap(solid, turn, origin, time)
        return _Sample(gap, origin[:, None] + turn @ solid.corners.T)

    def _gap(self, solid: Solid, turn: FloatArray, origin: FloatArray, time: float) -> float:
        gap = self._ground.gap(solid, turn, origin)
        self.found.left -= 1
        if time < self._entered and gap + self._lift >= CLEAR:
            gap += self._lift
            if self._lift > 0.0:
                # It rests on the ground, or has just left it, which is no gap to tell of.
                return gap
        self.found.see(gap, time, solid.name)
        return gap


class _Sample(NamedTuple):
    """A part at one time.

    Attributes:
        gap: its distance to the ground [m].
        corners: of the box around it ``(3, 8)`` [m].
    """

    gap: float
    corners: FloatArray


def _moved(corners: FloatArray, others: FloatArray) -> Any:
    """Farthest distance between the same corners at two places ``(3, 8, ...)``: ``(...)`` [m].

    No point of the box between them has moved farther.
    """
    x, y, z = corners - others
    return np.sqrt((x * x + y * y + z * z).max(axis=0))
