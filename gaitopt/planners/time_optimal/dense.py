"""A walk on a dense grid of knots."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.motion.path import MotionPath

SLIP_TOLERANCE = 1e-5
"""Most that a standing foot may wander between two dense knots [m]."""


class Dense(NamedTuple):
    """A route on a dense grid.

    Attributes:
        body: base position and roll, pitch, yaw ``(N, 6)`` in the world.
        centre: body centre in the heading frame ``(N, 3)`` [m].
        joints: in the robot's order ``(N, nj)`` [rad].
        times: of all dense knots ``(N,)`` [s].
        slowest: the joint that sets each dense interval's time ``(N - 1,)``.
        knots: the dense knot of every knot of the problem ``(K,)``.
    """

    body: FloatArray
    centre: FloatArray
    joints: FloatArray
    times: FloatArray
    slowest: np.ndarray
    knots: np.ndarray


def motion_path(dense: Dense) -> MotionPath:
    """The polyline in joint space; parts in which nothing moves are left out."""
    kept = np.concatenate([[True], np.diff(dense.times) > 0.0])
    values = np.concatenate([dense.body, dense.joints], axis=1)
    return MotionPath.polyline(dense.times[kept], values[kept])
