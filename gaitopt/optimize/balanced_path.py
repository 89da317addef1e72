"""The path of a body whose conditions on the ground's reaction are linearised.

Its coordinates are x and y, or more. Each is a spline of degree five. Within a phase it has four
continuous derivatives, and two where feet land or lift off. Accelerations jump only where one asks
for it. A quadratic program keeps linear conditions on the coordinates, their velocities and
accelerations at given instants, equations among them, and stays near a route. So a planner can
solve equations that hold the whole robot's dynamics: it linearises them at a path, solves, and
linearises again at what it found.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from gaitopt.conventions import BoolArray, FloatArray
from gaitopt.motion.path import MotionPath
from gaitopt.optimize.sparse_quadratic import solve_sparse
from gaitopt.optimize.sway import SHORTFALL_WEIGHT, acceleration_weight, rest_rows

DEGREE = 5
"""Degree of the spline: its accelerations are cubic, as smooth as a swing needs them, and a path
stores it without loss."""
CONTINUOUS = 2
"""Order of the highest derivative that is continuous where feet land or lift off; one less where
accelerations jump."""
UNIT = 0.01
"""Unit of the program's unknowns [m]: of the size of the body's displacements."""
LEAST_ROW = 1e-9
"""Largest factor below which a condition does not depend on the path: what is left is rounding of
differences, and those that count have factors of 1e-4 and more."""
FAR = 1e4
"""Displacement that no path has, in units of :data:`UNIT`. Conditions that are kept up to there are
left out: their large numbers spoil the solver's."""
BESIDE = 1e-9
"""How long before the end of a phase its acceleration is taken [s]."""


@dataclass(frozen=True, eq=False)
class BodySpline:
    """A spline of one coordinate, of ``n`` control points.

    Attributes:
        knots: with their multiplicities ``(n + 6,)`` [s].
        breaks: ends of the pieces ``(P + 1,)`` [s].
        jumps: breaks at which the second derivative jumps ``(J,)`` [s].
    """

    knots: FloatArray
    breaks: FloatArray
    jumps: FloatArray

    @classmethod
    def over(cls, edges: FloatArray, jumping: BoolArray, longest: float) -> BodySpline:
        """A spline whose pieces within phases are at most as long as asked for.

        Args:
            edges: ends of the phases ``(E + 1,)``, increasing [s].
            jumping: at which of the inner ones accelerations may jump ``(E - 1,)``.
            longest: longest piece [s].
        """
        counts = np.maximum(np.ceil(np.diff(edges) / longest - 1e-9).astype(int), 1)
        parts = [np.linspace(a, b, k, endpoint=False)
                 for a, b, k in zip(edges[:-1], edges[1:], counts, strict=True)]  # fmt: skip
        breaks = np.append(np.concatenate(parts), edges[-1])
        often = np.ones(len(breaks), dtype=int)
        often[np.cumsum(counts)[:-1]] = DEGREE - CONTINUOUS + jumping
        often[[0, -1]] = DEGREE + 1
        return cls(np.repeat(breaks, often), breaks, edges[1:-1][jumping])

    def __len__(self) -> int:
        return len(self.knots) - DEGREE - 1

    @property
    def abscissae(self) -> FloatArray:
        """Those of Greville ``(n,)`` [s]: control points at a function's values are near it."""
        knots = self.knots
        ahead = [knots[k : k + len(self)] for k in range(1, DEGREE + 1)]
        return np.asarray(np.mean(ahead, axis=0))

    def matrix(self, times: FloatArray, order: int) -> Any:
        """Sparse matrix ``(N, n)`` from control points to a derivative at times ``(N,)``."""
        from scipy.interpolate import BSpline
        from scipy.sparse import csr_array, diags_array

        if not len(times):
            return csr_array((0, len(self)))
        found: Any = None
        knots = self.knots
        for degree in range(DEGREE, DEGREE - order, -1):
            spans = knots[degree + 1 : -1] - knots[1 : -degree - 1]
            factors = np.divide(degree, spans, out=np.zeros_like(spans), where=spans > 0.0)
            count = len(spans)
            step = diags_array(
                [-factors, factors], offsets=[0, 1], shape=(count, count + 1), format="csr"
            )
            found = step if found is None else step @ found
            knots = knots[1:-1]
        values = csr_array(BSpline.design_matrix(times, knots, DEGREE - order))
        return values if found is None else csr_array(values @ found)

    def jump_matrix(self) -> Any:
        """Sparse matrix ``(J, n)`` from control points to jumps of the second derivative."""
        return self.matrix(self.jumps, 2) - self.matrix(self.jumps - BESIDE, 2)

    def path(self, points: FloatArray) -> MotionPath:
        """The path of control points ``(n, d)``."""
        from scipy.interpolate import BSpline, PPoly

        axes = [PPoly.from_spline(BSpline(self.knots, axis, DEGREE)) for axis in points.T]
        lasting = np.flatnonzero(np.diff(self.knots) > 0.0)
        return MotionPath(self.breaks, np.stack([axis.c[:, lasting] for axis in axes], axis=2))


