"""The sway of a body: its horizontal path that keeps the ZMP inside the support polygons.

The body's centre is taken as a point mass at constant height ``h``, so its ZMP is
``c - (h / g) c''`` ([XiLing], Module D; [Kajita2003]). The path is a cubic spline, so its ZMP is a
cubic on every piece. A cubic lies within the convex hull of its Bernstein coefficients
[Farouki2012]: a margin that these keep holds at every instant.

Two problems are solved. A linear program finds the largest margin that the ZMP can keep at every
instant. A quadratic program then keeps nearly all of that margin, increases the margin on every
piece up to a target, and moves the body as little as possible. (Where one foot lands at the instant
at which another lifts off, the ZMP crosses a common side of two triangles, and no path has a margin
above zero.)
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from gaitopt.conventions import GRAVITY, FloatArray, frozen
from gaitopt.errors import InputError, SolverError
from gaitopt.optimize.sparse_quadratic import solve_sparse

KEPT_SHARE = 0.95
"""Share of the largest margin that the path keeps; chosen here, so that it need not move far."""
MARGIN_SLACK = 1e-5
"""By how much less margin is asked for on top [m]: both solvers leave errors of this order."""
SHORTFALL_WEIGHT = 100.0
"""Weight of the squared shortfall of margins from the target, against squared displacements.

