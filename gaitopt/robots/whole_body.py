"""Kinematics of the whole robot: from a pose of the body and places of the feet to the joints.

Frames: the world W; the base, which is the URDF's root link; the body B, which shares the base's
origin and has x forward, y left, z up; and one leg frame L at each hip (see
:mod:`gaitopt.robots.leg`). ``position`` and ``rpy`` always place the *base* in the world, as in a
:class:`gaitopt.Plan`; with ``A`` for :attr:`Quadruped.body_axes` a foot is at::

    p_W = position + R(rpy) A (hip + axes @ p_L)

The inverse and its first two derivatives in time are closed forms over any number of samples.
Source: 003_8f161808651a8f3d.txt, Modules A to C.
"""

from __future__ import annotations

from typing import Final, Literal, NamedTuple, overload

import numpy as np
from numpy.typing import ArrayLike

from gaitopt.conventions import LEGS, BoolArray, FloatArray, frozen
from gaitopt.errors import InputError
from gaitopt.robots.leg import Leg
from gaitopt.robots.quadruped import Quadruped
from gaitopt.robots.rotations import (
    quaternion_to_rpy,
    rpy_accelerations_to_angular,
    rpy_rates_to_angular,
    rpy_to_matrix,
    rpy_to_quaternion,
)

XILING_LEG_AXES: Final = frozen([[0.0, 1.0, 0.0], [0.0, 0.0, -1.0], [-1.0, 0.0, 0.0]])
"""Axes of the leg frame of 003_8f161808651a8f3d.txt as columns in gaitopt's leg frame ``(3, 3)``.

Its formulae hold with x down the straight leg, y forward along the axis of HAA, and z right along
the axes of HFE and KFE. So its R_{B,Li} is no identity, as it says, but this matrix.
"""

REACH_TOLERANCE: Final = 1e-9
"""A foot that is no farther than this out of reach counts as reached [m]."""

SINGULAR: Final = 1e-9
"""A leg is singular below this share of its Jacobian's largest determinant."""


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


# --- frames -----------------------------------------------------------------------------------


def homogeneous(position: ArrayLike, rpy: ArrayLike) -> FloatArray:
    """Transforms ``T_{W,B}`` ``(..., 4, 4)`` from the frame at ``position``, turned by ``rpy``.

    Args:
        position: ``(..., 3)`` [m].
        rpy: roll, pitch and yaw ``(..., 3)`` [rad].

    Source: 003_8f161808651a8f3d.txt, Module C, Sections 1.2 to 1.4 and 4.1.
    """
    place = _array("position", position, 3)
    return _transform(rpy_to_matrix(_array("rpy", rpy, 3)), place)


def inverse_homogeneous(transform: ArrayLike) -> FloatArray:
    """Inverses ``(..., 4, 4)`` of rigid transforms, by transposing their rotation.

    Source: 003_8f161808651a8f3d.txt, Module C, Section 1.4.
    """
    given = _array("transform", transform, 4, 4)
    back = np.swapaxes(given[..., :3, :3], -1, -2)
    return _transform(back, -(back @ given[..., :3, 3:])[..., 0])


def hip_frames(robot: Quadruped) -> FloatArray:
    """Transforms ``T_{B,Li}`` from each leg's frame to the body frame ``(4, 4, 4)``.

    Legs are in the order of :data:`gaitopt.LEGS`. Multiply the rotation by
    :data:`XILING_LEG_AXES` for the leg frames of 003_8f161808651a8f3d.txt (Module C, Section 1.5).
    """
    legs = [robot.legs[name] for name in LEGS]
    return _transform(np.array([leg.axes for leg in legs]), np.array([leg.hip for leg in legs]))


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
        _array("position", position, 3),
        rpy_to_quaternion(_array("rpy", rpy, 3)),
        _array("joints", joints, len(robot.joint_names)),
    )
    lead = np.broadcast_shapes(*(part.shape[:-1] for part in parts))
    return np.concatenate(
        [np.broadcast_to(part, (*lead, part.shape[-1])) for part in parts], axis=-1
    )