@dataclass(frozen=True, eq=False)
class Conditions:
    """Linear conditions ``low <= sum of factors * derivatives - margin <= high`` on a path.

    Attributes:
        samples: the instant of each condition, by its number ``(R,)``.
        factors: of the coordinates' values, velocities and accelerations ``(R, 3, d)``.
        low, high: ``(R,)``; infinite for none.
        wishes: which wished margin is to be left over as well ``(R,)``, -1 for none.
    """

    samples: np.ndarray
    factors: FloatArray
    low: FloatArray
    high: FloatArray
    wishes: np.ndarray


@dataclass(frozen=True, eq=False)
class BalancedPathProblem:
    """Where the body should go, and what it must keep.

    Attributes:
        spline: the spline of each coordinate.
        times: instants of the conditions ``(N,)`` [s].
        route: instants ``(G,)`` [s], their weights ``(G,)``, and the route's places and
            accelerations there ``(G, d)`` each.
        ends: where the path begins and ends at rest ``(2, d)``.
        period: of the gait, which weighs accelerations against displacements [s].
        largest_offset: how far from the route each coordinate may go ``(d,)``.
        sizes: lengths that count like a unit of each coordinate ``(d,)`` [m]: 1 for those that are
            lengths.
        jump_weight: weight of the mean squared jump of accelerations, against their mean square.
        target: margin above which a larger one is not wished for [m].
        wished: weight of each wished margin ``(W,)``; all margins together weigh as much as the
            displacements.
    """

    spline: BodySpline
    times: FloatArray
    route: tuple[FloatArray, FloatArray, FloatArray, FloatArray]
    ends: FloatArray
    period: float
    largest_offset: FloatArray
    sizes: FloatArray
    jump_weight: float
    target: float
    wished: FloatArray

    def derivatives(self, points: FloatArray) -> FloatArray:
        """Values and two derivatives at the instants of the conditions ``(N, 3, d)``."""
        return np.stack([self.spline.matrix(self.times, k) @ points for k in range(3)], axis=1)