Chosen here: 1 mm of margin counts like 10 mm of the body's displacement.
"""
TOLERANCE = 1e-4
"""Largest violation of a constraint in an accepted solution [m]."""

_SHARES = np.array([0.0, 1.0, 2.0, 3.0]) / 3.0
"""Shares of a piece at which a cubic is taken; its four values there determine it."""
_BERNSTEIN = np.stack(
    [(1 - _SHARES) ** 3, 3 * _SHARES * (1 - _SHARES) ** 2, 3 * _SHARES**2 * (1 - _SHARES),
     _SHARES**3], axis=1,
)  # fmt: skip
"""Cubic Bernstein polynomials at these shares ``(4, 4)``; the inverse leads from values to
coefficients. (``BPoly.from_power_basis`` differs by rounding, and the quadratic program's solution
is so sensitive that it moved by 2e-8 m.)
"""


@dataclass(frozen=True, eq=False)
class SwayProblem:
    """Where the ZMP must be, and where the body should.

    Attributes:
        times: ends of the spline's pieces ``(K + 1,)`` [s].
        sides: for each piece the sides of its support polygon ``(m, 3)``: unit inward normal and
            offset, ``n p >= o`` inside; ``(0, 3)`` in flight.
        route: the nominal path at ``times`` ``(K + 1, 2)`` [m]; the body begins and ends on it at
            rest.
        height: of the body's centre above the ground [m].
        period: of the gait, which weighs accelerations against displacements [s].
        largest_offset: how far from the route the body may go along x and y [m].
        target: margin above which a larger one has no value [m].
        zmp: sparse matrix ``(4 K, n)`` from the spline's ``n`` coefficients, the control points,
            to the ZMP's Bernstein coefficients.
        place, second: matrices ``(K + 1, n)`` from these to the path at ``times``, and to its
            second derivative.
        power: the same to the path's coefficients on each piece, highest power first
            ``(4, K, n)``.
    """

    times: FloatArray
    sides: tuple[FloatArray, ...]
    route: FloatArray
    height: float
    period: float
    largest_offset: float
    target: float
    zmp: Any
    place: Any
    second: Any
    power: FloatArray


@dataclass(frozen=True, eq=False)
class SwaySolution:
    """A path of the body's centre, with its margin and residual.

    Attributes:
        times: ends of the pieces ``(K + 1,)`` [s].
        coefficients: ``(4, K, 2)`` [m], highest power first, in the time since the piece's start.
        margin: lower bound of the ZMP's margin over all instants, by its Bernstein coefficients
            [m]; infinite where there are no polygons.
        largest_margin: the linear program's optimum [m].
        residual: largest violation of any constraint at the solution [m].
    """

    times: FloatArray
    coefficients: FloatArray
    margin: float
    largest_margin: float
    residual: float


def build_sway_problem(
    times: FloatArray,
    sides: Sequence[FloatArray],
    route: FloatArray,
    height: float,
    period: float,
    largest_offset: float,
    target: float,
) -> SwayProblem:
    """Build the problem; the arguments are the attributes of :class:`SwayProblem`.

    Raises:
        InputError: shapes do not fit, or times do not increase.
    """
    from scipy.interpolate import BSpline
    from scipy.sparse import block_diag, csr_array

    t, way = np.asarray(times, dtype=np.float64), np.asarray(route, dtype=np.float64)
    pieces = len(t) - 1
    if pieces < 1 or len(sides) != pieces or way.shape != (pieces + 1, 2):
        raise InputError(
            f"a sway needs K + 1 times, K polygons and a route (K + 1, 2); got {len(t)}, "
            f"{len(sides)} and {way.shape}"
        )
    if not (np.diff(t) > 0).all() or not (height > 0 and period > 0 and largest_offset >= 0):
        raise InputError("times must increase, height and period be positive")
    knots = np.concatenate([[t[0]] * 3, t, [t[-1]] * 3])
    n = pieces + 3
    inside = t[:-1, None] + np.diff(t)[:, None] * _SHARES
    value = BSpline.design_matrix(inside.ravel(), knots, 3)
    spline = BSpline(knots, np.eye(n), 3)
    second = spline(t, 2)
    to_bernstein = block_diag([np.linalg.inv(_BERNSTEIN)] * pieces)
    second_inside = second[:-1, None, :] + (second[1:] - second[:-1])[:, None, :] * _SHARES[:, None]
    zmp = to_bernstein @ (value - (height / GRAVITY) * csr_array(second_inside.reshape(-1, n)))
    power = np.stack([
        (second[1:] - second[:-1]) / (6.0 * np.diff(t)[:, None]), second[:-1] / 2.0,
        spline(t[:-1], 1), spline(t[:-1]),
    ])  # fmt: skip
    return SwayProblem(
        frozen(t), tuple(frozen(s) for s in sides), frozen(way), float(height), float(period),
        float(largest_offset), float(target), csr_array(zmp), csr_array(spline(t)),
        csr_array(second), power,
    )  # fmt: skip


def solve_sway(problem: SwayProblem) -> SwaySolution:
    """The path of least displacement whose ZMP keeps nearly the largest margin at every instant.

    Raises:
        SolverError: the body cannot stay near enough to its route, or the solution failed the check
            of its constraints.
    """
    rows, low = _margin_rows(problem)
    bounds, floor = _offset_rows(problem)
    fixed, at = rest_rows(problem.place.shape[1], problem.route[[0, -1]])
    largest = _largest_margin(rows, low, bounds, floor, fixed, at)
    kept = problem.target
    if np.isfinite(largest):
        kept = min(largest - (1.0 - KEPT_SHARE) * abs(largest) - MARGIN_SLACK, kept)
    x = _least_displacement(problem, rows, low, kept, bounds, floor, fixed, at)
    margin = float((rows @ x - low).min(initial=np.inf))
    residual = max(
        kept - margin, float((floor - bounds @ x).max()), float(np.abs(fixed @ x - at).max())
    )
    if not residual <= TOLERANCE:
        raise SolverError(
            f"the body's sway was not solved: a constraint is violated by {residual:.2g} m; take a "
            "longer cycle or a smaller speed"
        )
    coefficients = problem.power @ x.reshape(2, -1).T
    return SwaySolution(problem.times, frozen(coefficients), margin, largest, residual)


def _margin_rows(problem: SwayProblem) -> tuple[Any, FloatArray]:
    """Rows ``J x - m >= o`` that keep the ZMP's Bernstein coefficients inside the sides."""
    from scipy.sparse import csr_array, diags_array, hstack

    counts = [len(s) for s in problem.sides]
    if not sum(counts):
        return csr_array((0, 2 * problem.zmp.shape[1])), np.zeros(0)
    # Four coefficients a piece, each against all of the piece's sides.
    picked = np.concatenate([np.repeat(4 * k + np.arange(4), m) for k, m in enumerate(counts) if m])
    table = np.concatenate([np.tile(s, (4, 1)) for s in problem.sides if len(s)])
    points = problem.zmp[picked]
    return (
        csr_array(hstack([diags_array(table[:, 0]) @ points, diags_array(table[:, 1]) @ points])),
        np.asarray(table[:, 2]),
    )


def _offset_rows(problem: SwayProblem) -> tuple[Any, FloatArray]:
    """Rows ``J x >= o``: the body stays within the largest offset of its route at all times."""
    from scipy.sparse import block_diag, csr_array, vstack

    both = block_diag([problem.place, problem.place])
    target = problem.route.T.ravel()
    reach = problem.largest_offset
    return csr_array(vstack([both, -both])), np.concatenate([target - reach, -target - reach])


