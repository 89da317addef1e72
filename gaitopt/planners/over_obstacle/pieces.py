"""Timed pieces of a walk over an obstacle: moves of the body, and swings of single feet.

Every piece starts and ends at rest, so pieces follow one another without a jump of velocity. Moves
of the body and swings over open ground are made to last one second, as quintics through exactly
computed states, and are then stretched until no joint breaks a limit anywhere. Swings over the
obstacle follow joint splines, whose ends can be changed so that they have no acceleration there.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gaitopt.conventions import LEGS, FloatArray, leg_index
from gaitopt.errors import SolverError
from gaitopt.motion.body_and_feet import body_and_feet_path
from gaitopt.motion.bounds import largest_sizes
from gaitopt.motion.path import BASE_COLUMNS, MotionPath
from gaitopt.motion.pieces import States, cut, joined, quintic_hermite, stretched
from gaitopt.motion.retiming import needed_stretch
from gaitopt.optimize.posture.problem import BodyPose
from gaitopt.optimize.spline.joint_spline import JointSpline
from gaitopt.robots.leg_angles import wrap_angle
from gaitopt.robots.quadruped import Quadruped
from gaitopt.robots.whole_body import joints_from_feet
from gaitopt.swing.curve import SwingCurve, smooth_step
from gaitopt.swing.polynomial import PolynomialSwing

STANCE_ERROR = 1e-6
"""Largest distance of a foot from its place between the path's knots [m]; chosen here."""
PARTS = 8
"""Intervals of a motion at first; they are halved where feet depart too far from their places."""
SPLINE_PARTS = 4
"""Segments into which each interval of a spline is cut, so that bounds on them are close."""
SWING_STRETCHES = (1.0, 1.02, 1.05, 1.1, 1.2, 1.35, 1.5, 2.0)
"""Factors on a swing's time that are tried, in this order, until its ends can be changed."""
LONGEST_END = 2.5
"""How many times as long a changed end may be as the piece that it replaces."""
END_LENGTHS = 40
"""Lengths of a changed end that are tried, from 1 to :data:`LONGEST_END` times the piece's."""
ROUNDING_RESERVE = 1.0 + 1e-10
"""Factor on stretched times, so that rounding breaks no limit."""
SAME_POSE = 1e-9
"""Difference between two poses that counts as none, for rounding [m, rad]."""


@dataclass(frozen=True, eq=False)
class StrideLimits:
    """Limits of all joints ``(nj,)``, in the order of :attr:`Quadruped.joint_names`.

    Attributes:
        velocity: [rad/s].
        acceleration: [rad/s^2].
        jerk: [rad/s^3]; infinite for no limit.
    """

    velocity: FloatArray
    acceleration: FloatArray
    jerk: FloatArray

    def needed_stretch(self, path: MotionPath) -> float:
        """Factor by which a path's time must grow, or may shrink, to reach its tightest limit."""
        return needed_stretch(*(
            (largest_sizes(path, order)[:, BASE_COLUMNS:] / limit).max(initial=0.0)
            for order, limit in enumerate((self.velocity, self.acceleration, self.jerk), start=1)
        ))  # fmt: skip


@dataclass(frozen=True, eq=False)
class PieceMotion:
    """A motion of one second, from rest to rest: the body moves, or one foot flies.

    Attributes:
        robot: the robot.
        start, end: the base's x, y, z, roll, pitch, yaw ``(6,)``.
        feet: where the feet stand ``(4, 3)`` [m].
        leg: the leg that flies; ``None`` when the body moves.
        curve: the flight of its foot.
    """

    robot: Quadruped
    start: FloatArray
    end: FloatArray
    feet: FloatArray
    leg: str | None = None
    curve: SwingCurve | None = None

    def base(self, times: FloatArray) -> States:
        """The base ``(N, 6)`` and two derivatives: a straight line in all six coordinates."""
        way = self.end - self.start
        out = [smooth_step(times, k)[:, None] * way for k in range(3)]
        return self.start + out[0], out[1], out[2]

    def feet_at(self, times: FloatArray) -> States:
        """Feet ``(N, 4, 3)`` and two derivatives."""
        place = np.broadcast_to(self.feet, (len(times), 4, 3)).copy()
        velocity, acceleration = np.zeros_like(place), np.zeros_like(place)
        if self.leg is not None and self.curve is not None:
            i, curve = leg_index(self.leg), self.curve
            place[:, i], velocity[:, i] = curve.position(times), curve.velocity(times)
            acceleration[:, i] = curve.acceleration(times)
        return place, velocity, acceleration

    def path(self, limits: StrideLimits) -> MotionPath:
        """The motion stretched in time until it just keeps all limits."""
        knots = np.linspace(0.0, 1.0, PARTS + 1)
        path = body_and_feet_path(self.robot, knots, self.base, self.feet_at, STANCE_ERROR)
        return stretched(path, limits.needed_stretch(path) * ROUNDING_RESERVE)