def solve_balanced_path(
    problem: BalancedPathProblem, conditions: Conditions, start: FloatArray
) -> FloatArray:
    """Control points ``(n, d)`` of the path nearest to the route that keeps the conditions.

    The solver's answer is not judged here: the caller evaluates what the conditions stand for.

    Args:
        problem, conditions: what is asked.
        start: control points of a path near it ``(n, d)``; the answer depends on them by
            rounding alone.
    """
    from scipy.sparse import diags_array

    n, coordinates = len(problem.spline), len(problem.sizes)
    matrix, low, high = _rows(problem, conditions)
    hessian, gradient = _cost(problem)
    units = UNIT / np.concatenate([np.repeat(problem.sizes, n), np.ones(len(problem.wished))])
    scaled = diags_array(units)
    matrix, hessian, gradient = matrix @ scaled, scaled @ hessian @ scaled, units * gradient
    # Unknowns are displacements from the start in units of UNIT, and rows have one size, so that
    # the solver need not tell centimetres from rounding.
    begin = np.concatenate([start.T.ravel(), np.zeros(len(problem.wished))]) / units
    size = np.abs(matrix.tocsr()).max(axis=1).toarray().ravel()
    shift = matrix @ begin
    room = np.minimum(shift - low, high - shift)
    bind = (size > LEAST_ROW) & (room <= FAR * size)
    matrix, low, high, shift, size = (
        matrix.tocsr()[bind], low[bind], high[bind], shift[bind], size[bind]
    )  # fmt: skip
    scale = 1.0 / float(np.abs(hessian.diagonal()).max())
    found, _ = solve_sparse(
        scale * hessian, scale * (gradient + hessian @ begin),
        diags_array(1.0 / size) @ matrix, (low - shift) / size, (high - shift) / size,
        refinement=True,
    )  # fmt: skip
    points = (units * (begin + found))[: coordinates * n]
    return np.asarray(points.reshape(coordinates, n).T)


def _rows(
    problem: BalancedPathProblem, conditions: Conditions
) -> tuple[Any, FloatArray, FloatArray]:
    """Rows ``low <= J x <= high``: conditions, offset, ends, target.

    Unknowns are the control points, coordinate by coordinate, and the wished margins.
    """
    from scipy.sparse import block_diag, csr_array, diags_array, hstack, vstack

    n, wishes = len(problem.spline), len(problem.wished)
    at = [problem.spline.matrix(problem.times, k)[conditions.samples] for k in range(3)]
    coordinates = len(problem.sizes)
    each = [
        sum(diags_array(conditions.factors[:, k, axis]) @ at[k] for k in range(3))
        for axis in range(coordinates)
    ]
    count, kept = len(conditions.low), conditions.wishes >= 0
    own = csr_array((-np.ones(kept.sum()), (np.flatnonzero(kept), conditions.wishes[kept])),
                    shape=(count, wishes))  # fmt: skip
    times, _, places, _ = problem.route
    place, middle = problem.spline.matrix(times, 0), places.T.ravel()
    fixed, where = rest_rows(n, problem.ends)
    matrix = vstack([
        hstack([*each, own]),
        hstack([block_diag([place] * coordinates), csr_array((len(middle), wishes))]),
        hstack([fixed, csr_array((len(where), wishes))]),
        hstack([csr_array((wishes, coordinates * n)), diags_array(np.ones(wishes))]),
    ])  # fmt: skip
    reach = np.repeat(problem.largest_offset, len(times))
    target = np.full(wishes, problem.target)
    low = [conditions.low, middle - reach, where, np.full(wishes, -np.inf)]
    high = [conditions.high, middle + reach, where, target]
    return matrix, np.concatenate(low), np.concatenate(high)


def _cost(problem: BalancedPathProblem) -> tuple[Any, FloatArray]:
    """Hessian and gradient over control points and wished margins."""
    from scipy.sparse import block_diag, diags_array

    times, weights, places, accelerations = problem.route
    place, second = (problem.spline.matrix(times, k) for k in (0, 2))
    jump = problem.spline.jump_matrix()
    weight = acceleration_weight(problem.period)
    weighted = diags_array(weights / weights.sum())
    jumps = problem.jump_weight / max(jump.shape[0], 1) * (jump.T @ jump)
    single = place.T @ weighted @ place + weight * (second.T @ weighted @ second + jumps)
    wish = SHORTFALL_WEIGHT * problem.wished / max(float(problem.wished.sum()), 1e-300)
    pulls = [
        -(size**2)
        * (place.T @ (weighted @ place_) + weight * (second.T @ (weighted @ acceleration)))
        for size, place_, acceleration in zip(problem.sizes, places.T, accelerations.T, strict=True)
    ]
    hessian = block_diag([*(size**2 * single for size in problem.sizes), diags_array(wish)])
    return hessian, np.concatenate([*pulls, -problem.target * wish])
