"""Second derivatives of functions of the joints by the poses of a walk."""

from __future__ import annotations

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.optimize.route.legs import (
    BODY,
    FOOT,
    JOINTS,
    ORIENTATION,
    POSE,
    LegKinematics,
    StackedLegs,
)

ANGLE_PAIRS = [(a, b) for a in range(3) for b in range(a, 3)]
"""Pairs of roll (0), pitch (1) and yaw (2), as :func:`gaitopt.robots.rotations.rpy_derivatives`
orders its second derivatives."""


def add_second_derivatives(hessian: FloatArray, second: FloatArray) -> None:
    """Add second derivatives by roll, pitch and yaw to Hessians by the pose.

    Args:
        hessian: ``(K, 9, 9)``; is changed.
        second: of each of :data:`ANGLE_PAIRS` ``(6, K)``.
    """
    first = ORIENTATION.start
    for (a, b), values in zip(ANGLE_PAIRS, second, strict=True):
        hessian[:, first + a, first + b] += values
        if a != b:
            hessian[:, first + b, first + a] += values


def pose_hessian(
    legs: StackedLegs, kinematics: LegKinematics, weights: FloatArray,
    of_joints: FloatArray | float = 0.0,
) -> FloatArray:  # fmt: skip
    """Second derivative by the pose of a function of the joints ``(K, 9, 9)``.

    Deriving ``forward(inverse(p)) = p`` twice gives the second derivative of the inverse
    kinematics from that of the forward kinematics.

    Args:
        legs: the legs.
        kinematics: of them at the poses.
        weights: the function's gradient by the angles ``(K, 4, 3)``.
        of_joints: its second derivative by those of each leg ``(K, 4, 3, 3)``; 0 for a weighted
            sum of the angles.
    """
    by_foot, count = kinematics.joints_by_foot, len(weights)
    # The weights as weights on the feet's places: to first order, both sums are the same.
    on_feet = (weights[:, :, None] @ by_foot)[:, :, 0]
    inner = of_joints - _forward_hessian(legs, kinematics, on_feet)
    inner = np.swapaxes(by_foot, 2, 3) @ inner @ by_foot
    # By the feet's places in the world, as those that fly and the body centre are in the pose:
    # sums over all legs, and over those that fly.
    sums = np.stack([np.ones_like(kinematics.swing), kinematics.swing], axis=1)
    rotations = kinematics.rotations
    turn = rotations.matrix[:, None]
    moved = (sums @ inner.reshape(count, 4, 9)).reshape(count, 2, 3, 3)
    moved = turn @ moved @ np.swapaxes(turn, 2, 3)
    out = np.zeros((count, POSE, POSE))
    out[:, BODY, BODY], out[:, FOOT, FOOT] = moved[:, 0], moved[:, 1]
    out[:, BODY, FOOT] = out[:, FOOT, BODY] = -moved[:, 1]
    if rotations.first is None or rotations.second is None:
        return out
    by_angles = np.ascontiguousarray(kinematics.foot_by_pose[..., ORIENTATION])
    mixed = inner @ by_angles
    flat = np.swapaxes(by_angles.reshape(count, JOINTS, 3), 1, 2)
    out[:, ORIENTATION, ORIENTATION] = flat @ mixed.reshape(count, JOINTS, 3)
    turned = turn @ (sums @ mixed.reshape(count, 4, 9)).reshape(count, 2, 3, 3)
    # The feet's places in the body depend on products of angles and places.
    turned += ((sums @ on_feet) @ np.swapaxes(rotations.first, 2, 3)).transpose(1, 2, 3, 0)
    for where, block in ((BODY, -turned[:, 0]), (FOOT, turned[:, 1])):
        out[:, where, ORIENTATION] = block
        out[:, ORIENTATION, where] = np.swapaxes(block, 1, 2)
    both = np.swapaxes(kinematics.body_to_feet, 1, 2) @ on_feet
    second = rotations.second.reshape(len(rotations.second), -1, 9)
    add_second_derivatives(out, np.einsum("akj,kj->ak", second, both.reshape(-1, 9)))
    return out


def _forward_hessian(
    legs: StackedLegs, kinematics: LegKinematics, weights: FloatArray
) -> FloatArray:
    """Second derivative by the angles of ``weights . foot`` for every leg ``(K, 4, 3, 3)``.

    Args:
        legs, kinematics: as for :func:`pose_hessian`.
        weights: on the feet's places in the body frame ``(K, 4, 3)``.
    """
    s, c, pitch, height = kinematics.in_plane
    x, y, z = legs.in_leg_frames(weights)
    # Weights on the height, and on its product with the roll angle.
    upward, sideways = c * z - s * y, -(c * y + s * z)
    out = np.empty((*weights.shape, 3))
    # In the leg frame the foot is (x, d cos - height sin, d sin + height cos).
    out[..., 0, 0] = sideways * legs.lateral - upward * height
    out[..., 0, 1] = out[..., 1, 0] = sideways * pitch.thigh_z
    out[..., 0, 2] = out[..., 2, 0] = sideways * pitch.knee_z
    out[..., 1, 1] = x * pitch.thigh_z - upward * pitch.thigh_x
    knee = x * pitch.knee_z - upward * pitch.knee_x
    out[..., 1, 2] = out[..., 2, 1] = out[..., 2, 2] = knee
    return np.asarray(out * (legs.signs[:, :, None] * legs.signs[:, None, :]))
