"""Kinematics of the whole robot: from a pose of the body and places of the feet to the joints.

Frames: the world W; the base, which is the URDF's root link; the body B, which shares the base's
origin and has x forward, y left, z up; and one leg frame L at each hip (see
:mod:`gaitopt.robots.leg`). ``position`` and ``rpy`` always place the *base* in the world, as in a
:class:`gaitopt.Plan`; with ``A`` for :attr:`Quadruped.body_axes` a foot is at::

    p_W = position + R(rpy) A (hip + axes @ p_L)

The inverse and its first two derivatives in time are closed forms over any number of samples.
Source: [XiLing], Modules A to C.
"""

from __future__ import annotations

from typing import Final, Literal, NamedTuple, overload

import numpy as np
from numpy.typing import ArrayLike

from gaitopt.conventions import LEGS, BoolArray, FloatArray
from gaitopt.errors import InputError
from gaitopt.inputs import as_text, check_leads, check_shape
from gaitopt.robots.leg import REACH_TOLERANCE, Leg
from gaitopt.robots.quadruped import Quadruped
from gaitopt.robots.rotations import (
    matrix_to_rpy,
    quaternion_to_rpy,
    rpy_to_matrix,
    rpy_to_quaternion,
)

TOGETHER: Final = 12 * 256
"""Up to this many coordinates of feet, four legs at once are faster than one leg after the other:
of one pose three times as fast. Of many poses, arrays of four legs leave the processor's cache."""


class Configuration(NamedTuple):
    """A robot's configuration in angles.

    Attributes:
        position: the base's position in the world ``(..., 3)`` [m].
        rpy: its roll, pitch and yaw ``(..., 3)`` [rad].
        joints: joint angles ``(..., nj)`` [rad], in the order of :attr:`Quadruped.joint_names`.
    """

    position: FloatArray
    rpy: FloatArray
    joints: FloatArray


# --- configurations ---------------------------------------------------------------------------


def configuration(
    robot: Quadruped, position: ArrayLike, rpy: ArrayLike, joints: ArrayLike
) -> FloatArray:
    """Pinocchio's configurations ``(..., nq)``: position, quaternion x, y, z, w, joints.

    Args:
        robot: the robot.
        position: the base's position in the world ``(..., 3)`` [m].
        rpy: its roll, pitch and yaw ``(..., 3)`` [rad].
        joints: ``(..., nj)`` [rad], in the order of :attr:`Quadruped.joint_names`.

    Raises:
        InputError: an array has another shape.
    """
    parts = (
        check_shape("position", position, 3),
        rpy_to_quaternion(check_shape("rpy", rpy, 3)),
        check_shape("joints", joints, len(robot.joint_names)),
    )
    names = ("position", "rpy", "joints")
    lead = check_leads(**{n: p.shape[:-1] for n, p in zip(names, parts, strict=True)})
    return np.concatenate(
        [np.broadcast_to(part, (*lead, part.shape[-1])) for part in parts], axis=-1
    )


def zero_configuration(robot: Quadruped) -> FloatArray:
    """Pinocchio's configuration ``(nq,)`` with the base at the origin and all leg joints at zero.

    Joints that no leg owns are at their neutral angles.
    """
    joints = robot.neutral_joints()
    joints[robot.leg_joint_columns] = 0.0
    return configuration(robot, np.zeros(3), np.zeros(3), joints)


def from_configuration(robot: Quadruped, q: ArrayLike) -> Configuration:
    """Position, roll-pitch-yaw and joints of Pinocchio's configurations ``q (..., nq)``.

    The inverse of :func:`configuration` for pitch angles within a quarter turn.

    Raises:
        InputError: ``q`` has another shape, or a quaternion is zero.
    """
    values = check_shape("q", q, 7 + len(robot.joint_names))
    rpy = quaternion_to_rpy(values[..., 3:7])
    return Configuration(values[..., :3].copy(), rpy, values[..., 7:].copy())


