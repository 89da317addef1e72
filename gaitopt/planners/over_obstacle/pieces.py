"""Timed pieces of a stride: body moves and plain swings by exact kinematics, and soft ends.

Every piece starts and ends at rest, so pieces follow one another without a jump of velocity. A
piece is made for one second, as quintics through exactly computed states; then it is stretched
until no joint breaks a limit anywhere.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gaitopt.conventions import LEGS, FloatArray, leg_index
from gaitopt.errors import SolverError
from gaitopt.motion.bounds import largest_rates
from gaitopt.motion.path import MotionPath
from gaitopt.motion.pieces import cut, hermite, joined, stretched
from gaitopt.motion.smooth_path import States, smooth_path
from gaitopt.optimize.posture.problem import BodyPose
from gaitopt.optimize.spline.joint_spline import JointSpline
from gaitopt.robots.quadruped import Quadruped
from gaitopt.robots.whole_body import feet_from_joints, joints_from_feet
from gaitopt.robots.whole_body_rates import (
    base_twist,
    base_twist_rate,
    joint_accelerations,
    joint_rates,
)
from gaitopt.swing.curve import SwingCurve, smooth_step
from gaitopt.swing.polynomial import PolynomialSwing

STANCE_ERROR = 1e-6
"""Most that a foot departs from where it should be, between the path's knots [m]."""
PARTS = 8
"""Pieces that a motion is cut into at first."""
SPLINE_PARTS = 4
"""Segments that each interval of a spline is cut into."""
SLOWER = (1.0, 1.02, 1.05, 1.1, 1.2, 1.35, 1.5, 2.0)
"""Stretches of a swing that are tried until its ends can be made soft."""
LONGEST_SOFT = 2.5
"""How much longer a soft end may be than the piece it replaces."""
SAFE = 1.0 + 1e-10
"""Stretch beyond what is needed, so that rounding breaks no limit."""


@dataclass(frozen=True, eq=False)
class StrideLimits:
    """Limits of all joints ``(nj,)``, in the order of :attr:`Quadruped.joint_names`.

    Attributes:
        velocity: [rad/s].
        acceleration: [rad/s^2].
        jerk: [rad/s^3]; infinite for no bound.
    """

    velocity: FloatArray
    acceleration: FloatArray
    jerk: FloatArray

    def stretch(self, path: MotionPath) -> float:
        """By how much a path's time must grow, or may shrink, to reach its tightest limit."""
        need = [
            (largest_rates(path, k)[:, 6:] / limit).max(initial=0.0) ** (1.0 / k)
            for k, limit in enumerate((self.velocity, self.acceleration, self.jerk), start=1)
        ]
        return float(max(need))


@dataclass(frozen=True, eq=False)
class PieceMotion:
    """Body and feet within one second: the body moves, or one foot flies.

    Attributes:
        robot: the robot.
        start, end: the base's x, y, z, roll, pitch, yaw ``(6,)``.
        feet: where the feet stand ``(4, 3)`` [m].
        leg: the leg that flies, if any.
        curve: its flight within one second.
    """

    robot: Quadruped
    start: FloatArray
    end: FloatArray
    feet: FloatArray
    leg: str | None = None
    curve: SwingCurve | None = None

    def base(self, times: FloatArray) -> States:
        """The base ``(N, 6)`` and two derivatives: a straight line in all six numbers."""
        way = self.end - self.start
        out = [smooth_step(times, k)[:, None] * way for k in range(3)]
        return self.start + out[0], out[1], out[2]

    def places(self, times: FloatArray) -> States:
        """Feet ``(N, 4, 3)`` and two derivatives."""
        place = np.broadcast_to(self.feet, (len(times), 4, 3)).copy()
        speed, change = np.zeros_like(place), np.zeros_like(place)
        if self.leg is not None and self.curve is not None:
            i, curve = leg_index(self.leg), self.curve
            place[:, i], speed[:, i] = curve.position(times), curve.velocity(times)
            change[:, i] = curve.acceleration(times)
        return place, speed, change

    def state(self, times: FloatArray, inside: FloatArray) -> States:
        """Path columns and two derivatives ``(N, 6 + nj)``, for :func:`smooth_path`."""
        base = self.base(times)[0]
        joints = joints_from_feet(self.robot, base[:, :3], base[:, 3:], self.places(times)[0])
        _, speed, change = self.base(inside)
        _, foot_speed, foot_change = self.places(inside)
        rpy = base[:, 3:]
        twist = base_twist(rpy, speed[:, :3], speed[:, 3:])
        rate = base_twist_rate(rpy, speed[:, :3], speed[:, 3:], change[:, :3], change[:, 3:])
        rates = joint_rates(self.robot, rpy, joints, twist, foot_speed)
        bends = joint_accelerations(self.robot, rpy, joints, twist, rates, rate, foot_change)
        return (
            np.concatenate([base, joints], axis=1),
            np.concatenate([speed, rates], axis=1),
            np.concatenate([change, bends], axis=1),
        )

    def error(self, times: FloatArray, values: FloatArray) -> FloatArray:
        """How far feet are from their places at path values ``(N, 6 + nj)``: ``(N,)`` [m]."""
        feet = feet_from_joints(self.robot, values[:, :3], values[:, 3:6], values[:, 6:])
        return np.asarray(np.linalg.norm(feet - self.places(times)[0], axis=2).max(axis=1))

    def path(self, limits: StrideLimits) -> MotionPath:
        """The fastest such motion within the limits."""
        knots = np.linspace(0.0, 1.0, PARTS + 1)
        path = smooth_path(knots, self.state, self.error, STANCE_ERROR)
        return stretched(path, limits.stretch(path) * SAFE)


