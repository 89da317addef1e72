"""Where a body goes and how fast, as one problem: the least time within rows of contact forces.

A motion is given: spans of its parameter ``s``, and on each of them what it asks of the ground. The
body's path is a quadratic B-spline in the horizontal plane. Unknown are how far each control point
but the first is moved from the given one; the squared speed ``x = (ds/dt)^2`` at every border of
spans; and the time of each span. On a span the acceleration ``u = d2s/dt2`` is constant, as in the
timing of [Pham2018]:

    minimise  sum_k t(k),    t(k) >= 2 h(k) / (sqrt(x(k)) + sqrt(x(k + 1)))

The body's acceleration is ``p''(s) x + p'(s) u``. So rows of forces at both ends of a span are
linear in the control points, and linear in ``(u, x)``: the problem is not convex, and its minimum
is a local one. It is a :class:`gaitopt.interior_point.problem.Problem`.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.interior_point.band import BlockBand, RowGroups
from gaitopt.optimize.body_path import DiscRows

SMOOTHING = 1e-4
"""Weight of the differences of neighbouring shifts, in units of length: where nothing holds a
control point it stays near the given path."""
LEAST_SQUARE = 0.01
"""Least squared speed along the given motion: at a tenth of its speed."""
LONGER = 1.1
"""Factor of the times of a first guess: the method begins inside."""
PER_SPAN = 4
"""Unknowns of a span: the shift of its control point, the squared speed where it begins, its time.
"""
SHIFTS, SQUARES, TIME = slice(0, 6), slice(6, 8), 8
"""Unknowns that a span's rows look at: the shifts of three control points, the squared speeds at
both of its ends, its time."""


class PacedRows(NamedTuple):
    """Inequalities ``by_u u + by_x x + rest + (by_place + by_first u + by_second x) . d >= 0``.

    The control points before, of and after a span are shifted by ``d``: x and y of one after the
    other.

    Attributes:
        span: each row's span ``(M,)``, ascending.
        end: at which end of it: 0 at its begin, 1 at its end ``(M,)``.
        by_u, by_x, rest: ``(M,)`` [m s^2, m s^2, m], as lengths.
        by_place, by_first, by_second: of the shifts ``(M, 6)``.
    """

    span: np.ndarray
    end: np.ndarray
    by_u: FloatArray
    by_x: FloatArray
    rest: FloatArray
    by_place: FloatArray
    by_first: FloatArray
    by_second: FloatArray

    @classmethod
    def joined(cls, parts: list[PacedRows]) -> PacedRows:
        """All rows, in the order of their spans."""
        columns = [np.concatenate(column) for column in zip(*parts, strict=True)]
        order = np.argsort(columns[0], kind="stable")
        return cls(*(column[order] for column in columns))

    def values(self, u: FloatArray, x: FloatArray) -> FloatArray:
        """Values ``(M,)`` where nothing is shifted.

        Args:
            u: accelerations of the spans ``(K,)``.
            x: squared speeds at both of their ends ``(K, 2)``.
        """
        return np.asarray(self.by_u * u[self.span] + self.by_x * x[self.span, self.end] + self.rest)


@dataclass(frozen=True, eq=False)
class PacedPathProblem:
    """The problem. Inside, shifts are counted in :attr:`unit`, and times in the mean span.

    Attributes:
        points: control points of the given path ``(K, 2)`` [m].
        spans: length of each span ``(K,)``, in the motion's parameter [s].
        rows: of forces and margins.
        discs: in which control points stay.
        tops: largest squared speeds where spans begin ``(K,)``.
        unit: of lengths [m].
    """

    points: FloatArray
    spans: FloatArray
    rows: PacedRows
    discs: DiscRows
    tops: FloatArray
    unit: float

    @property
    def knots(self) -> int:
        """Number of spans ``K``."""
        return len(self.spans)

    @property
    def restorable(self) -> int:
        """None of the inequalities can be met by a formula."""
        return 0

    def start(self, squares: FloatArray) -> FloatArray:
        """Unknowns ``(n,)`` of the given path with squared speeds where spans begin ``(K,)``."""
        x = np.zeros(self._size)
        x[self._places[1:, 2]] = squares[1:]
        roots = np.sqrt(self._of_spans(x)[:, SQUARES]).sum(axis=1)
        x[self._places[:, 3]] = LONGER * self._scale * 2.0 / roots
        return x

    def moved(self, x: FloatArray) -> FloatArray:
        """Control points ``(K, 2)`` [m] of unknowns ``(n,)``."""
        out = np.array(self.points)
        out[1:] += self.unit * x[self._places[1:, :2]]
        return out

    def duration(self, x: FloatArray) -> float:
        """Time of the walk [s] of unknowns ``(n,)``."""
        roots = np.sqrt(self._of_spans(x)[:, SQUARES]).sum(axis=1)
        return float((2.0 * self.spans / roots).sum())

    @cached_property
    def linear_cost(self) -> FloatArray:
        """The time ``(n,)``."""
        out = np.zeros(self._size)
        out[self._places[:, 3]] = 1.0
        return out

    @cached_property
    def quadratic_cost(self) -> FloatArray:
        """Lower band of the smoothing ``(5, n)``."""
        out = np.zeros((PER_SPAN + 1, self._size))
        for axis in range(2):
            at = self._places[1:, axis]
            out[0, at] += 2.0 * SMOOTHING
            out[0, at[:-1]] += 2.0 * SMOOTHING
            out[PER_SPAN, at[:-1]] = -2.0 * SMOOTHING
        return out

    @cached_property
    def _size(self) -> int:
        return PER_SPAN * self.knots - 3

    @cached_property
    def _scale(self) -> FloatArray:
        """Each span over the mean one ``(K,)``."""
        return np.asarray(self.spans / self.spans.mean())

    @cached_property
    def _places(self) -> np.ndarray:
        """Numbers of a span's unknowns ``(K, 4)``; -1 for the first control point.

        The motion begins and ends at constant speed, so the first span has the squared speed of the
        second, and it needs no number of its own.
        """
        at = np.arange(PER_SPAN * self.knots).reshape(-1, PER_SPAN) - 3
        at[0] = -1, -1, at[1, 2], 0
        return at

    @cached_property
    def _blocks(self) -> np.ndarray:
        """Numbers of the unknowns that a span's rows look at ``(K, 9)``; -1 for none."""
        at = np.pad(self._places[:, :2], ((1, 1), (0, 0)), constant_values=-1)
        squares = self._places[:, 2]
        ends = np.stack([squares, np.append(squares[1:], squares[-1])], axis=1)
        return np.concatenate([at[:-2], at[1:-1], at[2:], ends, self._places[:, 3:]], axis=1)

    @cached_property
    def _steep(self) -> FloatArray:
        """By how much ``u`` grows with the difference of both squared speeds ``(K,)``."""
        return 0.5 / self.spans

    @cached_property
    def _groups(self) -> RowGroups:
        return RowGroups.of(self.rows.span, self.knots)

    @cached_property
    def _band(self) -> BlockBand:
        return BlockBand.of(self._blocks, self._size)

    @cached_property
    def _plain(self) -> FloatArray:
        """``by_u``, ``by_x`` and ``rest`` of each span's rows ``(3, K, r)``, in units of length."""
        rows = self.rows
        return np.stack([
            self._groups.padded(part / self.unit) for part in (rows.by_u, rows.by_x, rows.rest)
        ])  # fmt: skip

    @cached_property
    def _by_shifts(self) -> FloatArray:
        """``by_first``, ``by_second`` and ``by_place`` of each span's rows ``(3, K, r, 6)``."""
        rows = self.rows
        return np.stack([
            self._groups.padded(part) for part in (rows.by_first, rows.by_second, rows.by_place)
        ])  # fmt: skip

    @cached_property
    def _at_end(self) -> np.ndarray:
        """Whether a span's rows look at its end ``(K, r)``."""
        return self._groups.padded(self.rows.end) > 0

    def _of_spans(self, x: FloatArray) -> FloatArray:
        """What each span's rows look at ``(K, 9)``; zero where nothing is unknown."""
        return np.asarray(np.where(self._blocks >= 0, x[self._blocks], 0.0))

    def _motion(self, blocks: FloatArray) -> tuple[FloatArray, FloatArray]:
        """``u`` of each span ``(K, 1)``, and ``x`` of each of its rows ``(K, r)``."""
        begin, end = blocks[:, 6:7], blocks[:, 7:8]
        return self._steep[:, None] * (end - begin), np.where(self._at_end, end, begin)

    def _slopes(self, blocks: FloatArray) -> FloatArray:
        """Derivatives of rows by ``u`` and ``x``, and what is left of them ``(3, K, r)``."""
        return np.asarray(self._plain + (self._by_shifts @ blocks[:, SHIFTS, None])[..., 0])

    def _from_discs(self, x: FloatArray) -> FloatArray:
        """Control points from the centres of their discs ``(D, 2)``, in units."""
        places = self._places[self.discs.span, :2]
        shifts = np.where(places >= 0, x[places], 0.0)
        return np.asarray(shifts + (self.points[self.discs.span] - self.discs.centre) / self.unit)

    def values(self, x: FloatArray) -> FloatArray:
        """All inequalities ``(m,)``: rows, discs, times, and bounds of squared speeds."""
        blocks = self._of_spans(x)
        u, square = self._motion(blocks)
        by_u, by_x, rest = self._slopes(blocks)
        radius, away = self.discs.radius / self.unit, self._from_discs(x)
        squares = x[self._places[1:, 2]]
        with np.errstate(invalid="ignore", divide="ignore"):
            pace = 2.0 / np.sqrt(blocks[:, SQUARES]).sum(axis=1)
        return np.concatenate([
            (by_u * u + by_x * square + rest)[self._groups.group, self._groups.place],
            # Near the edge this is the distance from it.
            (radius - (away**2).sum(axis=1) / radius) / 2.0,
            blocks[:, TIME] / self._scale - pace,
            self.tops[1:] - squares,
            squares - LEAST_SQUARE,
        ])  # fmt: skip

    def restore(
        self, x: FloatArray, values: FloatArray, slack: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Nothing can be restored."""
        return x, values

    def linearise(self, x: FloatArray) -> PacedPathLinearisation:
        """Values and derivatives at ``x (n,)``."""
        blocks = self._of_spans(x)
        u, square = self._motion(blocks)
        by_u, by_x, _ = self._slopes(blocks)
        by_first, by_second, by_place = self._by_shifts
        jacobian = np.empty((*by_u.shape, 8))
        jacobian[..., SHIFTS] = by_place + by_first * u[..., None] + by_second * square[..., None]
        steep = self._steep[:, None] * by_u
        jacobian[..., 6] = np.where(self._at_end, 0.0, by_x) - steep
        jacobian[..., 7] = np.where(self._at_end, by_x, 0.0) + steep
        by_discs = -self._from_discs(x) * (self.unit / self.discs.radius)[:, None]
        return PacedPathLinearisation(
            self, self.values(x), jacobian, by_discs, np.sqrt(blocks[:, SQUARES].T)
        )


@dataclass(frozen=True, eq=False)
class PacedPathLinearisation:
    """Values and derivatives of all inequalities at a point.

    Attributes:
        problem: whose.
        values: ``(m,)``.
        jacobian: derivatives of each span's rows by its shifts and squared speeds ``(K, r, 8)``.
        by_discs: derivatives of the discs' rows by their control points ``(D, 2)``.
        roots: roots of the squared speeds at both ends of spans ``(2, K)``.
    """

    problem: PacedPathProblem
    values: FloatArray
    jacobian: FloatArray
    by_discs: FloatArray
    roots: FloatArray

    @cached_property
    def _pace(self) -> FloatArray:
        """Time of each span over its length ``(K,)``."""
        return np.asarray(2.0 / self.roots.sum(axis=0))

    @cached_property
    def _by_squares(self) -> FloatArray:
        """Derivatives of the times' rows by the squared speeds at both ends ``(2, K)``."""
        return np.asarray(self._pace**2 / (4.0 * self.roots))

    def _parts(self, v: FloatArray) -> list[FloatArray]:
        """``v (m,)`` of rows, discs, times, largest and least squared speeds."""
        rows, discs = len(self.problem.rows.span), len(self.problem.discs.span)
        knots = self.problem.knots
        return np.split(v, np.cumsum([rows, discs, knots, knots - 1]))

    def jacobian_times(self, dx: FloatArray) -> FloatArray:
        """``J dx (m,)``."""
        problem = self.problem
        blocks = problem._of_spans(dx)
        places = problem._places[problem.discs.span, :2]
        moved = np.where(places >= 0, dx[places], 0.0)
        squares, groups = dx[problem._places[1:, 2]], problem._groups
        faster = (self._by_squares * blocks[:, SQUARES].T).sum(axis=0)
        return np.concatenate([
            (self.jacobian @ blocks[:, :TIME, None])[groups.group, groups.place, 0],
            (self.by_discs * moved).sum(axis=1),
            blocks[:, TIME] / problem._scale + faster,
            -squares,
            squares,
        ])  # fmt: skip

    def jacobian_transpose_times(self, v: FloatArray) -> FloatArray:
        """``J' v (n,)``."""
        problem = self.problem
        rows, discs, times, most, least = self._parts(v)
        parts = np.empty((problem.knots, 9))
        parts[:, :TIME] = (problem._groups.padded(rows)[:, None] @ self.jacobian)[:, 0]
        parts[:, SQUARES] += (self._by_squares * times).T
        parts[:, TIME] = times / problem._scale
        used = problem._blocks >= 0
        out = np.bincount(problem._blocks[used], parts[used], minlength=problem._size)
        at = problem._places[problem.discs.span, :2]
        weighted = self.by_discs * discs[:, None]
        out += np.bincount(at[at >= 0], weighted[at >= 0], minlength=problem._size)
        out[problem._places[1:, 2]] += least - most
        return np.asarray(out)

    def newton_matrix(self, scale: FloatArray, multipliers: FloatArray) -> FloatArray:
        """``J' diag(scale) J`` minus the Hessian of ``multipliers . values``, as a lower band."""
        problem = self.problem
        of_rows, of_discs, of_times, of_most, of_least = self._parts(scale)
        by_rows, by_discs, by_times, _, _ = self._parts(multipliers)
        blocks = np.zeros((problem.knots, 9, 9))
        weighted = self.jacobian * problem._groups.padded(of_rows)[..., None]
        blocks[:, :TIME, :TIME] = np.swapaxes(weighted, 1, 2) @ self.jacobian
        cross = self._bilinear(problem._groups.padded(by_rows))
        blocks[:, SHIFTS, SQUARES] -= cross
        blocks[:, SQUARES, SHIFTS] -= np.swapaxes(cross, 1, 2)
        slope = np.concatenate([self._by_squares, 1.0 / problem._scale[None]])
        blocks[:, 6:, 6:] += np.moveaxis(of_times * slope[:, None] * slope[None], 2, 0)
        bend = self._pace**3 / 8.0 / (self.roots[:, None] * self.roots[None])
        bend[[0, 1], [0, 1]] += self._pace**2 / 8.0 / self.roots**3
        blocks[:, SQUARES, SQUARES] += np.moveaxis(by_times * bend, 2, 0)
        at, radius = problem.discs.span, problem.discs.radius / problem.unit
        squares = of_discs[:, None, None] * self.by_discs[:, :, None] * self.by_discs[:, None]
        squares += (by_discs / radius)[:, None, None] * np.eye(2)
        own = np.array([2, 3])
        np.add.at(blocks, (at[:, None, None], own[:, None], own), squares)
        band = problem._band.matrix(blocks)
        band[0, problem._places[1:, 2]] += of_most + of_least
        return band

    def _bilinear(self, multipliers: FloatArray) -> FloatArray:
        """Second derivatives of ``multipliers . rows`` by shifts and squared speeds ``(K, 6, 2)``.

        Args:
            multipliers: of each span's rows ``(K, r)``.
        """
        problem = self.problem
        by_first, by_second, _ = problem._by_shifts
        weights = np.stack([multipliers, np.where(problem._at_end, 0.0, multipliers),
                            np.where(problem._at_end, multipliers, 0.0)], axis=1)  # fmt: skip
        by_u = (weights[:, :1] @ by_first)[:, 0] * problem._steep[:, None]
        begin, end = np.moveaxis(weights[:, 1:] @ by_second, 1, 0)
        return np.stack([begin - by_u, end + by_u], axis=2)