def base_of_body(robot: Quadruped, centre: ArrayLike, axes: ArrayLike) -> FloatArray:
    """The base's x, y, z, roll, pitch, yaw ``(..., 6)`` in the world, from where the body is.

    Args:
        robot: the robot.
        centre: the body centre, :attr:`Quadruped.centre`, in the world ``(..., 3)`` [m].
        axes: body axes as columns in the world ``(..., 3, 3)``.

    Raises:
        InputError: an array has another shape.
    """
    body = check_shape("axes", axes, 3, 3)
    position = check_shape("centre", centre, 3) - body @ robot.centre
    return joined(position, matrix_to_rpy(body @ robot.body_axes.T))


# --- feet and joints --------------------------------------------------------------------------


def feet_from_joints(
    robot: Quadruped, position: ArrayLike, rpy: ArrayLike, joints: ArrayLike
) -> FloatArray:
    """Places of the feet in the world ``(..., 4, 3)`` [m], in the order of :data:`gaitopt.LEGS`.

    Args:
        robot: the robot.
        position: the base's position in the world ``(..., 3)`` [m].
        rpy: its roll, pitch and yaw ``(..., 3)`` [rad].
        joints: ``(..., nj)`` [rad], in the order of :attr:`Quadruped.joint_names`.

    Source: [XiLing], Module C, "Full Forward Kinematics Chain".

    Raises:
        InputError: an array has another shape, or an angle is infinite.
    """
    place, angles = check_shape("position", position, 3), check_shape("rpy", rpy, 3)
    count = len(robot.joint_names)
    for name, values in (("rpy", angles), ("joints", check_shape("joints", joints, count))):
        if np.isinf(values).any():
            raise InputError(f"{name} must be angles, and one is infinite")
    to_world = rpy_to_matrix(angles) @ robot.body_axes
    feet = feet_in_body(robot, check_shape("joints", joints, len(robot.joint_names)))
    return place[..., None, :] + feet @ np.swapaxes(to_world, -1, -2)


@overload
def joints_from_feet(
    robot: Quadruped,
    position: ArrayLike,
    rpy: ArrayLike,
    feet: ArrayLike,
    *,
    on_unreachable: Literal["raise"] = "raise",
) -> FloatArray: ...


@overload
def joints_from_feet(
    robot: Quadruped,
    position: ArrayLike,
    rpy: ArrayLike,
    feet: ArrayLike,
    *,
    on_unreachable: Literal["mask"],
) -> tuple[FloatArray, BoolArray]: ...


def joints_from_feet(
    robot: Quadruped,
    position: ArrayLike,
    rpy: ArrayLike,
    feet: ArrayLike,
    *,
    on_unreachable: Literal["raise", "mask"] = "raise",
) -> FloatArray | tuple[FloatArray, BoolArray]:
    """Joint angles that put all feet at given places, for a given pose of the base.

    Knees are on their own side and feet below the roll axes (:meth:`Leg.inverse`); joints that no
    leg owns are neutral. Reach depends on the links and the knees' limits; limits of other joints
    are not checked. The foot of a pitch-pitch leg must lie in the leg's plane.

    Args:
        robot: the robot.
        position: the base's position in the world ``(..., 3)`` [m].
        rpy: its roll, pitch and yaw ``(..., 3)`` [rad].
        feet: foot frames in the world ``(..., 4, 3)`` [m], in the order of :data:`gaitopt.LEGS`.
        on_unreachable: ``"raise"`` an error, or return a ``"mask"`` of the feet that are reached.

    Returns:
        ``(..., nj)`` [rad], in the order of :attr:`Quadruped.joint_names`; with ``"mask"`` also
        ``(..., 4)``, true where the foot is reached. Elsewhere the leg points towards its foot,
        straight or folded. Source: [XiLing], Module C, Section 2.

    Raises:
        InputError: a foot is out of reach, an array has another shape, or ``on_unreachable`` is
            unknown.
    """
    if on_unreachable not in ("raise", "mask"):
        raise InputError(f"on_unreachable must be 'raise' or 'mask', got {as_text(on_unreachable)}")
    wanted = into_body(robot, position, rpy, feet)
    reached = np.empty(wanted.shape[:-1], dtype=np.bool_)
    for i, name in enumerate(LEGS):
        leg, points = robot.legs[name], wanted[..., i, :]
        # A comparison with NaN is false: a place that is not finite is not reached.
        reached[..., i] = leg.shortfall(points) <= REACH_TOLERANCE
        if on_unreachable == "raise" and not reached[..., i].all():
            raise InputError(_out_of_reach(robot, leg, points, reached[..., i]))
    joints = joints_from_feet_in_body(robot, wanted)
    return joints if on_unreachable == "raise" else (joints, reached)


