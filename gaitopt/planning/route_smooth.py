"""Plans with bounded joint accelerations: solve, look between the knots, tighten, again."""

from __future__ import annotations

from dataclasses import replace
from time import process_time

from gaitopt.conventions import FloatArray
from gaitopt.optimize.route_dynamics import RouteDynamics
from gaitopt.optimize.route_solver import Answer, solve_route
from gaitopt.planning.path import MotionPath
from gaitopt.planning.plan import Plan
from gaitopt.planning.route_collision import kept_apart, touching
from gaitopt.planning.route_dynamic import (
    MOST_STRETCH,
    build_dynamic,
    dynamic_phases,
    exact_path,
    new_motion,
    stretch_needed,
    tightened,
)
from gaitopt.planning.route_knots import RouteKnots, build_route
from gaitopt.planning.route_motion import RouteMotion
from gaitopt.planning.route_steps import Route, failed

ROUNDS = 10
"""Most rounds of tightening what a smooth motion asks for between knots."""
NEAR = 1e-3
"""First barrier parameter of all rounds but the first."""


def smooth_plan(route: Route, iterations: int) -> Plan:
    """A plan with bounded joint accelerations.

    Raises:
        RouteError: no convergence, or no motion through an answer keeps its margin.
    """
    began = process_time()
    settings = route.settings
    limit = float(settings.acceleration_limit or 0.0)
    knots, base = build_route(
        route.robot, route.steps, settings, route.cogs, route.footholds.radius
    )
    problem = build_dynamic(base, knots, settings, base.poses, route.robot.foot_radius)
    motion, path, answer, spent = _best_motion(route, knots, problem, limit, iterations)
    info: dict[str, float | str] = {
        "stability": "static margin of the body centre, on the horizontal projection"
        if settings.static
        else "ZMP of a point mass at the body centre",
        "row": settings.row,
        "knot_time": float(problem.cost @ answer.x),
        "solver_seconds": process_time() - began,
        "solver_iterations": float(spent),
        "stationarity": answer.stationarity,
        "violation": answer.primal,
        "complementarity": answer.complementarity,
    }
    phases = dynamic_phases(settings, route.steps, motion)
    return Plan(route.robot, route.footholds, settings, phases, path, info)


def _best_motion(
    route: Route, knots: RouteKnots, problem: RouteDynamics, limit: float, iterations: int
) -> tuple[RouteMotion, MotionPath, Answer, int]:
    """The fastest motion that keeps all limits, with its path, answer, and Newton steps spent.

    Raises:
        RouteError: there is none.
    """
    settings = route.settings
    start, barrier = problem.pack(problem.poses, 2.0 * problem.needed(problem.poses) + 0.1), 1e-2
    best: tuple[RouteMotion, MotionPath, Answer] | None = None
    spent = 0
    for _ in range(ROUNDS):
        answer = solve_route(problem, start, barrier=barrier, iterations=2 * iterations)
        spent += answer.iterations
        if answer.status != "solved":
            break
        motion = new_motion(route.robot, settings, knots, problem, answer.x)
        stretch = stretch_needed(problem, motion, limit)
        # A motion that takes a little longer keeps all limits of its joints.
        found = _kept(route, motion.slower(stretch), problem, limit)
        if found is not None and (best is None or found[0].times[-1] < best[0].times[-1]):
            best = *found, answer
        if found is not None and stretch <= MOST_STRETCH:
            break
        problem, start = _next_round(route, problem, motion, answer, stretch)
        barrier = NEAR
    if best is None:
        status = "limits between knots" if answer.status == "solved" else answer.status
        raise failed(route, problem, replace(answer, status=status), 0)
    return *best, spent


def _kept(
    route: Route, motion: RouteMotion, problem: RouteDynamics, limit: float
) -> tuple[RouteMotion, MotionPath] | None:
    """A motion whose path keeps the joints' limits, when it keeps its margin, too."""
    settings = route.settings
    if motion.margins(not settings.static).min() < settings.stability_margin:
        return None
    motion, path = exact_path(motion, problem, limit)
    safe = motion.margins(not settings.static).min() >= settings.stability_margin
    return (motion, path) if safe else None


def _next_round(
    route: Route, problem: RouteDynamics, motion: RouteMotion, answer: Answer, stretch: float
) -> tuple[RouteDynamics, FloatArray]:
    """The problem tightened by what was seen, and where to begin."""
    tighter = tightened(problem, motion, route.settings, stretch)
    poses, times = problem.unpack(answer.x)
    found = touching(route.shapes, problem, poses) if route.shapes is not None else None
    if route.shapes is not None and found is not None:
        tighter = kept_apart(route.shapes, tighter, poses, *found)
    return tighter, problem.pack(poses, 1.05 * stretch * times)
