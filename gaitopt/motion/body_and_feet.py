"""From the motion of body and feet to the base and all joints, with derivatives.

Every planner that moves body and feet by formulae gets its path here, and asks here how far
standing feet slip.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from gaitopt.conventions import BoolArray, FloatArray, rotation_z
from gaitopt.motion.path import BASE_COLUMNS, MotionPath
from gaitopt.motion.pieces import States
from gaitopt.motion.smooth_path import smooth_path
from gaitopt.robots.quadruped import Quadruped
from gaitopt.robots.rotations import matrix_to_rpy, rpy_to_matrix
from gaitopt.robots.whole_body import base_of_body, feet_from_joints, joints_from_feet
from gaitopt.robots.whole_body_rates import (
    base_twist,
    base_twist_rate,
    joint_motions,
)

MotionOfTime = Callable[[FloatArray], States]
"""Gives values, velocities and accelerations at times ``(N,)``."""


def base_poses(
    robot: Quadruped, heading: float, centre: FloatArray, rpy: ArrayLike = (0.0, 0.0, 0.0)
) -> FloatArray:
    """Base position and roll, pitch, yaw ``(N, 6)`` in the world, without jumps of whole turns.

    Args:
        robot: the robot.
        heading: of the walk [rad].
        centre: body centre in the heading frame ``(N, 3)`` [m].
        rpy: the body's roll, pitch, yaw against the heading frame ``(N, 3)`` [rad], or one for all.
            The base's yaw counts as many whole turns as the body's.
    """
    turned, angles = rotation_z(heading), np.asarray(rpy, dtype=np.float64)
    out = base_of_body(robot, centre @ turned.T, turned @ rpy_to_matrix(angles))
    if angles.ndim == 2:
        out[:, 3:] = np.unwrap(out[:, 3:], axis=0)
    # Angles begin within half a turn of zero; the heading may be any.
    missing = np.asarray(heading - out[0, 5])
    if angles.ndim == 2:
        missing = heading + angles[:, 2] + _yaw_of_base(robot) - out[:, 5]
    out[:, 5] += 2.0 * np.pi * np.round(missing / (2.0 * np.pi))
    return out


def _yaw_of_base(robot: Quadruped) -> float:
    """Yaw of the base of a robot whose body has none [rad]."""
    return float(matrix_to_rpy(robot.body_axes.T)[2])


def body_and_feet_path(
    robot: Quadruped, knots: FloatArray, base: MotionOfTime, feet: MotionOfTime, tolerance: float
) -> MotionPath:
    """The path of a motion whose base and feet are given by formulae.

    Args:
        robot: the robot.
        knots: times ``(K + 1,)`` between which both are analytic [s], from 0.
        base: x, y, z, roll, pitch, yaw of the base ``(N, 6)`` and two derivatives.
        feet: all feet in the world ``(N, 4, 3)`` and two derivatives.
        tolerance: largest distance of a foot from its place in the middle of any interval [m].

    Raises:
        InputError: a foot is out of reach.
        SolverError: feet depart from their places however short the intervals are.
    """

    def state(times: FloatArray, inside: FloatArray) -> States:
        return path_states(robot, (base(times)[0], *base(inside)[1:]),
                           (feet(times)[0], *feet(inside)[1:]))  # fmt: skip

    def error(times: FloatArray, values: FloatArray) -> FloatArray:
        return np.asarray(foot_errors(robot, values, feet(times)[0]).max(axis=1))

    return smooth_path(knots, state, error, tolerance)


def path_states(robot: Quadruped, base: States, feet: States) -> States:
    """Columns of a path ``(N, 6 + nj)`` and two derivatives, from those of base and feet.

    Args:
        robot: the robot.
        base: x, y, z, roll, pitch, yaw ``(N, 6)``, and two derivatives.
        feet: all feet in the world ``(N, 4, 3)``, and two derivatives.

    Raises:
        InputError: a foot is out of reach, or a leg is straight or folded.
    """
    value, velocity, acceleration = base
    rpy = value[:, 3:]
    joints = joints_from_feet(robot, value[:, :3], rpy, feet[0])
    twist = base_twist(rpy, velocity[:, :3], velocity[:, 3:])
    twist_rate = base_twist_rate(
        rpy, velocity[:, :3], velocity[:, 3:], acceleration[:, :3], acceleration[:, 3:]
    )
    rates, accelerations = joint_motions(robot, rpy, joints, (twist, twist_rate), feet[1:])
    return (
        np.concatenate([value, joints], axis=1),
        np.concatenate([velocity, rates], axis=1),
        np.concatenate([acceleration, accelerations], axis=1),
    )


def foot_errors(robot: Quadruped, values: FloatArray, feet: FloatArray) -> FloatArray:
    """How far path values put the feet from given places ``(N, 4)`` [m].

    Args:
        robot: the robot.
        values: columns of a path ``(N, 6 + nj)``.
        feet: the places in the world ``(N, 4, 3)`` [m].
    """
    base, joints = values[:, :BASE_COLUMNS], values[:, BASE_COLUMNS:]
    found = feet_from_joints(robot, base[:, :3], base[:, 3:], joints)
    return np.asarray(np.linalg.norm(found - feet, axis=2))


def largest_slip(
    robot: Quadruped, values: FloatArray, feet: FloatArray, standing: BoolArray
) -> FloatArray:
    """How far the worst standing foot is from its place ``(N,)`` [m]; 0 where none stands.

    Args:
        robot, values, feet: as in :func:`foot_errors`.
        standing: which feet stand ``(N, 4)``.
    """
    errors = foot_errors(robot, values, feet)
    return np.asarray(np.where(standing, errors, 0.0).max(axis=1))


def slip_between(
    robot: Quadruped, values: FloatArray, feet: FloatArray, standing: BoolArray
) -> FloatArray:
    """:func:`largest_slip` in the middle between every two knots of a polyline ``(N - 1,)`` [m].

    There standing feet are farthest from their places, since the path is a chord.

    Args:
        robot: the robot.
        values: columns of a path at its knots ``(N, 6 + nj)``.
        feet: where the feet stand during each interval ``(N - 1, 4, 3)`` in the world [m].
        standing: which feet do ``(N - 1, 4)``.
    """
    return largest_slip(robot, (values[1:] + values[:-1]) / 2.0, feet, standing)
