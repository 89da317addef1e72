"""The COG targets: where the body centre goes before each swing ([Wang2020], Section III)."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from gaitopt.conventions import LEGS, FloatArray, Progress, frozen, made, rotation_z
from gaitopt.errors import InfeasibleStepError, SolverError
from gaitopt.gait.crawl import WANG_SEQUENCE
from gaitopt.optimize.cog.solver import (
    CogProblem,
    CogSolution,
    CogWorkspace,
    build_cog_problems,
    solve_cog,
)
from gaitopt.plan.settings.crawl import CrawlSettings
from gaitopt.planners.phase_by_phase.demands import ROUNDING, Demands
from gaitopt.planners.phase_by_phase.diagnosis import explain_start, explain_step, not_held
from gaitopt.planners.phase_by_phase.steps import CrawlSteps, check_stance, crawl_steps
from gaitopt.robots.quadruped import Quadruped
from gaitopt.terrain.footholds import Footholds

MOST_ROUNDS = 12
"""Most rounds in which targets for the true centre of mass are found. Walks of the robots that
example-robot-data has took at most four."""
FORCE_ROUNDS = 6
"""Rounds after which forces hold the robot, or there is no place for it. Where walks with weak
joints were found, the last round in which they did not was the third."""
SHIFT_ROUNDS = 4
"""Rounds in which the shifts at the largest margin are looked for. They change by at most a third
of what the body moves, as legs have less than a third of the mass of the robots that were tried."""


def start_for_any_order(
    robot: Quadruped, footholds: Footholds, settings: CrawlSettings
) -> FloatArray:
    """Body centre at the start of a walk whose order of legs is not known yet ``(3,)`` [m].

    It is in the heading frame.

    Raises:
        InputError: legs cross in the first stance.
        InfeasibleStepError: the legs do not reach the first footholds.
    """
    # The start does not depend on the order: any will do.
    order = tuple(leg for leg in LEGS for _ in range(footholds.counts[leg] - 1))
    steps = crawl_steps(footholds, replace(settings, sequence=order or WANG_SEQUENCE))
    check_stance(steps)
    return start_place(robot, steps, settings)


def optimise_cogs(
    robot: Quadruped,
    steps: CrawlSteps,
    settings: CrawlSettings,
    start: FloatArray,
    progress: Progress | None = None,
) -> list[CogSolution]:
    """The COG target of every step, each beginning at the target of the step before.

    Where the settings say so, the true centre of mass keeps the margin, and not the body centre.
    With forces it is also where they hold the robot.

    Args:
        robot, steps, settings: the walk.
        start: body centre at the start ``(3,)`` [m], in the heading frame.
        progress: called with (steps done, steps in all).

    Raises:
        InfeasibleStepError: no place of the body centre allows a step.
        SolverError: there is one, and the solver did not find it to its tolerance.
    """
    demands = Demands.at_first(robot, steps, settings, start)
    for done in range(1, MOST_ROUNDS + 1):
        solutions, demands = _optimise(robot, steps, settings, start, demands, progress)
        if demands is None:
            return solutions
        cogs = np.column_stack([np.array([s.position for s in solutions]), steps.heights])
        demands = demands.raised(robot, steps, settings, cogs)
        if demands is None:
            return solutions
        if demands.not_held and done >= FORCE_ROUNDS:
            raise not_held(steps, settings, demands.not_held[0])
    raise SolverError(
        f"the true centre of mass keeps no margin after {MOST_ROUNDS} rounds: its distance from "
        "the body centre depends too much on where the body is; take com='body'"
    )


def _optimise(
    robot: Quadruped,
    steps: CrawlSteps,
    settings: CrawlSettings,
    start: FloatArray,
    demands: Demands | None,
    progress: Progress | None,
) -> tuple[list[CogSolution], Demands | None]:
    """The targets, and the demands that they meet.

    Args:
        robot, steps, settings, start, progress: as in :func:`optimise_cogs`.
        demands: what is asked for, if anything. Those of a step that is impossible with them are
            replaced by weaker ones, found nearer to where they have to hold.
    """
    problems = step_problems(robot, steps, settings, settings.objective, demands)
    workspace = CogWorkspace()
    solutions = []
    place = start[:2]
    for s, problem in enumerate(problems):
        if steps.wanted is not None:
            place = steps.wanted[s + 1]
        solution = solve_cog(problem.starting_at(place), workspace)
        if demands is not None and not _is_possible(solution, settings):
            step = steps.part(s, s + 1)
            for weaker in _weaker(robot, step, settings, demands.of_step(s)):
                demands = demands.with_step(s, weaker)
                (problem,) = step_problems(robot, step, settings, settings.objective, weaker)
                solution = solve_cog(problem.starting_at(place), workspace)
                if _is_possible(solution, settings):
                    break
        if not _is_possible(solution, settings):
            own = None if demands is None else demands.of_step(s)
            raise explain_step(robot, steps, settings, s, place, own)
        if solution.distance == 0.0:
            # Its place comes from differences; so nothing moves, not even by rounding.
            solution = made(CogSolution, **{**vars(solution), "position": frozen(place)})
        solutions.append(solution)
        place = solution.position
        if progress is not None:
            progress(s + 1, len(problems))
    return solutions, demands


def _weaker(
    robot: Quadruped, step: CrawlSteps, settings: CrawlSettings, demands: Demands
) -> Iterator[Demands]:
    """Demands of a single step with which it may be possible, one after the other.

    They were found for another place of the body, and may be too large here. So they are found at
    the largest margin. Less room for the forces comes first.
    """
    less = demands.with_less_room()
    while less is not None:
        demands = less
        yield demands
        less = demands.with_less_room()
    yield _at_largest_margin(robot, step, settings, demands)


def _is_possible(solution: CogSolution, settings: CrawlSettings) -> bool:
    """Whether a solution is one, with the margin that is asked for."""
    return solution.solved and solution.margin >= settings.stability_margin - ROUNDING


def _at_largest_margin(
    robot: Quadruped, step: CrawlSteps, settings: CrawlSettings, demands: Demands
) -> Demands:
    """What a single step needs where its margin is largest.

    Args:
        robot, settings: of the walk.
        step: the step alone.
        demands: a first guess.
    """
    for _ in range(SHIFT_ROUNDS):
        (problem,) = step_problems(robot, step, settings, "margin", demands)
        best = solve_cog(problem)
        if not best.solved:
            (problem,) = step_problems(robot, step, settings, "margin", demands.without_regions())
            best = solve_cog(problem)
        if not best.solved:
            break
        cogs = np.append(best.position, step.heights)[None]
        demands = demands.found_at(robot, step, settings, cogs)
    return demands


def step_problems(
    robot: Quadruped,
    steps: CrawlSteps,
    settings: CrawlSettings,
    objective: str,
    demands: Demands | None = None,
) -> list[CogProblem]:
    """The COG problems of all steps, each beginning in the middle of its feet.

    ``objective`` is ``"distance"``, ``"margin"`` or ``"reach"``, as in :mod:`gaitopt.optimize.cog`.
    """
    if not steps.legs:
        return []
    return build_cog_problems(
        robot, steps.feet, steps.heights, steps.legs, steps.targets,
        stability_margin=settings.stability_margin, reach_fraction=settings.reach_fraction,
        objective=objective,  # type: ignore[arg-type]
        shifts=None if demands is None else demands.shifts,
        further=None if demands is None else demands.half_planes,
        turns=steps.swing_turns,
    )  # fmt: skip


def start_place(robot: Quadruped, steps: CrawlSteps, settings: CrawlSettings) -> FloatArray:
    """Body centre at the start ``(3,)`` [m], in the heading frame.

    It is ``settings.cog_start``, or else the place nearest to where the footholds say, or to the
    middle of the feet, from which all legs reach them.

    Raises:
        InfeasibleStepError: the legs do not reach the first footholds from there.
    """
    cog_start = settings.cog_start
    wanted = steps.feet[0, :, :2].mean(axis=0) if steps.wanted is None else steps.wanted[0]
    if cog_start is not None:
        wanted = np.array(cog_start) @ rotation_z(settings.heading)[:2, :2]
    (problem,) = build_cog_problems(
        robot, steps.feet[:1], np.array([steps.start_height]), [None], None,
        stability_margin=0.0, reach_fraction=settings.reach_fraction, objective="distance",
        turns=None if steps.turns is None else steps.turns[:1],
    )  # fmt: skip
    problem = problem.starting_at(wanted)
    if cog_start is not None and problem.constraint_values(wanted).min() < -ROUNDING:
        worst = int(problem.constraint_values(wanted).argmin())
        raise InfeasibleStepError(
            f"the body cannot start at {list(cog_start)}: {problem.names[worst]} is exceeded; "
            "leave cog_start out to start as near to the middle of the feet as the legs reach",
            step=-1, leg=LEGS[worst], conflicts=(problem.names[worst],),
            reach_fraction=settings.reach_fraction,
        )  # fmt: skip
    solution = solve_cog(problem)
    if not solution.solved:
        raise explain_start(robot, steps, settings, wanted)
    return np.append(solution.position, steps.start_height)
