"""Plans a crawl in the order of legs that a search finds."""

from __future__ import annotations

from dataclasses import replace

from gaitopt.conventions import Progress
from gaitopt.errors import InfeasibleStepError
from gaitopt.plan.plan import Plan
from gaitopt.plan.record import CrawlRecord
from gaitopt.plan.settings.crawl import CrawlSettings
from gaitopt.planners.free_order.search import find_order
from gaitopt.planners.phase_by_phase.fitting_height import (
    plan_touches,
    warn_of_touch,
    with_fitting_height,
)
from gaitopt.planners.phase_by_phase.planner import plan_in_order
from gaitopt.robots.quadruped import Quadruped
from gaitopt.terrain.footholds import Footholds


def plan_free_crawl(
    robot: Quadruped,
    footholds: Footholds,
    settings: CrawlSettings,
    *,
    progress: Progress | None = None,
) -> Plan:
    """The crawl in the order that a search finds, or in the settings' own where that is better.

    An order in which no legs touch is better than one in which some do; else the faster one is.

    Args:
        robot, footholds, settings: as for :func:`gaitopt.plan_crawl`.
        progress: called with (steps done, steps in all).

    Returns:
        A plan whose settings' sequence names all of its steps. The record's
        ``free_order_gain`` is ``None`` where the settings' own order is not possible, or better.

    Raises:
        InputError: legs cross in the first stance.
        InfeasibleStepError: no order is possible: the error of the settings' own order, which also
            tells how far any other order gets.
    """
    fixed = _plan_or_error(robot, footholds, settings)
    order = find_order(robot, footholds, settings, progress=progress)
    found: Plan | InfeasibleStepError | None = None
    if order.complete and order.legs:
        found = _plan_or_error(robot, footholds, replace(settings, sequence=order.legs))
    if isinstance(found, Plan):
        return found if isinstance(fixed, InfeasibleStepError) else _better(found, fixed)
    if isinstance(fixed, Plan):
        return fixed
    raise replace(
        fixed, message=f"{fixed}; no other order gets beyond step {len(order.legs)} of "
        f"{footholds.steps} (candidates looked at: {order.candidates})",
    )  # fmt: skip


def plan_free_at_fitting_height(
    robot: Quadruped,
    footholds: Footholds,
    settings: CrawlSettings,
    *,
    open_swing: bool = False,
    progress: Progress | None = None,
) -> Plan:
    """The same at the first body height at which the settings' own order is possible.

    Where legs touch in the order that was found, too, it is searched for again at a height at which
    they do not touch in the settings' own order.

    Arguments and errors are those of :func:`plan_free_crawl`.

    Warns:
        FootholdsWarning: legs touch in the plan.
    """
    first = with_fitting_height(robot, footholds, settings, may_touch=True, open_swing=open_swing)
    plan = plan_free_crawl(robot, footholds, first, progress=progress)
    if not plan_touches(plan):
        return plan
    other = with_fitting_height(robot, footholds, settings, open_swing=open_swing)
    if other != first:
        plan = plan_free_crawl(robot, footholds, other, progress=progress)
    if other == first or plan_touches(plan):
        warn_of_touch(plan, settings)
    return plan


def _plan_or_error(
    robot: Quadruped, footholds: Footholds, settings: CrawlSettings
) -> Plan | InfeasibleStepError:
    """The plan with the settings' order of legs, or why there is none."""
    try:
        return plan_in_order(robot, footholds, settings)
    except InfeasibleStepError as error:
        return error


def _better(found: Plan, fixed: Plan) -> Plan:
    """The better one of the plan with the order that was found and that with the fixed order."""
    found_touches, fixed_touches = plan_touches(found), plan_touches(fixed)
    if found_touches != fixed_touches:
        return fixed if found_touches else found
    if fixed.duration <= found.duration:
        return fixed
    assert isinstance(found.record, CrawlRecord)
    gain = 1.0 - found.duration / fixed.duration
    return replace(found, record=replace(found.record, free_order_gain=gain))
