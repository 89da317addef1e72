"""A motion over footholds that is given by formulae, and the smooth path of it.

Body and flying foot move by formulae. Joints follow by inverse kinematics, so the feet that stand
do not slip.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from gaitopt.conventions import FloatArray, rotation_z
from gaitopt.motion.body_and_feet import base_poses, largest_slip
from gaitopt.motion.differences import time_derivatives
from gaitopt.motion.path import BASE_COLUMNS, MotionPath
from gaitopt.motion.pieces import States
from gaitopt.motion.smooth_path import smooth_path
from gaitopt.optimize.route.legs import BODY, JOINTS, ORIENTATION, StackedLegs
from gaitopt.planners.phase_by_phase.timing import SLIP_TOLERANCE
from gaitopt.planners.time_optimal.knots import Flying, RouteKnots
from gaitopt.robots.quadruped import Quadruped


class Contacts(NamedTuple):
    """Which feet stand at each of many instants, and where.

    Attributes:
        knot: the knot whose feet stand ``(N,)``.
        flying: which foot flies.
    """

    knot: np.ndarray
    flying: Flying


@dataclass(frozen=True, eq=False)
class FootholdMotion(ABC):
    """A motion in pieces, each of which has a formula.

    Poses are in the heading frame, paths in the world.

    Attributes:
        robot, heading: of the walk.
        legs: constants of the legs.
        knots: of the problem: where feet stand, and which foot flies when.
    """

    robot: Quadruped
    heading: float
    legs: StackedLegs
    knots: RouteKnots

    @property
    @abstractmethod
    def times(self) -> FloatArray:
        """When each piece begins, and when the last one ends ``(P + 1,)`` [s]."""

    @abstractmethod
    def poses_at(self, times: FloatArray, piece: np.ndarray) -> FloatArray:
        """Poses ``(N, 9)`` at times ``(N,)`` by the formulae of the given pieces ``(N,)``.

        A time may lie a little outside its piece, as finite differences need it.
        """

    @abstractmethod
    def contacts(self, piece: np.ndarray) -> Contacts:
        """Which feet stand during the given pieces ``(N,)``."""

    def piece_at(self, times: FloatArray) -> np.ndarray:
        """The piece that each time lies in ``(N,)``."""
        found = np.searchsorted(self.times, times, side="right") - 1
        return np.clip(found, 0, len(self.times) - 2)

    def joints_at(self, times: FloatArray, piece: np.ndarray) -> FloatArray:
        """Joint angles leg by leg ``(N, 12)`` [rad] by the formulae of the given pieces."""
        return self.joints_of(self.poses_at(times, piece), self.contacts(piece))

    def joints_of(self, poses: FloatArray, contacts: Contacts) -> FloatArray:
        """Joint angles leg by leg ``(N, 12)`` [rad] in poses ``(N, 9)``."""
        in_air = (~contacts.flying.stands).astype(np.float64)
        feet = self.knots.feet[contacts.knot]
        return self.legs.joints(poses, feet, in_air).reshape(-1, JOINTS)

    def values_at(self, times: FloatArray, piece: np.ndarray) -> FloatArray:
        """Columns of a path ``(N, 6 + nj)`` by the formulae of the given pieces."""
        return self.values_of(self.poses_at(times, piece), self.contacts(piece))

    def values_of(self, poses: FloatArray, contacts: Contacts) -> FloatArray:
        """Columns of a path ``(N, 6 + nj)`` in poses ``(N, 9)``."""
        out = np.empty((len(poses), BASE_COLUMNS + len(self.robot.joint_names)))
        out[:, :BASE_COLUMNS] = base_poses(
            self.robot, self.heading, poses[:, BODY], poses[:, ORIENTATION]
        )
        out[:, BASE_COLUMNS:] = self.robot.neutral_joints()
        joints = self.joints_of(poses, contacts)
        out[:, BASE_COLUMNS + self.robot.leg_joint_columns] = joints
        return out

    def path(self) -> MotionPath:
        """The motion as a path.

        Raises:
            SolverError: feet that stand leave their footholds.
        """

        def state(times: FloatArray, inside: FloatArray) -> States:
            piece = self.piece_at(inside)
            return (self.values_at(times, piece),
                    *time_derivatives(lambda t: self.values_at(t, piece), inside))  # fmt: skip

        return smooth_path(self.times, state, self._slip, SLIP_TOLERANCE)

    def _slip(self, times: FloatArray, values: FloatArray) -> FloatArray:
        """How far path values put standing feet from their footholds ``(N,)`` [m]."""
        contacts = self.contacts(self.piece_at(times))
        places = self.knots.feet[contacts.knot] @ rotation_z(self.heading).T
        return largest_slip(self.robot, values, places, contacts.flying.stands)
