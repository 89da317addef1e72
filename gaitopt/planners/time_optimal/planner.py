"""``plan_route``: the fastest statically stable walk, all steps in one optimisation.

Footholds, order of legs, stability margin and joint limits are those of the walk that is planned
phase by phase ([Wang2020]). What may be chosen beyond the targets of the body centre is a setting.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np

from gaitopt.conventions import LEGS, Progress
from gaitopt.entering.ending import ended
from gaitopt.entering.walking import plan_from_state, walk_from_near
from gaitopt.errors import GaitoptError, InfeasibleStepError, SolverError
from gaitopt.gait.crawl import CRAWL_SEQUENCES, FREE_ORDER, WANG_SEQUENCE
from gaitopt.optimize.route.legs import check_square_legs
from gaitopt.plan.com_margin import com_margin
from gaitopt.plan.limbs_in_columns import limb_in_column
from gaitopt.plan.plan import Plan
from gaitopt.plan.record import RouteRecord
from gaitopt.plan.settings.crawl import CrawlSettings
from gaitopt.plan.settings.keywords import chosen_settings, takes_settings
from gaitopt.plan.settings.time_optimal import RouteSettings
from gaitopt.plan.state import State
from gaitopt.planners.free_order.search import find_order
from gaitopt.planners.phase_by_phase.beside_columns import warn_beside_columns
from gaitopt.planners.phase_by_phase.fitting_height import (
    FittingPlan,
    fitting_plan,
    higher_than,
    plan_touches,
    warn_of_touch,
    with_fitting_height,
)
from gaitopt.planners.phase_by_phase.planner import plan_in_order, with_first_posture
from gaitopt.planners.phase_by_phase.steps import check_roll, check_walk
from gaitopt.planners.time_optimal.smooth.planner import smooth_plan
from gaitopt.planners.time_optimal.straight.planner import straight_plan
from gaitopt.planners.time_optimal.walk import Route, crawl_settings, prepare_route
from gaitopt.planners.time_optimal.with_forces import plan_with_forces
from gaitopt.robots.quadruped import Quadruped
from gaitopt.terrain.footholds import Footholds

LEAST_STANCE = 0.01
"""Shortest time between two swings of a foot in which it is to stand [s]. In physics feet of a1 and
go2 that had 3.6 and 6.5 ms, less than an interval of the controller, did not come down."""


@takes_settings(RouteSettings)
def plan_route(
    robot: Quadruped,
    footholds: Footholds,
    settings: RouteSettings | None = None,
    *,
    progress: Progress | None = None,
    start: State | None = None,
    end: State | None = None,
    **options: Any,
) -> Plan:
    """Plan the fastest statically stable walk over given footholds, all steps at once.

    Args:
        robot: from :func:`gaitopt.load_robot`; its legs need a roll joint.
        footholds: where the feet go; the first of each leg is where it stands at the start. Their
            ``order`` holds where no ``sequence`` is asked for; their ``swing_heights`` hold in
            place of ``swing_height``, and their ``postures`` in place of ``body_height``,
            ``follow_terrain`` and ``heading``. Where the body's posture is free, it stays within
            20 degrees of them.
        settings: all settings as one object. By default they fit the robot: margins and heights
            are to its size, and of a few body heights the first is taken at which the walk is
            possible phase by phase, and limbs are clear of columns. With the timing ``"velocity"``
            the body's centre keeps the margin (``com="body"``) unless the true centre of mass would
            leave the support polygon: then that keeps it (``com="model"``), and the plan's settings
            say so.
        progress: called with (done, in all), from (0, all) on: of steps, which are done window by
            window or all at once; with the sequence ``"free"`` of orders.
        start: the state in which the plan begins, as in :func:`gaitopt.plan_crawl`.
        end: the state in which it ends, as there.
        options: single settings by name: the fields of :class:`gaitopt.RouteSettings`.

    Returns:
        The plan. Its record holds the solver's residuals, worked out anew at the end.

    Raises:
        InputError: a setting is unknown or out of range, or the robot's legs cannot move sideways,
            or are not roll-pitch-pitch.
        InfeasibleStepError: a step is impossible even for the walk that is planned phase by phase.
        InfeasibleStateError: no plan begins in ``start``, or ends in ``end``; tells which limit is
            in the way.
        RouteError: no convergence; holds the walk planned phase by phase, and the solver's report.
        SolverError: standing feet cannot be kept on their footholds between knots.

    Warns:
        FootholdsWarning: legs touch, as they do at every body height that was tried; or, over
            columns, as for :func:`gaitopt.plan_crawl`.
    """
    if end is not None:
        plan = plan_route(robot, footholds, settings, progress=progress, start=start, **options)
        return ended(plan, end)
    check_walk("plan_route", robot, footholds)
    check_roll("plan_route", robot)
    robot.require_velocity_limits()
    check_square_legs(robot)
    open_height = settings is None and options.get("body_height") is None
    chosen = chosen_settings(RouteSettings, robot, settings, options)
    chosen = chosen.with_order_of(footholds, options.get("sequence") is not None)
    if footholds.postures is not None:
        chosen = with_first_posture(chosen, footholds)
        open_height = False
    if start is not None:
        return _from_state(robot, footholds, start, chosen, open_height, progress)
    asked = crawl_settings(chosen)
    fitting = _at_fitting_height(robot, footholds, asked) if open_height else None
    if fitting is not None:
        chosen = replace(chosen, body_height=fitting.plan.settings.body_height)
    plan = _planned(robot, footholds, chosen, progress, fitting.plan if fitting else None)
    own_com = settings is None and options.get("com") is None and chosen.com == "body"
    if own_com and not chosen.free.dynamic and _tips_over(plan):
        # On some robots (hyq) the true centre of mass is too far from the body's centre.
        chosen = replace(chosen, com="model")
        plan = _planned(robot, footholds, chosen, progress)
    if open_height:
        plan = _clear_of_columns(plan, chosen, asked.body_height, progress)
    if fitting is not None and fitting.touches and plan_touches(plan):
        warn_of_touch(plan, asked)
    warn_beside_columns(plan)
    return plan


def _clear_of_columns(
    plan: Plan, settings: RouteSettings, own: float, progress: Progress | None
) -> Plan:
    """The plan, or one at a greater body height, where only there limbs are clear of columns.

    Args:
        plan: with these settings.
        settings: of the walk.
        own: body height from which those to try follow [m].
        progress: as for :func:`plan_route`.
    """
    if limb_in_column(plan) is None:
        return plan
    for height in higher_than(settings.body_height, own):
        higher = replace(settings, body_height=height)
        with suppress(GaitoptError):
            other = _planned(plan.robot, plan.footholds, higher, progress)
            if limb_in_column(other) is None and not plan_touches(other):
                return other
    return plan


def _at_fitting_height(
    robot: Quadruped, footholds: Footholds, settings: CrawlSettings
) -> FittingPlan | None:
    """The walk phase by phase at the first body height that fits; ``None`` where none does."""
    try:
        return fitting_plan(robot, footholds, settings)
    except InfeasibleStepError:
        return None


def _planned(
    robot: Quadruped, footholds: Footholds, settings: RouteSettings, progress: Progress | None,
    crawl: Plan | None = None,
) -> Plan:  # fmt: skip
    """The plan with these settings; ``crawl`` is the walk phase by phase, where it is known."""
    if settings.sequence == FREE_ORDER:
        return _fastest_order(robot, footholds, settings, progress)
    return _plan_in_order(robot, footholds, settings, progress, crawl)


def _tips_over(plan: Plan) -> bool:
    """Whether the true centre of mass leaves the feet's support polygon."""
    return plan.robot.mass > 0.0 and bool((com_margin(plan)[1] < 0.0).any())


