"""``plan_gait``: plan walk, trot and other gaits by velocity, from standing to standing.

Sources: [Wang2024], [XiLing].
"""

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
from gaitopt.retiming.retimed import retimed
from gaitopt.robots.quadruped import Quadruped
from gaitopt.terrain.footholds import Footholds

FOOT_TOLERANCE = 1e-6
"""Largest distance between a foot and its place, between the path's knots [m]. Chosen here: a
micrometre, far below what a robot can measure."""
INTERVALS_A_SWING = 10
"""Intervals between knots during a swing, at least. Chosen here: the path gets more where
:data:`FOOT_TOLERANCE` asks for them."""
PARTS = 16
"""Parts of each interval in which a leg is looked for that is too short only between knots. Chosen
here: the instant of the largest length is then found to a 160th of a swing."""
LARGEST_SWAY = 0.4
"""How far the body may leave its route, as a share of the stance's shorter side. Chosen here: at
0.5 it would be above the feet of one side."""
SWAY_MARGIN = 0.15
"""Margin of the ZMP beyond which a larger one has no value, as a share of the stance's shorter
side. Chosen here: half of the largest margin over three feet of a square stance, 0.29."""
MARGIN_SAMPLES = 101
"""Instants of a cycle at which its ZMP margin is computed. Chosen here: a hundredth of a cycle
apart, several in each phase."""


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

    The robot starts standing with its feet below its hips, accelerates, walks at the commanded
    velocity, slows down, and stops on four feet. Standing feet are fixed in the world. Each
    foothold is the foot's nominal place under the body in the middle of its stance. So the foot
    touches down ahead of that place by half the stance time times the velocity ([Wang2024],
    eqs. (15) and (16), as corrected in ``docs/papers.md``).

    Args:
        robot: from :func:`gaitopt.load_robot`.
        schedule: the gait, :func:`gaitopt.trot` for instance.
        settings: all settings as one object, with the same schedule. By default they fit the
            robot.
        progress: called with (stages done, stages in all).
        options: single settings by name: the fields of :class:`gaitopt.GaitSettings`, and
            ``distance`` [m] or ``duration`` [s] at full speed, and ``ramp`` [s]; see
            :meth:`gaitopt.GaitSettings.for_robot`. ``velocity`` is forward and sideways in the
            body's axes, or a forward velocity alone [m/s].

    With ``timing="forces"`` contact forces and joint torques exist at every instant, within
    ``forces``, and the robot is slower than asked where they require it. Feet are points, so a
    trot whose ZMP leaves the line between two feet has none.

    Returns:
        The plan. Its record holds ``zmp_margin``, the smallest margin of the body centre's ZMP
        while any foot stands [m] (for a trot: minus the distance from the support line), and
        ``flight``, the share of the time in which no foot stands, and there is no ZMP.

    Raises:
        InputError: a setting is unknown or out of range, or neither distance nor duration is given.
        InfeasibleStepError: with ``timing="forces"``, somewhere there are no forces at any speed.
        InfeasibleSpeedError: a joint or a leg's reach does not allow the velocity; names the
            fastest one that is possible.
        SolverError: no sway of the body was found.
    """
    if not isinstance(robot, Quadruped) or not isinstance(schedule, GaitSchedule):
        raise InputError(
            "plan_gait takes a Quadruped (from load_robot) and a GaitSchedule (gaitopt.trot(0.5), "
            f"for instance), got {type(robot).__name__} and {type(schedule).__name__}"
        )
    if isinstance(settings, GaitSettings) and settings.schedule != schedule:
        raise InputError(
            f"settings have the schedule {settings.schedule.name!r}, and the schedule to plan is "
            f"{schedule.name!r}: give the same schedule twice"
        )
    if settings is None:
        options["schedule"] = schedule
    return _planned(robot, chosen_settings(GaitSettings, robot, settings, options), progress)


def _planned(robot: Quadruped, settings: GaitSettings, progress: Progress | None) -> Plan:
    """Plan a gait with complete settings; errors are those of :func:`plan_gait`."""
    stages = 3 if settings.adapt else 2
    motion, lengths, path = _attempt(robot, settings)
    if progress is not None:
        progress(1, stages)
    if settings.adapt and path is not None:
        settings = replace(settings, cycle_times=_adapted_times(motion, settings))
        motion, lengths, path = _attempt(robot, settings)
    violations = find_violations(motion, lengths, path, settings)
    if violations or path is None:
        raise explain(settings, violations, lambda other: _is_possible(robot, other))
    phases, record = gait_phases(motion, path)
    if progress is not None:
        progress(stages, stages)
    plan = Plan(robot, motion.footholds, settings, phases, path, record)
    return plan if settings.forces is None else retimed(plan)


def _attempt(
    robot: Quadruped, settings: GaitSettings
) -> tuple[GaitMotion, LegLengths, MotionPath | None]:
    """A gait's motion, the lengths of its legs, and its path: ``None`` where legs are too short."""
    motion = _motion(robot, settings)
    knots = motion.knots(settings.schedule.swing_time / INTERVALS_A_SWING)
    lengths = leg_lengths(motion, knots)
    if not lengths.reached.all():
        return motion, lengths, None
    try:
        return motion, lengths, motion.path(knots, FOOT_TOLERANCE)
    except InputError:
        # The path is computed between these knots, too, where a leg may be a little too short.
        longest = settings.schedule.swing_time / (INTERVALS_A_SWING * PARTS)
        lengths = leg_lengths(motion, motion.knots(longest))
        if lengths.reached.all():
            raise
        return motion, lengths, None


