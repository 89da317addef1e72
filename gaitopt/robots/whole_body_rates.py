"""Velocities and accelerations of the joints that follow from those of the body and the feet.

Closed forms over any number of samples, with the frames of :mod:`gaitopt.robots.whole_body`.
"""

from __future__ import annotations

from typing import Final, Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from gaitopt.conventions import LEGS, BoolArray, FloatArray
from gaitopt.errors import InputError, SingularLegError
from gaitopt.inputs import as_text, check_shape
from gaitopt.robots.leg import Leg
from gaitopt.robots.quadruped import Quadruped
from gaitopt.robots.rotations import (
    rpy_accelerations_to_angular,
    rpy_rates_to_angular,
    rpy_to_matrix,
)
from gaitopt.robots.whole_body import at_sample, feet_in_body, joined, turned_back

SINGULAR: Final = 1e-9
"""Share of its Jacobian's largest determinant below which a leg counts as singular.

Joint velocities are then about 1e9 times those in the best posture, or more.
"""


SINGULAR_LEG: Final = "straight or folded leg"
"""Begin of the conflict that an error names for a motion in which a leg is singular."""


def base_twist(rpy: ArrayLike, position_rates: ArrayLike, rpy_rates: ArrayLike) -> FloatArray:
    """Pinocchio's base velocity ``v[..., :6]``: linear, then angular, in the base's own frame.

    Args:
        rpy: ``(..., 3)`` [rad].
        position_rates: derivative of the base's position in the world ``(..., 3)`` [m/s].
        rpy_rates: derivative of ``rpy`` ``(..., 3)`` [rad/s].
    """
    rotation = rpy_to_matrix(check_shape("rpy", rpy, 3))
    linear = turned_back(rotation, check_shape("position_rates", position_rates, 3))
    angular = rpy_rates_to_angular(rpy, check_shape("rpy_rates", rpy_rates, 3))
    return joined(linear, angular)


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
    linear = turned_back(rotation, check_shape("position_accelerations", position_accelerations, 3))
    accelerations = check_shape("rpy_accelerations", rpy_accelerations, 3)
    angular = rpy_accelerations_to_angular(rpy, rpy_rates, accelerations)
    # The axes turn, so the components of a constant velocity change, too.
    return joined(linear - np.cross(twist[..., 3:], twist[..., :3]), angular)


def joint_rates(
    robot: Quadruped,
    rpy: ArrayLike,
    joints: ArrayLike,
    twist: ArrayLike,
    foot_velocities: ArrayLike,
    *,
    on_singular: Literal["raise", "nan"] = "raise",
) -> FloatArray:
    """Joint velocities for given velocities of base and feet.

    Args:
        robot: the robot.
        rpy: roll, pitch and yaw of the base ``(..., 3)`` [rad].
        joints: ``(..., nj)`` [rad], in the order of :attr:`Quadruped.joint_names`.
        twist: velocity of the base in its own frame ``(..., 6)``, see :func:`base_twist`.
        foot_velocities: in the world ``(..., 4, 3)`` [m/s]. A pitch-pitch leg's foot follows only
            the component in the leg's plane.
        on_singular: a leg is singular where it is straight or folded, or its foot is on the roll
            axis: no finite joint velocity moves the foot in some direction. ``"raise"`` an error,
            or return ``"nan"`` for that leg's joints.

    Returns:
        ``(..., nj)`` [rad/s]; 0 for joints that no leg owns.

    Raises:
        InputError: a leg is singular, or an array has another shape.
    """
    angles = check_shape("joints", joints, len(robot.joint_names))
    return _rates(robot, _body_motion(robot, rpy, twist), angles, foot_velocities,
                  _leg_matrices(robot, angles, on_singular))  # fmt: skip


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
    """Joint accelerations for given motions of base and feet.

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
    angles = check_shape("joints", joints, len(robot.joint_names))
    speeds = check_shape("rates", rates, len(robot.joint_names))
    matrices = _leg_matrices(robot, angles, on_singular)
    return _accelerations(robot, (motion, change), angles, speeds, foot_accelerations, matrices)


def joint_motions(
    robot: Quadruped, rpy: ArrayLike, joints: ArrayLike, twists: tuple[ArrayLike, ArrayLike],
    feet: tuple[ArrayLike, ArrayLike],
) -> tuple[FloatArray, FloatArray]:  # fmt: skip
    """:func:`joint_rates` and :func:`joint_accelerations` in two thirds of their time.

    Args:
        robot, rpy, joints: as in :func:`joint_rates`.
        twists: velocity of the base in its own frame, and its derivative, each ``(..., 6)``.
        feet: velocities and accelerations of the feet in the world, each ``(..., 4, 3)``.

    Raises:
        InputError: a leg is singular, or an array has another shape.
    """
    motion, change = (_body_motion(robot, rpy, twist) for twist in twists)
    angles = check_shape("joints", joints, len(robot.joint_names))
    matrices = _leg_matrices(robot, angles, "raise")
    rates = _rates(robot, motion, angles, feet[0], matrices)
    return rates, _accelerations(robot, (motion, change), angles, rates, feet[1], matrices)


def _rates(
    robot: Quadruped, motion: _BodyMotion, angles: FloatArray, foot_velocities: ArrayLike,
    matrices: list[_LegMatrix],
) -> FloatArray:  # fmt: skip
    """:func:`joint_rates` with the legs' matrices."""
    speeds = check_shape("foot_velocities", foot_velocities, 4, 3) @ motion.to_world
    feet = feet_in_body(robot, angles)
    carried = motion.linear[..., None, :] + np.cross(motion.angular[..., None, :], feet)
    return _solved(robot, matrices, angles, speeds - carried)


