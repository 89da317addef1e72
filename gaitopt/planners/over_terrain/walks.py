"""The walk over the footholds of a search, and what is tried where it is refused."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from gaitopt.conventions import Progress
from gaitopt.errors import InfeasibleStepError, RouteError, SolverError, TerrainError
from gaitopt.plan.plan import Plan
from gaitopt.plan.rolled_feet import first_rolling_step
from gaitopt.planners.crawl import plan_crawl
from gaitopt.planners.over_terrain.failure import also_tried, no_plan, no_way
from gaitopt.planners.over_terrain.links.limbs import Limbs
from gaitopt.planners.over_terrain.links.plan_clearance import first_touching_step
from gaitopt.planners.over_terrain.links.rolling import PLANNED
from gaitopt.planners.over_terrain.result import TerrainSearch
from gaitopt.planners.over_terrain.search import Search
from gaitopt.planners.over_terrain.settings import TerrainSettings
from gaitopt.planners.over_terrain.setup import along, first_layer, result_of, with_settings
from gaitopt.planners.over_terrain.ways.kinds import shorter_steps
from gaitopt.planners.over_terrain.ways.tries import Tries
from gaitopt.robots.quadruped import Quadruped

BEFORE = 4
"""Steps before one that was refused from which the search goes on: a foot is where the last cycle
put it. Where the same step is refused again it goes on from as many steps before that."""
MOST_PLANS = 12
"""Most walks that are planned over the ways of one search. Chosen: three were needed at most on the
maps that were tried."""
SHORTER_UNTIL, OTHERS_UNTIL = 1.5, 2.5
"""Times in which walks are planned, in times of ``longest_for_walks`` of :class:`TerrainSettings`:
one is for the way that was found and for what is found without a step of it, until the first of
these shorter steps are tried along the same course, and until the second other ways."""


@dataclass(frozen=True, eq=False)
class Walks:
    """Walks over the footholds of searches, planned until one of them is possible.

    Attributes:
        searching: the search along the course that was asked for.
        options: of :func:`gaitopt.plan_crawl`.
        asked: settings of the search by name that were given.
        progress: called with (steps found, steps in all) while the search goes on, and with (steps
            done, steps in all) while a walk is planned.
    """

    searching: Search
    options: Mapping[str, Any]
    asked: Mapping[str, Any]
    progress: Progress | None

    def first_of(self, search: TerrainSearch, further: Callable[[], Tries]) -> tuple[Plan, Search]:
        """The walk over what was found, else over shorter steps, else over what is found further.

        Args:
            search: what was found, which reaches the goal.
            further: gives the searches that go on after it, or begin anew; called where they are
                needed.

        Returns:
            The walk, and the search that its footholds are of.

        Raises:
            TerrainError: that of the first walk, with what else was tried.
        """
        begin = time.thread_time()
        longest = search.settings.longest_for_walks(search.course.length)
        try:
            return self._over(search, begin + longest)
        except TerrainError as error:
            # What is not about a step of this way is the same in all others.
            if error.step < 0:
                raise
            first = error
        lengths, until = [], begin + SHORTER_UNTIL * longest
        for shorter in self._shorter(search, until):
            lengths.append(shorter.settings.step_length)
            if shorter.complete:
                with suppress(TerrainError):
                    return self._over(shorter, until)
        end, others, tries = begin + OTHERS_UNTIL * longest, 0, further()
        while (other := tries.next_way(end)) is not None:
            # Those that begin anew find the first way once more.
            if np.array_equal(other.stands, search.stands):
                continue
            others += 1
            with suppress(TerrainError):
                return self._over(other, end)
        raise also_tried(first, lengths, others)

    def _over(self, search: TerrainSearch, until: float) -> tuple[Plan, Search]:
        """The walk over the footholds of a search, or others where it is refused; and the search.

        Raises:
            TerrainError: there is none, or none until this processor time [s].
        """
        # What was found may lead beside the course that was asked for.
        searching = along(replace(self.searching, fine=search.fine), search.course)
        searching = with_settings(searching, search.settings)
        return walk_over(searching, search, self.options, self.progress, until), searching

    def _shorter(self, search: TerrainSearch, until: float) -> Iterator[TerrainSearch]:
        """Searches with shorter steps along the course of one, where no length was asked for."""
        usual = TerrainSettings.for_robot(self.searching.judge.robot).step_length
        # Cycles that fit the treads of stairs fit one length of step.
        course = replace(search.course, marks=None)
        for length in shorter_steps(usual, search.settings, self.asked):
            if time.thread_time() > until:
                return
            settings = replace(search.settings, step_length=length)
            started = time.perf_counter()
            other = with_settings(along(self.searching, course), settings)
            other = replace(other, fine=search.fine)
            latest = time.thread_time() + settings.longest(search.course.length)
            found = other.run([first_layer(other)], self.progress, until=min(latest, until))
            yield result_of(other, found, started)


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
