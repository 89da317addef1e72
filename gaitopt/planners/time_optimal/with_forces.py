"""Time-optimal walks whose timing forces set: which kind of walk is planned, and which is taken."""

from __future__ import annotations

from dataclasses import replace
from time import process_time

import numpy as np

from gaitopt.conventions import LEGS, OTHER_LEGS, Progress
from gaitopt.errors import InfeasibleStepError, SolverError
from gaitopt.plan.plan import Plan
from gaitopt.plan.record import RouteRecord
from gaitopt.plan.settings.base import FORCES
from gaitopt.planners.phase_by_phase.planner import ROUNDING, plan_in_order
from gaitopt.planners.time_optimal.continuous.planner import continuous_plan
from gaitopt.planners.time_optimal.smooth.planner import smooth_plan
from gaitopt.planners.time_optimal.straight.planner import straight_plan
from gaitopt.planners.time_optimal.walk import Route, crawl_settings
from gaitopt.retiming.reserves import PLANNED_SHARE, tightened
from gaitopt.retiming.retimed import retimed
from gaitopt.robots.abilities import has_quick_joints
from gaitopt.stability.support import triangle_half_planes
from gaitopt.terrain.footholds import Footholds

ROOM_FOR_FORCES = 1.5
"""Factor of the distance from a support triangle's sides at which every foot bears the least normal
force at rest: what is left is for motion. Walks of wang2020 (2 and 3 columns) take 13.63 s with 6
mm, where every foot bears it at 5.3 mm, 13.41 s with 8, 13.94 s with 10 and 13.56 s with 14 mm.
Such a margin costs time where it is not needed: over 2 columns hyq takes 0.51 s and not 0.46 with
no margin (``swing``), and go2 with a reserve of 0.08 takes 0.62 s and not 0.51. So it is tried
second. With default settings nothing is raised (eleven robots)."""


def plan_with_forces(route: Route, progress: Progress | None = None) -> Plan:
    """Plan a walk as fast as contact forces allow.

    With a free swing curve there are two ways. Where joints are quick, forces set the pace: the
    body goes where it keeps balance with the least accelerations, and moves on while feet fly.
    Where joints are slow they set the pace, and the walk is optimised along splines within their
    limits. The walk phase by phase is planned only where no such walk is found: it took 1.2 to 2.7
    times as long on ten robots, and 1.8 times on wang2020. With box swings the walk is optimised
    without forces. With these, and in windows, the walk phase by phase is planned as well, and
    taken where it is faster.

    Args:
        route: the walk.
        progress: called with (steps done, steps in all) before every window but the first.

    Raises:
        InfeasibleStepError: no walk phase by phase is possible with forces.
    """
    free = route.settings.free
    continuous = free.swing and has_quick_joints(route.robot) and route.settings.horizon is None
    splines = free.swing and route.settings.horizon is None
    boxes = None if splines else _phase_by_phase(route)
    try:
        if free.swing:
            found = _without_stops(route, continuous, progress)
        else:
            found = retimed(straight_plan(route, progress), rounding=ROUNDING)
    except (InfeasibleStepError, SolverError) as error:
        reason = f"no other walk was found: {str(error).split(';')[0]}"
        return _with_reason(boxes or _phase_by_phase(route), reason)
    if boxes is None or found.duration <= boxes.duration:
        # It promises the margin that was asked for.
        return replace(found, settings=route.settings)
    return _with_reason(boxes, "the walk phase by phase is faster than the other that was found")


def _without_stops(route: Route, continuous: bool, progress: Progress | None) -> Plan:
    """The walk with a free swing curve: at the margin asked for, or at one that forces need.

    Raises:
        InfeasibleStepError, SolverError: there is none at either margin.
    """

    def walk(at: Route) -> Plan:
        return continuous_plan(at) if continuous else retimed(smooth_plan(at, progress))

    held = _held_by_forces(route)
    if held is route:
        return walk(route)
    # A greater margin costs time, so it comes second.
    try:
        return walk(route)
    except (InfeasibleStepError, SolverError):
        return walk(held)


def _held_by_forces(route: Route) -> Route:
    """The walk with a stability margin at which least normal forces of all feet are possible.

    The problem of the path knows margins, and no forces: nearer to a side than that the foot on the
    other side may bear too little, and there may be no timing. The longest side of a triangle
    counts, which is that between diagonal feet: the centre of mass is near to it when a foot lifts
    off.
    """
    settings = route.settings
    limits = settings.promised_forces
    if limits is None or not settings.static or not route.count:
        return route
    swinging = np.array([LEGS.index(leg) for leg in route.steps.legs])
    standing = OTHER_LEGS[swinging]
    corners = np.take_along_axis(route.steps.feet, standing[..., None], axis=1)[..., :2]
    normal, offset = triangle_half_planes(corners)
    heights = (np.einsum("sni,smi->snm", normal, corners) - offset[..., None]).max(axis=2)
    share = tightened(limits, PLANNED_SHARE).reserve
    margin = ROOM_FOR_FORCES * share * float(heights.min(axis=1).max())
    if margin <= settings.stability_margin:
        return route
    return replace(route, settings=replace(settings, stability_margin=margin))


def _phase_by_phase(route: Route) -> Plan:
    """The walk phase by phase, timed by forces, as a plan of the route's settings."""
    began, settings = process_time(), route.settings
    crawl = replace(crawl_settings(settings), timing=FORCES, forces=settings.forces)
    footholds, rounding = route.footholds, ROUNDING
    if settings.free.swing:
        # A rounded box goes straight up until its rounding begins: as high as the clearance.
        clearance = settings.clearance + settings.clearance_reserve
        top = max(crawl.swing_height, clearance)
        crawl = replace(crawl, swing_height=top)
        footholds, least = _lifted(route, clearance)
        rounding = min(ROUNDING, 1.0 - clearance / min(least, top))
    plan = plan_in_order(route.robot, footholds, crawl, rounding=rounding)
    plan = replace(plan, footholds=route.footholds)
    if settings.acceleration_limit is not None:
        plan = retimed(replace(plan, settings=settings))
    record = RouteRecord(stability=plan.record.stability, solver_seconds=process_time() - began)
    # The body rests while a foot flies, so the walk is static whatever was free.
    static = replace(settings, free=replace(settings.free, dynamic=False))
    return replace(plan, settings=static, record=record)


def _lifted(route: Route, clearance: float) -> tuple[Footholds, float]:
    """The footholds with swings that rise by no less than ``clearance`` [m], and the least of them.

    Where they say nothing of swing heights they are the same, and the least is infinite.
    """
    heights = route.footholds.swing_heights
    if heights is None:
        return route.footholds, np.inf
    lifted = {leg: np.maximum(h, clearance) for leg, h in heights.items()}
    least = min((float(h.min()) for h in lifted.values() if len(h)), default=np.inf)
    return route.footholds.with_(swing_heights=lifted), least


def _with_reason(plan: Plan, reason: str) -> Plan:
    """The walk phase by phase, with the reason why it is taken in its record."""
    assert isinstance(plan.record, RouteRecord)
    return replace(plan, record=replace(plan.record, instead=reason))
