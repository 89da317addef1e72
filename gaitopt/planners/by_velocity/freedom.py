"""How the body of a gait may move: level at one height, or free to rise, fall and turn."""

from __future__ import annotations

from enum import Enum, auto

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.motion.pieces import States
from gaitopt.planners.by_velocity.motion import GaitMotion

LARGEST_RISE = 0.5
"""How far a free body may be above or below its height, as a share of it. Chosen here: legs reach
no farther."""
LARGEST_TURN = 0.6
"""How far a free body may turn away from its level course about each axis [rad]. Chosen here, as
above: a bound of a1 pitches by 0.09 to either side."""


class Freedom(Enum):
    """Which coordinates of the body are found."""

    LEVEL = auto()
    """x and y of its centre; it is level, at one height, and turns as its route does."""
    FREE = auto()
    """All six of its base: x, y, z, roll, pitch and yaw."""

    def route(self, motion: GaitMotion, times: FloatArray) -> States:
        """The coordinates along the route ``(N, d)``, and two derivatives."""
        centre = motion.route.motion(times)
        return motion.base_of(times, centre) if self is Freedom.FREE else centre

    def sizes(self, motion: GaitMotion) -> FloatArray:
        """Lengths that count like a unit of each coordinate ``(d,)`` [m]."""
        if self is Freedom.LEVEL:
            return np.ones(2)
        return np.repeat([1.0, motion.robot.stance_size[0] / 2.0], 3)

    def largest_offsets(self, motion: GaitMotion, level: float) -> FloatArray:
        """How far each coordinate may be from the route ``(d,)``.

        Args:
            motion: along its route.
            level: the same of x and y [m].
        """
        if self is Freedom.LEVEL:
            return np.full(2, level)
        return np.array([level, level, LARGEST_RISE * motion.height, *[LARGEST_TURN] * 3])