def _plan_in_order(
    robot: Quadruped, footholds: Footholds, settings: RouteSettings, progress: Progress | None,
    crawl: Plan | None = None,
) -> Plan:  # fmt: skip
    """The plan with the settings' order of legs."""
    route = prepare_route(robot, footholds, settings, crawl)
    if not route.count:
        # The body stands where it starts.
        path = plan_in_order(robot, footholds, crawl_settings(settings)).path
        return Plan(robot, footholds, settings, (), path, RouteRecord())
    if progress is not None:
        progress(0, route.count)
    plan = _plan_steps(route, progress)
    if progress is not None:
        progress(route.count, route.count)
    return plan


def _plan_steps(route: Route, progress: Progress | None) -> Plan:
    """The plan of a walk that has steps.

    With bounded accelerations a foot that flies along a box has to stop at its corners: such walks
    are straight ones, too.
    """
    settings = route.settings
    if settings.forces is not None:
        return plan_with_forces(route, progress)
    kind = smooth_plan if settings.smooth and settings.free.swing else straight_plan
    return kind(route, progress)


def _fastest_order(
    robot: Quadruped, footholds: Footholds, settings: RouteSettings, progress: Progress | None
) -> Plan:
    """The fastest of the plans with each of the six cycles, and with the order that is searched.

    Orders in which legs touch only count where they touch in all orders. So do those in which a
    foot hardly stands between two swings of a walk that does not stop.

    Raises:
        InfeasibleStepError, SolverError: of the first order, when none is feasible.
    """
    plans: list[Plan] = []
    errors: list[GaitoptError] = []
    orders = _orders(robot, footholds, settings)
    for done, order in enumerate(orders):
        if progress is not None:
            progress(done, len(orders))
        try:
            plans.append(_plan_in_order(robot, footholds, replace(settings, sequence=order), None))
        except (InfeasibleStepError, SolverError) as error:
            errors.append(error)
    if progress is not None:
        progress(len(orders), len(orders))
    if not plans:
        raise errors[0]
    best = min(plans, key=lambda plan: (plan_touches(plan), hardly_stands(plan), plan.duration))
    assert isinstance(best.record, RouteRecord)
    return replace(best, record=replace(best.record, orders_feasible=len(plans)))


