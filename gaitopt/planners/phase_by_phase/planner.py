"""The walk planned phase by phase, in a given order of legs ([Wang2020]).

Planned in a frame that is turned to the walk's heading.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from gaitopt.conventions import Progress
from gaitopt.errors import InfeasibleStepError
from gaitopt.plan.plan import Plan
from gaitopt.plan.settings.crawl import CrawlSettings
from gaitopt.planners.phase_by_phase.diagnosis import check_heights
from gaitopt.planners.phase_by_phase.steps import check_stance, crawl_steps
from gaitopt.planners.phase_by_phase.targets import optimise_cogs, start_place
from gaitopt.planners.phase_by_phase.timing import assemble_plan
from gaitopt.robots.quadruped import Quadruped
from gaitopt.terrain.footholds import Footholds

HEIGHTS = (14, 15, 16, 17, 13, 12, 11)
"""Body heights that are tried, in fourteenths of the standing height, which is 0.7 of the reach:
up to 0.85 of the reach first, since high legs need less of their joints' ranges, then lower ones.
"""


def plan_in_order(
    robot: Quadruped,
    footholds: Footholds,
    settings: CrawlSettings,
    *,
    progress: Progress | None = None,
) -> Plan:
    """The walk with the settings' order of legs; errors as for :func:`gaitopt.plan_crawl`."""
    settings = replace(settings, sequence=settings.order)
    steps = crawl_steps(footholds, settings)
    check_stance(steps)
    check_heights(robot, steps, settings)
    start = start_place(robot, steps, settings)
    solutions = optimise_cogs(robot, steps, settings, start, progress)
    return assemble_plan(robot, footholds, settings, steps, start, solutions)


def plan_at_fitting_height(
    robot: Quadruped,
    footholds: Footholds,
    settings: CrawlSettings,
    *,
    progress: Progress | None = None,
) -> Plan:
    """The walk at the first of a few body heights at which it is possible.

    Raises:
        InfeasibleStepError: it is possible at none of them; that of the settings' own height.
    """
    first: InfeasibleStepError | None = None
    for height in _heights(settings.body_height):
        try:
            return plan_in_order(
                robot, footholds, replace(settings, body_height=height), progress=progress
            )
        except InfeasibleStepError as error:
            first = first or error
    assert first is not None
    raise first


def with_fitting_height(
    robot: Quadruped, footholds: Footholds, settings: CrawlSettings
) -> CrawlSettings:
    """The settings with the body height of :func:`plan_at_fitting_height`; unchanged if none is."""
    try:
        plan = plan_at_fitting_height(robot, footholds, settings)
    except InfeasibleStepError:
        return settings
    return replace(settings, body_height=plan.settings.body_height)


def _heights(standing: float) -> Iterator[float]:
    """The heights to try, in whole centimetres but for the first [m]."""
    for share in HEIGHTS:
        yield (
            standing if share == HEIGHTS[0] else max(round(standing * share / HEIGHTS[0], 2), 0.01)
        )
