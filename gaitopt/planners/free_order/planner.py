"""Plans in the order of legs that was found."""

from __future__ import annotations

from dataclasses import replace

from gaitopt.conventions import Progress
from gaitopt.errors import InfeasibleStepError
from gaitopt.plan.plan import Plan
from gaitopt.plan.record import CrawlRecord
from gaitopt.plan.settings.crawl import CrawlSettings
from gaitopt.planners.free_order.search import find_order
from gaitopt.planners.phase_by_phase.planner import plan_in_order
from gaitopt.robots.collision_shapes import path_touches
from gaitopt.robots.quadruped import Quadruped
from gaitopt.terrain.footholds import Footholds


def plan_free_crawl(
    robot: Quadruped,
    footholds: Footholds,
    settings: CrawlSettings,
    *,
    progress: Progress | None = None,
) -> Plan:
    """The crawl in the order that was found, or in the settings' own where that one is faster.

    A fixed order on which legs touch gives way to one on which they do not, however fast it is.

    Args:
        robot, footholds, settings: as for :func:`gaitopt.plan_crawl`.
        progress: called with (steps done, steps in all).

    Returns:
        A plan whose settings' sequence names all of its steps. The record's
        ``free_order_gain`` is ``None`` where the settings' own order is not possible, or faster.

    Raises:
        InfeasibleStepError: no order is possible; that of the settings' own order, with how far
            any other gets.
    """
    fixed, error = None, None
    try:
        fixed = plan_in_order(robot, footholds, settings)
    except InfeasibleStepError as caught:
        error = caught
    order = find_order(robot, footholds, settings, progress=progress)
    found = None
    if order.complete and order.legs:
        try:
            sequenced = replace(settings, sequence=order.legs)
            found = plan_in_order(robot, footholds, sequenced)
        except InfeasibleStepError as caught:
            error = error or caught
    if found is None and fixed is None:
        assert error is not None
        raise replace(
            error, message=f"{error}; no other order gets beyond step {len(order.legs)} of "
            f"{footholds.steps} ({order.states} ways were looked at)",
        )  # fmt: skip
    if found is None:
        assert fixed is not None
        return fixed
    if fixed is None:
        return found
    touches = [plan_touches(plan) for plan in (found, fixed)]
    if touches[0] != touches[1]:
        return fixed if touches[0] else found
    if fixed.duration <= found.duration:
        return fixed
    gain = 1.0 - found.duration / fixed.duration
    record = found.record
    assert isinstance(record, CrawlRecord)
    return replace(found, record=replace(record, free_order_gain=gain))


def plan_touches(plan: Plan) -> bool:
    """Whether legs or trunk touch at any knot of a plan's path."""
    return path_touches(plan.robot, plan.path.coefficients[-1][:, 6:])
