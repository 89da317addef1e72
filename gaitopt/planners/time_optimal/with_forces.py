"""Time-optimal walks whose timing forces set: which kind of walk is planned, and which is taken."""

from __future__ import annotations

from dataclasses import replace
from time import process_time

import numpy as np

from gaitopt.conventions import GRAVITY, Progress
from gaitopt.errors import InfeasibleStepError, SolverError
from gaitopt.optimize.route.layout import TIME_UNIT_ROTATION
from gaitopt.plan.plan import Plan
from gaitopt.plan.record import RouteRecord
from gaitopt.plan.settings.base import FORCES
from gaitopt.planners.phase_by_phase.planner import ROUNDING, plan_in_order
from gaitopt.planners.time_optimal.continuous.planner import continuous_plan
from gaitopt.planners.time_optimal.smooth.build import FORCE_TIME_SHARE
from gaitopt.planners.time_optimal.smooth.planner import smooth_plan
from gaitopt.planners.time_optimal.straight.planner import straight_plan
from gaitopt.planners.time_optimal.walk import Route, crawl_settings
from gaitopt.retiming.retimed import retimed
from gaitopt.robots.quadruped import Quadruped


def plan_with_forces(route: Route, progress: Progress | None = None) -> Plan:
    """Plan a walk as fast as contact forces allow.

    With a free swing curve there are two ways. Where joints are quick, forces set the pace: the
    body goes where it keeps balance with the least accelerations, and moves on while feet fly. The
    walk phase by phase is planned only where no such walk is found: it took 1.2 to 2.7 times as
    long on ten robots. Where joints are slow they set the pace, and the walk is optimised along
    splines within their limits. With box swings it is optimised without forces. In these two cases
    the walk phase by phase is planned as well, and taken where it is faster.

    Args:
        route: the walk.
        progress: called with (steps done, steps in all) before every window but the first.

    Raises:
        InfeasibleStepError: no walk phase by phase is possible with forces.
    """
    free = route.settings.free
    continuous = free.swing and has_quick_joints(route.robot) and route.settings.horizon is None
    boxes = None if continuous else _phase_by_phase(route)
    try:
        if continuous:
            found = continuous_plan(route)
        elif free.swing:
            found = retimed(smooth_plan(route, progress))
        else:
            found = retimed(straight_plan(route, progress), rounding=ROUNDING)
    except (InfeasibleStepError, SolverError) as error:
        reason = f"no other walk was found: {str(error).split(';')[0]}"
        return _with_reason(boxes or _phase_by_phase(route), reason)
    if boxes is None or found.duration <= boxes.duration:
        return found
    return _with_reason(boxes, "the walk phase by phase is faster than the other that was found")


def has_quick_joints(robot: Quadruped) -> bool:
    """Whether forces, and not joints, set the pace of a robot's walks.

    So it is where the slowest joint turns by :data:`TIME_UNIT_ROTATION` in less than a share of the
    time in which a pendulum as long as a leg turns by one radian.
    """
    legs = robot.legs.values()
    slowest = min(float(leg.velocity_limits.min()) for leg in legs)
    reach = max(leg.upper + leg.lower for leg in legs)
    quick = TIME_UNIT_ROTATION / slowest < FORCE_TIME_SHARE * float(np.sqrt(reach / GRAVITY))
    return bool(quick)


def _phase_by_phase(route: Route) -> Plan:
    """The walk phase by phase, timed by forces, as a plan of the route's settings."""
    began, settings = process_time(), route.settings
    crawl = replace(crawl_settings(settings), timing=FORCES, forces=settings.forces)
    rounding = ROUNDING
    if settings.free.swing:
        # A rounded box goes straight up until its rounding begins: as high as the clearance.
        clearance = settings.clearance + settings.clearance_reserve
        top = max(crawl.swing_height, clearance)
        crawl, rounding = replace(crawl, swing_height=top), min(ROUNDING, 1.0 - clearance / top)
    plan = plan_in_order(route.robot, route.footholds, crawl, rounding=rounding)
    if settings.acceleration_limit is not None:
        plan = retimed(replace(plan, settings=settings))
    record = RouteRecord(stability=plan.record.stability, solver_seconds=process_time() - began)
    # The body rests while a foot flies, so the walk is static whatever was free.
    static = replace(settings, free=replace(settings.free, dynamic=False))
    return replace(plan, settings=static, record=record)


def _with_reason(plan: Plan, reason: str) -> Plan:
    """The walk phase by phase, with the reason why it is taken in its record."""
    assert isinstance(plan.record, RouteRecord)
    return replace(plan, record=replace(plan.record, instead=reason))
