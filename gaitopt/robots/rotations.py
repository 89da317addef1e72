"""Roll-pitch-yaw angles, R = Rz(yaw) Ry(pitch) Rx(roll), and quaternions, over any samples.

Source: [XiLing], Module C, Section 1.3. Angular velocities and accelerations are
in the body's own frame, as Pinocchio has them.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from gaitopt.conventions import FloatArray
from gaitopt.errors import InputError


def rpy_to_matrix(rpy: ArrayLike) -> FloatArray:
    """Rotation matrices ``(..., 3, 3)`` of ``rpy (..., 3)`` [rad]."""
    return _matrices(rpy_matrix_rows(*_columns(rpy)))


def rpy_matrix_rows(roll: Any, pitch: Any, yaw: Any) -> list[list[Any]]:
    """Rows of the rotation matrix of three angles [rad]; takes arrays or CasADi symbols."""
    (cr, cp, cy), (sr, sp, sy) = (
        [f(angle) for angle in (roll, pitch, yaw)] for f in (np.cos, np.sin)
    )
    return [
        [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
        [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
        [-sp, cp * sr, cp * cr],
    ]


def rpy_derivatives(rpy: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Derivatives of :func:`rpy_to_matrix` by the angles.

    Returns:
        The first ones, by roll, pitch and yaw ``(3, ..., 3, 3)``; and the second ones, by (roll,
        roll), (roll, pitch), (roll, yaw), (pitch, pitch), (pitch, yaw) and (yaw, yaw)
        ``(6, ..., 3, 3)``.
    """
    roll, pitch, yaw = _columns(rpy)
    (cr, cp, cy), (sr, sp, sy) = (
        [f(angle) for angle in (roll, pitch, yaw)] for f in (np.cos, np.sin)
    )
    matrix = _matrices(rpy_matrix_rows(roll, pitch, yaw))
    by_pitch = _matrices([[-cy * sp, cy * cp * sr, cy * cp * cr],
                          [-sy * sp, sy * cp * sr, sy * cp * cr],
                          [-cp, -sp * sr, -sp * cr]])  # fmt: skip
    by_roll = _by_roll(matrix)
    first = np.stack([by_roll, by_pitch, _by_yaw(matrix)])
    # Of Ry, which stands between the others, the second derivative is -Ry but for the y axis.
    twice = -matrix
    for row, of_yaw in enumerate((-sy, cy)):
        twice[..., row, 1] += of_yaw * cr
        twice[..., row, 2] -= of_yaw * sr
    second = np.stack([_by_roll(by_roll), _by_roll(by_pitch), _by_yaw(by_roll), twice,
                       _by_yaw(by_pitch), _by_yaw(first[2])])  # fmt: skip
    return first, second


def _by_roll(matrix: FloatArray) -> FloatArray:
    """Derivative by the roll of ``... Rx(roll)``: the columns y and z turn."""
    out = np.zeros_like(matrix)
    out[..., 1], out[..., 2] = matrix[..., 2], -matrix[..., 1]
    return out


def _by_yaw(matrix: FloatArray) -> FloatArray:
    """Derivative by the yaw of ``Rz(yaw) ...``: the rows x and y turn."""
    out = np.zeros_like(matrix)
    out[..., 0, :], out[..., 1, :] = -matrix[..., 1, :], matrix[..., 0, :]
    return out


def rpy_to_quaternion(rpy: ArrayLike) -> FloatArray:
    """Unit quaternions ``(..., 4)`` in Pinocchio's order x, y, z, w of ``rpy (..., 3)`` [rad]."""
    half = np.asarray(rpy, np.float64) / 2.0
    (cr, cp, cy), (sr, sp, sy) = _cosines(half), _sines(half)
    return np.stack(
        [
            sr * cp * cy - cr * sp * sy,
            cr * sp * cy + sr * cp * sy,
            cr * cp * sy - sr * sp * cy,
            cr * cp * cy + sr * sp * sy,
        ],
        axis=-1,
    )


def quaternion_to_matrix(quaternion: ArrayLike) -> FloatArray:
    """Rotation matrices ``(..., 3, 3)`` of quaternions x, y, z, w ``(..., 4)`` of any length.

    Raises:
        InputError: a quaternion is zero, and so no rotation.
    """
    values = np.asarray(quaternion, np.float64)
    square = (values**2).sum(axis=-1)
    if (square == 0.0).any():
        raise InputError(
            f"quaternion {tuple(map(int, np.argwhere(square == 0.0)[0]))} is zero, which is no "
            "rotation; no rotation at all is (0, 0, 0, 1)"
        )
    x, y, z, w = np.moveaxis(values, -1, 0)
    s = 2.0 / square
    rows = [
        [1 - s * (y * y + z * z), s * (x * y - z * w), s * (x * z + y * w)],
        [s * (x * y + z * w), 1 - s * (x * x + z * z), s * (y * z - x * w)],
        [s * (x * z - y * w), s * (y * z + x * w), 1 - s * (x * x + y * y)],
    ]
    return _matrices(rows)


