"""``retimed``: a plan's motion as fast as contact forces and joint torques allow."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from gaitopt.conventions import GRAVITY
from gaitopt.dynamics.contacts import ForceLimits
from gaitopt.errors import InputError
from gaitopt.inputs import check_kind, check_number
from gaitopt.motion.path import MotionPath
from gaitopt.plan.phase import Phase
from gaitopt.plan.plan import Plan
from gaitopt.plan.settings.by_velocity import GaitSettings
from gaitopt.plan.settings.crawl import CrawlSettings
from gaitopt.plan.settings.time_optimal import RouteSettings
from gaitopt.plan.zmp_margin import with_zmp_margins
from gaitopt.retiming.other_limits import HEIGHT, OtherLimits
from gaitopt.retiming.paced import PacedCourse
from gaitopt.retiming.rounds import paced
from gaitopt.retiming.transfers import rested
from gaitopt.robots.abilities import has_quick_joints, require_joints_that_feel

LOAD_TIME, TURNING_LOAD_TIME = 0.015, 0.035
"""Time within which feet take over the weight on static walks along splines of slow joints, where
the motion leaves a choice [s]: of a level body, and of one that turns (``posture``). 64 steps of
``swing`` take 0.4 % more time with 0.035 s, and 0.1 % less with none."""
BY_TIMING = ("joint velocity", "speed")
"""Kinds of limits of phases that belong to a plan's old timing."""

LARGEST_LIFT = 0.6 * GRAVITY
"""Largest vertical acceleration of the body in a walk phase by phase [m/s^2].

The body goes up and down from rest to rest while four feet stand. Forces alone would let it fall by
9 mm and catch it with 3.4 times its weight, on a foot that has landed 40 ms before. In physics this
foot slid."""
GENTLE_LIFT = 0.25 * GRAVITY
"""Largest vertical acceleration of a body that moves on four feet from rest to rest, to where a
walk begins or from where it ended [m/s^2]: they then carry 75 to 125 % of its weight (at the places
of the timing's grid, and a little more or less between them). Without it robots that rose from a
low posture were thrown up by their whole torque, and flew: anymal_c, which lies on its belly,
reached 145 % of a joint's velocity in physics, and with it 44 %."""


def retimed(plan: Plan, forces: ForceLimits | None = None, *, rounding: float = 0.0) -> Plan:
    """The same motion as fast as contact forces, joint torques and joint velocities allow.

    Body and feet go where the plan has them go, at other times. A plan whose velocities jump (a
    walk phase by phase) stops at the end of every straight line, save where corners of flights are
    rounded. A smooth plan is followed without stops, through landings and lift-offs. The timing is
    the fastest one on a grid along the course, with a constant acceleration on each interval
    ([Pham2018], with contact forces), and with the reserves that it needs between the grid's
    places. On static walks along splines of slow joints feet take over the weight gently where they
    can (:data:`LOAD_TIME`), as planned. The body of a walk phase by phase goes up and down with
    :data:`LARGEST_LIFT` at most, and that of any plan with :data:`GENTLE_LIFT` before its walk
    begins and after it has ended.

    Args:
        plan: from any planner.
        forces: limits on forces and torques; those that the plan promises, or else the defaults of
            :class:`ForceLimits`.
        rounding: how far from each corner of a foot's flight along straight lines its rounding
            begins and ends, as a share of the shorter of its two lines, from 0 to 0.5. A foot does
            not stop at rounded corners.

    Returns:
        A plan that promises contact forces within these limits. :func:`gaitopt.verify` checks it.

    Raises:
        InputError: this is no plan, these are no limits, the robot has no mass, the plan promises a
            jerk limit, which new timings do not keep, it begins in motion, or ``rounding`` is out
            of range.
        RobotError: the robot's joints rub with more than its
            weight, or its motors are too heavy to catch it.
        InfeasibleStepError: somewhere along the path there are no forces at any speed; names the
            step, and the limits that are in the way.
        SolverError: feet cannot be kept on their course, or no timing was found that has forces
            between the places at which they are looked for.
    """
    check_kind("plan", plan, Plan)
    return retimed_gently(plan, forces, rounding, _load_time(plan))


def _load_time(plan: Plan) -> float:
    """Time within which feet take over the weight, as far as the motion leaves a choice [s].

    It is 0, and loads may jump, but on static walks along splines of slow joints.
    """
    settings = plan.settings
    if not isinstance(settings, RouteSettings) or plan.path.degree <= 1:
        return 0.0
    if not (settings.free.swing and settings.static) or has_quick_joints(plan.robot):
        return 0.0
    return TURNING_LOAD_TIME if settings.free.posture else LOAD_TIME


