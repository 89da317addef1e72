"""The true centre of mass (COM) at many poses, in closed form, with first and second derivatives.

A leg has a roll joint and two pitch joints. In the leg frame of :mod:`gaitopt.robots.leg`, the
first moment of its three links about the hip is ``Rx(roll) (A + Ry(thigh) B + Ry(thigh + knee) C)``
with three constant vectors. Everything else on the robot moves with the body. Derivatives are by
the nine numbers of a pose (:mod:`gaitopt.optimize.route.legs`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from gaitopt.conventions import LEGS, FloatArray
from gaitopt.optimize.route.legs import (
    BODY,
    JOINTS,
    ORIENTATION,
    POSE,
    LegKinematics,
    add_second_derivatives,
)
from gaitopt.robots.quadruped import Quadruped
from gaitopt.robots.rotations import rpy_to_matrix
from gaitopt.robots.whole_body import zero_configuration


class ComDerivatives(NamedTuple):
    """The COM at many poses, with its first derivatives.

    Attributes:
        com: in the frame of the poses ``(K, 3)`` [m].
        com_by_pose: ``(K, 3, 9)``.
        in_body: from the body centre, in the body frame ``(K, 3)`` [m].
        in_body_by_joints: ``(K, 3, 12)`` [m/rad].
        in_body_by_pose: ``(K, 3, 9)``.
    """

    com: FloatArray
    com_by_pose: FloatArray
    in_body: FloatArray
    in_body_by_joints: FloatArray
    in_body_by_pose: FloatArray


@dataclass(frozen=True, eq=False)
class MassDistribution:
    """Mass distribution of a robot whose legs have three joints each.

    First moments are divided by the robot's whole mass, so their unit is metre.

    Attributes:
        body: of all that moves with the body, about the body centre, in the body frame ``(3,)``
            [m]. The legs' masses count as if they were at their hips.
        parts: ``A``, ``B``, ``C`` of every leg in its leg frame ``(3, 4, 3)`` [m].
        axes: leg frames' axes as columns in the body frame ``(4, 3, 3)``.
        signs: +1 or -1: sense of turning of the joints against their leg frames ``(4, 3)``.
    """

    body: FloatArray
    parts: FloatArray
    axes: FloatArray
    signs: FloatArray

    @classmethod
    def of(cls, robot: Quadruped) -> MassDistribution:
        """Read off the Pinocchio model, joints that no leg owns at their neutral angles.

        Raises:
            InputError: the robot has no mass.
        """
        import pinocchio as pin

        robot.require_masses()

        model, data = robot.model, robot.model.createData()
        pin.forwardKinematics(model, data, zero_configuration(robot))
        masses = np.array([inertia.mass for inertia in model.inertias])
        to_body = robot.body_axes.T
        centres = np.array(
            [to_body @ m.act(i.lever) for m, i in zip(data.oMi, model.inertias, strict=True)]
        )
        joints = np.array([to_body @ m.translation for m in data.oMi])
        body, parts = (masses[:, None] * centres).sum(axis=0), np.zeros((3, 4, 3))
        for i, name in enumerate(LEGS):
            leg = robot.legs[name]
            links = [model.getJointId(joint) for joint in leg.joints]
            mass = masses[links]
            # From the hip, in the leg frame: the links' centres of mass, and both pitch joints.
            at = (centres[links] - leg.hip) @ leg.axes
            thigh, knee = (joints[links[1:]] - leg.hip) @ leg.axes
            parts[0, i] = mass[0] * at[0] + (mass[1] + mass[2]) * thigh
            parts[1, i] = mass[1] * (at[1] - thigh) + mass[2] * (knee - thigh)
            parts[2, i] = mass[2] * (at[2] - knee)
            body += mass.sum() * leg.hip - mass @ centres[links]
        total = masses.sum()
        return cls(
            body=body / total - robot.centre, parts=parts / total,
            axes=np.array([robot.legs[name].axes for name in LEGS]),
            signs=np.array([robot.legs[name].signs for name in LEGS]),
        )  # fmt: skip

    def com(self, poses: FloatArray, joints: FloatArray) -> FloatArray:
        """The COM ``(K, 3)`` [m] at ``poses (K, 9)`` with ``joints (K, 4, 3)`` [rad]."""
        rotation = rpy_to_matrix(poses[:, ORIENTATION])
        return np.asarray(
            poses[:, BODY] + np.einsum("Kij,Kj->Ki", rotation, self.com_in_body(joints))
        )

    def com_in_body(self, joints: FloatArray) -> FloatArray:
        """The COM from the body centre, in the body frame ``(K, 3)`` [m].

        Args:
            joints: ``(K, 4, 3)`` [rad].
        """
        moments = _rolled(joints[..., 0] * self.signs[:, 0], self._before_roll(joints)[0])[0]
        return np.asarray(np.einsum("lij,Klj->Ki", self.axes, moments) + self.body)

    def derivatives(
        self, poses: FloatArray, kinematics: LegKinematics, joints_by_pose: FloatArray
    ) -> ComDerivatives:
        """The COM with its first derivatives.

        Args:
            poses: ``(K, 9)``.
            kinematics: at these poses.
            joints_by_pose: derivative of all joints by the pose ``(K, 12, 9)``.
        """
        rotations, joints = kinematics.rotations, kinematics.joints
        in_body, by_joints = self.com_in_body(joints), self._by_joints(joints)
        in_body_by_pose = by_joints @ joints_by_pose
        by_pose = rotations.matrix @ in_body_by_pose
        by_pose[:, range(3), range(3)] += 1.0
        by_pose[:, :, ORIENTATION] += np.einsum("aKij,Kj->Kia", rotations.first, in_body)
        com = poses[:, BODY] + np.einsum("Kij,Kj->Ki", rotations.matrix, in_body)
        return ComDerivatives(com, by_pose, in_body, by_joints, in_body_by_pose)

    def joint_weights(
        self, kinematics: LegKinematics, com: ComDerivatives, weights: FloatArray
    ) -> FloatArray:
        """Gradient of ``weights . com`` by the joints alone, the body at rest ``(K, 4, 3)``.

        Args:
            kinematics, com: at the poses.
            weights: ``(K, 3)``.
        """
        in_body = np.einsum("Kji,Kj->Ki", kinematics.rotations.matrix, weights)
        return np.asarray(np.einsum("Kij,Ki->Kj", com.in_body_by_joints, in_body).reshape(-1, 4, 3))

    def hessian(
        self,
        kinematics: LegKinematics,
        joints_by_pose: FloatArray,
        com: ComDerivatives,
        weights: FloatArray,
    ) -> FloatArray:
        """Second derivative by the pose of ``weights . com``, a part of it ``(K, 9, 9)``.

        Missing is the part that the joints' own second derivative contributes. It is
        :meth:`StackedLegs.hessian` with the weights of :meth:`joint_weights`.

        Args:
            kinematics, joints_by_pose, com: at the poses.
            weights: ``(K, 3)``.
        """
        rotations = kinematics.rotations
        in_body = np.einsum("Kji,Kj->Ki", rotations.matrix, weights)
        by_leg = joints_by_pose.reshape(len(weights), 4, 3, POSE)
        joint_hessian = self._joint_hessian(kinematics.joints, in_body)
        out = (np.swapaxes(by_leg, 2, 3) @ (joint_hessian @ by_leg)).sum(axis=1)
        # By an angle of the body and anything that moves the COM in the body.
        mixed = np.einsum("aKij,Ki->Kaj", rotations.first, weights) @ com.in_body_by_pose
        out[:, ORIENTATION] += mixed
        out[:, :, ORIENTATION] += np.swapaxes(mixed, 1, 2)
        add_second_derivatives(out, [
            np.einsum("Ki,Kij,Kj->K", weights, second, com.in_body) for second in rotations.second
        ])  # fmt: skip
        return np.asarray(out)

    def _before_roll(self, joints: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """``A + Ry(thigh) B + Ry(thigh + knee) C``, and derivatives of its last two terms.

        Returns:
            The sum ``(K, 4, 3)``; the first and the second derivative of the terms with B and C by
            the angle in each ``(2, K, 4, 3)``.
        """
        thigh = joints[..., 1] * self.signs[:, 1]
        angles = np.stack([thigh, thigh + joints[..., 2] * self.signs[:, 2]])
        s, c = np.sin(angles), np.cos(angles)
        x, y, z = np.moveaxis(self.parts[1:, None], -1, 0)
        forward, up = c * x + s * z, c * z - s * x
        zero = np.zeros_like(forward)
        terms = np.stack([forward, y + zero, up], axis=-1)
        first = np.stack([up, zero, -forward], axis=-1)
        second = -np.stack([forward, zero, up], axis=-1)
        return self.parts[0] + terms.sum(axis=0), first, second

    def _by_joints(self, joints: FloatArray) -> FloatArray:
        """Derivative of :meth:`com_in_body` by the joints ``(K, 3, 12)``."""
        roll = joints[..., 0] * self.signs[:, 0]
        moment, (thigh, knee), _ = self._before_roll(joints)
        by_angle = np.stack(
            [_rolled(roll, moment)[1], _rolled(roll, thigh + knee)[0], _rolled(roll, knee)[0]],
            axis=-1,
        )
        out = self.axes @ (by_angle * self.signs[:, None])
        return np.asarray(np.moveaxis(out, 1, 2).reshape(len(joints), 3, JOINTS))

    def _joint_hessian(self, joints: FloatArray, weights: FloatArray) -> FloatArray:
        """Second derivative by the joints of ``weights . com_in_body`` ``(K, 4, 3, 3)``.

        Args:
            joints: ``(K, 4, 3)`` [rad].
            weights: in the body frame ``(K, 3)``.
        """
        roll = joints[..., 0] * self.signs[:, 0]
        moment, (thigh, knee), (thigh_2, knee_2) = self._before_roll(joints)
        in_leg_frames = np.einsum("lji,Kj->Kli", self.axes, weights)
        entries = [
            _rolled(roll, moment)[2],
            _rolled(roll, thigh + knee)[1],
            _rolled(roll, knee)[1],
            _rolled(roll, thigh_2 + knee_2)[0],
            _rolled(roll, knee_2)[0],
        ]
        a, b, c, d, e = ((entry * in_leg_frames).sum(axis=-1) for entry in entries)
        rows = [np.stack(row, axis=-1) for row in ((a, b, c), (b, d, e), (c, e, e))]
        return np.asarray(
            np.stack(rows, axis=-2) * (self.signs[:, :, None] * self.signs[:, None, :])
        )


def _rolled(angle: FloatArray, v: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """``Rx(angle) v`` and its first two derivatives by the angle."""
    s, c = np.sin(angle), np.cos(angle)
    y, z = c * v[..., 1] - s * v[..., 2], s * v[..., 1] + c * v[..., 2]
    zero = np.zeros_like(y)
    return (np.stack([v[..., 0] + zero, y, z], axis=-1), np.stack([zero, -z, y], axis=-1),
            -np.stack([zero, y, z], axis=-1))  # fmt: skip


@dataclass(frozen=True, eq=False)
class ComRows:
    """Inequalities ``normal . com - offset >= 0`` on the COM's horizontal place at single poses.

    Attributes:
        masses: of the robot.
        knot: the knot whose pose each row looks at ``(M,)``.
        normal: ``(M, 2)``.
        offset: ``(M,)`` [m].
    """

    masses: MassDistribution
    knot: np.ndarray
    normal: FloatArray
    offset: FloatArray

    def values(self, com: FloatArray) -> FloatArray:
        """Values ``(M,)`` [m] of the rows with the COM ``(K, 3)`` [m] at all knots."""
        return np.asarray((self.normal * com[self.knot, :2]).sum(axis=1) - self.offset)

    def from_knot(self, first: int) -> ComRows:
        """The rows from the knot ``first`` on, which becomes knot 0."""
        return self._chosen(self.knot >= first, first)

    def between(self, first: int, last: int) -> ComRows:
        """The rows of the knots after ``first`` up to ``last``; ``first`` becomes knot 0."""
        return self._chosen((self.knot > first) & (self.knot <= last), first)

    def _chosen(self, kept: np.ndarray, first: int) -> ComRows:
        """Some of the rows ``(M,)``, whose knots are counted from ``first``."""
        return replace(self, knot=self.knot[kept] - first, normal=self.normal[kept],
                       offset=self.offset[kept])  # fmt: skip

    def raised(self, offsets: FloatArray) -> ComRows:
        """The rows with offsets that are higher by ``offsets (M,)`` [m]."""
        return replace(self, offset=self.offset + offsets)

    def by_pose(self, com: ComDerivatives) -> FloatArray:
        """Derivatives of the rows by their poses ``(M, 9)``."""
        return np.asarray(np.einsum("mi,mic->mc", self.normal, com.com_by_pose[self.knot, :2]))

    def com_weights(self, v: FloatArray, knots: int) -> FloatArray:
        """Gradient of ``v . values`` by the COM at each knot ``(K, 3)``.

        Args:
            v: weights of the rows ``(M,)``.
            knots: how many there are.
        """
        out = np.zeros((knots, 3))
        for axis in range(2):
            out[:, axis] = np.bincount(self.knot, v * self.normal[:, axis], minlength=knots)
        return out
