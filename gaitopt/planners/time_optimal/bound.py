"""How far from the best possible a time-optimal route can be: a bound without coupling."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from gaitopt.conventions import FloatArray, frozen
from gaitopt.errors import InputError
from gaitopt.inputs import check_count
from gaitopt.interior_point.solver import minimise
from gaitopt.optimize.route.problem import RouteProblem
from gaitopt.plan.plan import Plan
from gaitopt.plan.settings.time_optimal import RouteSettings
from gaitopt.planners.time_optimal.build import problem_of
from gaitopt.planners.time_optimal.walk import Route, prepared


def route_bound(plan: Plan, window: int = 8, iterations: int = 300) -> FloatArray:
    """Times [s] below which no plan of the same settings is expected to come, window by window.

    The coupling between windows of steps is relaxed: each may begin in whatever pose of the body
    suits it best, and moving there takes no time. Limits of accelerations are relaxed, too, and
    of a dynamic walk the whole of its balance: what is left of it is reach, clearance and joint
    velocities. Knots joined in joint space take a little less time than the motion through them,
    which is on the safe side; but the problems are not convex, so each bound is that of the best
    local optimum found, and not a proof.

    Args:
        plan: a time-optimal route.
        window: steps of each window; with 1 every swing is on its own. The bound grows with it.
        iterations: most Newton steps of each problem.

    Returns:
        One time a window; their sum bounds the whole walk. Where a window did not converge it is
        that of its halves, which is lower; NaN where not even single steps did.

    Raises:
        InputError: the plan is no route, or ``window`` is below 1.
    """
    settings = plan.settings
    if not isinstance(settings, RouteSettings):
        raise InputError("route_bound takes a plan of plan_route")
    window = check_count("window", window, 1, 10_000)
    free = replace(settings.free, dynamic=False)
    relaxed = replace(settings, acceleration_limit=None, free=free)
    route = prepared(plan.robot, plan.footholds, relaxed)
    count = len(route.steps.legs)
    return frozen([
        _least_time(route, settings.static, first, min(first + window, count), iterations)
        for first in range(0, count, window)
    ])  # fmt: skip


def _least_time(route: Route, static: bool, first: int, last: int, iterations: int) -> float:
    """Least time of some steps; of their halves apart, where there is no convergence."""
    problem = _without_start(problem_of(route, first, last), route.settings.stance_knots)
    if not static:
        problem = _without_balance(problem)
    solution = minimise(problem, problem.first_guess(), barrier=problem.first_barrier,
                        iteration_limit=iterations)  # fmt: skip
    if solution.solved:
        return float(problem.least_times(problem.unpack(solution.x)[0]).sum())
    if last - first == 1:
        return float("nan")
    middle = (first + last) // 2
    return _least_time(route, static, first, middle, iterations) + _least_time(
        route, static, middle, last, iterations
    )


def _without_start(problem: RouteProblem, stance: int) -> RouteProblem:
    """The problem from its first swing on, with a free pose of the body at its beginning."""
    unknown = problem.unknown[stance:].copy()
    free = unknown >= 0
    # Knots may share unknowns: where the body stands still, those of a swing do.
    unknown[free] = np.unique(unknown[free], return_inverse=True)[1]
    rows = problem.rows.chosen(problem.rows.knot >= stance).shifted(-stance)
    com = None if problem.com is None else problem.com.from_knot(stance)
    return replace(
        problem,
        feet=problem.feet[stance:],
        swing=problem.swing[stance:],
        poses=problem.poses[stance:],
        unknown=unknown,
        rows=rows,
        com=com,
    )


def _without_balance(problem: RouteProblem) -> RouteProblem:
    """The problem without the rows that hold the body's centre over its support."""
    level = np.abs(problem.rows.linear[:, :2]).sum(axis=1) == 0
    return replace(problem, rows=problem.rows.chosen(level))
