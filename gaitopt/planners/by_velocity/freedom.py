"""How a gait's body may move: straight ahead, level at one height, or free to rise and turn."""

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

    AHEAD = auto()
    """The way of its centre along a straight route: legs without roll joints hold it there. The
    body is level, at one height."""
    LEVEL = auto()
    """x and y of its centre; it is level, at one height, and turns as its route does."""
    FREE = auto()
    """All six of its base: x, y, z, roll, pitch and yaw."""

    def route(self, motion: GaitMotion, times: FloatArray) -> States:
        """The coordinates along the route ``(N, d)``, and two derivatives."""
        centre = motion.route.motion(times)
        if self is Freedom.AHEAD:
            place, velocity, acceleration = (row @ motion.ahead[:, None] for row in centre)
            return place, velocity, acceleration
        return motion.base_of(times, centre) if self is Freedom.FREE else centre

    def sizes(self, motion: GaitMotion) -> FloatArray:
        """Lengths that count like a unit of each coordinate ``(d,)`` [m]."""
        if self is not Freedom.FREE:
            return np.ones(1 if self is Freedom.AHEAD else 2)
        return np.repeat([1.0, motion.robot.stance_size[0] / 2.0], 3)

    def largest_offsets(self, motion: GaitMotion, level: float) -> FloatArray:
        """How far each coordinate may be from the route ``(d,)``.

        Args:
            motion: along its route.
            level: the same of x and y, or of the way [m].
        """
        if self is not Freedom.FREE:
            return np.full(1 if self is Freedom.AHEAD else 2, level)
        return np.array([level, level, LARGEST_RISE * motion.height, *[LARGEST_TURN] * 3])