def _motion(robot: Quadruped, settings: GaitSettings) -> GaitMotion:
    """Swings, footholds, route and sway of a gait; nothing is checked against limits."""
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
        width = min(robot.stance_size)
        sway = sway_path(
            route, footholds, events, end + settings.lead,
            settings.body_height + robot.foot_radius, settings.schedule.cycle_time,
            LARGEST_SWAY * width, SWAY_MARGIN * width,
        )  # fmt: skip
    return GaitMotion(
        robot, route, sway, settings.body_height, footholds, events, settings.swing,
        settings.swing_height, end + settings.lead,
    )  # fmt: skip


def _footholds(
    robot: Quadruped, settings: GaitSettings, events: tuple[SwingEvent, ...], route: BodyRoute
) -> Footholds:
    """Footholds below the hips: in the middle of each stance, and at both ends of the walk."""
    points = {}
    for name in LEGS:
        leg = robot.legs[name]
        mine = [e for e in events if e.leg == name]
        # The last stance has no end: the robot stops with its feet below its hips.
        lifts = [e.lift_off for e in mine[1:]]
        middles = [(a.touch_down + b) / 2.0 for a, b in zip(mine, lifts, strict=False)]
        times = np.array([0.0, *middles, route.end][: len(mine) + 1])
        nominal = (leg.hip + leg.axes[:, 1] * leg.lateral - robot.centre)[:2]
        yaw = route.yaw(times)[0]
        c, s = np.cos(yaw), np.sin(yaw)
        under = np.stack([c * nominal[0] - s * nominal[1], s * nominal[0] + c * nominal[1]], -1)
        points[name] = np.column_stack([route.position(times) + under, np.zeros(len(times))])
    return Footholds(points)


def _is_possible(robot: Quadruped, settings: GaitSettings) -> bool:
    """Whether a gait keeps all limits."""
    motion, lengths, path = _attempt(robot, settings)
    return path is not None and not find_violations(motion, lengths, path, settings)


def _adapted_times(motion: GaitMotion, settings: GaitSettings) -> tuple[float, ...]:
    """Times of all cycles [s], adapted to the ZMP margins of a motion with the nominal time.

    Source: [XiLing], "Stability and Gait Control", Section 4. Cycles in which no foot stands, so
    that they have no margin, count as average.
    """
    count = max(cycles_spanned(settings.schedule, settings.cycles), 1)
    nominal = settings.schedule.cycle_time
    margins = []
    for k in range(count):
        start = settings.lead + k * nominal
        times = np.linspace(start, min(start + nominal, motion.duration), MARGIN_SAMPLES)
        margins.append(smallest_zmp_margin(motion, times))
    known = [m for m in margins if np.isfinite(m)]
    mean = float(np.mean(known)) if known else 0.0
    return tuple(
        float(adapted_step_time(nominal, m if np.isfinite(m) else mean, mean, settings.adapt))
        for m in margins
    )