def _accelerations(
    robot: Quadruped, motions: tuple[_BodyMotion, _BodyMotion], angles: FloatArray,
    speeds: FloatArray, foot_accelerations: ArrayLike, matrices: list[_LegMatrix],
) -> FloatArray:  # fmt: skip
    """:func:`joint_accelerations` with the legs' matrices."""
    motion, change = motions
    wanted = check_shape("foot_accelerations", foot_accelerations, 4, 3) @ motion.to_world
    # Velocity of each foot relative to the body, and its acceleration at constant joint rates.
    relative, curving = [], []
    for name, matrix in zip(LEGS, matrices, strict=True):
        leg, columns = robot.legs[name], list(robot.leg_columns[name])
        q, dq = angles[..., columns], speeds[..., columns]
        relative.append(np.einsum("...ij,...j->...i", matrix.jacobian, dq))
        curving.append(np.einsum("...ij,...j->...i", leg.jacobian_rate(q, dq), dq))
    spin, feet = motion.angular[..., None, :], feet_in_body(robot, angles)
    # What feet have at constant joint rates: the origin's acceleration, and the turning body's.
    frame = change.linear + np.cross(motion.angular, motion.linear)
    carried = (
        frame[..., None, :]
        + np.cross(change.angular[..., None, :], feet)
        + np.cross(spin, np.cross(spin, feet) + 2.0 * np.stack(relative, axis=-2))
        + np.stack(curving, axis=-2)
    )
    return _solved(robot, matrices, angles, wanted - carried)


class _BodyMotion(NamedTuple):
    """Body axes in the world ``(..., 3, 3)``, and a twist in these axes, ``(..., 3)`` each."""

    to_world: FloatArray
    linear: FloatArray
    angular: FloatArray


def _body_motion(robot: Quadruped, rpy: ArrayLike, twist: ArrayLike) -> _BodyMotion:
    """A twist in the base's axes, turned into the body's."""
    values = check_shape("twist", twist, 6)
    to_world = rpy_to_matrix(check_shape("rpy", rpy, 3)) @ robot.body_axes
    axes = robot.body_axes
    return _BodyMotion(to_world, values[..., :3] @ axes, values[..., 3:] @ axes)


class _LegMatrix(NamedTuple):
    """How a leg's joints move its foot.

    Attributes:
        jacobian: in the body frame ``(..., 3, k)``.
        axes: directions in which the joints can move the foot ``(3, k)``.
        inverse: of the Jacobian's part along them ``(..., k, k)``; NaN where the leg is singular.
    """

    jacobian: FloatArray
    axes: FloatArray
    inverse: FloatArray


def _leg_matrices(robot: Quadruped, joints: FloatArray, on_singular: str) -> list[_LegMatrix]:
    """Of all legs at joint angles ``(..., nj)``."""
    if on_singular not in ("raise", "nan"):
        raise InputError(f"on_singular must be 'raise' or 'nan', got {as_text(on_singular)}")
    out = []
    for name in LEGS:
        leg, columns = robot.legs[name], list(robot.leg_columns[name])
        # Two joints move the foot in the leg's plane only; three joints in all directions.
        axes = leg.axes if leg.has_roll else leg.axes[:, [0, 2]]
        jacobian = leg.jacobian(joints[..., columns])
        matrix = axes.T @ jacobian
        largest = leg.upper * leg.lower * (leg.upper + leg.lower if leg.has_roll else 1.0)
        regular = np.abs(np.linalg.det(matrix)) > SINGULAR * largest
        if on_singular == "raise" and not regular.all():
            raise _singular(robot, leg, regular)
        safe = np.where(regular[..., None, None], matrix, np.eye(len(columns)))
        inverse = np.where(regular[..., None, None], np.linalg.inv(safe), np.nan)
        out.append(_LegMatrix(jacobian, axes, inverse))
    return out


def _solved(
    robot: Quadruped, matrices: list[_LegMatrix], joints: FloatArray, wanted: FloatArray
) -> FloatArray:
    """Joint vectors ``(..., nj)`` that the legs' Jacobians map to ``wanted (..., 4, 3)``."""
    found = np.zeros((*np.broadcast_shapes(joints.shape[:-1], wanted.shape[:-2]), joints.shape[-1]))
    for i, (name, matrix) in enumerate(zip(LEGS, matrices, strict=True)):
        right = wanted[..., i, :] @ matrix.axes
        found[..., list(robot.leg_columns[name])] = (matrix.inverse @ right[..., None])[..., 0]
    return found


def _singular(robot: Quadruped, leg: Leg, regular: BoolArray) -> SingularLegError:
    """The error for the first sample in which a leg is singular."""
    sample = tuple(int(k) for k in np.argwhere(~regular)[0])
    return SingularLegError(
        f"{robot.name}: no finite joint velocity moves foot {leg.name} in all directions"
        f"{at_sample(sample)}: the leg is straight or folded, or its foot is on the roll axis; "
        "keep off the end of its reach, or ask with on_singular='nan'",
        leg.name,
    )