def from_configuration(robot: Quadruped, q: ArrayLike) -> Configuration:
    """Position, roll-pitch-yaw and joints of Pinocchio's configurations ``q (..., nq)``.

    The inverse of :func:`configuration` for pitch angles within a quarter turn.

    Raises:
        InputError: ``q`` has another shape, or a quaternion is zero.
    """
    values = _array("q", q, 7 + len(robot.joint_names))
    rpy = quaternion_to_rpy(values[..., 3:7])
    return Configuration(values[..., :3].copy(), rpy, values[..., 7:].copy())


def base_twist(rpy: ArrayLike, position_rates: ArrayLike, rpy_rates: ArrayLike) -> FloatArray:
    """Pinocchio's base velocity ``v[..., :6]``: linear, then angular, in the base's own frame.

    Args:
        rpy: ``(..., 3)`` [rad].
        position_rates: derivative of the base's position in the world ``(..., 3)`` [m/s].
        rpy_rates: derivative of ``rpy`` ``(..., 3)`` [rad/s].
    """
    rotation = rpy_to_matrix(_array("rpy", rpy, 3))
    linear = _turned_back(rotation, _array("position_rates", position_rates, 3))
    angular = rpy_rates_to_angular(rpy, _array("rpy_rates", rpy_rates, 3))
    return _joined(linear, angular)


def base_twist_rate(
    rpy: ArrayLike,
    position_rates: ArrayLike,
    rpy_rates: ArrayLike,
    position_accelerations: ArrayLike,
    rpy_accelerations: ArrayLike,
) -> FloatArray:
    """Pinocchio's base acceleration ``a[..., :6]``: the derivative of :func:`base_twist`.

    Args:
        rpy: ``(..., 3)`` [rad].
        position_rates: ``(..., 3)`` [m/s].
        rpy_rates: ``(..., 3)`` [rad/s].
        position_accelerations: second derivative of the position in the world [m/s^2].
        rpy_accelerations: second derivative of ``rpy`` [rad/s^2].
    """
    twist = base_twist(rpy, position_rates, rpy_rates)
    rotation = rpy_to_matrix(rpy)
    pull = _turned_back(rotation, _array("position_accelerations", position_accelerations, 3))
    accelerations = _array("rpy_accelerations", rpy_accelerations, 3)
    angular = rpy_accelerations_to_angular(rpy, rpy_rates, accelerations)
    # The axes turn below the velocity, so its components change also when it does not.
    return _joined(pull - np.cross(twist[..., 3:], twist[..., :3]), angular)


# --- feet and joints --------------------------------------------------------------------------


def feet_from_joints(
    robot: Quadruped, position: ArrayLike, rpy: ArrayLike, joints: ArrayLike
) -> FloatArray:
    """Where the feet are in the world ``(..., 4, 3)`` [m], in the order of :data:`gaitopt.LEGS`.

    Args:
        robot: the robot.
        position: the base's position in the world ``(..., 3)`` [m].
        rpy: its roll, pitch and yaw ``(..., 3)`` [rad].
        joints: ``(..., nj)`` [rad], in the order of :attr:`Quadruped.joint_names`.

    Source: 003_8f161808651a8f3d.txt, Module C, "Full Forward Kinematics Chain".

    Raises:
        InputError: an array has another shape.
    """
    place = _array("position", position, 3)
    to_world = rpy_to_matrix(_array("rpy", rpy, 3)) @ robot.body_axes
    feet = _feet_in_body(robot, _array("joints", joints, len(robot.joint_names)))
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
    """Joint angles that put all feet where they are asked to be, below a given body.

    Knees are on their own side and feet below the roll axes (:meth:`Leg.inverse`); joints that no
    leg owns are neutral. Reach counts the links and the knees' limits; other joints' limits are
    not judged. The foot of a pitch-pitch leg must lie in the leg's plane.

    Args:
        robot: the robot.
        position: the base's position in the world ``(..., 3)`` [m].
        rpy: its roll, pitch and yaw ``(..., 3)`` [rad].
        feet: foot frames in the world ``(..., 4, 3)`` [m], in the order of :data:`gaitopt.LEGS`.
        on_unreachable: ``"raise"``, or ``"mask"``: say which feet are reached.

    Returns:
        ``(..., nj)`` [rad], in the order of :attr:`Quadruped.joint_names`; with ``"mask"`` also
        ``(..., 4)``, true where the foot is reached. Where it is not, the leg points towards it,
        straight or folded. Source: 003_8f161808651a8f3d.txt, Module C, Section 2.

    Raises:
        InputError: a foot is out of reach, an array has another shape, or ``on_unreachable`` is
            unknown.
    """
    if on_unreachable not in ("raise", "mask"):
        raise InputError(f"on_unreachable must be 'raise' or 'mask', got {on_unreachable!r}")
    place, angles = _array("position", position, 3), _array("rpy", rpy, 3)
    to_world = rpy_to_matrix(angles) @ robot.body_axes
    wanted = (_array("feet", feet, 4, 3) - place[..., None, :]) @ to_world
    joints = np.empty((*wanted.shape[:-2], len(robot.joint_names)))
    joints[...] = robot.neutral_joints()
    reached = np.empty(wanted.shape[:-1], dtype=np.bool_)
    for i, name in enumerate(LEGS):
        leg, points = robot.legs[name], wanted[..., i, :]
        # An unknown place is not reached either.
        reached[..., i] = leg.shortfall(points) <= REACH_TOLERANCE
        if on_unreachable == "raise" and not reached[..., i].all():
            raise InputError(_out_of_reach(robot, leg, points, reached[..., i]))
        joints[..., list(robot.leg_columns[name])] = leg.inverse(points)
    return joints if on_unreachable == "raise" else (joints, reached)


