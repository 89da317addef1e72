"""The fastest joint spline through given knots within limits.

IPOPT chooses the intervals; its answer is judged anew from knots and intervals alone
(:mod:`gaitopt.optimize.spline.joint_spline`). The answer is stretched in time by the part in a
million or less by which it breaks a bound, so that a solved spline breaks none.

Other solvers were tried: Fatrop took a third of IPOPT's time, but on one of 60 random problems it
did not come to an end; CasADi's sqpmethod did not converge with any of seven QP solvers.

Source: [Shao2011], Section III.B; the problem is in
:mod:`gaitopt.optimize.spline.problem`.
"""

from __future__ import annotations

import time
from dataclasses import replace
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.errors import InputError, UnsolvedSplineError
from gaitopt.optimize.spline.joint_spline import (
    JointSpline,
    SolverReport,
    SplineStatus,
    uniform_spline,
)
from gaitopt.optimize.spline.problem import (
    ROUNDING_RESERVE,
    SplineProblem,
    clamped_spline,
    spline_formulation,
    stretch_to_limits,
)

FEASIBILITY = 1e-6
"""Largest share by which a solver's answer may break a bound before it is stretched."""
OPTIMALITY = 1e-6
"""Largest residual of the optimality conditions in an accepted answer, in shares of the cost."""
_ITERATIONS = 300
_SECONDS = 10.0


def solve_spline(problem: SplineProblem, starts: int = 2) -> JointSpline:
    """The intervals that minimise eq. (7) with all bounds on the whole curve.

    The problem is not convex. IPOPT runs from several starts and the best verified answer counts.
    Of 355 problems with knots at random, one start found the best optimum known on 97.5 %, two on
    98.6 %, three on 99.2 %; the paper's swing has shown only one optimum. Not for several threads
    at a time: solvers are built once for each size, and kept.

    Args:
        problem: from :func:`gaitopt.optimize.spline.problem.build_spline_problem`.
        starts: from how many starts, 1 to 4; more are tried when none of these leads to an optimum.

    Raises:
        UnsolvedSplineError: a :class:`SolverError`; no answer's residuals are small enough. Its
            ``spline`` is feasible, if slow.
        InputError: ``starts`` is no such number.
    """
    if starts not in (1, 2, 3, 4):
        raise InputError(f"starts must be 1, 2, 3 or 4, got {starts!r}")
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
    """All the same, fast and slow; in proportion to what each needs alone, very slow and fast."""
    limits, steps = problem.limits, np.abs(np.diff(problem.angles, axis=0))
    alone = np.maximum(steps / limits.velocity, np.sqrt(steps / limits.acceleration))
    needed = np.maximum(alone, np.cbrt(steps / limits.jerk)).max(axis=1)
    fast = uniform_spline(problem.angles, limits, needed).intervals
    return [problem.intervals, 5.0 * problem.intervals, 20.0 * fast, fast]


def _solved(problem: SplineProblem) -> JointSpline:
    """One run of IPOPT, and its answer when that is verified."""
    answer = _answer(problem)
    intervals = answer.x[: len(problem.intervals)] * problem.unit
    if not (np.isfinite(answer.x).all() and (intervals > 0.0).all()):
        by_hand = uniform_spline(problem.angles, problem.limits)
        raise UnsolvedSplineError(f"IPOPT found no spline ({answer.message})", by_hand)
    factor = stretch_to_limits(clamped_spline(problem.angles, intervals), problem.limits)
    report = SolverReport(
        answer.message, answer.iterations, answer.seconds, max(factor - 1.0, 0.0),
        *_residuals(problem, answer),
    )  # fmt: skip
    optimality = max(report.stationarity, report.complementarity)
    if not (report.violation <= FEASIBILITY and optimality <= OPTIMALITY):
        raise UnsolvedSplineError(
            f"the spline through {len(problem.angles)} knots was not solved within "
            f"{report.iterations} iterations of IPOPT ({report.message}): a bound is broken by "
            f"{report.violation:.2g} of its limit, optimality by {optimality:.2g}; use more evenly "
            "spaced knots, or this error's uniformly scaled spline",
            uniform_spline(problem.angles, problem.limits),
        )
    # Where only time counts, what room the answer left is used up too.
    if factor > 1.0 or problem.acceleration_weight == 0.0:
        intervals = intervals * factor * ROUNDING_RESERVE
    return JointSpline(problem.angles, intervals, problem.limits, SplineStatus.SOLVED, report)


class _Answer(NamedTuple):
    """IPOPT's answer: unknowns, multipliers of constraints and of bounds, and what it says."""

    x: FloatArray
    row_duals: FloatArray
    bound_duals: FloatArray
    message: str
    iterations: int
    seconds: float


def _answer(problem: SplineProblem) -> _Answer:
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
    return _Answer(x, rows, bounds, words, int(said["iter_count"]), seconds)


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


def _residuals(problem: SplineProblem, answer: _Answer) -> tuple[float, float]:
    """Stationarity and complementarity of IPOPT's answer, from exact derivatives."""
    form, (low, high) = problem.formulation, problem.bounds
    slope, rows = form.gradient(answer.x, problem.parameters, answer.row_duals)
    free = high > low
    stationarity = np.abs(np.asarray(slope).ravel() + answer.bound_duals)[free].max()
    # A multiplier is negative where a lower bound pushes, positive where an upper one does.
    slack = np.where(answer.bound_duals < 0.0, answer.x - low, high - answer.x)
    slack = np.where(answer.bound_duals == 0.0, 0.0, np.where(free, slack, 0.0))
    products = np.concatenate([
        answer.bound_duals * slack,
        (answer.row_duals * np.asarray(rows).ravel())[form.equalities :],
    ])  # fmt: skip
    return float(stationarity), float(np.abs(products).max())
