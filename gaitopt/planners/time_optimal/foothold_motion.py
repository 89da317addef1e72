"""A motion over footholds that is given by formulae, and the smooth path of it.

Body and flying foot move by formulae; joints follow by inverse kinematics, so standing feet stand.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from gaitopt.conventions import LEGS, BoolArray, FloatArray, rotation_z
from gaitopt.motion.body_and_feet import base_poses, largest_slip
from gaitopt.motion.differences import time_derivatives
from gaitopt.motion.path import BASE_COLUMNS, MotionPath
from gaitopt.motion.pieces import States
from gaitopt.motion.smooth_path import smooth_path
from gaitopt.optimize.route.legs import BODY, JOINTS, ORIENTATION, StackedLegs
from gaitopt.planners.time_optimal.dense import SLIP_TOLERANCE
from gaitopt.planners.time_optimal.knots import RouteKnots
from gaitopt.robots.quadruped import Quadruped


class Contacts(NamedTuple):
    """Which feet stand at each of many times, and where.

    Attributes:
        knot: whose feet stand ``(N,)``.
        flies: whether a foot flies ``(N,)``.
        leg: index of the leg that does ``(N,)``.
    """

    knot: np.ndarray
    flies: BoolArray
    leg: np.ndarray


@dataclass(frozen=True, eq=False)
class FootholdMotion(ABC):
    """A motion in pieces; all but the robot's base is in the heading frame.

    Attributes:
        robot, heading: of the walk.
        legs: constants of the legs.
        knots: of the problem: where feet stand, and who flies when.
    """

    robot: Quadruped
    heading: float
    legs: StackedLegs
    knots: RouteKnots

    @property
    @abstractmethod
    def times(self) -> FloatArray:
        """Begin of every piece, and the end ``(P + 1,)`` [s]."""

    @abstractmethod
    def poses_at(self, times: FloatArray, piece: np.ndarray) -> FloatArray:
        """Poses by the formulae of given pieces ``(N, 9)``."""

    @abstractmethod
    def contacts(self, piece: np.ndarray) -> Contacts:
        """Which feet stand on given pieces."""

    def piece(self, times: FloatArray) -> np.ndarray:
        """The piece that each time lies in ``(N,)``."""
        found = np.searchsorted(self.times, times, side="right") - 1
        return np.clip(found, 0, len(self.times) - 2)

    def angles(self, poses: FloatArray, contacts: Contacts) -> FloatArray:
        """Joint angles leg by leg ``(N, 12)`` [rad] in poses ``(N, 9)``."""
        flying = np.zeros((len(poses), len(LEGS)))
        flying[np.arange(len(poses)), contacts.leg] = contacts.flies
        feet = self.knots.feet[contacts.knot]
        return self.legs.joints(poses, feet, flying).reshape(-1, JOINTS)

    def values(self, times: FloatArray, piece: np.ndarray) -> FloatArray:
        """Columns of a path ``(N, 6 + nj)`` by the formulae of given pieces."""
        poses = self.poses_at(times, piece)
        out = np.empty((len(times), BASE_COLUMNS + len(self.robot.joint_names)))
        out[:, :BASE_COLUMNS] = base_poses(
            self.robot, self.heading, poses[:, BODY], poses[:, ORIENTATION]
        )
        out[:, BASE_COLUMNS:] = self.robot.neutral_joints()
        joints = self.angles(poses, self.contacts(piece))
        out[:, BASE_COLUMNS + self.robot.leg_joint_columns] = joints
        return out

    def path(self) -> MotionPath:
        """The motion as a path.

        Raises:
            SolverError: standing feet do not stay in their places.
        """

        def state(times: FloatArray, inside: FloatArray) -> States:
            piece = self.piece(inside)
            return (self.values(times, piece),
                    *time_derivatives(lambda t: self.values(t, piece), inside))  # fmt: skip

        return smooth_path(self.times, state, self._slip, SLIP_TOLERANCE)

    def _slip(self, times: FloatArray, values: FloatArray) -> FloatArray:
        """How far path values put standing feet from their places ``(N,)`` [m]."""
        contacts = self.contacts(self.piece(times))
        places = self.knots.feet[contacts.knot] @ rotation_z(self.heading).T
        standing = np.ones((len(times), len(LEGS)), dtype=np.bool_)
        standing[np.arange(len(times)), contacts.leg] = ~contacts.flies
        return largest_slip(self.robot, values, places, standing)