# --- shared -----------------------------------------------------------------------------------


def into_body(robot: Quadruped, position: ArrayLike, rpy: ArrayLike, feet: ArrayLike) -> FloatArray:
    """Feet in the world ``(..., 4, 3)`` in the body frame ``(..., 4, 3)`` [m].

    Args:
        robot: the robot.
        position, rpy: the base's pose in the world ``(..., 3)`` [m], [rad].
        feet: ``(..., 4, 3)`` [m].

    Raises:
        InputError: an array has another shape.
    """
    place, angles = check_shape("position", position, 3), check_shape("rpy", rpy, 3)
    to_world = rpy_to_matrix(angles) @ robot.body_axes
    return np.asarray((check_shape("feet", feet, 4, 3) - place[..., None, :]) @ to_world)


def joints_from_feet_in_body(
    robot: Quadruped, feet: FloatArray, order: Literal["C", "F"] = "C"
) -> FloatArray:
    """Joint angles ``(..., nj)`` [rad] for feet in the body frame ``(..., 4, 3)`` [m].

    A leg that does not reach its foot points towards it; joints that no leg owns are neutral.

    Args:
        robot, feet: whose, and where they are.
        order: NumPy's order in memory: with ``"F"`` the angles of one joint stand side by side, so
            that what is done joint by joint is faster.
    """
    joints = np.empty((*feet.shape[:-2], len(robot.joint_names)), order=order)
    if joints.shape[-1] > len(robot.leg_joint_columns):
        joints[...] = robot.neutral_joints()
    if robot.four_legs is not None and feet.size <= TOGETHER:
        angles = robot.four_legs.inverse(feet)
        joints[..., robot.leg_joint_columns] = angles.reshape(
            *angles.shape[:-2], angles.shape[-2] * angles.shape[-1]
        )
        return joints
    for i, name in enumerate(LEGS):
        rows = robot.legs[name].inverse_columns(*np.moveaxis(feet[..., i, :], -1, 0))
        for column, angle in zip(robot.leg_columns[name], rows, strict=True):
            joints[..., column] = angle
    return joints


def feet_in_body(robot: Quadruped, joints: FloatArray) -> FloatArray:
    """Feet in the body frame ``(..., 4, 3)`` [m] at joint angles ``(..., nj)`` [rad]."""
    return np.stack(
        [robot.legs[leg].forward(joints[..., list(robot.leg_columns[leg])]) for leg in LEGS],
        axis=-2,
    )


def _out_of_reach(robot: Quadruped, leg: Leg, points: FloatArray, reached: BoolArray) -> str:
    """Message for the first foot that is not reached, of ``points (..., 3)`` in the body frame."""
    sample = tuple(int(k) for k in np.argwhere(~reached)[0])
    point = points[sample]
    if not np.isfinite(point).all():
        return f"{robot.name}: the place asked for foot {leg.name}{at_sample(sample)} is not finite"
    return (
        f"{robot.name}: leg {leg.name} does not reach its foot{at_sample(sample)}: it is "
        f"{leg.gap_in_words(point)} "
        f"({leg.shortfall(point):.3g} m short); move the body or the foot"
    )


def at_sample(sample: tuple[int, ...]) -> str:
    """Text that names a sample; empty for the only one."""
    return f" at sample {', '.join(map(str, sample))}" if sample else ""


def turned_back(rotation: FloatArray, vectors: FloatArray) -> FloatArray:
    """``vectors (..., 3)`` turned by the inverse of ``rotation (..., 3, 3)``."""
    return np.asarray(np.einsum("...ij,...i->...j", rotation, vectors))


def joined(linear: FloatArray, angular: FloatArray) -> FloatArray:
    """A linear and an angular part as one array ``(..., 6)``."""
    return np.concatenate(np.broadcast_arrays(linear, angular), axis=-1)