# --- velocities and accelerations -------------------------------------------------------------


def joint_rates(
    robot: Quadruped,
    rpy: ArrayLike,
    joints: ArrayLike,
    twist: ArrayLike,
    foot_velocities: ArrayLike,
    *,
    on_singular: Literal["raise", "nan"] = "raise",
) -> FloatArray:
    """Joint velocities of given motions of the body and the feet.

    Args:
        robot: the robot.
        rpy: roll, pitch and yaw of the base ``(..., 3)`` [rad].
        joints: ``(..., nj)`` [rad], in the order of :attr:`Quadruped.joint_names`.
        twist: velocity of the base in its own frame ``(..., 6)``, see :func:`base_twist`.
        foot_velocities: in the world ``(..., 4, 3)`` [m/s]. Of a pitch-pitch leg's foot only the
            part in the leg's plane is followed.
        on_singular: what to do where a leg is straight or folded, or a foot on its roll axis, so
            that no finite rate moves it: ``"raise"``, or ``"nan"`` for that leg's joints.

    Returns:
        ``(..., nj)`` [rad/s]; 0 for joints that no leg owns.

    Raises:
        InputError: a leg is singular, or an array has another shape.
    """
    motion = _body_motion(robot, rpy, twist)
    angles = _array("joints", joints, len(robot.joint_names))
    speeds = _array("foot_velocities", foot_velocities, 4, 3) @ motion.to_world
    feet = _feet_in_body(robot, angles)
    carried = motion.linear[..., None, :] + np.cross(motion.angular[..., None, :], feet)
    return _solved(robot, angles, speeds - carried, on_singular)


def joint_accelerations(
    robot: Quadruped,
    rpy: ArrayLike,
    joints: ArrayLike,
    twist: ArrayLike,
    rates: ArrayLike,
    twist_rate: ArrayLike,
    foot_accelerations: ArrayLike,
    *,
    on_singular: Literal["raise", "nan"] = "raise",
) -> FloatArray:
    """Joint accelerations of given motions of the body and the feet.

    Args:
        robot: the robot.
        rpy: roll, pitch and yaw of the base ``(..., 3)`` [rad].
        joints: ``(..., nj)`` [rad], in the order of :attr:`Quadruped.joint_names`.
        twist: velocity of the base in its own frame ``(..., 6)``, see :func:`base_twist`.
        rates: joint velocities ``(..., nj)`` [rad/s], of :func:`joint_rates`.
        twist_rate: derivative of ``twist`` ``(..., 6)``, see :func:`base_twist_rate`.
        foot_accelerations: in the world ``(..., 4, 3)`` [m/s^2].
        on_singular: as in :func:`joint_rates`.

    Returns:
        ``(..., nj)`` [rad/s^2]; 0 for joints that no leg owns.

    Raises:
        InputError: a leg is singular, or an array has another shape.
    """
    motion, change = _body_motion(robot, rpy, twist), _body_motion(robot, rpy, twist_rate)
    angles = _array("joints", joints, len(robot.joint_names))
    speeds = _array("rates", rates, len(robot.joint_names))
    pulls = _array("foot_accelerations", foot_accelerations, 4, 3) @ motion.to_world
    relative, turning = [], []
    for name in LEGS:
        leg, columns = robot.legs[name], list(robot.leg_columns[name])
        q, dq = angles[..., columns], speeds[..., columns]
        relative.append(np.einsum("...ij,...j->...i", leg.jacobian(q), dq))
        turning.append(np.einsum("...ij,...j->...i", jacobian_rate(leg, q, dq), dq))
    spin, feet = motion.angular[..., None, :], _feet_in_body(robot, angles)
    frame = change.linear + np.cross(motion.angular, motion.linear)
    carried = (
        frame[..., None, :]
        + np.cross(change.angular[..., None, :], feet)
        + np.cross(spin, np.cross(spin, feet) + 2.0 * np.stack(relative, axis=-2))
        + np.stack(turning, axis=-2)
    )
    return _solved(robot, angles, pulls - carried, on_singular)