def body_move(
    robot: Quadruped, start: BodyPose, end: BodyPose, feet: FloatArray, limits: StrideLimits
) -> MotionPath | None:
    """The body's move on four feet; ``None`` when it stays where it is."""
    a, b = start.base(robot), end.base(robot)
    b[3:] = a[3:] + (b[3:] - a[3:] + np.pi) % (2.0 * np.pi) - np.pi
    if np.abs(b - a).max() < 1e-9:
        return None
    return PieceMotion(robot, a, b, feet).path(limits)


def plain_swing(
    robot: Quadruped,
    pose: BodyPose,
    feet: FloatArray,
    leg: str,
    target: FloatArray,
    height: float,
    limits: StrideLimits,
) -> MotionPath:
    """A foot's swing over open ground, the body standing still."""
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
    """A swing whose leg follows a joint spline, the body standing still.

    The spline's own peaks are exact, those of a path are bounds on its segments. So segments are
    cut, and the swing takes about a part in 1e5 longer.
    """
    base = pose.base(robot)
    still = joints_from_feet(robot, base[:3], base[3:], feet)
    coefficients = np.zeros((4, len(spline.times) - 1, 6 + len(still)))
    coefficients[-1] = np.concatenate([base, still])
    columns = [6 + c for c in robot.leg_columns[leg]]
    coefficients[:, :, columns] = spline.coefficients
    whole = MotionPath(spline.times, coefficients)
    parts = cut(whole, np.diff(whole.times) / SPLINE_PARTS)
    return stretched(parts, max(limits.stretch(parts), 1.0) * SAFE)


def softened(path: MotionPath, limits: StrideLimits, ends: int = SPLINE_PARTS) -> MotionPath:
    """The path with its ends made softer: no acceleration at the very first and last instant.

    The clamped spline of eq. (7) starts with an acceleration out of nothing, which no bound on jerk
    allows. Its first and last pieces become quintics through the same places that start and end
    without acceleration, as much longer as the limits ask for.

    Args:
        path: from rest to rest.
        limits: of all joints.
        ends: how many segments make the first piece, and the last.

    Raises:
        SolverError: no length of the pieces, and no slower motion, is within the limits.
    """
    for slower in SLOWER:
        calm = stretched(path, slower)
        first, last = (_soft_piece(calm, limits, ends, last=last) for last in (False, True))
        if first is not None and last is not None:
            times = calm.times[ends:-ends]
            inner = MotionPath(times - times[0], calm.coefficients[:, ends:-ends])
            return joined([first, inner, last])
    raise SolverError(
        "a swing's ends cannot be made soft within the jerk limits; leave jerk_limit out, or give "
        "a larger one"
    )


def _soft_piece(
    path: MotionPath, limits: StrideLimits, count: int, *, last: bool
) -> MotionPath | None:
    """The first or last ``count`` segments as a quintic without acceleration at the path's end."""
    ends = path.times[[-1 - count, -1]] if last else path.times[[0, count]]
    place = path.evaluate(ends)
    slope, bend = path.evaluate(ends, 1), path.evaluate(ends, 2)
    outer = 1 if last else 0
    # What follows the piece, or goes before it, is the same polynomial's neighbour: a cubic
    # spline's velocity and acceleration do not jump there.
    slope[outer] = bend[outer] = 0.0
    for factor in np.geomspace(1.0, LONGEST_SOFT, 40):
        length = float(ends[1] - ends[0]) * factor
        piece = MotionPath(np.array([0.0, length]), hermite(length, place, slope, bend)[:, None])
        parts = cut(piece, length / count)
        if limits.stretch(parts) <= 1.0:
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
