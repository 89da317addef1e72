"""The walk over the footholds of a search, and what becomes of the search where it is refused."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Mapping
from typing import Any

from gaitopt.conventions import Progress
from gaitopt.errors import InfeasibleStepError, RouteError, SolverError
from gaitopt.plan.plan import Plan
from gaitopt.plan.rolled_feet import first_rolling_step
from gaitopt.planners.crawl import plan_crawl
from gaitopt.planners.over_terrain.failure import no_plan, no_way
from gaitopt.planners.over_terrain.links.limbs import Limbs
from gaitopt.planners.over_terrain.links.plan_clearance import first_touching_step
from gaitopt.planners.over_terrain.links.rolling import PLANNED
from gaitopt.planners.over_terrain.result import TerrainSearch
from gaitopt.planners.over_terrain.search import Search
from gaitopt.planners.over_terrain.setup import first_layer, result_of
from gaitopt.robots.quadruped import Quadruped

BEFORE = 4
"""Steps before one that was refused from which the search goes on: a foot is where the last cycle
put it. Where the same step is refused again it goes on from as many steps before that."""
MOST_PLANS = 12
"""Most walks that are planned over the ways of one search. Chosen: three were needed at most on the
maps that were tried."""


def walk_over(
    searching: Search, search: TerrainSearch, options: Mapping[str, Any],
    progress: Progress | None, end: float,
) -> Plan:  # fmt: skip
    """The walk over the footholds that were found, or over others where it is refused.

    Args:
        searching: the search.
        search: what it found, which reaches the goal.
        options: of :func:`gaitopt.plan_crawl`.
        progress: called with (steps found, steps in all) while the search goes on, and with (steps
            done, steps in all) while a walk is planned.
        end: processor time from which on no other way is looked for, by ``time.thread_time`` [s].

    Raises:
        TerrainError: all walks that were tried are refused.
    """
    robot, begin = searching.judge.robot, time.perf_counter()
    detail, layers, plans, again = "", [first_layer(searching)], 0, Counter[int]()
    while True:
        plan, refused, detail = _planned(robot, search, searching.limbs, options, progress)
        if plan is not None:
            return plan
        plans += 1
        late = time.thread_time() > end
        if refused < 0 or plans == MOST_PLANS or late:
            raise no_plan(search, refused, detail, plans, late)
        again[refused] += 1
        searching = searching.without(search, refused)
        kept = layers[: max(refused + 1 - BEFORE * again[refused], 1)]
        found = searching.run(kept, progress, until=end)
        other, layers = result_of(searching, found, begin), list(found.layers)
        if other.late:
            # How far another search got in the time that was left says nothing about the ground.
            raise no_plan(search, refused, detail, plans, late=True)
        search = other
        if not search.complete:
            raise no_way(search, detail)


def _planned(
    robot: Quadruped, search: TerrainSearch, limbs: Limbs, options: Mapping[str, Any],
    progress: Progress | None,
) -> tuple[Plan | None, int, str]:  # fmt: skip
    """The walk over the footholds of a search; or ``None``, the step that is refused, and why.

    The step is -1 where the planner does not say which it is.
    """
    try:
        plan = plan_crawl(robot, search.footholds, progress=progress, **options)
    except (InfeasibleStepError, SolverError) as error:
        return None, _refused_step(error), f"the planner of the walk said: {error}"
    touching = first_touching_step(plan, limbs)
    if touching is not None:
        when = f"in step {touching} of" if touching >= 0 else "where it stands at the start of"
        words = f"{when} the walk that was planned a limb touches the ground or another link"
        return None, touching, words
    rolling = first_rolling_step(plan, PLANNED)
    if rolling is None:
        return plan, -1, ""
    step, leg, way = rolling
    words = (
        f"after step {step} of the walk that was planned the foot of {leg} rolls by "
        f"{1e3 * way:.1f} mm to either side of its place, and "
        f"{1e3 * PLANNED:.1f} mm are allowed"
    )
    return None, step, words


def _refused_step(error: InfeasibleStepError | SolverError) -> int:
    """The step that an error of the planner is about; -1 where it does not say."""
    if isinstance(error, RouteError):
        return error.steps[0] if error.steps else -1
    if isinstance(error, InfeasibleStepError):
        # What is wrong with the first stance is not there over another first step.
        return max(error.step, 0)
    return -1 if error.step is None else max(error.step, 0)
