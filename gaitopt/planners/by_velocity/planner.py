"""``plan_gait``: walk, trot and all other gaits by velocity, from standing to standing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from gaitopt.conventions import LEGS, Progress
from gaitopt.errors import InputError
from gaitopt.gait.schedule import GaitSchedule
from gaitopt.gait.step_timing import SwingEvent, adapted_step_time, cycles_spanned, swing_events
from gaitopt.inputs import check_number
from gaitopt.motion.path import MotionPath
from gaitopt.motion.smooth_path import smooth_path
from gaitopt.plan.plan import Plan
from gaitopt.plan.settings.by_velocity import GaitSettings, checked_velocity
from gaitopt.planners.by_velocity.body_route import BodyRoute
from gaitopt.planners.by_velocity.limits import Stretch, explain, find_violations, stretch_of
from gaitopt.planners.by_velocity.motion import GaitMotion
from gaitopt.planners.by_velocity.phases import gait_phases, smallest_zmp_margin
from gaitopt.planners.by_velocity.sway import sway_path
from gaitopt.robots.quadruped import Quadruped
from gaitopt.terrain.footholds import Footholds

STANCE_ERROR = 1e-6
"""Most that a foot departs from where it should be, between the path's knots [m]."""
LONGEST_WALK = 2000
"""Most cycles of a walk."""
KNOTS_A_SWING = 10
FINER = 16
"""Into how many parts a knot's interval is cut where a leg falls short between knots."""


def plan_gait(
    robot: Quadruped,
    schedule: GaitSchedule,
    velocity: float | ArrayLike = (0.0, 0.0),
    yaw_rate: float = 0.0,
    *,
    distance: float | None = None,
    duration: float | None = None,
    ramp: float | None = None,
    lead: float | None = None,
    body_height: float | None = None,
    swing_height: float | None = None,
    swing: str = "polynomial",
    sway: bool | None = None,
    adapt: float = 0.0,
    reach_fraction: float = 1.0,
    acceleration_limit: float | None = None,
    heading: float = 0.0,
    progress: Progress | None = None,
) -> Plan:
    """Plan a gait at a commanded velocity on level ground.

    The robot starts standing with its feet below its hips, gets to speed, walks, slows down, and
    stops on four feet. Standing feet are fixed in the world. Each foothold lies where the foot
    will be at its nominal place under the body in the middle of its stance: half the stance's
    time times the velocity ahead ([Wang2024], eqs. (15) and (16), corrected as in
    ``docs/papers.md``).

    Args:
        robot: from :func:`gaitopt.load_robot`.
        schedule: the gait, :func:`gaitopt.trot` for instance.
        velocity: forward and sideways in the body's own axes, or the forward one alone [m/s].
        yaw_rate: turning left is positive [rad/s].
        distance: way at full speed [m]; getting to speed and slowing down come on top.
        duration: time at full speed [s]. One of ``distance`` and ``duration`` is needed.
        ramp: least time to get to speed, and to slow down [s]; two cycles by default. It becomes
            longer so that a whole number of cycles is walked.
        lead: time on four feet before the first lift-off and after the last touch-down [s]; by
            default half a cycle for a body that sways, which must first get over its feet, and
            none otherwise.
        body_height: height of the hips above the ground's foot frames [m]; by default
            ``robot.standing_height``.
        swing_height: how far a foot rises [m]; 0.15 of the body's height by default.
        swing: swing curve: ``"polynomial"``, ``"cycloid"``, ``"sine arch"``, ``"half-ellipse"``,
            ``"trapezoid"`` or ``"box"``.
        sway: whether the body leaves its straight way so that its ZMP lies as deep in the support
            polygons as the speed allows; by default where more than half of the cycle is stance
            and the legs can move sideways.
        adapt: gain of the step time's adaptation to the ZMP's margin [1/m] ([XiLing], Section 4):
            each cycle's time becomes ``1 + adapt (mean margin - its margin)`` times as long.
        reach_fraction: share of each leg's reach that may be used.
        acceleration_limit: of every joint [rad/s^2].
        heading: direction in which the body faces at the start [rad].
        progress: called with (stages done, stages in all).

    Returns:
        The plan. Its ``info`` holds ``zmp_margin``, the smallest margin of the ZMP of the body's
        centre while any foot stands [m] (minus the distance from the support line for a trot), and
        ``flight``, the share of the time without a foot on the ground, where there is no ZMP.

    Raises:
        InputError: a setting is out of range.
        InfeasibleSpeedError: a joint or a leg's reach does not allow it; offers the fastest
            velocity that works.
        SolverError: the sway was not solved.
    """
    if not isinstance(robot, Quadruped) or not isinstance(schedule, GaitSchedule):
        raise InputError(
            "plan_gait takes a Quadruped (from load_robot) and a GaitSchedule (gaitopt.trot(0.5), "
            f"for instance), got {type(robot).__name__} and {type(schedule).__name__}"
        )
    height = robot.standing_height if body_height is None else body_height
    swaying = _sways(robot, schedule) if sway is None else sway
    command = checked_velocity(velocity)
    settings = GaitSettings(
        body_height=height,
        swing_height=round(0.15 * float(height), 3) if swing_height is None else swing_height,
        reach_fraction=reach_fraction, heading=heading, acceleration_limit=acceleration_limit,
        schedule=schedule, velocity=command, yaw_rate=yaw_rate,
        plateau=_plateau(command, yaw_rate, distance, duration),
        lead=(0.5 * schedule.cycle_time if swaying else 0.0) if lead is None else lead,
        swing=swing, sway=swaying, adapt=adapt,
    )  # fmt: skip
    least_ramp = 2.0 * schedule.cycle_time if ramp is None else ramp
    settings = replace(settings, cycles=_cycles(settings, least_ramp), cycle_times=())
    stages = 3 if settings.adapt else 2
    motion, stretch, path = _attempt(robot, settings)
    if progress is not None:
        progress(1, stages)
    if settings.adapt and path is not None:
        settings = replace(settings, cycle_times=_adapted(motion, settings))
        motion, stretch, path = _attempt(robot, settings)
    violations = find_violations(motion, stretch, path, settings)
    if violations or path is None:
        raise explain(settings, violations, lambda other: _works(robot, other))
    plan = _assembled(robot, settings, motion, path)
    if progress is not None:
        progress(stages, stages)
    return plan


