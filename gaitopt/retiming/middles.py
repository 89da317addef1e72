"""Forces between two places of a course's grid.

At both ends of an interval there are forces. Their mean keeps all limits, which are convex, and
makes the mean of what the motion asks for at both ends. What it asks for in the middle is another
wrench, and other torques, by as much as they bend along the interval. Where that is less than the
reserve with which forces are planned at places there are forces in between, too. Elsewhere
programs look for them, in the middle and near both ends, and at a third and two thirds where the
motion asks for other forces there than for the mean of those beside it.
"""

from __future__ import annotations

import numpy as np

from gaitopt.conventions import GRAVITY, BoolArray, FloatArray
from gaitopt.dynamics.contacts import LEVEL_GROUND, ContactGround, ForceLimits
from gaitopt.dynamics.force_space import ForceProblem
from gaitopt.dynamics.forces import build_force_problem, solve_forces
from gaitopt.dynamics.torque_limits import effort_limits
from gaitopt.dynamics.whole_body import PathDynamics, motion_of_path
from gaitopt.motion.path import MotionPath
from gaitopt.plan.load_transfer import Stances, most_normal_shares
from gaitopt.retiming.course import Course, GridPlaces
from gaitopt.retiming.paced import PacedCourse
from gaitopt.retiming.reserves import MIDDLE_SHARE, SHARE_OF_WEIGHT
from gaitopt.robots.at_many_poses.inverse_dynamics import inverse_dynamics
from gaitopt.robots.quadruped import Quadruped

BENT_WRENCH = 1e-3
"""How far a wrench in the middle may be from the mean of both ends, as a share of the weight and of
the weight times half the stance, without a look at it: feet keep 0.0015 of the weight more at
places than in middles."""
BENT_TORQUE = 5e-3
"""The same of a joint's torque, as a share of its limit: 0.015 more of it is left at places."""

BETWEEN = (0.5, 1.0 / 6.0, 5.0 / 6.0)
"""Where programs look for forces, as shares of an interval. A quintic has the motion's acceleration
at both ends of it. In between its acceleration errs most in the middle and at 0.11 and 0.89: a walk
of hyq with forces in every middle had none at 0.2 of an interval in which a knee brakes."""
THIRDS = ((1.0 / 3.0, 0, 1), (2.0 / 3.0, 0, 2))
"""Where they are looked for as well, and whose mean that is: the numbers of two shares in
:data:`BETWEEN`. Mean forces do there, but where the motion turns round between them: a walk of
spirit40 had forces at these shares of an interval, and lacked 0.2 thousandths of its weight in
friction between two of them."""
LEFT_WRENCH = 2e-4
"""How far a wrench may be from that mean without a look, in the units of :data:`BENT_WRENCH`:
middles keep 0.0005 of the weight."""
LEFT_TORQUE = 2e-3
"""The same of a joint's torque, as a share of its limit: middles keep 0.005 of it."""


def without_forces(
    motion: PacedCourse,
    path: MotionPath,
    own: np.ndarray,
    limits: ForceLimits,
    spans: Stances | None = None,
    ground: ContactGround = LEVEL_GROUND,
) -> BoolArray:
    """Intervals without forces that keep the limits at :data:`BETWEEN` or :data:`THIRDS` ``(n,)``.

    Args:
        motion: the course with its timing.
        path: its path.
        own: the intervals that are looked at ``(n,)``.
        limits: on forces and torques.
        spans: when feet that stand on all ``K`` intervals land and lift off, in the times of the
            motion ``(K, 4)``; by default nothing is known of it.
        ground: below the feet on these intervals.
    """
    robot, count = motion.course.robot, len(own)
    if not count:
        return np.zeros(0, dtype=np.bool_)
    problem = _problem(
        motion, path, own, np.tile(np.arange(count), len(BETWEEN)), np.repeat(BETWEEN, count),
        limits, spans, ground,
    )  # fmt: skip
    out = np.asarray(~solve_forces(problem).feasible.reshape(-1, count).all(axis=0))
    asked, left = problem.equations.forces.reshape(-1, count, robot.model.nv), np.flatnonzero(~out)
    number = np.tile(left, len(THIRDS))
    if not number.size:
        return out
    shares = np.repeat([share for share, _, _ in THIRDS], len(left))
    means = [(asked[before, left] + asked[after, left]) / 2.0 for _, before, after in THIRDS]
    moved = motion_of_path(robot, *_rates(motion, path, own[number], shares))
    off = np.abs(inverse_dynamics(robot.model, *moved) - np.concatenate(means))
    far = _exceeds(robot, off, LEFT_WRENCH, LEFT_TORQUE)
    number, shares = number[far], shares[far]
    if number.size:
        problem = _problem(motion, path, own, number, shares, limits, spans, ground)
        out[number[~solve_forces(problem).feasible]] = True
    return out


