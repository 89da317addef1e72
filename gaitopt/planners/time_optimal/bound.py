"""A lower bound on the time of a time-optimal walk: the least times of its windows, each alone."""

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
from gaitopt.planners.time_optimal.build import build_route
from gaitopt.planners.time_optimal.walk import Route, prepare_route

LONGEST_WINDOW = 10_000
"""Most steps of a window, so that a wrong number is refused."""


def route_bound(plan: Plan, window: int = 8, iterations: int = 300) -> FloatArray:
    """Times [s] below which no plan of the same settings is expected to come, window by window.

    A walk over all steps contains a walk over each window of steps. So the sum of the least times
    of all windows is at most the time of the whole walk, when each window but the first may begin
    with the body in whatever pose suits it best, and moving there takes no time. The first one
    begins where the walk does. Acceleration limits are left
    out, and for a dynamic walk balance, too: what is left are reach, clearance and joint
    velocities. A path that is straight between knots in joint space takes a little less time than
    the motion through the same knots, so the bound is on the safe side. But the problems are not
    convex: each bound is the time of the best local optimum that was found, and no proof.

    Args:
        plan: a time-optimal walk.
        window: steps of each window; with 1 every step is on its own. The bound grows with it.
        iterations: most Newton steps of each problem.

    Returns:
        One time for each window; their sum bounds the whole walk. Where a window did not converge
        it is the sum of those of its halves, which is lower; NaN where not even single steps did.

    Raises:
        InputError: the plan is no time-optimal walk, or ``window`` is below 1.
    """
    settings = plan.settings
    if not isinstance(settings, RouteSettings):
        raise InputError("route_bound takes a plan of plan_route")
    window = check_count("window", window, 1, LONGEST_WINDOW)
    free = replace(settings.free, dynamic=False)
    relaxed = replace(settings, acceleration_limit=None, free=free, iterations=iterations)
    route = prepare_route(plan.robot, plan.footholds, relaxed)
    return frozen([
        _least_time(
            route.window(first, min(first + window, route.count)), settings.static, not first
        )
        for first in range(0, route.count, window)
    ])  # fmt: skip


def _least_time(route: Route, balanced: bool, at_start: bool) -> float:
    """Least time of a window [s]; where the solver does not converge, that of its two halves.

    Args:
        route: the window.
        balanced: whether the body centre has to keep its margin.
        at_start: whether the window begins where the walk does.
    """
    problem = build_route(route)[1]
    if not at_start:
        problem = _with_free_start(problem, route.settings.stance_knots)
    if not balanced:
        problem = _without_balance(problem)
    solution = minimise(problem, problem.first_guess(), barrier=problem.first_barrier,
                        iteration_limit=route.settings.iterations)  # fmt: skip
    if solution.solved:
        return float(problem.least_times(problem.unpack(solution.x)[0]).sum())
    if route.count == 1:
        return float("nan")
    half = route.count // 2
    return _least_time(route.window(0, half), balanced, at_start) + _least_time(
        route.window(half, route.count), balanced, False
    )


def _with_free_start(problem: RouteProblem, first_swing: int) -> RouteProblem:
    """The problem from the knot ``first_swing`` on, at which the body's pose is free.

    There the first swing begins.
    """
    unknown = problem.unknown[first_swing:].copy()
    free = unknown >= 0
    # Numbers begin at 0 again. Knots may share unknowns: where the body stands still, those of a
    # swing do.
    unknown[free] = np.unique(unknown[free], return_inverse=True)[1]
    rows = problem.rows.chosen(problem.rows.knot >= first_swing).shifted(-first_swing)
    return replace(
        problem,
        feet=problem.feet[first_swing:],
        swing=problem.swing[first_swing:],
        poses=problem.poses[first_swing:],
        unknown=unknown,
        rows=rows,
        com=None if problem.com is None else problem.com.from_knot(first_swing),
    )


def _without_balance(problem: RouteProblem) -> RouteProblem:
    """The problem without the rows that keep the body centre above its support polygon."""
    elsewhere = np.abs(problem.rows.linear[:, :2]).sum(axis=1) == 0
    return replace(problem, rows=problem.rows.chosen(elsewhere))
