"""How far from the best possible a time-optimal route can be: a bound without coupling."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from gaitopt.conventions import FloatArray, frozen
from gaitopt.errors import InputError
from gaitopt.optimize.route_problem import RouteProblem, Rows
from gaitopt.optimize.route_solver import solve_route
from gaitopt.planning.plan import Plan
from gaitopt.planning.route_settings import RouteSettings
from gaitopt.planning.route_steps import prepared, problem_of


def route_bound(plan: Plan, window: int = 8, iterations: int = 300) -> FloatArray:
    """Times [s] below which no plan of the same settings is expected to come, window by window.

    The coupling between windows of steps is relaxed: each may begin in whatever pose of the body
    suits it best, and moving there takes no time. What is left is one problem a window. Knots
    joined in joint space take a little less time than the motion through them, which is on the
    safe side; but the problems are not convex, so each bound is that of the best local optimum
    found, and not a proof.

    Args:
        plan: a time-optimal route, static and without acceleration limits.
        window: steps of each window; with 1 every swing is on its own. The bound grows with it.
        iterations: most Newton steps of each problem.

    Returns:
        One time a window; their sum bounds the whole walk. NaN where there was no convergence.

    Raises:
        InputError: the plan is no route, or has accelerations, or ``window`` is below 1.
    """
    settings = plan.settings
    if not isinstance(settings, RouteSettings) or settings.smooth or "overlap" not in settings.free:
        raise InputError(
            "route_bound takes a plan of plan_route whose body moves during swings and whose "
            "accelerations are not limited"
        )
    if isinstance(window, bool) or window < 1:
        raise InputError(f"window must be a whole number of steps from 1, got {window!r}")
    route = prepared(plan.robot, plan.footholds, settings, None)
    times = []
    count = len(route.steps.legs)
    for first in range(0, count, window):
        whole = problem_of(route, first, min(first + window, count))
        problem = _without_start(whole, settings.stance_knots)
        answer = solve_route(problem, problem.start(), barrier=problem.barrier,
                             iterations=iterations)  # fmt: skip
        needed = problem.needed(problem.unpack(answer.x)[0]).sum()
        times.append(float(needed) if answer.status == "solved" else float("nan"))
    return frozen(times)


def _without_start(problem: RouteProblem, stance: int) -> RouteProblem:
    """The problem from its first swing on, with a free pose of the body at its beginning."""
    unknown = problem.unknown[stance:].copy()
    free = unknown >= 0
    number = np.cumsum(free).reshape(free.shape) - 1
    kept = problem.rows.knot >= stance
    rows = Rows(problem.rows.knot[kept] - stance, *(part[kept] for part in problem.rows[1:]))
    com = None if problem.com is None else problem.com.since(stance)
    return replace(
        problem,
        feet=problem.feet[stance:],
        swing=problem.swing[stance:],
        poses=problem.poses[stance:],
        unknown=np.where(free, number, -1),
        rows=rows,
        com=com,
    )