def body_move(
    robot: Quadruped, start: BodyPose, end: BodyPose, feet: FloatArray, limits: StrideLimits
) -> MotionPath | None:
    """The body's move on four feet; ``None`` when both poses are the same."""
    a, b = start.base(robot), end.base(robot)
    # The shorter way round.
    b[3:] = wrap_angle(b[3:], a[3:])
    if np.abs(b - a).max() < SAME_POSE:
        return None
    return PieceMotion(robot, a, b, feet).path(limits)


def open_ground_swing(
    robot: Quadruped,
    pose: BodyPose,
    feet: FloatArray,
    leg: str,
    target: FloatArray,
    height: float,
    limits: StrideLimits,
) -> MotionPath:
    """A foot's swing over open ground, while the body stands still."""
    base = pose.base(robot)
    curve = PolynomialSwing(feet[leg_index(leg)], target, height, 1.0)  # type: ignore[arg-type]
    return PieceMotion(robot, base, base, feet, leg, curve).path(limits)


def spline_swing(
    robot: Quadruped,
    pose: BodyPose,
    feet: FloatArray,
    leg: str,
    spline: JointSpline,
    limits: StrideLimits,
) -> MotionPath:
    """A swing whose leg follows a joint spline, while the body stands still.

    A path's limits are judged by bounds on its segments, which are a little above the largest
    values. So segments are cut, and the swing takes about 1e-5 longer than the spline.
    """
    base = pose.base(robot)
    still = joints_from_feet(robot, base[:3], base[3:], feet)
    coefficients = np.zeros((4, len(spline.times) - 1, BASE_COLUMNS + len(still)))
    coefficients[-1] = np.concatenate([base, still])
    columns = BASE_COLUMNS + np.array(robot.leg_columns[leg])
    coefficients[:, :, columns] = spline.coefficients
    whole = MotionPath(spline.times, coefficients)
    parts = cut(whole, np.diff(whole.times) / SPLINE_PARTS)
    return stretched(parts, max(limits.needed_stretch(parts), 1.0) * ROUNDING_RESERVE)


def without_end_accelerations(
    path: MotionPath, limits: StrideLimits, count: int = SPLINE_PARTS
) -> MotionPath:
    """The path with no acceleration at its very first and last instant.

    The clamped spline of eq. (7) starts with a jump of acceleration, which no bound on jerk allows.
    Its first and last pieces become quintics through the same places that start and end without
    acceleration, as much longer as the limits ask for.

    Args:
        path: from rest to rest.
        limits: of all joints.
        count: how many segments make the first piece, and the last.

    Raises:
        SolverError: no length of the pieces, and no slower motion, is within the limits.
    """
    for factor in SWING_STRETCHES:
        slower = stretched(path, factor)
        first, last = (_end_piece(slower, limits, count, last=last) for last in (False, True))
        if first is not None and last is not None:
            times = slower.times[count:-count]
            inner = MotionPath(times - times[0], slower.coefficients[:, count:-count])
            return joined([first, inner, last])
    raise SolverError(
        "a swing cannot start and end without acceleration within the jerk limits; leave "
        "jerk_limit out, or give a larger one"
    )


def _end_piece(
    path: MotionPath, limits: StrideLimits, count: int, *, last: bool
) -> MotionPath | None:
    """The first or last ``count`` segments as a quintic without acceleration at the path's end.

    ``None`` when none of the lengths that are tried is within the limits.
    """
    ends = path.times[[-1 - count, -1]] if last else path.times[[0, count]]
    # At the inner end velocity and acceleration of a cubic spline do not jump: those of the
    # neighbouring segment are the path's own.
    values, velocities, accelerations = (path.evaluate(ends, order) for order in range(3))
    outer = 1 if last else 0
    velocities[outer] = accelerations[outer] = 0.0
    begin, end = ((values[[k]], velocities[[k]], accelerations[[k]]) for k in (0, 1))
    for factor in np.geomspace(1.0, LONGEST_END, END_LENGTHS):
        length = float(ends[1] - ends[0]) * factor
        quintic = quintic_hermite(np.array([length]), begin, end)
        parts = cut(MotionPath(np.array([0.0, length]), quintic), length / count)
        if limits.needed_stretch(parts) <= 1.0:
            return parts
    return None


def leg_limits(
    robot: Quadruped, accelerations: Sequence[float], jerks: Sequence[float]
) -> StrideLimits:
    """Limits of all joints from those of one leg's, which hold for all legs.

    Joints that no leg owns never move.
    """
    count = len(robot.joint_names)
    acceleration, jerk = np.full(count, np.inf), np.full(count, np.inf)
    for leg in LEGS:
        columns = list(robot.leg_columns[leg])
        acceleration[columns] = accelerations
        if jerks:
            jerk[columns] = jerks
    return StrideLimits(np.array(robot.velocity_limits), acceleration, jerk)
