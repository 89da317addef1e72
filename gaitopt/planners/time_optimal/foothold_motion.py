"""A motion over footholds that is given by formulae, and the smooth path of it.

Body and flying foot move by formulae; joints follow by inverse kinematics, so standing feet stand.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from gaitopt.conventions import LEGS, BoolArray, FloatArray, rotation_z
from gaitopt.motion.body_and_feet import base_poses
from gaitopt.motion.differences import time_derivatives
from gaitopt.motion.path import MotionPath
from gaitopt.motion.smooth_path import smooth_path
from gaitopt.optimize.route.legs import BODY, JOINTS, ORIENTATION, StackedLegs
from gaitopt.planners.time_optimal.dense import SLIP_TOLERANCE
from gaitopt.planners.time_optimal.knots import RouteKnots
from gaitopt.robots.quadruped import Quadruped
from gaitopt.robots.rotations import rpy_to_matrix


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
        out = np.empty((len(times), 6 + len(self.robot.joint_names)))
        out[:, :6] = base_poses(self.robot, self.heading, poses[:, BODY], poses[:, ORIENTATION])
        out[:, 6:] = self.robot.neutral_joints()
        columns = [6 + c for leg in LEGS for c in self.robot.leg_columns[leg]]
        out[:, columns] = self.angles(poses, self.contacts(piece))
        return out

    def path(self) -> MotionPath:
        """The motion as a path.

        Raises:
            SolverError: standing feet do not stay in their places.
        """

        def state(
            times: FloatArray, inner: FloatArray
        ) -> tuple[FloatArray, FloatArray, FloatArray]:
            piece = self.piece(inner)
            return (self.values(times, piece),
                    *time_derivatives(lambda t: self.values(t, piece), inner))  # fmt: skip

        return smooth_path(self.times, state, self._slip, SLIP_TOLERANCE)

    def _slip(self, times: FloatArray, values: FloatArray) -> FloatArray:
        """How far path values put standing feet from their places ``(N,)`` [m]."""
        contacts = self.contacts(self.piece(times))
        turned = rpy_to_matrix(values[:, 3:6]) @ self.robot.body_axes
        places = self.knots.feet[contacts.knot] @ rotation_z(self.heading).T
        slip = np.zeros(len(times))
        for i, leg in enumerate(LEGS):
            columns = [6 + c for c in self.robot.leg_columns[leg]]
            foot = self.robot.legs[leg].forward(values[:, columns])
            away = values[:, :3] + np.einsum("nij,nj->ni", turned, foot) - places[:, i]
            stands = ~(contacts.flies & (contacts.leg == i))
            slip = np.where(stands, np.maximum(slip, np.linalg.norm(away, axis=1)), slip)
        return slip
