"""The time-optimal route as one smooth problem whose matrices are banded.

Unknowns are poses at knots and the times ``h`` between them; minimise the sum of all ``h``. Between
two knots every joint keeps its velocity limit, ``|q(k+1) - q(k)| <= w h``: the path's length in the
norm ``max |dq| / w`` (``docs/theory.md``), written so that it is smooth. All else are inequalities
at single knots: joint position limits, rows that are linear or separable quadratics of a pose, and
rows that are linear in the true centre of mass. There are no equalities: what is fixed is no
unknown.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.optimize.route_com import ComRows
from gaitopt.optimize.route_legs import RouteLegs

JOINTS = 12
UNIT_TURN = np.radians(17.0)
"""The slowest joint turns by so much in a problem's unit of time [rad]."""


class Rows(NamedTuple):
    """Inequalities ``offset + linear . y + sum(square * y**2) / 2 >= 0`` on single poses ``y``.

    Attributes:
        knot: the pose that each row looks at ``(M,)``, ascending.
        linear, square: ``(M, 9)``.
        offset: ``(M,)``.
    """

    knot: np.ndarray
    linear: FloatArray
    square: FloatArray
    offset: FloatArray


class Slots(NamedTuple):
    """Lays out rows by their knots, so that sums over each knot's rows are matrix products.

    Attributes:
        knot: of each row ``(M,)``, ascending.
        slot: its number among its knot's rows ``(M,)``.
        shape: knots, and most rows of any.
    """

    knot: np.ndarray
    slot: np.ndarray
    shape: tuple[int, int]

    @classmethod
    def of(cls, knot: np.ndarray, knots: int) -> Slots:
        """From each row's knot, ascending."""
        first = np.searchsorted(knot, knot, side="left")
        slot = np.arange(len(knot)) - first
        return cls(knot, slot, (knots, int(slot.max(initial=0)) + 1))

    def spread(self, rows: FloatArray) -> FloatArray:
        """``rows (M, ...)`` as ``(knots, most, ...)``, with zeros where there is none."""
        out = np.zeros((*self.shape, *rows.shape[1:]))
        out[self.knot, self.slot] = rows
        return out