def jacobian_rate(leg: Leg, q: ArrayLike, rates: ArrayLike) -> FloatArray:
    """Derivative of :meth:`Leg.jacobian` over time ``(..., 3, nj)``, in the body frame.

    Its product with ``rates`` is the foot's acceleration at constant joint velocities.

    Args:
        leg: the leg.
        q: joint angles ``(..., nj)`` [rad].
        rates: their derivatives ``(..., nj)`` [rad/s].

    Raises:
        InputError: an array has another shape.
    """
    signs = np.array(leg.signs)
    angles = np.moveaxis(_array("q", q, len(signs)) * signs, -1, 0)
    speeds = np.moveaxis(_array("rates", rates, len(signs)) * signs, -1, 0)
    thigh = angles[-2] + leg.zeros[0]
    shank = thigh + angles[-1] + leg.zeros[1]
    thigh_rate, shank_rate = speeds[-2], speeds[-2] + speeds[-1]
    roll, roll_rate = (angles[0], speeds[0]) if leg.has_roll else (0.0 * thigh, 0.0 * thigh)
    sine, cosine = np.sin(roll), np.cos(roll)
    # Height of the foot over the roll axis in the leg's plane, and how it changes.
    up, low = leg.upper * np.cos(thigh), leg.lower * np.cos(shank)
    up_slope, low_slope = leg.upper * np.sin(thigh), leg.lower * np.sin(shank)
    height, climb = -leg.drop - up - low, up_slope * thigh_rate + low_slope * shank_rate
    zero = 0.0 * climb

    def turned(x: FloatArray, z: FloatArray, dx: FloatArray, dz: FloatArray) -> FloatArray:
        """Rate of the column ``(x, -z sin, z cos)`` of a pitch joint."""
        return np.stack(
            [dx, -dz * sine - z * cosine * roll_rate, dz * cosine - z * sine * roll_rate], axis=-1
        )

    swing = np.stack(
        [
            zero,
            (height * sine - leg.lateral * cosine) * roll_rate - climb * cosine,
            -(height * cosine + leg.lateral * sine) * roll_rate - climb * sine,
        ],
        axis=-1,
    )
    knee = turned(-low, low_slope, low_slope * shank_rate, low * shank_rate)
    hip = knee + turned(-up, up_slope, up_slope * thigh_rate, up * thigh_rate)
    local = np.stack([swing, hip, knee][-len(signs) :], axis=-1)
    return np.asarray(leg.axes @ (local * signs))


# --- within -----------------------------------------------------------------------------------


class _BodyMotion(NamedTuple):
    """Body axes in the world ``(..., 3, 3)``, and a twist along them, each ``(..., 3)``."""

    to_world: FloatArray
    linear: FloatArray
    angular: FloatArray


def _body_motion(robot: Quadruped, rpy: ArrayLike, twist: ArrayLike) -> _BodyMotion:
    values = _array("twist", twist, 6)
    to_world = rpy_to_matrix(_array("rpy", rpy, 3)) @ robot.body_axes
    axes = robot.body_axes
    return _BodyMotion(to_world, values[..., :3] @ axes, values[..., 3:] @ axes)


def _feet_in_body(robot: Quadruped, joints: FloatArray) -> FloatArray:
    return np.stack(
        [robot.legs[leg].forward(joints[..., list(robot.leg_columns[leg])]) for leg in LEGS],
        axis=-2,
    )


