"""Solves the problem of a straight walk: all steps at once, or in windows.

Long walks are solved in sections: windows of many steps, of which nearly all are kept. The solver's
Newton steps grow with the number of steps that are solved at once, as its step length and its
damping are those of the worst place of the walk; so the time for each step grows, too. In sections
it does not.

A solution keeps its inequalities at knots. Then legs may still touch each other, and between knots
the true centre of mass may lose its margin, and feet their clearance. So solutions come in rounds:
solve, measure, add or raise rows where something is missing, and solve again from the last answer.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from gaitopt.conventions import FloatArray, Progress
from gaitopt.errors import RouteError
from gaitopt.interior_point.solver import Solution, minimise
from gaitopt.optimize.route.legs import POSE
from gaitopt.optimize.route.problem import RouteProblem
from gaitopt.planners.time_optimal.balance import margin_shortfall, with_raised_com_rows
from gaitopt.planners.time_optimal.build import build_route
from gaitopt.planners.time_optimal.collision import touching_pairs, with_distance_rows
from gaitopt.planners.time_optimal.failure import route_error
from gaitopt.planners.time_optimal.knots import RouteKnots
from gaitopt.planners.time_optimal.straight.clearance import (
    FlightHeights,
    clearance_is_kept,
    flight_heights,
    with_stricter_clearance,
)
from gaitopt.planners.time_optimal.straight.densify import densify
from gaitopt.planners.time_optimal.walk import Route

SECTION, SECTION_OVERLAP = 64, 4
"""Steps of the sections in which a longer walk is solved, and how many of the last ones of each are
solved anew with the next. A section's end is a poor guide for what follows only in its last steps:
six walks of 256 steps (seeds 0 and 1, ``swing``, ``height`` and ``posture``) took 0.19 % less to
0.05 % more time than all steps at once, in three quarters of the processor time. With sections of
32 steps ``posture`` became up to 0.2 % slower."""
GUESS_WINDOW = 16
"""Steps of the windows that give a first guess where nothing else does; half of each is kept."""
WARM_BARRIER_SHARE = 1e-2
"""First barrier parameter from the last solution, as a share of that from a poor first guess."""
DISTANCE_ROUNDS = 6
"""Rounds in which legs may get new rows that keep them apart."""
MOST_STRAIGHT_ROUNDS = 12
"""Most rounds."""

Solutions = list[Solution[RouteProblem]]


class Solved(NamedTuple):
    """A walk at its knots.

    Attributes:
        poses: at all knots ``(K, 9)``.
        last: the solutions that they come from, one for each window.
        iterations: Newton steps of all solutions, those of earlier rounds included.
    """

    poses: FloatArray
    last: Solutions
    iterations: int


def solve_walk(
    route: Route, knots: RouteKnots, problem: RouteProblem, progress: Progress | None = None
) -> Solved:
    """Solve for all steps of a walk: at once, or in sections where it is long.

    Where a section fails, all steps are solved at once. Where this fails, windows give a first
    guess.

    Args:
        route: the walk.
        knots, problem: from :func:`gaitopt.planners.time_optimal.build.build_route`.
        progress: called with (steps done, steps in all) before every section and window but the
            first.

    Raises:
        RouteError: no convergence.
    """
    if route.count > SECTION:
        try:
            return solve_in_windows(route, SECTION, SECTION - SECTION_OVERLAP, progress)
        except RouteError:
            pass
    solutions = _solve_in_rounds(route, problem, knots)
    iterations = _iterations(solutions)
    if not solutions[-1].solved:
        guess = solve_in_windows(route, GUESS_WINDOW, GUESS_WINDOW // 2, progress, as_guess=True)
        solutions = _solve_in_rounds(route, problem, knots, guess.poses)
        iterations += guess.iterations + _iterations(solutions)
    if not solutions[-1].solved:
        raise route_error(route, solutions[-1])
    return Solved(problem.unpack(solutions[-1].x)[0], solutions[-1:], iterations)


def _iterations(solutions: Solutions) -> int:
    """Newton steps of some solutions."""
    return sum(solution.iterations for solution in solutions)


def solve_in_windows(
    route: Route,
    length: int,
    kept: int,
    progress: Progress | None = None,
    *,
    as_guess: bool = False,
) -> Solved:
    """Solve for some steps at a time: each window begins where the kept part of the last one ends.

    Args:
        route: the walk.
        length, kept: steps of a window, and how many of them are kept.
        progress: called with (steps done, steps in all) before every window but the first.
        as_guess: whether the poses are only to be a first guess. Then nothing is measured between
            knots, and a window's poses are taken even where it did not converge.

    Raises:
        RouteError: a window did not converge.
    """
    each = route.intervals
    poses = np.zeros((route.count * each + 1, POSE))
    ends: Solutions = []
    first = iterations = 0
    while first < route.count:
        if first and progress is not None:
            progress(first, route.count)
        last = min(first + length, route.count)
        window = route.window(first, last)
        knots, problem = build_route(window)
        if first:
            problem = problem.with_start(poses[first * each])
        solutions = _solve_in_rounds(window, problem, None if as_guess else knots)
        if not solutions[-1].solved and not as_guess:
            raise route_error(window, solutions[-1])
        iterations += _iterations(solutions)
        ends.append(solutions[-1])
        found = problem.unpack(solutions[-1].x)[0]
        steps = last - first if last == route.count else kept
        poses[first * each : (first + steps) * each + 1] = found[: steps * each + 1]
        first += steps
    return Solved(poses, ends, iterations)


def _solve_in_rounds(
    route: Route,
    problem: RouteProblem,
    knots: RouteKnots | None,
    guess: FloatArray | None = None,
) -> Solutions:
    """Solutions of the problem, each with stricter rows than the one before.

    In the last one legs keep apart, the true centre of mass keeps its margin, and flying feet keep
    their clearance; or it is not solved, or it is that of the last round.

    Args:
        route: the walk, or a window of it.
        problem: its problem.
        knots: its knots; ``None`` to measure nothing between knots but distances of legs.
        guess: poses near the optimum, from which to begin; by default the problem's own guess.
    """
    solutions = [_solve(route, problem, guess)]
    with_distances = problem
    for n in range(MOST_STRAIGHT_ROUNDS):
        if not solutions[-1].solved:
            break
        poses = problem.unpack(solutions[-1].x)[0]
        close = missing = None
        if route.shapes is not None and n < DISTANCE_ROUNDS:
            close = touching_pairs(route.shapes, problem, poses)
        if knots is not None:
            missing = _measure(route, problem, knots, poses)
        if close is None and missing is None:
            break
        if knots is not None and missing is not None:
            problem = _stricter(route, problem, knots, missing)
            with_distances = _stricter(route, with_distances, knots, missing)
        if route.shapes is not None and close is not None:
            # Distances are linearised anew: rows from the rounds before are left out.
            with_distances = with_distance_rows(route.shapes, problem, poses, close)
        solutions.append(_solve(route, with_distances, poses))
    return solutions


def _solve(route: Route, problem: RouteProblem, guess: FloatArray | None) -> Solution[RouteProblem]:
    """Solve from poses near the optimum, or from the problem's own first guess."""
    limit, barrier = route.settings.iterations, problem.first_barrier
    if guess is None:
        return minimise(problem, problem.first_guess(), barrier=barrier, iteration_limit=limit)
    start = problem.unknowns_near(guess)
    return minimise(problem, start, barrier=WARM_BARRIER_SHARE * barrier, iteration_limit=limit)


