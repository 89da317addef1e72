"""Rotations of one body at one instant: for one of them plain numbers are faster than arrays."""

from __future__ import annotations

import numpy as np

from gaitopt.conventions import FloatArray


def rotation_of(quaternion: FloatArray) -> FloatArray:
    """Rotation matrix ``(3, 3)`` of a unit quaternion xyzw.

    For one quaternion plain numbers are faster than arrays.
    """
    x, y, z, w = quaternion.tolist()
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


SMALLEST_SINE = 1e-9
"""Below this sine of a rotation's angle the sine is the angle, to rounding."""


def rotation_vector(rotation: FloatArray) -> FloatArray:
    """Rotation vector ``(3,)`` [rad] of a rotation matrix, for angles below pi."""
    r = rotation
    axis = 0.5 * np.array([r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]])
    sine = float(np.sqrt(axis @ axis))
    if sine < SMALLEST_SINE:
        return axis
    angle = float(np.arctan2(sine, 0.5 * (r[0, 0] + r[1, 1] + r[2, 2] - 1.0)))
    return np.asarray(axis * (angle / sine))
