"""A walk on a dense grid of knots."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.motion.path import MotionPath

RESERVE_KEPT = 0.5
"""Share of the settings' reserves of margin and clearance that the motion between knots keeps.

Chosen here: rows at knots ask for the margin (or the clearance) and the whole reserve. A motion is
accepted that keeps half of the reserve, so that rounds come to an end; half of it is still far more
than rounding.
"""


class DensePath(NamedTuple):
    """A walk on so dense a grid of knots that standing feet hardly slip between them.

    Attributes:
        base: position and roll, pitch, yaw of the robot's base in the world ``(N, 6)``.
        body_centre: in the heading frame ``(N, 3)`` [m].
        joints: in the robot's order ``(N, nj)`` [rad].
        times: of all dense knots ``(N,)`` [s].
        slowest_joint: the joint whose velocity limit sets the time of each dense interval
            ``(N - 1,)``.
        at_knots: index of the dense knot that is each knot of the problem ``(K,)``.
    """

    base: FloatArray
    body_centre: FloatArray
    joints: FloatArray
    times: FloatArray
    slowest_joint: np.ndarray
    at_knots: np.ndarray

    @property
    def values(self) -> FloatArray:
        """Base and joints, as the columns of a path ``(N, 6 + nj)``."""
        return np.concatenate([self.base, self.joints], axis=1)

    def motion_path(self) -> MotionPath:
        """The path that is straight between the dense knots; intervals of no time are left out."""
        kept = np.concatenate([[True], np.diff(self.times) > 0.0])
        return MotionPath.polyline(self.times[kept], self.values[kept])
