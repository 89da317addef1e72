"""The fastest joint spline through given knots within limits.

IPOPT [Waechter2006] chooses the intervals. Its solution is judged from knots and intervals alone
(:mod:`gaitopt.optimize.spline.joint_spline`). It may exceed a limit by a part in a million, and is
stretched in time by as much, so that a solved spline exceeds none.

Other solvers were tried: fatrop [Vanroye2023] took a third of IPOPT's time, but did not end on one
of 60 random problems; CasADi's sqpmethod did not converge with any of seven QP solvers.

Source: [Shao2011], Section III.B; the problem is in :mod:`gaitopt.optimize.spline.problem`.
"""

from __future__ import annotations

import time
from dataclasses import replace
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.errors import InputError, UnsolvedSplineError
from gaitopt.inputs import as_text, check_kind
from gaitopt.optimize.spline.clamped import ROUNDING_RESERVE, clamped_spline, stretch_to_limits
from gaitopt.optimize.spline.joint_spline import (
    JointSpline,
    SolverReport,
    SplineStatus,
    uniform_spline,
)
from gaitopt.optimize.spline.problem import SplineProblem, spline_formulation

FEASIBILITY = 1e-6
"""Largest share by which a solution may exceed a limit before it is stretched."""
OPTIMALITY = 1e-6
"""Largest residual of the optimality conditions in an accepted solution, in shares of the cost.

Both are a hundred times IPOPT's own tolerance.
"""
_ITERATIONS = 300
"""Most iterations of IPOPT; 100 random problems with up to 13 knots took 26 at most."""
_SECONDS = 10.0
"""Longest time of one run of IPOPT [s]; these took 41 ms at most."""
STARTS = (1, 2, 3, 4)
"""Numbers of starts that may be asked for."""


def solve_spline(problem: SplineProblem, starts: int = 2) -> JointSpline:
    """The spline that minimises eq. (7) with all limits kept on the whole curve.

    The problem is not convex. IPOPT runs from several starts, and the best verified solution is
    taken. Of 355 problems with random knots, one start found the best known optimum in 97.5 %, two
    in 98.6 %, three in 99.2 %; for the paper's swing only one optimum has been found. The function
    is not for several threads at a time: solvers are built once for each size, and kept.

    Args:
        problem: from :func:`gaitopt.optimize.spline.problem.build_spline_problem`.
        starts: from how many starts, 1 to 4; more are used when none of these leads to an optimum.

    Raises:
        UnsolvedSplineError: a :class:`SolverError`; no solution's residuals are small enough. Its
            ``spline`` keeps all limits, but is slower.
        InputError: ``starts`` is none of these numbers.
    """
    check_kind("problem", problem, SplineProblem)
    if starts not in STARTS:
        raise InputError(f"starts must be 1, 2, 3 or 4, got {as_text(starts)}")
    found: list[JointSpline] = []
    refused: UnsolvedSplineError | None = None
    for run, intervals in enumerate(_starting_intervals(problem)):
        if run >= starts and found:
            break
        try:
            found.append(_solved(replace(problem, intervals=intervals)))
        except UnsolvedSplineError as error:
            refused = refused or error
    if not found and refused:
        raise refused
    weights = problem.time_weight, problem.acceleration_weight
    return min(found, key=lambda spline: spline.cost(*weights))


def _starting_intervals(problem: SplineProblem) -> list[FloatArray]:
    """Four choices: equal intervals, fast and slow; and intervals in proportion to the time that
    each needs alone from rest to rest, very slow and fast.
    """
    limits, steps = problem.limits, np.abs(np.diff(problem.angles, axis=0))
    alone = np.maximum(steps / limits.velocity, np.sqrt(steps / limits.acceleration))
    needed = np.maximum(alone, np.cbrt(steps / limits.jerk)).max(axis=1)
    fast = uniform_spline(problem.angles, limits, needed).intervals
    return [problem.intervals, 5.0 * problem.intervals, 20.0 * fast, fast]


