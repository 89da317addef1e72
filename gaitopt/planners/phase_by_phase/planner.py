"""The walk planned phase by phase, in a given order of legs."""

from __future__ import annotations

from numpy.typing import ArrayLike

from gaitopt.conventions import Progress
from gaitopt.plan.plan import Plan
from gaitopt.plan.settings.crawl import CrawlSettings
from gaitopt.planners.phase_by_phase.diagnosis import check_heights
from gaitopt.planners.phase_by_phase.steps import check_stance, crawl_steps
from gaitopt.planners.phase_by_phase.targets import optimise_cogs, start_place
from gaitopt.planners.phase_by_phase.timing import assemble_plan
from gaitopt.robots.quadruped import Quadruped
from gaitopt.terrain.footholds import Footholds


def plan_in_order(
    robot: Quadruped,
    footholds: Footholds,
    settings: CrawlSettings,
    cog_start: ArrayLike | None = None,
    progress: Progress | None = None,
) -> Plan:
    """The crawl with the settings' sequence; arguments and errors of :func:`plan_crawl`."""
    steps = crawl_steps(footholds, settings)
    check_stance(steps)
    check_heights(robot, steps, settings)
    start = start_place(robot, steps, settings, cog_start)
    solutions = optimise_cogs(robot, steps, settings, start, progress)
    return assemble_plan(robot, footholds, settings, steps, start, solutions)
