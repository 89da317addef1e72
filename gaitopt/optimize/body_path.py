"""The smoothest path of a body that keeps its balance, at given times, as one convex problem.

The path is a quadratic B-spline in the horizontal plane. Every knot has a span of time, on which
the path is a parabola of three control points, with one acceleration. Unknown are all control
points but the first, and for every span a length by which its soft rows may be missed. Wanted are
small accelerations, with small jumps from span to span:

    minimise  sum_k |r(k+1) - r(k)|^2 + w sum_k |r(k)|^2 + c sum_k missed(k),    r = (h / g) p''

``r`` is how far the zero moment point of a point mass is from the mass. Rows are linear in the
three control points of a span (the zero moment point, or the path itself, beyond a line), discs
bound the distance of a control point from a place. So the problem is convex, and its minimum is
global. It is a :class:`gaitopt.interior_point.problem.Problem`.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.interior_point.band import BlockBand, RowGroups
from gaitopt.motion.quadratic_spline import parabola_weights

ACCELERATION_WEIGHT = 1.0
"""Weight ``w`` of the accelerations themselves, against that of their jumps."""
MISSED_COST = 30.0
"""Cost ``c`` of missing a soft row, in the unit of the other terms per unit of length."""
FIRST_BARRIER = 1.0
"""Barrier parameter to begin with: accelerations are of the size of the unit of length."""
LEAST_BARRIER = 1e-5
"""Barrier parameter to end with. The objective is then exact to about 1e-5 for each row, and it is
about 1 for each step."""
LEAST_MISSED = 0.1
"""By how much more than needed rows are missed at first, in units: the method begins inside."""
PER_SPAN = 3
"""Unknowns of a span: its control point, and by how much soft rows are missed."""


class LineRows(NamedTuple):
    """Inequalities ``normal . (weights @ points) >= offset``, softened where ``soft``.

    Attributes:
        span: each row's span ``(M,)``.
        weights: of the control points before, of and after this span ``(M, 3)``.
        normal: ``(M, 2)``.
        offset: ``(M,)`` [m].
        soft: which rows may be missed ``(M,)``.
    """

    span: np.ndarray
    weights: FloatArray
    normal: FloatArray
    offset: FloatArray
    soft: np.ndarray


class DiscRows(NamedTuple):
    """Control points stay within discs.

    Attributes:
        span: the control point's number ``(D,)``.
        centre: ``(D, 2)`` [m].
        radius: ``(D,)`` [m].
    """

    span: np.ndarray
    centre: FloatArray
    radius: FloatArray


@dataclass(frozen=True, eq=False)
class BodyPathProblem:
    """The problem. Inside, lengths are counted in :attr:`unit`, from the first control point.

    Attributes:
        start: the first control point ``(2,)`` [m].
        spans: length of each span ``(K,)`` [s].
        pendulum: ``h / g`` on each span ``(K,)`` [s^2].
        lines, discs: the inequalities.
        unit: about how far the ZMP is from the centre of mass [m].
    """

    start: FloatArray
    spans: FloatArray
    pendulum: FloatArray
    lines: LineRows
    discs: DiscRows
    unit: float

    @property
    def knots(self) -> int:
        """Number of knots ``K``."""
        return len(self.spans)

    @property
    def restorable(self) -> int:
        """None of the inequalities can be met by a formula."""
        return 0

    def pack(self, points: FloatArray) -> FloatArray:
        """Unknowns ``(n,)`` of control points ``(K, 2)`` [m]; soft rows are missed as they must."""
        x = np.zeros(PER_SPAN * self.knots - 2)
        x[self._places[1:, :2]] = ((points - self.start) / self.unit)[1:]
        lines, span = self.lines, self.lines.span
        lacking = self._least - self.line_values(self._of_spans(x))
        missed = np.full(self.knots, LEAST_MISSED)
        np.maximum.at(missed, span[lines.soft], lacking[lines.soft] + LEAST_MISSED)
        x[self._places[:, 2]] = missed
        return x

    def points(self, x: FloatArray) -> FloatArray:
        """Control points ``(K, 2)`` [m] of unknowns ``(n,)``."""
        out = np.zeros((self.knots, 2))
        out[1:] = x[self._places[1:, :2]]
        return np.asarray(self.start + self.unit * out)

    def missed(self, x: FloatArray) -> FloatArray:
        """By how much soft rows of each span are missed ``(K,)`` [m]."""
        return np.asarray(self.unit * np.maximum(x[self._places[:, 2]], 0.0))

    @cached_property
    def _places(self) -> np.ndarray:
        """Numbers of a span's unknowns ``(K, 3)``: the point's two, and what is missed."""
        at = np.arange(PER_SPAN * self.knots).reshape(-1, PER_SPAN) - 2
        at[0] = -1, -1, 0
        return at

    @cached_property
    def _blocks(self) -> np.ndarray:
        """Numbers of the unknowns that a span's rows look at ``(K, 7)``; -1 for none."""
        at = np.pad(self._places[:, :2], ((1, 1), (0, 0)), constant_values=-1)
        return np.concatenate([at[:-2], at[1:-1], at[2:], self._places[:, 2:]], axis=1)

    @cached_property
    def linear_cost(self) -> FloatArray:
        """Cost of what is missed ``(n,)``."""
        out = np.zeros(PER_SPAN * self.knots - 2)
        out[self._places[:, 2]] = MISSED_COST
        return out

    @cached_property
    def quadratic_cost(self) -> FloatArray:
        """Lower band of the quadratic cost ``(10, n)``."""
        from scipy import sparse

        # Accelerations are twice the first coefficients of the parabolas.
        before, own, after = 2.0 * self.pendulum * parabola_weights(self.spans)[0].T
        reach = sparse.diags([before[1:], own, after[:-1]], [-1, 0, 1]).tocsr()
        jumps = sparse.diags([-1.0, 1.0], [0, 1], shape=(self.knots - 1, self.knots)) @ reach
        share = self.spans / self.spans.mean()
        form = jumps.T @ jumps + ACCELERATION_WEIGHT * (reach.T @ sparse.diags(share) @ reach)
        form = 2.0 * sparse.tril(form[1:, 1:]).tocoo()
        out = np.zeros((PER_SPAN * 3 + 1, PER_SPAN * self.knots - 2))
        for axis in range(2):
            out[PER_SPAN * (form.row - form.col), self._places[1 + form.col, axis]] = form.data
        return out

    @cached_property
    def _jacobian(self) -> FloatArray:
        """Derivatives of the lines' rows by their span's unknowns ``(M, 7)``."""
        lines = self.lines
        by_points = (lines.weights[:, :, None] * lines.normal[:, None]).reshape(-1, 6)
        return np.concatenate([by_points, lines.soft[:, None].astype(np.float64)], axis=1)

    @cached_property
    def _least(self) -> FloatArray:
        """Least values of the lines' rows, from the first control point, in units ``(M,)``."""
        lines = self.lines
        # The control points' weights add up to one.
        return np.asarray((lines.offset - lines.normal @ self.start) / self.unit)

    @cached_property
    def _groups(self) -> RowGroups:
        return RowGroups.of(self.lines.span, self.knots)

    @cached_property
    def _padded_jacobian(self) -> FloatArray:
        return self._groups.padded(self._jacobian)

    @cached_property
    def _band(self) -> BlockBand:
        return BlockBand.of(self._blocks, PER_SPAN * self.knots - 2)

    def _of_spans(self, x: FloatArray) -> FloatArray:
        """What each span's rows look at ``(K, 7)``; zero where nothing is unknown."""
        return np.asarray(np.where(self._blocks >= 0, x[self._blocks], 0.0))

    def _from_discs(self, x: FloatArray) -> FloatArray:
        """Control points from the centres of their discs ``(D, 2)``, in units."""
        places = self._places[self.discs.span, :2]
        points = np.where(places >= 0, x[places], 0.0)
        return np.asarray(points - (self.discs.centre - self.start) / self.unit)

    def line_values(self, blocks: FloatArray) -> FloatArray:
        """``J y`` of the lines' rows ``(M,)``, of spans' unknowns ``(K, 7)``."""
        return np.asarray((self._jacobian * blocks[self.lines.span]).sum(axis=1))

    def values(self, x: FloatArray) -> FloatArray:
        """All inequalities ``(m,)``: lines, discs, and that nothing is missed by less than 0."""
        radius = self.discs.radius / self.unit
        away = self._from_discs(x)
        return np.concatenate([
            self.line_values(self._of_spans(x)) - self._least,
            # Near the edge this is the distance from it.
            (radius - (away**2).sum(axis=1) / radius) / 2.0,
            x[self._places[:, 2]],
        ])  # fmt: skip

    def restore(
        self, x: FloatArray, values: FloatArray, slack: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Nothing can be restored."""
        return x, values

    def linearise(self, x: FloatArray) -> BodyPathLinearisation:
        """Values and derivatives at ``x (n,)``."""
        radius = self.discs.radius / self.unit
        return BodyPathLinearisation(self, self.values(x), -self._from_discs(x) / radius[:, None])


@dataclass(frozen=True, eq=False)
class BodyPathLinearisation:
    """Values and derivatives of all inequalities at a point.

    Attributes:
        problem: whose.
        values: ``(m,)``.
        by_discs: derivatives of the discs' rows by their control points ``(D, 2)``.
    """

    problem: BodyPathProblem
    values: FloatArray
    by_discs: FloatArray

    def jacobian_times(self, dx: FloatArray) -> FloatArray:
        """``J dx (m,)``."""
        problem = self.problem
        places = problem._places[problem.discs.span, :2]
        moved = np.where(places >= 0, dx[places], 0.0)
        return np.concatenate([
            problem.line_values(problem._of_spans(dx)),
            (self.by_discs * moved).sum(axis=1),
            dx[problem._places[:, 2]],
        ])  # fmt: skip

    def jacobian_transpose_times(self, v: FloatArray) -> FloatArray:
        """``J' v (n,)``."""
        problem = self.problem
        lines, discs = len(problem.lines.span), len(problem.discs.span)
        size = len(problem.linear_cost)
        weights = problem._groups.padded(v[:lines])[:, None]
        parts = (weights @ problem._padded_jacobian)[:, 0]
        used = problem._blocks >= 0
        out = np.bincount(problem._blocks[used], parts[used], minlength=size)
        at = problem._places[problem.discs.span, :2]
        weighted = self.by_discs * v[lines : lines + discs, None]
        out += np.bincount(at[at >= 0], weighted[at >= 0], minlength=size)
        out[problem._places[:, 2]] += v[lines + discs :]
        return np.asarray(out)

    def newton_matrix(self, scale: FloatArray, multipliers: FloatArray) -> FloatArray:
        """``J' diag(scale) J`` minus the Hessian of ``multipliers . values``, as a lower band."""
        problem = self.problem
        lines, discs = len(problem.lines.span), len(problem.discs.span)
        weighted = problem._padded_jacobian * problem._groups.padded(scale[:lines])[..., None]
        blocks = np.swapaxes(weighted, 1, 2) @ problem._padded_jacobian
        at, on_discs = problem.discs.span, slice(lines, lines + discs)
        radius = problem.discs.radius / problem.unit
        squares = scale[on_discs, None, None] * self.by_discs[:, :, None] * self.by_discs[:, None]
        squares += (multipliers[on_discs] / radius)[:, None, None] * np.eye(2)
        own = np.array([2, 3])
        np.add.at(blocks, (at[:, None, None], own[:, None], own), squares)
        blocks[:, 6, 6] += scale[lines + discs :]
        band = problem._band.matrix(blocks)
        wide = len(problem.quadratic_cost)
        return np.pad(band, ((0, max(wide - len(band), 0)), (0, 0)))