def _solved(
    robot: Quadruped, joints: FloatArray, wanted: FloatArray, on_singular: str
) -> FloatArray:
    """Joint vectors ``(..., nj)`` whose Jacobians make ``wanted (..., 4, 3)`` in the body frame."""
    if on_singular not in ("raise", "nan"):
        raise InputError(f"on_singular must be 'raise' or 'nan', got {on_singular!r}")
    lead = np.broadcast_shapes(joints.shape[:-1], wanted.shape[:-2])
    found = np.zeros((*lead, joints.shape[-1]))
    for i, name in enumerate(LEGS):
        leg, columns = robot.legs[name], list(robot.leg_columns[name])
        # Two joints move the foot within the leg's plane; three need no such choice.
        axes = leg.axes if leg.has_roll else leg.axes[:, [0, 2]]
        matrix = axes.T @ leg.jacobian(joints[..., columns])
        largest = leg.upper * leg.lower * (leg.upper + leg.lower if leg.has_roll else 1.0)
        regular = np.abs(np.linalg.det(matrix)) > SINGULAR * largest
        if on_singular == "raise" and not regular.all():
            raise InputError(_singular(robot, leg, regular))
        safe = np.where(regular[..., None, None], matrix, np.eye(len(columns)))
        right = np.broadcast_to(wanted[..., i, :] @ axes, (*lead, len(columns)))
        rates = np.linalg.solve(safe, right[..., None])[..., 0]
        found[..., columns] = np.where(regular[..., None], rates, np.nan)
    return found


def _out_of_reach(robot: Quadruped, leg: Leg, points: FloatArray, reached: BoolArray) -> str:
    """What to say of the first foot ``points (..., 3)`` in the body frame that is not reached."""
    sample = tuple(int(k) for k in np.argwhere(~reached)[0])
    point = points[sample]
    if not np.isfinite(point).all():
        return f"{robot.name}: the place asked for foot {leg.name}{_at(sample)} is not finite"
    distance = float(np.sqrt(leg.straightness(*point)))
    aside = float((point - leg.hip) @ leg.axes[:, 1])
    what = f"{distance:.4g} m from its pitch axis where it reaches {leg.least_reach:.4g} to "
    what += f"{leg.reach:.4g} m"
    if not leg.has_roll and abs(aside - leg.lateral) > REACH_TOLERANCE:
        what += f", and {abs(aside - leg.lateral):.4g} m beside the plane of a leg without roll"
    elif leg.has_roll and leg.least_reach <= distance <= leg.reach:
        what = f"nearer to its roll axis than its sideways offset of {abs(leg.lateral):.4g} m"
    return (
        f"{robot.name}: leg {leg.name} does not reach its foot{_at(sample)}: it is {what} "
        f"({leg.shortfall(point):.3g} m short); move the body or the foot, or ask with "
        "on_unreachable='mask' which feet are reached"
    )


def _singular(robot: Quadruped, leg: Leg, regular: BoolArray) -> str:
    sample = tuple(int(k) for k in np.argwhere(~regular)[0])
    return (
        f"{robot.name}: no finite joint velocity moves foot {leg.name} in all directions"
        f"{_at(sample)}: the leg is straight or folded, or its foot is on the roll axis; keep off "
        "the end of its reach, or ask with on_singular='nan'"
    )


def _at(sample: tuple[int, ...]) -> str:
    return f" at sample {', '.join(map(str, sample))}" if sample else ""


def _transform(rotation: FloatArray, position: FloatArray) -> FloatArray:
    lead = np.broadcast_shapes(rotation.shape[:-2], position.shape[:-1])
    out = np.zeros((*lead, 4, 4))
    out[..., :3, :3], out[..., :3, 3], out[..., 3, 3] = rotation, position, 1.0
    return out


def _turned_back(rotation: FloatArray, vectors: FloatArray) -> FloatArray:
    return np.asarray(np.einsum("...ij,...i->...j", rotation, vectors))


def _joined(linear: FloatArray, angular: FloatArray) -> FloatArray:
    return np.concatenate(np.broadcast_arrays(linear, angular), axis=-1)


def _array(name: str, values: ArrayLike, *tail: int) -> FloatArray:
    array = np.asarray(values, np.float64)
    if array.shape[-len(tail) :] != tail:
        wanted = ", ".join(map(str, tail))
        raise InputError(f"{name} must be (..., {wanted}), got {array.shape}")
    return array
