"""The curve that one foot flies while its leg's joints move and the body stands still."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Generic, Protocol, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from gaitopt.conventions import FloatArray
from gaitopt.motion.bounds import largest_sizes
from gaitopt.motion.path import BASE_COLUMNS, MotionPath
from gaitopt.robots.leg import Leg


class JointCurve(Protocol):
    """The motion of one leg's joints over time."""

    @property
    def times(self) -> FloatArray:
        """Knots ``(K,)``, increasing [s]."""

    @property
    def largest_velocities(self) -> FloatArray:
        """Bound on the joint velocities on each interval ``(K - 1, nj)`` [rad/s]."""

    def evaluate(self, times: ArrayLike) -> FloatArray:
        """Joint angles at ``times (N,)``: ``(N, nj)`` [rad]."""


J = TypeVar("J", bound=JointCurve, covariant=True)


@dataclass(frozen=True, eq=False)
class FootCurve(Generic[J]):
    """What a leg's foot flies when its joints move and the body stands still.

    Attributes:
        leg: the leg.
        joints: its joints' motion.
        position: of the body frame in the world ``(3,)`` [m].
        rotation: body axes as columns in the world ``(3, 3)``.
    """

    leg: Leg
    joints: J
    position: FloatArray
    rotation: FloatArray

    @property
    def times(self) -> FloatArray:
        """Times of the knots ``(K,)`` [s]."""
        return self.joints.times

    @cached_property
    def speeds(self) -> FloatArray:
        """Bound on the foot's speed on each interval ``(K - 1,)`` [m/s].

        Joint velocities times the largest distances of the foot from the joints' axes.
        """
        return np.asarray(self.joints.largest_velocities @ self.leg.levers)

    def place(self, times: FloatArray) -> FloatArray:
        """The foot in the world ``(N, 3)`` [m] at ``times (N,)``."""
        foot = self.leg.forward(self.joints.evaluate(times))
        return np.asarray(self.position + foot @ self.rotation.T)


@dataclass(frozen=True, eq=False)
class LegOfPath:
    """The joints of one leg in a path of the whole robot.

    Attributes:
        path: of body and joints.
        columns: positions of the leg's joints, one of :attr:`Quadruped.leg_columns`.
    """

    path: MotionPath
    columns: tuple[int, ...]

    @property
    def times(self) -> FloatArray:
        """Knots of the path ``(K,)`` [s]."""
        return self.path.times

    @property
    def largest_velocities(self) -> FloatArray:
        """Bound on the leg's joint velocities on each segment ``(K - 1, nj)`` [rad/s]."""
        return largest_sizes(self.path)[:, BASE_COLUMNS + np.array(self.columns)]

    def evaluate(self, times: ArrayLike) -> FloatArray:
        """The leg's joint angles at ``times (N,)``: ``(N, nj)`` [rad]."""
        return self.path.evaluate(times)[:, BASE_COLUMNS + np.array(self.columns)]