def _solved(problem: SplineProblem) -> JointSpline:
    """The spline of one run of IPOPT, when its solution is verified."""
    found = _run_ipopt(problem)
    intervals = found.x[: len(problem.intervals)] * problem.unit
    if not (np.isfinite(found.x).all() and (intervals > 0.0).all()):
        slower = uniform_spline(problem.angles, problem.limits)
        raise UnsolvedSplineError(f"IPOPT found no spline ({found.message})", slower)
    factor = stretch_to_limits(clamped_spline(problem.angles, intervals), problem.limits)
    report = SolverReport(
        found.message, found.iterations, found.seconds, max(factor - 1.0, 0.0),
        *_residuals(problem, found),
    )  # fmt: skip
    optimality = max(report.stationarity, report.complementarity)
    if not (report.violation <= FEASIBILITY and optimality <= OPTIMALITY):
        raise UnsolvedSplineError(
            f"the spline through {len(problem.angles)} knots was not solved within "
            f"{report.iterations} iterations of IPOPT ({report.message}): a limit is exceeded by "
            f"{report.violation:.2g} of itself, the residual of optimality is {optimality:.2g}; "
            "use more evenly spaced knots, or the slower spline in this error's .spline",
            uniform_spline(problem.angles, problem.limits),
        )
    # Where only time counts, the spline is also made faster until the tightest limit is reached.
    if factor > 1.0 or problem.acceleration_weight == 0.0:
        intervals = intervals * factor * ROUNDING_RESERVE
    return JointSpline(problem.angles, intervals, problem.limits, SplineStatus.SOLVED, report)


class _IpoptSolution(NamedTuple):
    """IPOPT's unknowns, multipliers of constraints and of bounds, and status."""

    x: FloatArray
    row_multipliers: FloatArray
    bound_multipliers: FloatArray
    message: str
    iterations: int
    seconds: float


def _run_ipopt(problem: SplineProblem) -> _IpoptSolution:
    form = problem.formulation
    call = _ipopt(form.knots, form.joints)
    low, high = problem.bounds
    most = np.where(np.arange(form.nlp["g"].numel()) < form.equalities, 0.0, np.inf)
    begun = time.perf_counter()
    found = call(x0=problem.start, p=problem.parameters, lbx=low, ubx=high, lbg=0.0, ubg=most)
    seconds = time.perf_counter() - begun
    x, rows, bounds = (np.asarray(found[k]).ravel() for k in ("x", "lam_g", "lam_x"))
    said = call.stats()
    words = str(said["return_status"]).replace("_", " ")
    return _IpoptSolution(x, rows, bounds, words, int(said["iter_count"]), seconds)


@lru_cache(maxsize=32)
def _ipopt(knots: int, joints: int) -> Any:
    """The solver for one size, built once."""
    import casadi as ca

    options: dict[str, Any] = {
        "print_level": 0, "sb": "yes", "tol": 1e-8,
        "max_iter": _ITERATIONS, "max_wall_time": _SECONDS,
        # Velocities at knots strictly within their bounds keep the square roots real.
        "bound_relax_factor": 0.0,
    }  # fmt: skip
    more: dict[str, Any] = {"print_time": False, "error_on_fail": False, "ipopt": options}
    return ca.nlpsol("spline", "ipopt", spline_formulation(knots, joints).nlp, more)


def _residuals(problem: SplineProblem, found: _IpoptSolution) -> tuple[float, float]:
    """Stationarity and complementarity of IPOPT's solution, from exact derivatives."""
    form, (low, high) = problem.formulation, problem.bounds
    gradient, rows = form.gradient(found.x, problem.parameters, found.row_multipliers)
    free = high > low
    stationarity = np.abs(np.asarray(gradient).ravel() + found.bound_multipliers)[free].max()
    # A multiplier is negative where a lower bound is active, positive where an upper one is.
    slack = np.where(found.bound_multipliers < 0.0, found.x - low, high - found.x)
    slack = np.where(found.bound_multipliers == 0.0, 0.0, np.where(free, slack, 0.0))
    products = np.concatenate([
        found.bound_multipliers * slack,
        (found.row_multipliers * np.asarray(rows).ravel())[form.equalities :],
    ])  # fmt: skip
    return float(stationarity), float(np.abs(products).max())