@dataclass(frozen=True, eq=False)
class RouteProblem:
    """A time-optimal route problem.

    Attributes:
        legs: constants of the robot's legs.
        feet: where the feet stand at each knot ``(K, 4, 3)`` [m].
        swing: 1 for the leg whose foot is part of the pose ``(K, 4)``.
        poses: values of all poses ``(K, 9)``; those that are unknowns serve as a first guess.
        unknown: number of each entry among the poses' unknowns ``(K, 9)``, -1 where it is fixed;
            ascending from knot to knot. Knots may share unknowns.
        rows: inequalities on single poses.
        bounded: which position limits are looked at, low and high ``(2, 12)``.
        evenness: weight of the small quadratic term in the times [1/s].
        com: inequalities on the true centre of mass, where there are any.
    """

    legs: RouteLegs
    feet: FloatArray
    swing: FloatArray
    poses: FloatArray
    unknown: np.ndarray
    rows: Rows
    bounded: np.ndarray
    evenness: float = 1.0
    com: ComRows | None = None

    @property
    def knots(self) -> int:
        """Number of knots ``K``."""
        return len(self.poses)

    @cached_property
    def rates(self) -> FloatArray:
        """Velocity limits of all joints ``(12,)`` [rad/s]."""
        return np.asarray(self.legs.rates.reshape(JOINTS))

    @property
    def unit(self) -> float:
        """A time that is short for this robot [s]: of the size of what is between two knots."""
        return float(UNIT_TURN / self.rates.min())

    @property
    def barrier(self) -> float:
        """First barrier parameter from a poor guess: small against an interval's time [s]."""
        return 1e-2 * self.unit

    @cached_property
    def columns(self) -> np.ndarray:
        """The pose's entries that are unknown at any knot."""
        return np.flatnonzero((self.unknown >= 0).any(axis=0))

    @cached_property
    def numbering(self) -> tuple[np.ndarray, np.ndarray, int]:
        """Places of poses ``(K, nc)`` and times ``(K - 1,)`` in the vector of unknowns; its size.

        Times are put between the poses that they separate, so that matrices are banded.
        """
        poses = self.unknown[:, self.columns]
        latest = np.maximum.accumulate(poses.max(axis=1, initial=-1))
        times = latest[:-1] + 1 + np.arange(self.knots - 1)
        count = int(poses.max(initial=-1)) + 1
        # An unknown pose moves back by the number of times that stand before it.
        before = np.searchsorted(latest[:-1], np.arange(count), side="left")
        placed = np.where(poses >= 0, poses + before[np.maximum(poses, 0)], -1)
        return placed, times, count + self.knots - 1

    @cached_property
    def fixed_knots(self) -> int:
        """Number of leading knots without unknowns, at which nothing is to be decided."""
        free = (self.unknown >= 0).any(axis=1)
        return int(np.argmax(free)) if free.any() else self.knots

    def start(self) -> FloatArray:
        """The first guess as a vector of unknowns, with times a little longer than needed."""
        return self.near(self.poses, 1e-2)

    def near(self, poses: FloatArray, spare: float = 1e-3) -> FloatArray:
        """Unknowns of given poses ``(K, 9)``, with times a little longer than needed.

        Args:
            poses: of all knots.
            spare: added to every time, in units of time.
        """
        return self.pack(poses, 1.1 * self.needed(poses) + spare * self.unit)

    def needed(self, poses: FloatArray) -> FloatArray:
        """The least time between each two of ``poses (K, 9)`` ``(K - 1,)`` [s]."""
        joints = self.legs.joints(poses, self.feet, self.swing).reshape(-1, JOINTS)
        return np.asarray((np.abs(np.diff(joints, axis=0)) / self.rates).max(axis=1))

    def worst_knots(self, x: FloatArray, duals: FloatArray, count: int = 3) -> np.ndarray:
        """The knots at which the Lagrangian's gradient is largest ``(count,)``."""
        placed, at, _ = self.numbering
        slope = np.abs(self.cost + self.even * x - self.linearised(x).pull(duals))
        by_knot = np.where(placed >= 0, slope[np.maximum(placed, 0)], 0.0).max(axis=1)
        by_knot[1:] = np.maximum(by_knot[1:], slope[at])
        return np.argsort(-by_knot)[:count]

    def pack(self, poses: FloatArray, times: FloatArray) -> FloatArray:
        """The vector of unknowns of given poses and times."""
        placed, at, size = self.numbering
        x = np.zeros(size)
        mine = placed >= 0
        x[placed[mine]] = poses[:, self.columns][mine]
        x[at] = times
        return x

    def unpack(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Poses ``(K, 9)`` and times ``(K - 1,)`` of a vector of unknowns."""
        placed, at, _ = self.numbering
        poses = self.poses.copy()
        poses[:, self.columns] = np.where(
            placed >= 0, x[np.maximum(placed, 0)], poses[:, self.columns]
        )
        return poses, x[at]

    @cached_property
    def cost(self) -> FloatArray:
        """Gradient of the sum of all times."""
        _, at, size = self.numbering
        out = np.zeros(size)
        out[at] = 1.0
        return out

    @cached_property
    def even(self) -> FloatArray:
        """Diagonal of the small quadratic term that keeps knots apart, in the times only."""
        return self.cost * self.evenness

    def values(self, x: FloatArray) -> FloatArray:
        """All inequalities, which must not be negative; NaN where a foot is out of reach."""
        poses, times = self.unpack(x)
        joints = self.legs.joints(poses, self.feet, self.swing).reshape(-1, JOINTS)
        return self._values(poses, times, joints)

    def _values(self, poses: FloatArray, times: FloatArray, joints: FloatArray) -> FloatArray:
        turn, room = np.diff(joints, axis=0), self.rates * times[:, None]
        late = joints[self.fixed_knots :]
        low, high = self.bounded
        y = poses[self.rows.knot]
        single = self.rows.offset + ((self.rows.linear + self.rows.square * y / 2.0) * y).sum(1)
        if self.com is not None:
            points = self.com.masses.points(poses, joints.reshape(-1, 4, 3))
            single = np.concatenate([single, self.com.values(points)])[self.order]
        return np.concatenate([
            (room - turn).ravel(), (room + turn).ravel(),
            (late - self.legs.low.ravel())[:, low].ravel(),
            (self.legs.high.ravel() - late)[:, high].ravel(), single,
        ])  # fmt: skip

    @property
    def settled(self) -> int:
        """How many of the first inequalities can be met by giving intervals more time."""
        return 2 * (self.knots - 1) * JOINTS

    def settle(
        self, x: FloatArray, values: FloatArray, slack: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Give intervals just so much more time that velocity limits keep their ``slack``.

        Args:
            x: unknowns.
            values: of all inequalities at ``x``.
            slack: what the velocity limits are to keep.

        Returns:
            Unknowns and values with the longer times.
        """
        count = self.settled
        short = np.maximum(slack[:count] - values[:count], 0.0).reshape(2, -1, JOINTS)
        more = (short.max(axis=0) / self.rates).max(axis=1)
        out, after = x.copy(), values.copy()
        out[self.numbering[1]] += more
        after[:count] += np.tile((more[:, None] * self.rates).ravel(), 2)
        return out, after

    def linearised(self, x: FloatArray) -> Linearised:
        """Values and derivatives at ``x``."""
        return Linearised(self, x)

    @cached_property
    def order(self) -> np.ndarray:
        """Order that makes knots ascend in ``rows`` followed by those of the centre of mass."""
        return np.argsort(self._knots_in_turn, kind="stable")

    @property
    def _knots_in_turn(self) -> np.ndarray:
        return self.rows.knot if self.com is None else np.append(self.rows.knot, self.com.knot)

    @cached_property
    def row_knots(self) -> np.ndarray:
        """Knots of all rows on single poses, ascending."""
        return np.asarray(self._knots_in_turn[self.order])

    @cached_property
    def squares(self) -> FloatArray:
        """Quadratic parts of all rows on single poses, in the poses' unknown entries."""
        square = np.zeros((len(self.order), len(self.columns)))
        square[: len(self.rows.knot)] = self.rows.square[:, self.columns]
        return np.asarray(square[self.order])

    @cached_property
    def slots(self) -> Slots:
        """The rows by their knots."""
        return Slots.of(self.row_knots, self.knots)

    @cached_property
    def band(self) -> Band:
        """Where the blocks of each interval go in the banded matrix."""
        placed, at, size = self.numbering
        return Band.of(np.concatenate([placed[:-1], at[:, None], placed[1:]], axis=1), size)


class Band(NamedTuple):
    """Scatters blocks of intervals into the lower band of a symmetric matrix.

    Attributes:
        source: entries of the flattened blocks that are used.
        target: their places in the flattened band.
        shape: of the band, ``(width, size)``.
        where: unknown of each row of each block ``(K - 1, b)``, -1 where there is none.
    """

    source: np.ndarray
    target: np.ndarray
    shape: tuple[int, int]
    where: np.ndarray

    @classmethod
    def of(cls, where: np.ndarray, size: int) -> Band:
        """From the unknowns that each block's rows belong to."""
        row, column = where[:, :, None], where[:, None, :]
        used = (row >= column) & (column >= 0)
        source = np.flatnonzero(used)
        down = np.broadcast_to(row - column, used.shape).reshape(-1)[source]
        across = np.broadcast_to(column, used.shape).reshape(-1)[source]
        width = int(down.max(initial=0)) + 1
        return cls(source, down * size + across, (width, size), where)

    def matrix(self, blocks: FloatArray) -> FloatArray:
        """Sum of ``blocks (K - 1, b, b)`` in LAPACK's lower banded form ``(width, size)``."""
        flat = np.bincount(
            self.target, blocks.reshape(-1)[self.source], minlength=self.shape[0] * self.shape[1]
        )
        return np.asarray(flat.reshape(self.shape))


class Linearised:
    """A problem's values and derivatives at one point.

    Attributes:
        values: all inequalities ``(m,)``.
    """

    def __init__(self, problem: RouteProblem, x: FloatArray) -> None:
        self._problem = problem
        self._poses, times = problem.unpack(x)
        self._bent = problem.legs.bend(self._poses, problem.feet, problem.swing)
        joints = self._bent.joints.reshape(-1, JOINTS)
        self.values = problem._values(self._poses, times, joints)
        self._gradients = self._bent.gradients()
        self._slopes = self._gradients[:, :, problem.columns]
        rows, com = problem.rows, problem.com
        single = rows.linear + rows.square * self._poses[rows.knot]
        if com is not None:
            self._com = com.masses.at(self._poses, self._bent, self._gradients)
            single = np.concatenate([single, com.slopes(self._com)])[problem.order]
        self._rows = single[:, problem.columns]

    def _split(self, v: FloatArray) -> tuple[FloatArray, ...]:
        """Parts of a vector over inequalities: up, down, low, high, rows."""
        p = self._problem
        late = p.knots - p.fixed_knots
        spans = (p.knots - 1) * JOINTS
        low, high = (int(b.sum()) * late for b in p.bounded)
        up, down, below, above, rows = np.split(v, np.cumsum([spans, spans, low, high]))
        return (up.reshape(-1, JOINTS), down.reshape(-1, JOINTS),
                below.reshape(late, -1), above.reshape(late, -1), rows)  # fmt: skip

    def _on_joints(self, v: FloatArray) -> FloatArray:
        """``sum of v * values`` as weights on the joints of every knot ``(K, 12)``."""
        p = self._problem
        up, down, below, above, _ = self._split(v)
        out = np.zeros((p.knots, JOINTS))
        out[1:] += down - up
        out[:-1] -= down - up
        out[p.fixed_knots :, p.bounded[0]] += below
        out[p.fixed_knots :, p.bounded[1]] -= above
        return out

    def pull(self, v: FloatArray) -> FloatArray:
        """Transposed Jacobian times ``v (m,)``."""
        p = self._problem
        up, down, _, _, rows = self._split(v)
        on_poses = np.einsum("kj,kjc->kc", self._on_joints(v), self._slopes)
        on_poses += p.slots.spread(rows[:, None] * self._rows).sum(axis=1)
        placed, at, size = p.numbering
        mine = placed >= 0
        out = np.bincount(placed[mine], on_poses[mine], minlength=size)
        out[at] += (up + down) @ p.rates
        return np.asarray(out)

    def push(self, dx: FloatArray) -> FloatArray:
        """Jacobian times ``dx (n,)``."""
        p = self._problem
        placed, at, _ = p.numbering
        moves = np.where(placed >= 0, dx[np.maximum(placed, 0)], 0.0)
        joints = np.einsum("kjc,kc->kj", self._slopes, moves)
        turn, room = np.diff(joints, axis=0), p.rates * dx[at][:, None]
        late = joints[p.fixed_knots :]
        return np.concatenate([
            (room - turn).ravel(), (room + turn).ravel(), late[:, p.bounded[0]].ravel(),
            -late[:, p.bounded[1]].ravel(), (self._rows * moves[p.row_knots]).sum(axis=1),
        ])  # fmt: skip

    def normal(self, scale: FloatArray, duals: FloatArray) -> FloatArray:
        """``J' diag(scale) J`` minus the curvature of ``duals * values``, in banded form."""
        p = self._problem
        c = len(p.columns)
        up, down, below, above, rows = self._split(scale)
        slopes = self._slopes
        sides = np.concatenate([-slopes[:-1], slopes[1:]], axis=2)
        pair = np.swapaxes(sides, 1, 2) @ ((up + down)[:, :, None] * sides)
        cross = np.einsum("kjc,kj->kc", sides, (down - up) * p.rates)
        blocks = np.empty((p.knots - 1, 2 * c + 1, 2 * c + 1))
        blocks[:, :c, :c], blocks[:, c + 1 :, c + 1 :] = pair[:, :c, :c], pair[:, c:, c:]
        blocks[:, :c, c + 1 :], blocks[:, c + 1 :, :c] = pair[:, :c, c:], pair[:, c:, :c]
        blocks[:, :c, c] = blocks[:, c, :c] = cross[:, :c]
        blocks[:, c + 1 :, c] = blocks[:, c, c + 1 :] = cross[:, c:]
        blocks[:, c, c] = (up + down) @ p.rates**2
        single = self._single(below, above, rows, duals)
        blocks[:, :c, :c] += single[:-1]
        blocks[-1, c + 1 :, c + 1 :] += single[-1]
        return p.band.matrix(blocks)

    def _single(
        self,
        below: FloatArray,
        above: FloatArray,
        rows: FloatArray,
        duals: FloatArray,
    ) -> FloatArray:
        """What single knots add to the matrix ``(K, c, c)``."""
        p = self._problem
        on_rows = self._split(duals)[4]
        bent = self._curvature(self._on_joints(duals).reshape(-1, 4, 3), on_rows)
        out = -bent[:, p.columns][:, :, p.columns]
        bow = on_rows[:, None] * p.squares
        bend = p.slots.spread(bow).sum(axis=1)
        out[:, range(len(p.columns)), range(len(p.columns))] -= bend
        stiff = np.zeros((p.knots, JOINTS))
        stiff[p.fixed_knots :, p.bounded[0]] += below
        stiff[p.fixed_knots :, p.bounded[1]] += above
        if p.bounded.any():
            out += np.swapaxes(self._slopes, 1, 2) @ (stiff[:, :, None] * self._slopes)
        spread = p.slots.spread(self._rows)
        out += np.swapaxes(spread, 1, 2) @ (p.slots.spread(rows)[:, :, None] * spread)
        return np.asarray(out)

    def _curvature(self, weights: FloatArray, on_rows: FloatArray) -> FloatArray:
        """Curvature of ``weights (K, 4, 3)`` on joints and of rows on the centre of mass."""
        p = self._problem
        if p.com is None:
            return p.legs.curvature(self._bent, weights)
        in_turn = np.empty_like(on_rows)
        in_turn[p.order] = on_rows
        pull = p.com.pull(in_turn[len(p.rows.knot) :], p.knots)
        masses = p.com.masses
        weights = weights + masses.on_joints(self._bent, self._com, pull)
        out = masses.curvature(self._bent, self._gradients, self._com, pull)
        return np.asarray(out + p.legs.curvature(self._bent, weights))
