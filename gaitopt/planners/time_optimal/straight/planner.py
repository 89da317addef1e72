"""Plans of straight walks: between knots the body moves along straight lines."""

from __future__ import annotations

from dataclasses import replace
from time import process_time

import numpy as np

from gaitopt.conventions import FloatArray, Progress
from gaitopt.dynamics.contacts import ForceLimits
from gaitopt.interior_point.solver import Solution
from gaitopt.motion.path import MotionPath
from gaitopt.optimize.route.legs import StackedLegs
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
from gaitopt.planners.time_optimal.straight.solve import solve_in_windows, solve_whole
from gaitopt.planners.time_optimal.straight.stops import StoppingMotion, stopping_path
from gaitopt.planners.time_optimal.walk import Route

FORCE_RESERVE = 0.02
"""Share by which forces are planned within tighter limits than are promised, for what happens
between two places of the grid. With it the walks of go2, a1, anymal_c and wang2020 over 8 steps are
certified; the certificate judges every plan anew."""
WORST_STEPS = 3
"""How many knots an error blames."""


def straight_plan(route: Route, progress: Progress | None = None) -> Plan:
    """Plan a walk without acceleration limits, or one with a stop at every corner of its box.

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
        poses, solutions = solve_whole(route, knots, problem, progress)
    else:
        kept = max(settings.horizon // 2, 1)
        poses, solutions = solve_in_windows(route, settings.horizon, kept, progress)
    seconds, last = process_time() - began, solutions[-1]
    dense = densify(route.robot, settings, knots, problem.legs, poses)
    if settings.true_com:
        _check_margin(route, knots, dense, last)
    clearance = _checked_clearance(route, knots, dense, last) if settings.free.swing else None
    path = dense.motion_path()
    if settings.stops:
        dense, path = _with_stops(route, knots, problem.legs, poses)
    phases = straight_phases(route, knots, dense)
    centre = "true centre of mass" if settings.true_com else "body centre"
    record = RouteRecord(
        stability=f"static margin of the {centre}, on the horizontal projection",
        knot_time=float(problem.least_times(poses).sum()),
        solver_seconds=seconds,
        solver_iterations=sum(solution.iterations for solution in solutions),
        stationarity=last.stationarity(),
        violation=last.violation(),
        complementarity=last.complementarity() * problem.time_unit,
        clearance=clearance,
    )
    return Plan(route.robot, route.footholds, settings, phases, path, record)


def tightened(limits: ForceLimits) -> ForceLimits:
    """Limits that leave a reserve for what happens between the places at which they are kept."""
    share = 1.0 - FORCE_RESERVE
    on_four = limits.reserve / 2.0 if limits.reserve_on_four is None else limits.reserve_on_four
    return replace(
        limits,
        friction=share * limits.friction,
        reserve=limits.reserve + FORCE_RESERVE / 10.0,
        reserve_on_four=on_four + FORCE_RESERVE / 10.0,
        torque_share=share * limits.torque_share,
    )


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


def _with_stops(
    route: Route, knots: RouteKnots, legs: StackedLegs, poses: FloatArray
) -> tuple[DensePath, MotionPath]:
    """The motion through poses with bounded accelerations or forces: it stops at every corner.

    Raises:
        InfeasibleStepError: there are no forces, not even at rest.
    """
    settings = route.settings
    limit = np.inf if settings.acceleration_limit is None else settings.acceleration_limit
    forces = None if settings.forces is None else tightened(settings.forces)
    motion = StoppingMotion.of(route.robot, settings.heading, legs, knots, poses, limit, forces)
    motion, path = stopping_path(motion, limit)
    return motion.dense_path(), path
