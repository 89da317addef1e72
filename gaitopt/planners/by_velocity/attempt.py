"""One attempt at a gait: its motion, its path, and the limits that it exceeds."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gaitopt.conventions import LEGS, FloatArray
from gaitopt.dynamics.contacts import ForceLimits
from gaitopt.errors import InputError, SolverError
from gaitopt.gait.step_timing import SwingEvent, swing_events
from gaitopt.motion.path import MotionPath
from gaitopt.plan.settings.by_velocity import GaitSettings
from gaitopt.planners.by_velocity.balanced import balanced_motion
from gaitopt.planners.by_velocity.body_route import BodyRoute
from gaitopt.planners.by_velocity.force_violations import force_violations, no_path
from gaitopt.planners.by_velocity.freedom import Freedom
from gaitopt.planners.by_velocity.limits import (
    BALANCE,
    KINEMATIC,
    LegLengths,
    Violation,
    find_violations,
    leg_lengths,
    straightest,
)
from gaitopt.planners.by_velocity.motion import GaitMotion
from gaitopt.planners.by_velocity.sway import sway_path
from gaitopt.retiming.reserves import PLANNED_SHARE, tightened
from gaitopt.robots.quadruped import Quadruped
from gaitopt.terrain.footholds import Footholds

FOOT_TOLERANCE = 1e-6
"""Largest distance between a foot and its place, between the path's knots [m]. Chosen here: a
micrometre, far below what a robot can measure."""
INTERVALS_A_SWING = 10
"""Intervals between knots during a swing, at least. Chosen here: the path gets more where
:data:`FOOT_TOLERANCE` asks for them."""
PIECES_A_SWING = (16, 32)
"""Pieces of the body's spline in the time of a swing that are tried. Between the instants of the
conditions the ZMP of a trot of a1 is beside the line by up to 0.5 mm with 8, by 0.02 mm with 16."""
EVEN = 2.0
"""How many times as long the period is taken for the weight of a free body's accelerations: they
then weigh 16 times as much. Measured, against 1: bounds of six robots need a tenth to a quarter
less torque, and that of a1 tilts by 0.4 degrees in physics instead of 2.5. The body moves more."""
PARTS = 16
"""Parts of each interval in which a leg is looked for that is too short only between knots. Chosen
here: the instant of the largest length is then found to a 160th of a swing."""
LARGEST_SWAY = 0.4
"""How far the body may leave its route, as a share of the stance's shorter side. Chosen here: at
0.5 it would be above the feet of one side."""
SWAY_MARGIN = 0.15
"""Margin of the ZMP beyond which a larger one has no value, as a share of the stance's shorter
side. Chosen here: half of the largest margin over three feet of a square stance, 0.29."""


class Attempt(NamedTuple):
    """A gait's motion with what is wrong with it.

    Attributes:
        motion: body and feet.
        path: of body and joints; ``None`` where there is none.
        violations: limits that are exceeded, the largest share first; empty for a gait that works.
    """

    motion: GaitMotion
    path: MotionPath | None
    violations: list[Violation]


def attempt(robot: Quadruped, settings: GaitSettings, stands: FloatArray | None = None) -> Attempt:
    """A gait with complete settings.

    Args:
        robot, settings: of the gait.
        stands: where the feet stand at the start, seen from where the route begins ``(4, 3)`` [m];
            below the hips by default.

    Raises:
        SolverError: no sway of the body was found.
    """
    motion = nominal_motion(robot, settings, stands)
    limits = settings.forces
    if limits is None or not _lengths(motion, settings).reached.all():
        return _without_forces(motion, settings)
    if not all(leg.has_roll for leg in robot.legs.values()):
        return _with_forces(motion, settings, limits, Freedom.AHEAD)
    if settings.schedule.has_flight:
        return _free(motion, settings, limits)
    level = _with_forces(motion, settings, limits, Freedom.LEVEL)
    if not level.violations or level.violations[0].kind in KINEMATIC:
        return level
    if settings.schedule.least_support > 2:
        # Above three feet there is room enough for a level body.
        return level
    # Where no level body has forces, one that rises and turns may have them.
    return _better(level, _free(motion, settings, limits))


def _free(motion: GaitMotion, settings: GaitSettings, limits: ForceLimits) -> Attempt:
    """An attempt with contact forces whose body rises and turns.

    Its forces are even; where that does not do, the body stays nearer to its route.
    """
    even = _with_forces(motion, settings, limits, Freedom.FREE, EVEN)
    if not even.violations:
        return even
    return _better(even, _with_forces(motion, settings, limits, Freedom.FREE))


def _better(one: Attempt, other: Attempt) -> Attempt:
    """The attempt that exceeds its limits less; the first one of equals."""
    return min(one, other, key=lambda each: each.violations[0].use if each.violations else 0.0)


def _with_forces(
    motion: GaitMotion, settings: GaitSettings, limits: ForceLimits, freedom: Freedom,
    ease: float = 1.0,
) -> Attempt:  # fmt: skip
    """An attempt with contact forces.

    Args:
        motion: along its route.
        settings, limits: what is asked for.
        freedom: how the body may move.
        ease: accelerations are weighed as those of a gait with a period this many times as long.
    """
    for pieces in PIECES_A_SWING:
        found = _with_pieces(motion, settings, limits, freedom, ease, pieces)
        # Between the instants of its conditions a finer spline misses the balance by less.
        missed = found.path is not None and any(v.kind == BALANCE for v in found.violations)
        if not missed:
            break
    return found


def _without_forces(motion: GaitMotion, settings: GaitSettings) -> Attempt:
    """An attempt whose body is where the motion has it."""
    lengths, path = _path(motion, settings)
    return Attempt(motion, path, find_violations(motion, lengths, path, settings))


def _with_pieces(
    motion: GaitMotion, settings: GaitSettings, limits: ForceLimits, freedom: Freedom, ease: float,
    pieces: int,
) -> Attempt:  # fmt: skip
    """The same with a number of pieces.

    Args:
        motion, settings, limits, freedom, ease: as above.
        pieces: of the body's spline in the time of a swing, at least.
    """
    width, planned = min(motion.robot.stance_size), tightened(limits, PLANNED_SHARE)
    try:
        balanced, time = balanced_motion(
            motion, planned, ease * settings.schedule.cycle_time, LARGEST_SWAY * width,
            SWAY_MARGIN * width, pieces, freedom,
        )  # fmt: skip
    except InputError as error:
        words = f"no path of the body with contact forces was found within the legs' reach: {error}"
        return Attempt(motion, None, [Violation("reach", np.inf, motion.duration / 2.0, words)])
    if balanced is None:
        return Attempt(motion, None, [no_path(motion, time)])
    found = _without_forces(balanced, settings)
    if found.path is None or found.violations:
        return found
    return found._replace(violations=force_violations(balanced, found.path, limits))


def _lengths(motion: GaitMotion, settings: GaitSettings) -> LegLengths:
    """Lengths of the legs at the knots of a path."""
    return leg_lengths(motion, motion.knots(settings.schedule.swing_time / INTERVALS_A_SWING))


def _path(motion: GaitMotion, settings: GaitSettings) -> tuple[LegLengths, MotionPath | None]:
    """Lengths of a motion's legs, and its path: ``None`` where legs are too short."""
    lengths = _lengths(motion, settings)
    if not lengths.reached.all():
        return lengths, None
    try:
        return lengths, motion.path(lengths.times, FOOT_TOLERANCE)
    except (InputError, SolverError) as error:
        # The path is computed between these knots, too, where a leg may be a little too short.
        longest = settings.schedule.swing_time / (INTERVALS_A_SWING * PARTS)
        lengths = leg_lengths(motion, motion.knots(longest))
        if not lengths.reached.all():
            return lengths, None
        # The knee of a leg that is just straight for an instant would turn without bound there.
        straight = straightest(motion, lengths)
        if isinstance(error, InputError) or straight is None:
            raise
        return straight, None


def nominal_motion(
    robot: Quadruped, settings: GaitSettings, stands: FloatArray | None = None
) -> GaitMotion:
    """Swings, footholds and route of a gait; without forces also its sway.

    Nothing is checked against limits. Arguments are those of :func:`attempt`.
    """
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
    if stands is not None:
        points = {leg: np.array(footholds[leg]) for leg in LEGS}
        for i, leg in enumerate(LEGS):
            points[leg][0] = stands[i]
        footholds = footholds.with_(points=points)
    sway = None
    if settings.sway and settings.forces is None:
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