def _sways(robot: Quadruped, schedule: GaitSchedule) -> bool:
    return schedule.duty_factor > 0.5 and all(leg.has_roll for leg in robot.legs.values())


def _plateau(
    velocity: tuple[float, float], yaw_rate: float, distance: object, duration: object
) -> float:
    """Time at full speed [s]."""
    if (distance is None) == (duration is None):
        raise InputError(
            "plan_gait needs either distance (in metres at full speed) or duration (in seconds at "
            f"full speed), got {distance!r} and {duration!r}"
        )
    name, value = ("duration", duration) if distance is None else ("distance", distance)
    asked = check_number(name, value, 0.0, 1e6, "s" if distance is None else "m")
    if distance is None:
        return asked
    speed = float(np.hypot(*velocity))
    if not speed > 0:
        raise InputError(
            f"a distance of {asked:g} m is never walked at no speed; give velocity, or a duration "
            "to step in place or turn"
        )
    return asked / speed


def _cycles(settings: GaitSettings, ramp: object) -> int:
    """Swings of each leg, so that the ramps are at least as long as asked for."""
    least = check_number("ramp", ramp, 1e-3, 1e5, "s")
    once = swing_events(settings.schedule, 1)
    first = max(e.touch_down for e in once)
    missing = settings.plateau + 2.0 * least - first
    cycles = 1 + max(int(np.ceil(missing / settings.schedule.cycle_time - 1e-9)), 0)
    if cycles > LONGEST_WALK:
        raise InputError(
            f"{settings.plateau:.4g} s at full speed take {cycles} cycles of "
            f"{settings.schedule.cycle_time:g} s; at most {LONGEST_WALK} are planned at once"
        )
    return cycles


