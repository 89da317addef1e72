"""Time-optimal routes without acceleration limits: all steps in one solution, or in windows.

After a solution legs are moved apart where they touch, and the true centre of mass gets more room
where it loses its margin between knots; then it is solved again, from where it was.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from gaitopt.conventions import FloatArray, Progress
from gaitopt.interior_point.solver import Solution, minimise
from gaitopt.planners.time_optimal.balance import raised, shortfall
from gaitopt.planners.time_optimal.build import knots_of, problem_of
from gaitopt.planners.time_optimal.collision import kept_apart, touching
from gaitopt.planners.time_optimal.failure import failed
from gaitopt.planners.time_optimal.knots import RouteKnots
from gaitopt.planners.time_optimal.straight.clearance import dense_heights, narrowed
from gaitopt.planners.time_optimal.straight.densify import densify
from gaitopt.planners.time_optimal.walk import Route

if TYPE_CHECKING:
    from gaitopt.optimize.route.problem import RouteProblem

DIRECT_STEPS = 1024
"""Longer routes are first planned in overlapping windows, and then as a whole."""
WINDOW = 16
"""Steps of such a window."""
NEAR = 1e-2
"""First barrier parameter from a good guess, as a share of that from a poor one."""
ROUNDS = 6
"""Most rounds of moving legs apart."""
BETWEEN_ROUNDS = 12
"""Most rounds of keeping margin and clearance between knots, too."""


def planned_whole(
    route: Route, iterations: int, progress: Progress | None = None
) -> tuple[FloatArray, list[Solution[RouteProblem]]]:
    """Poses at all knots ``(K, 9)``, all steps at once, and all solutions on the way there.

    Args:
        route: what is walked.
        iterations: most Newton steps of each solution.
        progress: called with (steps done, steps in all), where windows have to show the way.

    Raises:
        RouteError: no convergence.
    """
    count = len(route.steps.legs)
    problem, knots = problem_of(route, 0, count), knots_of(route, 0, count)
    solutions: list[Solution[RouteProblem]] = []
    if count <= DIRECT_STEPS:
        solutions = _solved(route, problem, knots, None, iterations)
    if not solutions or not solutions[-1].solved:
        poses, windows = planned_in_windows(
            route, WINDOW, WINDOW // 2, iterations, progress, partial=True
        )
        solutions += [*windows, *_solved(route, problem, knots, poses, iterations)]
    if not solutions[-1].solved:
        raise failed(route, solutions[-1], 0)
    return problem.unpack(solutions[-1].x)[0], solutions


def _solved(
    route: Route,
    problem: RouteProblem,
    knots: RouteKnots | None,
    guess: FloatArray | None,
    iterations: int,
) -> list[Solution[RouteProblem]]:
    """Solutions of the problem, each with more rows than the one before.

    In the last one legs keep apart, the true COM its margin, and flying feet their clearance.

    Args:
        route, problem: what is walked, and the steps that are solved.
        knots: of these steps; ``None`` to keep margin and clearance at knots only.
        guess: poses from which to begin, near the optimum; the problem's own by default.
        iterations: most Newton steps of each solution.
    """

    def again(changed: RouteProblem, poses: FloatArray) -> Solution[RouteProblem]:
        return minimise(changed, changed.unknowns_near(poses), barrier=NEAR * changed.first_barrier,
                        iteration_limit=iterations)  # fmt: skip

    if guess is None:
        solutions = [minimise(problem, problem.first_guess(), barrier=problem.first_barrier,
                              iteration_limit=iterations)]  # fmt: skip
    else:
        solutions = [again(problem, guess)]
    apart = problem
    for attempt in range(BETWEEN_ROUNDS):
        if not solutions[-1].solved:
            break
        poses = problem.unpack(solutions[-1].x)[0]
        found = None
        if route.shapes is not None and attempt < ROUNDS:
            found = touching(route.shapes, problem, poses)
        safer = None if knots is None else _safer(route, apart, knots, poses)
        if found is None and safer is None:
            break
        if safer is not None:
            problem, apart = safer(problem), safer(apart)
        if route.shapes is not None and found is not None:
            apart = kept_apart(route.shapes, problem, poses, *found)
        solutions.append(again(apart, poses))
    return solutions


def _safer(
    route: Route, problem: RouteProblem, knots: RouteKnots, poses: FloatArray
) -> Callable[[RouteProblem], RouteProblem] | None:
    """What asks more of the true COM and of flying feet, where they lose margin or clearance.

    Between knots, that is. ``None`` where they keep them.
    """
    settings, free = route.settings, route.settings.free.swing
    if problem.com is None and not free:
        return None
    dense = densify(route.robot, settings, knots, problem.legs, poses)
    com, seen = problem.com, dense_heights(route, knots, dense) if free else None
    if com is not None:
        short = shortfall(route.robot, settings, knots, dense)
        com = raised(com, knots, short) if short.max() > 0.0 else None
    if com is None and (seen is None or narrowed(problem.rows, knots, seen, settings) is None):
        return None

    def changed(one: RouteProblem) -> RouteProblem:
        rows = None if seen is None else narrowed(one.rows, knots, seen, settings)
        return replace(one, com=com or one.com, rows=rows or one.rows)

    return changed


def planned_in_windows(
    route: Route,
    length: int,
    kept: int,
    iterations: int,
    progress: Progress | None = None,
    *,
    partial: bool = False,
) -> tuple[FloatArray, list[Solution[RouteProblem]]]:
    """Poses at all knots ``(K, 9)``, planned in windows that move along, and all solutions.

    Args:
        route: what is walked.
        length, kept: steps of a window, and how many of them are kept.
        iterations: most Newton steps of each solution.
        progress: called with (steps done, steps in all) before every window but the first.
        partial: take what was found even where a window did not converge, as a first guess.

    Raises:
        RouteError: a window did not converge.
    """
    count, each = len(route.steps.legs), route.settings.stance_knots + route.settings.swing_knots
    poses = np.zeros((count * each + 1, 9))
    solutions: list[Solution[RouteProblem]] = []
    first, here = 0, None
    while first < count:
        if first and progress is not None:
            progress(first, count)
        last = min(first + length, count)
        problem = problem_of(route, first, last)
        if here is not None:
            problem = problem.with_start(here)
        # A first guess need not hold between knots.
        knots = None if partial else knots_of(route, first, last)
        solutions += _solved(route, problem, knots, None, iterations)
        solution = solutions[-1]
        if not solution.solved and not partial:
            raise failed(route, solution, first)
        found = problem.unpack(solution.x)[0]
        step = last - first if last == count else kept
        poses[first * each : (first + step) * each + 1] = found[: step * each + 1]
        here, first = found[step * each], first + step
    return poses, solutions