def _problem(
    motion: PacedCourse, path: MotionPath, own: np.ndarray, number: np.ndarray, share: FloatArray,
    limits: ForceLimits, spans: Stances | None, ground: ContactGround,
) -> ForceProblem:  # fmt: skip
    """The forces at shares ``(m,)`` of the intervals with these numbers ``(m,)`` among ``own``."""
    course: Course = motion.course
    mine, below = own[number], ground.at(number)
    most = np.array(np.inf)
    if spans is not None:
        times = _times(motion, mine, share)[:, None]
        since, until = times - spans.landed[mine], spans.lifted[mine] - times
        most = most_normal_shares(limits, since, until) - SHARE_OF_WEIGHT * MIDDLE_SHARE
    return build_force_problem(
        course.robot, motion_of_path(course.robot, *_rates(motion, path, mine, share)),
        course.standing[motion.grid.piece[mine]], limits,
        normals=below.normals, grip=below.grip, most=most,
    )  # fmt: skip


def _times(motion: PacedCourse, intervals: np.ndarray, share: FloatArray) -> FloatArray:
    """Times at shares ``(n,)`` of intervals ``(n,)`` [s]."""
    return np.asarray((1.0 - share) * motion.times[intervals] + share * motion.times[intervals + 1])


def _rates(
    motion: PacedCourse, path: MotionPath, intervals: np.ndarray, share: FloatArray
) -> list[FloatArray]:
    """Columns of the path at shares of intervals, and two derivatives of them ``(n, 6 + nj)``."""
    times = _times(motion, intervals, share)
    return [path.evaluate(times, k) for k in range(3)]


def bent(motion: PacedCourse, places: GridPlaces, dynamics: PathDynamics) -> BoolArray:
    """Intervals in whose middle a motion may ask for other forces than around it ``(K,)``.

    Args:
        motion: the course with its timing.
        places: both ends of its intervals.
        dynamics: at the places.
    """
    robot, lengths = motion.course.robot, (motion.grid.end - motion.grid.begin)[:, None]
    middle = ((motion.begin + motion.end) / 2.0)[:, None]
    # Between both ends the squared speed is linear, so A u + B x + g bends as A, B and g do, and
    # by the product of what B and x change by.
    tables = dynamics.acceleration, dynamics.speed, dynamics.gravity
    factors = np.abs(motion.acceleration)[:, None], middle, np.ones_like(middle)
    slopes = [(table[places.end] - table[places.begin]) / lengths for table in tables]
    change = (motion.end - motion.begin)[:, None] * lengths
    found = np.abs(slopes[1] * change) / 8.0
    inner = np.ones(len(lengths), dtype=np.bool_)
    inner[motion.grid.first[:-1]] = False
    for slope, factor in zip(slopes, factors, strict=True):
        found = found + _second(slope, lengths, inner) * factor * lengths**2 / 8.0
    return _exceeds(robot, np.abs(found), BENT_WRENCH, BENT_TORQUE)


def _exceeds(robot: Quadruped, off: FloatArray, wrench: float, torque: float) -> BoolArray:
    """Where generalised forces ``off (n, nv)`` are more than shares of weight or torques ``(n,)``.

    Moments are compared with the weight times half the stance.
    """
    unit = robot.mass * GRAVITY * np.repeat([1.0, robot.stance_size[0] / 2.0], 3)
    torques = off[:, 6:] / effort_limits(robot).limits
    too_much = (off[:, :6] / unit).max(axis=1) > wrench
    return np.asarray(too_much | (torques.max(axis=1) > torque))


def _second(slopes: FloatArray, lengths: FloatArray, inner: BoolArray) -> FloatArray:
    """Largest second differences at both ends of intervals ``(K, n)``, from their slopes.

    Args:
        slopes: on the intervals ``(K, n)``.
        lengths: of the intervals ``(K, 1)``.
        inner: intervals that begin where another one of their chain ends ``(K,)``.
    """
    steps = np.abs(slopes[1:] - slopes[:-1]) * 2.0 / (lengths[1:] + lengths[:-1])
    steps = np.where(inner[1:, None], steps, 0.0)
    none = np.zeros((1, slopes.shape[1]))
    at_begin, at_end = np.concatenate([none, steps]), np.concatenate([steps, none])
    return np.asarray(np.maximum(at_begin, at_end))
