"""How far a time-optimal walk is from the fastest: a lower bound on its time.

Cut the route into parts, and let every part begin with the body wherever and however it likes. Each
part of any walk over the whole route is then among those that are looked at, so the parts' least
times add up to at most the whole's. What the bound holds for is the planner's own problem: its
knots, between which everything moves straight, and its solver, which finds the least time of a part
among its neighbours.
"""

from __future__ import annotations

from dataclasses import fields, replace

import numpy as np

from gaitopt.conventions import FloatArray, rotation_z
from gaitopt.errors import InputError
from gaitopt.optimize.route_problem import RouteProblem
from gaitopt.optimize.route_solver import solve_route
from gaitopt.planning.crawl import CrawlSteps, crawl_steps, optimise_cogs
from gaitopt.planning.plan import Plan
from gaitopt.planning.route_knots import build_route
from gaitopt.planning.route_settings import RouteSettings
from gaitopt.planning.settings import CrawlSettings

PART = 16
"""Steps of a part: the longer, the nearer is the bound, and the less is it worth as evidence."""
_BODY = 6
_NEAR = 1e-3


def lower_bound(plan: Plan, part: int = PART) -> float:
    """A time that no walk over the same footholds, with as much freedom, stays below [s].

    Args:
        plan: from :func:`gaitopt.planning.route_crawl.plan_route`.
        part: steps of each part that is looked at by itself.

    Returns:
        The bound; ``nan`` for plans that are balanced by their ZMP, have acceleration limits, or
        come from another planner, and where a part did not converge.

    Raises:
        InputError: ``part`` is no positive whole number.
    """
    if isinstance(part, bool) or not isinstance(part, int) or part < 1:
        raise InputError(f"part must be a whole number of steps from 1, got {part!r}")
    settings = plan.settings
    if not isinstance(settings, RouteSettings):
        return float("nan")
    if not settings.static or settings.acceleration_limit is not None:
        return float("nan")
    steps, cogs = _way(plan, settings)
    if not steps.legs:
        return 0.0
    whole = _problem(plan, settings, steps, cogs)
    near = solve_route(whole, whole.start())
    poses = whole.unpack(near.x)[0] if near.status == "solved" else whole.poses
    each, total = settings.stance_knots + settings.swing_knots, 0.0
    for first in range(0, len(steps.legs), part):
        last = min(first + part, len(steps.legs))
        problem = _problem(plan, settings, _part(steps, first, last), cogs[first : last + 1])
        problem = problem if first == 0 else freed(problem)
        total += least_time(problem, poses[first * each : last * each + 1])
    return total


def _problem(
    plan: Plan, settings: RouteSettings, steps: CrawlSteps, cogs: FloatArray
) -> RouteProblem:
    """The planner's problem, with nothing but the time to be saved."""
    found = build_route(plan.robot, steps, settings, cogs, plan.footholds.radius)[1]
    return replace(found, evenness=0.0)


def freed(problem: RouteProblem) -> RouteProblem:
    """The same problem with a body that may begin wherever and however it likes."""
    columns = problem.columns[problem.columns < _BODY]
    unknown = np.where(problem.unknown >= 0, problem.unknown + len(columns), -1)
    unknown[0, columns] = np.arange(len(columns))
    return replace(problem, unknown=unknown)


def least_time(problem: RouteProblem, poses: FloatArray) -> float:
    """The least time that is found for a part, less what the answer may be above it [s].

    Args:
        problem: of the part.
        poses: a second start beside the problem's own ``(K, 9)``; of a good answer.
    """
    start = problem.pack(poses, 1.1 * problem.needed(poses) + 1e-3)
    answers = (solve_route(problem, problem.start()), solve_route(problem, start, barrier=_NEAR))
    found = [
        float(problem.needed(problem.unpack(a.x)[0]).sum()) - a.complementarity
        for a in answers if a.status == "solved"
    ]  # fmt: skip
    return min(found, default=float("nan"))


def _way(plan: Plan, settings: RouteSettings) -> tuple[CrawlSteps, FloatArray]:
    """Steps, and the body centre before and after each stance phase of the per-phase walk."""
    shared = {f.name for f in fields(RouteSettings)} & {f.name for f in fields(CrawlSettings)}
    paper = CrawlSettings(**{name: getattr(settings, name) for name in shared})
    steps = crawl_steps(plan.footholds, paper)
    if not steps.legs:
        return steps, np.zeros((1, 3))
    start = plan.phases[0].cog_start @ rotation_z(settings.heading)
    solutions = optimise_cogs(plan.robot, steps, paper, start)
    ends = [np.append(s.position, z) for s, z in zip(solutions, steps.heights, strict=True)]
    return steps, np.vstack([start, *ends])


def _part(steps: CrawlSteps, first: int, last: int) -> CrawlSteps:
    """The steps from ``first`` up to, not including, ``last``."""
    return CrawlSteps(
        steps.legs[first:last], steps.feet[first:last], steps.targets[first:last],
        steps.heights[first:last], steps.start_height,
    )  # fmt: skip
