"""Plans of smooth walks: bounded joint accelerations, along B-splines."""

from __future__ import annotations

from dataclasses import replace
from time import process_time

from gaitopt.conventions import Progress
from gaitopt.errors import RouteError
from gaitopt.plan.plan import Plan
from gaitopt.plan.record import RouteRecord
from gaitopt.planners.time_optimal.build import build_route
from gaitopt.planners.time_optimal.smooth.build import build_smooth
from gaitopt.planners.time_optimal.smooth.clearance import lowest_heights
from gaitopt.planners.time_optimal.smooth.guess import rough_guess
from gaitopt.planners.time_optimal.smooth.phases import smooth_phases
from gaitopt.planners.time_optimal.smooth.rounds import (
    DynamicSolution,
    FoundMotion,
    best_motion,
)
from gaitopt.planners.time_optimal.smooth.window import SmoothWindow
from gaitopt.planners.time_optimal.smooth.windows import plan_in_windows
from gaitopt.planners.time_optimal.walk import Route

RESCUE_WINDOW = 16
"""Steps of the windows in which a walk is planned that was not found as a whole."""


def smooth_plan(route: Route, progress: Progress | None = None) -> Plan:
    """Plan a walk along splines, with bounded joint accelerations.

    Where forces set the timing the plan is still to be timed.

    Args:
        route: the walk.
        progress: called with (steps done, steps in all) before every window but the first.

    Raises:
        RouteError: no convergence, or no motion through a solution keeps all limits.
        SolverError: standing feet cannot be kept on their footholds between knots.
    """
    began, settings = process_time(), route.settings
    knots, base = build_route(route)
    problem = build_smooth(base, knots, route)
    horizon, shares = settings.horizon, list[float]()
    if horizon is None:
        try:
            poses, spans = rough_guess(route, problem.time_unit)
            whole = SmoothWindow.whole(route, replace(problem, poses=poses), knots, spans)
            found, solutions = best_motion(whole)
        except RouteError:
            if route.count <= RESCUE_WINDOW:
                raise
            horizon = RESCUE_WINDOW
    if horizon is not None:
        found, solutions, shares = plan_in_windows(route, knots, problem, horizon, progress)
    phases = smooth_phases(route, found.motion)
    record = replace(
        _record(route, found, solutions),
        solver_seconds=process_time() - began,
        windows=len(shares) or None,
        window_share=max(shares, default=None),
    )
    return Plan(route.robot, route.footholds, settings, phases, found.path, record)


def _record(route: Route, found: FoundMotion, solutions: list[DynamicSolution]) -> RouteRecord:
    """What the plan tells of itself.

    Residuals are the worst of the solutions that the motion comes from.
    """
    problem, dynamic = found.solutions[-1].problem, route.settings.free.dynamic
    whole = SmoothWindow.whole(route, problem, found.motion.knots, found.motion.spans[:-1])
    centre = "true centre of mass" if route.settings.true_com else "body centre"
    stability = f"static margin of the {centre}, on the horizontal projection"
    zmp_margin = None
    if dynamic and route.settings.forces:
        stability = "contact forces of the whole robot"
    elif dynamic:
        stability = "ZMP of a point mass at the body centre"
        # Less than the settings ask for, where the robot stands with less at first.
        zmp_margin = float(whole.wanted_margins(found.motion).min())
    radius = route.footholds.landing_radius
    return RouteRecord(
        stability=stability,
        zmp_margin=zmp_margin,
        knot_time=float(found.motion.times[-1]),
        solver_iterations=sum(solution.iterations for solution in solutions),
        stationarity=max(solution.stationarity() for solution in found.solutions),
        violation=max(solution.violation() for solution in found.solutions),
        complementarity=problem.time_unit
        * sum(solution.complementarity() for solution in found.solutions),
        clearance=float(lowest_heights(found.motion, radius).min()),
    )