def hardly_stands(plan: Plan) -> bool:
    """Whether a foot stands for less than :data:`LEAST_STANCE` in a walk that does not stop."""
    settings, record = plan.settings, plan.record
    assert isinstance(settings, RouteSettings) and isinstance(record, RouteRecord)
    if settings.forces is None or not settings.free.swing or record.instead is not None:
        return False
    stood = [after.start - before.end for leg in LEGS
             for before, after in pairwise(s for s in plan.swings if s.leg == leg)]  # fmt: skip
    return bool(min(stood, default=np.inf) < LEAST_STANCE)


def _orders(
    robot: Quadruped, footholds: Footholds, settings: RouteSettings
) -> list[tuple[str, ...]]:
    """The orders to try; the last is the fastest one phase by phase, where there is any.

    Before it come the six cycles of legs, that of [Wang2020] first; or where legs step unequally
    often, the order of the footholds.
    """
    orders = [WANG_SEQUENCE, *(order for order in CRAWL_SEQUENCES if order != WANG_SEQUENCE)]
    if footholds.order and len(set(footholds.counts.values())) > 1:
        orders = [footholds.order]
    found = find_order(robot, footholds, crawl_settings(settings))
    return [*orders, found.legs] if found.complete and found.legs else orders


def _from_state(
    robot: Quadruped, footholds: Footholds, start: State, chosen: RouteSettings,
    open_height: bool, progress: Progress | None,
) -> Plan:  # fmt: skip
    """The walk that begins in a state.

    Args:
        robot, footholds, start, progress: as for :func:`plan_route`.
        chosen: the settings.
        open_height: whether the body height that fits is looked for.
    """

    def walk(over: Footholds, asked: RouteSettings) -> Plan:
        if open_height:
            fitting = with_fitting_height(robot, over, crawl_settings(asked))
            asked = replace(asked, body_height=fitting.body_height)
        return plan_route(robot, over, asked, progress=progress)

    return plan_from_state(robot, footholds, start, chosen, walk_from_near(walk, chosen))