def rest_rows(count: int, ends: FloatArray) -> tuple[Any, FloatArray]:
    """Rows ``J x = o``: at rest at both ends, without acceleration.

    They are sparse ``(6 d, d count)``, over the control points of each coordinate.

    Args:
        count: control points of the spline of each coordinate.
        ends: where the path begins and ends ``(2, d)``.
    """
    from scipy.sparse import block_diag, csr_array

    # The first (last) three control points in one place: no velocity, no acceleration.
    chosen = [0, 1, 2, count - 3, count - 2, count - 1]
    rows = csr_array((np.ones(6), (np.arange(6), chosen)), shape=(6, count))
    return csr_array(block_diag([rows] * ends.shape[1])), np.repeat(ends.T, 3)


def acceleration_weight(period: float) -> float:
    """Weight of squared accelerations against squared displacements [s^4], for a ``period`` [s]."""
    # A sine of the period has accelerations (2 pi / period)^2 times its displacements.
    return (period / (2.0 * np.pi)) ** 4


def _largest_margin(
    rows: Any, low: FloatArray, bounds: Any, floor: FloatArray, fixed: Any, at: FloatArray
) -> float:
    """Optimum of the linear program, by HiGHS; infinite where there are no polygons."""
    from scipy.optimize import linprog
    from scipy.sparse import csr_array, hstack, vstack

    if not rows.shape[0]:
        return float("inf")
    n = rows.shape[1]
    one = csr_array(np.ones((rows.shape[0], 1)))
    upper = vstack([hstack([-rows, one]), hstack([-bounds, csr_array((bounds.shape[0], 1))])])
    equal = hstack([fixed, csr_array((fixed.shape[0], 1))])
    # HiGHS' own choice of a method has been seen to end without a solution or a status.
    for method in ("highs", "highs-ipm", "highs-ds"):
        found = linprog(
            np.append(np.zeros(n), -1.0), A_ub=upper, b_ub=np.concatenate([-low, -floor]),
            A_eq=equal, b_eq=at, bounds=(None, None), method=method, options={"time_limit": 60.0},
        )  # fmt: skip
        if found.x is not None and np.isfinite(found.x).all():
            return float(found.x[-1])
    raise SolverError(
        f"no sway keeps the body near its route ({found.message}); take sway=False, a longer cycle "
        "or a smaller speed"
    )


def _least_displacement(
    problem: SwayProblem, rows: Any, low: FloatArray, kept: float, bounds: Any,
    floor: FloatArray, fixed: Any, at: FloatArray,
) -> FloatArray:  # fmt: skip
    """Spline coefficients ``(2 n,)`` of the quadratic program's solution, by PIQP."""
    from scipy.sparse import block_diag, csr_array, diags_array, hstack, vstack

    hessian, gradient, owner = _cost(problem)
    pieces, n = len(problem.sides), fixed.shape[1]
    own = csr_array((np.ones(len(owner)), (np.arange(len(owner)), owner)),
                    shape=(len(owner), pieces))  # fmt: skip
    matrix = block_diag([bounds, diags_array(np.ones(pieces))])
    if rows.shape[0]:
        matrix = vstack([hstack([rows, -own]), matrix])
    least = np.concatenate([low, floor, np.full(pieces, kept)])
    most = np.full(len(least), np.inf)
    most[len(least) - pieces :] = problem.target
    equal = hstack([fixed, csr_array((len(at), pieces))])
    scale = 1.0 / float(np.abs(hessian.diagonal()).max())
    found, _ = solve_sparse(
        hessian * scale, gradient * scale, vstack([equal, matrix]), np.concatenate([at, least]),
        np.concatenate([at, most]),
    )  # fmt: skip
    return found[:n]


def _cost(problem: SwayProblem) -> tuple[Any, FloatArray, np.ndarray]:
    """Hessian and gradient over (x, margin of each piece), and the piece of each margin row."""
    from scipy.sparse import block_diag, diags_array

    shares = np.diff(problem.times) / (problem.times[-1] - problem.times[0])
    steps = np.concatenate([shares, [0.0]]) / 2.0 + np.concatenate([[0.0], shares]) / 2.0
    weight = acceleration_weight(problem.period)
    place, second = problem.place, problem.second
    weighted = diags_array(steps)
    single = place.T @ weighted @ place + weight * (second.T @ weighted @ second)
    hessian = block_diag([single, single, diags_array(SHORTFALL_WEIGHT * shares)])
    gradient = np.concatenate([
        *(-(place.T @ (steps * problem.route[:, i])) for i in range(2)),
        -SHORTFALL_WEIGHT * problem.target * shares,
    ])  # fmt: skip
    counts = np.array([len(s) for s in problem.sides])
    return hessian, gradient, np.repeat(np.arange(len(counts)), 4 * counts)
