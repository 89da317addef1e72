"""Plans of straight walks: between knots the body moves along straight lines."""

from __future__ import annotations

from time import process_time

import numpy as np

from gaitopt.conventions import Progress
from gaitopt.interior_point.solver import Solution
from gaitopt.optimize.route.problem import RouteProblem
from gaitopt.plan.plan import Plan
from gaitopt.plan.record import RouteRecord
from gaitopt.planners.time_optimal.balance import margin_shortfall
from gaitopt.planners.time_optimal.build import build_route
from gaitopt.planners.time_optimal.dense import RESERVE_KEPT, DensePath
from gaitopt.planners.time_optimal.failure import Reason, route_error
from gaitopt.planners.time_optimal.knots import RouteKnots
from gaitopt.planners.time_optimal.straight.clearance import flight_heights
from gaitopt.planners.time_optimal.straight.densify import densify
from gaitopt.planners.time_optimal.straight.phases import straight_phases
from gaitopt.planners.time_optimal.straight.solve import solve_in_windows, solve_walk
from gaitopt.planners.time_optimal.walk import Route
from gaitopt.retiming.retimed import stopped

WORST_STEPS = 3
"""How many knots an error blames."""


def straight_plan(route: Route, progress: Progress | None = None) -> Plan:
    """Plan a walk without acceleration limits, or one with a stop at every corner of its box.

    Where forces set the timing the plan is still to be timed.

    Args:
        route: the walk.
        progress: called with (steps done, steps in all) before every window but the first.

    Raises:
        RouteError: no convergence, or the motion through the solution loses its margin or its
            clearance.
        SolverError: standing feet cannot be kept on their footholds between knots.
    """
    began, settings = process_time(), route.settings
    knots, problem = build_route(route)
    if settings.horizon is None:
        solved = solve_walk(route, knots, problem, progress)
    else:
        kept = max(settings.horizon // 2, 1)
        solved = solve_in_windows(route, settings.horizon, kept, progress)
    seconds, last = process_time() - began, solved.last[-1]
    dense = densify(route.robot, settings, knots, problem.legs, solved.poses)
    if settings.true_com:
        _check_margin(route, knots, dense, last)
    clearance = _checked_clearance(route, knots, dense, last) if settings.free.swing else None
    path = dense.motion_path()
    phases = straight_phases(route, knots, dense)
    centre = "true centre of mass" if settings.true_com else "body centre"
    record = RouteRecord(
        stability=f"static margin of the {centre}, on the horizontal projection",
        knot_time=float(problem.least_times(solved.poses).sum()),
        solver_seconds=seconds,
        solver_iterations=solved.iterations,
        stationarity=max(solution.stationarity() for solution in solved.last),
        violation=max(solution.violation() for solution in solved.last),
        complementarity=problem.time_unit
        * sum(solution.complementarity() for solution in solved.last),
        clearance=clearance,
    )
    plan = Plan(route.robot, route.footholds, settings, phases, path, record)
    return stopped(plan) if settings.smooth and settings.forces is None else plan


def _check_margin(
    route: Route, knots: RouteKnots, dense: DensePath, solution: Solution[RouteProblem]
) -> None:
    """Refuse a motion whose true centre of mass loses the stability margin between knots.

    Raises:
        RouteError: it does.
    """
    # A shortfall counts from the margin and the share of its reserve that is to be kept.
    reserve = route.settings.margin_reserve * RESERVE_KEPT
    shortfall = margin_shortfall(route.robot, route.settings, knots, dense)
    if shortfall.max() > reserve:
        worst = np.argsort(-shortfall.max(axis=1))[:WORST_STEPS] + 1
        raise route_error(route, solution, Reason.COM_MARGIN, worst)


def _checked_clearance(
    route: Route, knots: RouteKnots, dense: DensePath, solution: Solution[RouteProblem]
) -> float:
    """Least height of a flying foot above its higher foothold, outside the columns [m].

    Raises:
        RouteError: it is less than the clearance.
    """
    lowest = flight_heights(route, knots, dense).lowest
    if lowest.min() < route.settings.clearance:
        raise route_error(route, solution, Reason.CLEARANCE, np.argsort(lowest)[:WORST_STEPS] + 1)
    return float(lowest.min())
