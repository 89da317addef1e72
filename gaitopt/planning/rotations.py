"""Roll-pitch-yaw angles, R = Rz(yaw) Ry(pitch) Rx(roll), vectorised over samples."""

from __future__ import annotations

import numpy as np

from gaitopt.conventions import FloatArray


def rpy_to_matrix(rpy: FloatArray) -> FloatArray:
    """Rotation matrices ``(..., 3, 3)`` of ``rpy (..., 3)`` [rad]."""
    (cr, cp, cy), (sr, sp, sy) = np.moveaxis(np.cos(rpy), -1, 0), np.moveaxis(np.sin(rpy), -1, 0)
    rows = [
        [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
        [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
        [-sp, cp * sr, cp * cr],
    ]
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def rpy_to_quaternion(rpy: FloatArray) -> FloatArray:
    """Unit quaternions ``(..., 4)`` in Pinocchio's order x, y, z, w of ``rpy (..., 3)`` [rad]."""
    half = np.asarray(rpy) / 2.0
    (cr, cp, cy), (sr, sp, sy) = np.moveaxis(np.cos(half), -1, 0), np.moveaxis(np.sin(half), -1, 0)
    return np.stack(
        [
            sr * cp * cy - cr * sp * sy,
            cr * sp * cy + sr * cp * sy,
            cr * cp * sy - sr * sp * cy,
            cr * cp * cy + sr * sp * sy,
        ],
        axis=-1,
    )


def rpy_rates_to_angular(rpy: FloatArray, rates: FloatArray) -> FloatArray:
    """Angular velocity in the body's own frame ``(..., 3)`` [rad/s] from rates of ``rpy``."""
    roll, pitch, _ = np.moveaxis(np.asarray(rpy), -1, 0)
    droll, dpitch, dyaw = np.moveaxis(np.asarray(rates), -1, 0)
    cr, sr, cp = np.cos(roll), np.sin(roll), np.cos(pitch)
    return np.stack(
        [
            droll - np.sin(pitch) * dyaw,
            cr * dpitch + sr * cp * dyaw,
            -sr * dpitch + cr * cp * dyaw,
        ],
        axis=-1,
    )
