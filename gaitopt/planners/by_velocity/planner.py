"""``plan_gait``: walk, trot and all other gaits by velocity, from standing to standing."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from gaitopt.conventions import LEGS, Progress
from gaitopt.errors import InputError
from gaitopt.gait.schedule import GaitSchedule
from gaitopt.gait.step_timing import SwingEvent, adapted_step_time, cycles_spanned, swing_events
from gaitopt.motion.path import MotionPath
from gaitopt.plan.plan import Plan
from gaitopt.plan.settings.by_velocity import GaitSettings
from gaitopt.plan.settings.keywords import chosen_settings, takes_settings
from gaitopt.planners.by_velocity.body_route import BodyRoute
from gaitopt.planners.by_velocity.limits import LegLengths, explain, find_violations, leg_lengths
from gaitopt.planners.by_velocity.motion import GaitMotion
from gaitopt.planners.by_velocity.phases import gait_phases, smallest_zmp_margin
from gaitopt.planners.by_velocity.sway import sway_path
from gaitopt.robots.quadruped import Quadruped
from gaitopt.terrain.footholds import Footholds

STANCE_ERROR = 1e-6
"""Most that a foot departs from where it should be, between the path's knots [m]."""
KNOTS_A_SWING = 10
FINER = 16
"""Into how many parts a knot's interval is cut where a leg falls short between knots."""


@takes_settings(GaitSettings, distance=float, duration=float, ramp=float)
def plan_gait(
    robot: Quadruped,
    schedule: GaitSchedule,
    settings: GaitSettings | None = None,
    *,
    progress: Progress | None = None,
    **options: Any,
) -> Plan:
    """Plan a gait at a commanded velocity on level ground.

    The robot starts standing with its feet below its hips, gets to speed, walks, slows down, and
    stops on four feet. Standing feet are fixed in the world. Each foothold lies where the foot
    will be at its nominal place under the body in the middle of its stance: half the stance's
    time times the velocity ahead ([Wang2024], eqs. (15) and (16) as corrected in
    ``docs/papers.md``).

    Args:
        robot: from :func:`gaitopt.load_robot`.
        schedule: the gait, :func:`gaitopt.trot` for instance.
        settings: all settings as one object, of this schedule. By default they fit the robot.
        progress: called with (stages done, stages in all).
        options: single settings by name: the fields of :class:`gaitopt.GaitSettings`, and
            ``distance`` or ``duration`` at full speed, and ``ramp``, which
            :meth:`gaitopt.GaitSettings.for_robot` describes. ``velocity`` is forward and sideways
            in the body's own axes, or the forward one alone [m/s].

    Returns:
        The plan. Its record holds ``zmp_margin``, the smallest margin of the ZMP of the body's
        centre while any foot stands [m] (minus the distance from the support line for a trot), and
        ``flight``, the share of the time without a foot on the ground, where there is no ZMP.

    Raises:
        InputError: a setting is unknown or out of range, or neither distance nor duration is given.
        InfeasibleSpeedError: a joint or a leg's reach does not allow it; offers the fastest
            velocity that works.
        SolverError: the sway was not solved.
    """
    if not isinstance(robot, Quadruped) or not isinstance(schedule, GaitSchedule):
        raise InputError(
            "plan_gait takes a Quadruped (from load_robot) and a GaitSchedule (gaitopt.trot(0.5), "
            f"for instance), got {type(robot).__name__} and {type(schedule).__name__}"
        )
    if isinstance(settings, GaitSettings) and settings.schedule != schedule:
        raise InputError(
            f"settings are of the schedule {settings.schedule.name!r}, and {schedule.name!r} is to "
            "be planned: give the same schedule twice"
        )
    if settings is None:
        options["schedule"] = schedule
    return _planned(robot, chosen_settings(GaitSettings, robot, settings, options), progress)


def _planned(robot: Quadruped, settings: GaitSettings, progress: Progress | None) -> Plan:
    """The plan of complete settings."""
    stages = 3 if settings.adapt else 2
    motion, lengths, path = _attempt(robot, settings)
    if progress is not None:
        progress(1, stages)
    if settings.adapt and path is not None:
        settings = replace(settings, cycle_times=_adapted(motion, settings))
        motion, lengths, path = _attempt(robot, settings)
    violations = find_violations(motion, lengths, path, settings)
    if violations or path is None:
        raise explain(settings, violations, lambda other: _works(robot, other))
    phases, record = gait_phases(motion, path)
    if progress is not None:
        progress(stages, stages)
    return Plan(robot, motion.footholds, settings, phases, path, record)


def _attempt(
    robot: Quadruped, settings: GaitSettings
) -> tuple[GaitMotion, LegLengths, MotionPath | None]:
    """The motion, how far its legs are stretched, and its path unless a foot is out of reach."""
    motion = _motion(robot, settings)
    knots = motion.knots(settings.schedule.swing_time / KNOTS_A_SWING)
    lengths = leg_lengths(motion, knots)
    if not lengths.reached.all():
        return motion, lengths, None
    try:
        return motion, lengths, motion.path(knots, STANCE_ERROR)
    except InputError:
        # A path is looked at between its knots, too, where a leg may fall just short.
        longest = settings.schedule.swing_time / (KNOTS_A_SWING * FINER)
        lengths = leg_lengths(motion, motion.knots(longest))
        if lengths.reached.all():
            raise
        return motion, lengths, None


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
    motion, lengths, path = _attempt(robot, settings)
    return path is not None and not find_violations(motion, lengths, path, settings)


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
