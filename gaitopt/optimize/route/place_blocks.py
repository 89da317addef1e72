"""Second-order matrices of rows on velocities and accelerations, in places and spans.

A *place* is the joint angles and the body centre at a knot, 15 numbers. With places ``u``, spans
``d`` and ``h(k) = (d(k) + d(k+1)) / 2`` the velocity in interval ``k`` is ``v(k) = (u(k+1) - u(k))
/ h(k)``, and the velocity change at knot ``k`` is ``v(k) - v(k-1)``: one number of a place never
looks at another one. So joints need no blocks, but diagonals only; the body centre has small blocks
for the rows of the ZMP.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.optimize.route.legs import JOINTS

PLACE = JOINTS + 3
"""Numbers of a place."""
BODY_AXES = 3
"""Axes of the body centre."""
LOCAL = 12
"""What the ZMP's rows of a knot look at: body centres before, at and after it, and their spans."""


@dataclass(frozen=True, eq=False)
class VelocityChanges:
    """How velocities and their changes depend on places and spans.

    Attributes:
        times: of all intervals ``(K - 1,)``.
        velocities: in all intervals ``(K - 1, 15)``.
    """

    times: FloatArray
    velocities: FloatArray

    @cached_property
    def by_places(self) -> FloatArray:
        """Derivative of a change by its number in the places before, at and after ``(3, K)``."""
        one = 1.0 / self.times
        before, after = np.append(0.0, one), np.append(one, 0.0)
        return np.stack([before, -before - after, after])

    @cached_property
    def by_spans(self) -> FloatArray:
        """Derivative of a change by the spans before, at and after ``(3, K, 15)``."""
        half = self.velocities / (2.0 * self.times[:, None])
        none = np.zeros((1, PLACE))
        before, after = np.concatenate([none, half]), np.concatenate([half, none])
        return np.stack([before, before - after, -after])

    def by_local(self, numbers: slice) -> FloatArray:
        """Derivative of three numbers' changes by these and spans about a knot ``(K, 3, 12)``."""
        out = np.zeros((len(self.times) + 1, 3, LOCAL))
        for i in range(3):
            out[:, range(3), range(3 * i, 3 * i + 3)] = self.by_places[i][:, None]
            out[:, :, 9 + i] = self.by_spans[i][:, numbers]
        return out

    def times_moves(self, places: FloatArray, spans: FloatArray) -> tuple[FloatArray, FloatArray]:
        """What moves places ``(K, 15)`` and spans ``(K,)`` change, to first order.

        Returns:
            The differences of neighbouring joint angles ``(K - 1, 12)``, and all velocity changes
            ``(K, 15)``.
        """
        turned = np.diff(places, axis=0)
        between = (spans[1:] + spans[:-1])[:, None] / 2.0
        velocity = (turned - between * self.velocities) / self.times[:, None]
        rest = np.zeros((1, PLACE))
        return turned[:, :JOINTS], np.diff(np.concatenate([rest, velocity, rest]), axis=0)

    def transpose_times(
        self, on_velocities: FloatArray, on_turns: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Gradient of weighted velocities and differences of places, each ``(K - 1, 15)``.

        Returns:
            By places ``(K, 15)``, and by the intervals' times ``(K - 1,)``.
        """
        by_turn = on_velocities / self.times[:, None]
        by_times = -(by_turn * self.velocities).sum(axis=1)
        by_turn = by_turn + on_turns
        rest = np.zeros((1, PLACE))
        return -np.diff(np.concatenate([rest, by_turn, rest]), axis=0), by_times


@dataclass(frozen=True, eq=False)
class PlaceBlocks:
    """A symmetric matrix in places and spans, by the distance of the knots in it.

    It is added up in place; entries beyond the first and last knots stay zero.

    Attributes:
        joints: of joints with themselves, at knots that are 0, 1 and 2 apart ``(3, K, 12)``;
            ``None`` where all of these are zero.
        body: of body centres, the same ``(3, K, 3, 3)``; rows belong to the first of two knots.
        mixed: of a place with the spans from two knots before to two knots after ``(K, 15, 5)``.
        spans: of spans that are 0, 1 and 2 knots apart ``(3, K)``.
    """

    joints: FloatArray | None
    body: FloatArray
    mixed: FloatArray
    spans: FloatArray

    @classmethod
    def empty(cls, knots: int, joints: bool) -> PlaceBlocks:
        """Of zeros.

        Args:
            knots: how many there are.
            joints: whether there is anything of joints with themselves.
        """
        own = np.zeros((3, knots, JOINTS)) if joints else None
        return cls(own, np.zeros((3, knots, 3, 3)), np.zeros((knots, PLACE, 5)),
                   np.zeros((3, knots)))  # fmt: skip

    def minus(self, other: PlaceBlocks) -> PlaceBlocks:
        """The difference from blocks that have nothing of joints with themselves."""
        return PlaceBlocks(self.joints, self.body - other.body, self.mixed - other.mixed,
                           self.spans - other.spans)  # fmt: skip

    def add_accelerations(
        self, changes: VelocityChanges, scale: FloatArray, limits: FloatArray
    ) -> None:
        """Add ``J' diag(scale) J`` of rows ``limit * span -+ change``, each ``(2, K, 12)``."""
        places, spans = changes.by_places[:, :, None], changes.by_spans[:, :, :JOINTS]
        own, both = self._own(), scale.sum(axis=0)
        crossed = scale[1] * limits[1] - scale[0] * limits[0]
        of_places = both * places
        for i in range(3):
            for j in range(i, 3):
                self._add(own[j - i], of_places[i] * places[j], i)
            for j in range(3):
                mixed = of_places[i] * spans[j]
                if j == 1:
                    mixed += crossed * places[i]
                self._add(self.mixed[:, :JOINTS, j - i + 2], mixed, i)
        of_spans = both * spans
        for i in range(3):
            for j in range(i, 3):
                self._add(self.spans[j - i], (of_spans[i] * spans[j]).sum(axis=1), i)
        by_own = (crossed * spans).sum(axis=2)
        self._add(self.spans[1], by_own[0], 0)
        self.spans[0] += 2.0 * by_own[1] + (scale * limits**2).sum(axis=(0, 2))
        self._add(self.spans[1], by_own[2], 1)

    def add_velocities(self, scale: FloatArray, limits: FloatArray) -> None:
        """Add the same of rows ``limit * time -+ turn`` of intervals, each ``(2, K - 1, 12)``."""
        own, both = self._own(), scale.sum(axis=0)
        own[0, :-1] += both
        own[0, 1:] += both
        own[1, :-1] -= both
        signed = (scale[1] * limits[1] - scale[0] * limits[0]) / 2.0
        square = (scale * limits**2).sum(axis=(0, 2)) / 4.0
        self._add_interval(signed, square)

    def add_positions(self, first: int, joints: np.ndarray, scale: FloatArray) -> None:
        """Add the same of rows of some joints' angles from a knot on ``(K - first, n)``."""
        self._own()[0, first:, joints] += scale.T

    def add_curvature(self, changes: VelocityChanges, on_velocities: FloatArray) -> None:
        """Add the Hessian of weighted velocities ``(K - 1, 15)`` by places and spans."""
        times = changes.times[:, None]
        # v = (u(k+1) - u(k)) / h: by h and a place, and twice by h, which is the mean of two spans.
        half = on_velocities / (2.0 * times**2)
        self._add_interval(-half, (half * changes.velocities).sum(axis=1))

    def add_local(self, local: FloatArray) -> None:
        """Add matrices of body centres and spans before, at and after each knot ``(K, 12, 12)``."""
        for i in range(3):
            rows = slice(3 * i, 3 * i + 3)
            for j in range(3):
                if j >= i:
                    self._add(self.body[j - i], local[:, rows, 3 * j : 3 * j + 3], i)
                    self._add(self.spans[j - i], local[:, 9 + i, 9 + j], i)
                self._add(self.mixed[:, JOINTS:, j - i + 2], local[:, rows, 9 + j], i)

    def by_poses(self, joints: FloatArray, body_axes: np.ndarray, own: FloatArray) -> FloatArray:
        """All entries of the matrix in poses and spans, for :meth:`PlaceBand.matrix`.

        Args:
            joints: derivative of the joints by the poses ``(K, 12, c)``.
            body_axes: axes of the body centre that are among the poses' first entries.
            own: what is added at single knots ``(K, c, c)``.
        """
        turned = np.ascontiguousarray(np.swapaxes(joints, 1, 2))
        knots, count = len(joints), len(body_axes)
        size, mixed_size = own[0].size, 5 * len(own[0])
        sizes = [size * (knots - apart) for apart in range(3)] + [mixed_size * knots, 3 * knots]
        ends = np.cumsum(sizes).tolist()
        entries = np.zeros(ends[-1])
        every = slice(None) if count == BODY_AXES else body_axes
        for apart in range(3):
            last = knots - apart
            block = entries[ends[apart] - sizes[apart] : ends[apart]].reshape(last, *own.shape[1:])
            if self.joints is not None:
                scaled = self.joints[apart, :last, :, None] * joints[apart:]
                np.matmul(turned[:last], scaled, out=block)
            block[:, :count, :count] += self.body[apart, :last][:, every][:, :, every]
            if apart == 0:
                block += own
        mixed = entries[ends[2] : ends[3]].reshape(knots, -1, 5)
        np.matmul(turned, self.mixed[:, :JOINTS], out=mixed)
        mixed[:, :count] += self.mixed[:, JOINTS:][:, every]
        entries[ends[3] :] = self.spans.ravel()
        return entries

    def _own(self) -> FloatArray:
        """What is of joints with themselves."""
        assert self.joints is not None
        return self.joints

    def _add_interval(self, mixed: FloatArray, spans: FloatArray) -> None:
        """Add entries of intervals.

        Args:
            mixed: of the difference of both places and either span ``(K - 1, n)``.
            spans: of both spans, in all pairs ``(K - 1,)``.
        """
        some = slice(0, mixed.shape[1])
        for column in (2, 3):
            self.mixed[:-1, some, column] -= mixed
            self.mixed[1:, some, column - 1] += mixed
        self.spans[0, :-1] += spans
        self.spans[0, 1:] += spans
        self.spans[1, :-1] += spans

    @staticmethod
    def _add(out: FloatArray, values: FloatArray, which: int) -> None:
        """Add values of knots to the knot before (0), at (1) or after (2) each of them."""
        if which == 0:
            out[:-1] += values[1:]
        elif which == 1:
            out += values
        else:
            out[1:] += values[:-1]


@dataclass(frozen=True, eq=False)
class PlaceBand:
    """Where the entries of :meth:`PlaceBlocks.by_poses` go in a banded matrix.

    Attributes:
        source: numbers of the entries that are used.
        target: their places in the flattened band.
        doubled: which of the used ones belong to one unknown with itself, and so stand for two.
        shape: of the band, ``(width, n)``.
    """

    source: np.ndarray
    target: np.ndarray
    doubled: np.ndarray
    shape: tuple[int, int]

    @classmethod
    def of(cls, poses: np.ndarray, spans: np.ndarray, size: int) -> PlaceBand:
        """From the numbers of unknowns; -1 where one is fixed.

        Args:
            poses: ``(K, c)``.
            spans: ``(K,)``.
            size: number of unknowns ``n``.
        """
        knots = len(poses)
        pairs, off = [], []
        for apart in range(3):
            first, second = poses[: knots - apart, :, None], poses[apart:, None]
            shape = (knots - apart, poses.shape[1], poses.shape[1])
            pairs.append(np.stack([np.broadcast_to(x, shape).ravel() for x in (first, second)]))
            off.append(np.full(pairs[-1].shape[1], apart > 0))
        # Entries at one knot stand twice, mirrored: one half is used.
        pairs[0][:, pairs[0][0] < pairs[0][1]] = -1
        none = np.full(2, -1)
        wide = np.concatenate([none, spans, none])
        near = np.stack([wide[i : i + knots] for i in range(5)], axis=1)
        shape = (*poses.shape, 5)
        mixed = [np.broadcast_to(x, shape).ravel() for x in (poses[:, :, None], near[:, None])]
        pairs.append(np.stack(mixed))
        pairs.append(np.stack([np.tile(spans, 3), near[:, 2:].T.ravel()]))
        off += [np.zeros(pairs[3].shape[1], dtype=bool), np.repeat([False, True, True], knots)]
        one, other = np.concatenate(pairs, axis=1)
        used = np.flatnonzero((one >= 0) & (other >= 0))
        one, other, apart_ = one[used], other[used], np.concatenate(off)[used]
        below = np.abs(one - other)
        width = int(below.max(initial=0)) + 1
        target = below * size + np.minimum(one, other)
        return cls(used, target, np.flatnonzero(apart_ & (below == 0)), (width, size))

    def matrix(self, entries: FloatArray) -> FloatArray:
        """The sum of all entries in LAPACK's form ``(width, n)``."""
        taken = entries[self.source]
        taken[self.doubled] *= 2.0
        flat = np.bincount(self.target, taken, minlength=self.shape[0] * self.shape[1])
        return np.asarray(flat.reshape(self.shape))