class _Missing(NamedTuple):
    """What a motion lacks between knots; ``None`` where nothing is missing.

    Attributes:
        margin: of the true centre of mass, from :func:`margin_shortfall`.
        heights: of flying feet, from :func:`flight_heights`.
    """

    margin: FloatArray | None
    heights: FlightHeights | None


def _measure(
    route: Route, problem: RouteProblem, knots: RouteKnots, poses: FloatArray
) -> _Missing | None:
    """What the motion through poses lacks between knots; ``None`` where it lacks nothing."""
    settings, margin, heights = route.settings, None, None
    if problem.com is None and not settings.free.swing:
        return None
    dense = densify(route.robot, settings, knots, problem.legs, poses)
    if problem.com is not None:
        margin = margin_shortfall(route.robot, settings, knots, dense)
        margin = margin if margin.max() > 0.0 else None
    if settings.free.swing:
        heights = flight_heights(route, knots, dense)
        heights = None if clearance_is_kept(heights, settings) else heights
    return None if margin is None and heights is None else _Missing(margin, heights)


def _stricter(
    route: Route, problem: RouteProblem, knots: RouteKnots, missing: _Missing
) -> RouteProblem:
    """The problem with rows that ask for what is missing."""
    com, rows = problem.com, problem.rows
    if com is not None and missing.margin is not None:
        com = with_raised_com_rows(com, knots, missing.margin)
    if missing.heights is not None:
        rows = with_stricter_clearance(rows, knots, missing.heights, route.settings)
    return replace(problem, com=com, rows=rows)