def _attempt(
    robot: Quadruped, settings: GaitSettings
) -> tuple[GaitMotion, Stretch, MotionPath | None]:
    """The motion, how far its legs are stretched, and its path unless a foot is out of reach."""
    motion = _motion(robot, settings)
    knots = motion.knots(settings.schedule.swing_time / KNOTS_A_SWING)
    stretch = stretch_of(motion, knots)
    if not stretch.reached.all():
        return motion, stretch, None
    try:
        return motion, stretch, smooth_path(knots, motion.state, motion.foot_error, STANCE_ERROR)
    except InputError:
        # A path is looked at between its knots, too, where a leg may fall just short.
        longest = settings.schedule.swing_time / (KNOTS_A_SWING * FINER)
        stretch = stretch_of(motion, motion.knots(longest))
        if stretch.reached.all():
            raise
        return motion, stretch, None


def _motion(robot: Quadruped, settings: GaitSettings) -> GaitMotion:
    events = tuple(
        SwingEvent(e.leg, e.step, e.lift_off + settings.lead, e.touch_down + settings.lead)
        for e in swing_events(settings.schedule, settings.cycles, settings.cycle_times)
    )
    end = max(e.touch_down for e in events)
    route = BodyRoute(
        settings.velocity, settings.yaw_rate, settings.heading, settings.lead,
        (end - settings.lead - settings.plateau) / 2.0, settings.plateau,
    )  # fmt: skip
    footholds = _footholds(robot, settings, events, route)
    sway = None
    if settings.sway:
        # The deepest point of a triangle of feet is about a quarter of the stance inside.
        narrow = min(robot.stance_size)
        sway = sway_path(
            route, footholds, events, end + settings.lead,
            settings.body_height + robot.foot_radius, settings.schedule.cycle_time,
            0.4 * narrow, 0.15 * narrow,
        )  # fmt: skip
    return GaitMotion(
        robot, route, sway, settings.body_height, footholds, events, settings.swing,
        settings.swing_height, end + settings.lead,
    )  # fmt: skip


def _footholds(
    robot: Quadruped, settings: GaitSettings, events: tuple[SwingEvent, ...], route: BodyRoute
) -> Footholds:
    """Where each foot stands: under its hip in the middle of the stance, and at both ends."""
    points = {}
    for name in LEGS:
        leg = robot.legs[name]
        mine = [e for e in events if e.leg == name]
        # The last stance has no end: the robot comes to rest square above its feet.
        lifts = [e.lift_off for e in mine[1:]]
        middles = [(a.touch_down + b) / 2.0 for a, b in zip(mine, lifts, strict=False)]
        times = np.array([0.0, *middles, route.end][: len(mine) + 1])
        nominal = (leg.hip + leg.axes[:, 1] * leg.lateral - robot.centre)[:2]
        yaw = route.yaw(times)[0]
        c, s = np.cos(yaw), np.sin(yaw)
        under = np.stack([c * nominal[0] - s * nominal[1], s * nominal[0] + c * nominal[1]], -1)
        points[name] = np.column_stack([route.position(times) + under, np.zeros(len(times))])
    return Footholds(points)


def _works(robot: Quadruped, settings: GaitSettings) -> bool:
    motion, stretch, path = _attempt(robot, settings)
    return path is not None and not find_violations(motion, stretch, path, settings)


def _adapted(motion: GaitMotion, settings: GaitSettings) -> tuple[float, ...]:
    """Time of each cycle, adapted to the margin that it has at the nominal pace."""
    count = max(cycles_spanned(settings.schedule, settings.cycles), 1)
    nominal = settings.schedule.cycle_time
    margins = []
    for k in range(count):
        start = settings.lead + k * nominal
        times = np.linspace(start, min(start + nominal, motion.duration), 101)
        margins.append(smallest_zmp_margin(motion, times))
    known = [m for m in margins if np.isfinite(m)]
    mean = float(np.mean(known)) if known else 0.0
    return tuple(
        float(adapted_step_time(nominal, m if np.isfinite(m) else mean, mean, settings.adapt))
        for m in margins
    )


def _assembled(
    robot: Quadruped, settings: GaitSettings, motion: GaitMotion, path: MotionPath
) -> Plan:
    phases, info = gait_phases(motion, path)
    return Plan(robot, motion.footholds, settings, phases, path, info)