def matrix_to_rpy(matrix: ArrayLike) -> FloatArray:
    """Roll, pitch and yaw ``(..., 3)`` [rad] of rotation matrices ``(..., 3, 3)``.

    Roll and yaw lie within half a turn, pitch within a quarter. At a pitch of exactly a quarter
    turn only one combination of roll and yaw has an effect, and roll is set to 0. Over time the
    angles may jump by whole turns, which ``numpy.unwrap`` removes.
    """
    m = np.asarray(matrix, np.float64)
    roll = np.arctan2(m[..., 2, 1], m[..., 2, 2])
    pitch = np.arctan2(-m[..., 2, 0], np.hypot(m[..., 2, 1], m[..., 2, 2]))
    # Yaw is computed from roll: near a pitch of a quarter turn each alone is ill-conditioned, but
    # together they still give the matrix.
    sine, cosine = np.sin(roll), np.cos(roll)
    yaw = np.arctan2(
        sine * m[..., 0, 2] - cosine * m[..., 0, 1], cosine * m[..., 1, 1] - sine * m[..., 1, 2]
    )
    return np.stack([roll, pitch, yaw], axis=-1)


def quaternion_to_rpy(quaternion: ArrayLike) -> FloatArray:
    """Roll, pitch and yaw ``(..., 3)`` [rad] of quaternions x, y, z, w ``(..., 4)``.

    Raises:
        InputError: a quaternion is zero, and so no rotation.
    """
    return matrix_to_rpy(quaternion_to_matrix(quaternion))


def rpy_rates_to_angular(rpy: ArrayLike, rates: ArrayLike) -> FloatArray:
    """Angular velocity in the body's own frame ``(..., 3)`` [rad/s] from rates of ``rpy``."""
    (cr, cp, _), (sr, sp, _) = _cosines(rpy), _sines(rpy)
    roll, pitch, yaw = _columns(rates)
    return np.stack(
        [roll - sp * yaw, cr * pitch + sr * cp * yaw, -sr * pitch + cr * cp * yaw], axis=-1
    )


def angular_to_rpy_rates(rpy: ArrayLike, angular: ArrayLike) -> FloatArray:
    """Rates of ``rpy (..., 3)`` [rad/s] from the angular velocity in the body's own frame.

    They grow without bound as the pitch nears a quarter turn.
    """
    (cr, cp, _), (sr, sp, _) = _cosines(rpy), _sines(rpy)
    x, y, z = _columns(angular)
    yaw = (sr * y + cr * z) / cp
    return np.stack([x + sp * yaw, cr * y - sr * z, yaw], axis=-1)


def rpy_accelerations_to_angular(
    rpy: ArrayLike, rates: ArrayLike, accelerations: ArrayLike
) -> FloatArray:
    """Derivative of :func:`rpy_rates_to_angular` over time ``(..., 3)`` [rad/s^2].

    Args:
        rpy: ``(..., 3)`` [rad].
        rates: its first derivative [rad/s].
        accelerations: its second derivative [rad/s^2].
    """
    (cr, cp, _), (sr, sp, _) = _cosines(rpy), _sines(rpy)
    roll, pitch, yaw = _columns(rates)
    turning = [
        -cp * pitch * yaw,
        -sr * roll * pitch + (cr * cp * roll - sr * sp * pitch) * yaw,
        -cr * roll * pitch - (sr * cp * roll + cr * sp * pitch) * yaw,
    ]
    return np.asarray(rpy_rates_to_angular(rpy, accelerations) + np.stack(turning, axis=-1))


def _matrices(rows: list[list[Any]]) -> FloatArray:
    """Matrices ``(..., 3, 3)`` of nine arrays ``(...)``."""
    # Written into one array: planners ask for single matrices, for which np.stack takes longer
    # than all of the arithmetic.
    out = np.empty((*np.shape(rows[0][0]), 3, 3))
    for i, row in enumerate(rows):
        for j, entry in enumerate(row):
            out[..., i, j] = entry
    return out


def _columns(values: ArrayLike) -> FloatArray:
    array: FloatArray = np.asarray(values, np.float64)
    # As np.moveaxis(array, -1, 0), which takes ten times as long.
    return np.asarray(array.transpose(array.ndim - 1, *range(array.ndim - 1)))


def _cosines(angles: ArrayLike) -> FloatArray:
    return np.cos(_columns(angles))


def _sines(angles: ArrayLike) -> FloatArray:
    return np.sin(_columns(angles))