def retimed_gently(
    plan: Plan, forces: ForceLimits | None, rounding: float, load_time: float
) -> Plan:
    """The same with another time in which loads go over gently, where the motion leaves a choice.

    Args:
        plan, forces, rounding: as for :func:`retimed`.
        load_time: within which a foot is to take over the weight [s]; 0 for none. It is a wish, and
            not promised. The plan's own times are to be near the new ones.

    Raises:
        InputError, InfeasibleStepError, SolverError: as :func:`retimed` does.
    """
    check_number("rounding", rounding, 0.0, 0.5, "")
    check_kind("plan", plan, Plan)
    plan.robot.require_masses()
    require_joints_that_feel(plan.robot)
    promised = plan.settings.promised_forces if forces is None else forces
    settings = plan.settings.with_forces(ForceLimits() if promised is None else promised)
    if plan.begins_moving:
        raise InputError(
            "a plan that begins in motion keeps its velocity; plan from the state anew, with other "
            "limits"
        )
    if settings.jerk_limit is not None:
        raise InputError("retimed keeps no jerk limit: take a plan whose jerk_limit is None")
    if not np.ptp(plan.path.knots(), axis=0).any():
        return replace(plan, settings=settings)
    course = replace(plan, settings=settings)
    others = _without_hops(plan, _other_limits(plan))
    found = timed(course, settings.promised_forces, others, rounding, load_time)
    return found if settings.static else with_zmp_margins(found)


def stopped(plan: Plan) -> Plan:
    """The same straight lines with the accelerations that the plan's settings allow.

    The motion stops at the end of every line. Nothing is said of forces.

    Args:
        plan: whose path is of degree one.

    Raises:
        SolverError: feet cannot be kept on their course.
    """
    if not np.ptp(plan.path.knots(), axis=0).any():
        return plan
    return timed(plan, None, _other_limits(plan))


def timed(
    plan: Plan, limits: ForceLimits | None, others: OtherLimits, rounding: float = 0.0,
    load_time: float = 0.0,
) -> Plan:  # fmt: skip
    """A plan that moves, as fast as limits allow.

    Args:
        plan: the motion.
        limits: on forces and torques; ``None`` for none.
        others: on accelerations and speeds.
        rounding: of corners, as for :func:`retimed`.
        load_time: as for :func:`retimed_gently`.

    Raises:
        InfeasibleStepError, SolverError: as :func:`retimed` does.
    """
    motion, path, rests = paced(plan, limits, others, rounding, load_time)
    moving = replace(plan, path=path, phases=_phases(plan, motion, path))
    return rested(moving, motion, rests)


def _other_limits(plan: Plan) -> OtherLimits:
    """What the settings ask for beside forces."""
    settings = plan.settings
    others = OtherLimits.of_joints(settings.joint_accelerations(plan.robot))
    if isinstance(settings, CrawlSettings) and settings.speed != "max":
        others = replace(others, speed=float(settings.speed))
    if isinstance(settings, GaitSettings):
        # A gait has the velocity that was asked for, and is slower only where it has to be.
        others = replace(others, faster=1.0)
    return others


def _without_hops(plan: Plan, others: OtherLimits) -> OtherLimits:
    """With :data:`LARGEST_LIFT` where a walk phase by phase rises or falls.

    Before the walk begins and after it has ended it is :data:`GENTLE_LIFT`.
    """
    if not np.ptp(plan.path.knots()[:, HEIGHT]) > 0.0:
        return others
    phase_by_phase, phases = isinstance(plan.settings, CrawlSettings), plan.phases
    until, since = (phases[plan.entry - 1].end if plan.entry else -np.inf), np.inf
    moves_last = len(phases) > plan.entry and phases[-1].kind == "stance"
    if moves_last and (phase_by_phase or phases[-2:][0].kind == "stance"):
        since = phases[-1].start
    gentle = None if until < 0.0 and since == np.inf else (GENTLE_LIFT, until, since)
    return replace(others, lift=LARGEST_LIFT if phase_by_phase else others.lift, gentle=gentle)


def _phases(plan: Plan, motion: PacedCourse, path: MotionPath) -> tuple[Phase, ...]:
    """The plan's phases, when they are now: each begins and ends at a knot of the path."""
    old = np.array([[p.start, p.end] for p in plan.phases])
    new = motion.new_times(old.ravel())
    after = np.clip(np.searchsorted(path.times, new), 1, len(path.times) - 1)
    nearer = new - path.times[after - 1] < path.times[after] - new
    starts, ends = path.times[after - nearer].reshape(-1, 2).T
    return tuple(
        replace(
            phase, start=start, duration=max(end - start, 0.0),
            limited_by=tuple(x for x in phase.limited_by if x.kind not in BY_TIMING),
        )
        for phase, start, end in zip(plan.phases, starts.tolist(), ends.tolist(), strict=True)
    )  # fmt: skip
