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
from gaitopt.optimize.route.leg_hessians import add_second_derivatives
from gaitopt.optimize.route.legs import (
    BODY,
    JOINTS,
    ORIENTATION,
    LegKinematics,
)
from gaitopt.robots.quadruped import Quadruped
from gaitopt.robots.rotations import rpy_to_matrix
from gaitopt.robots.whole_body import zero_configuration


class LegMoments(NamedTuple):
    """First moments of four legs about their hips, in parts, each ``(K, 4)`` [m].

    ``Ry(thigh) B`` and ``Ry(thigh + knee) C`` have a forward and an upward part. By their angles
    these become upward and minus forward.

    Attributes:
        sine, cosine: of the roll angle.
        forward, up: of both terms ``(2, K, 4)``.
        moment: the whole sum before the roll, x, y and z ``(3, K, 4)``.
    """

    sine: FloatArray
    cosine: FloatArray
    forward: FloatArray
    up: FloatArray
    moment: FloatArray

    @property
    def rolled(self) -> FloatArray:
        """The sum after the roll ``(K, 4, 3)``."""
        x, y, z = self.moment
        rows = x, self.cosine * y - self.sine * z, self.sine * y + self.cosine * z
        return np.stack(rows, axis=-1)


class ComDerivatives(NamedTuple):
    """The COM at many poses, with its first derivatives.

    Attributes:
        com: in the frame of the poses ``(K, 3)`` [m].
        com_by_pose: ``(K, 3, 9)``.
        moments: of the legs.
        in_body: from the body centre, in the body frame ``(K, 3)`` [m].
        in_body_by_joints: ``(K, 3, 12)`` [m/rad].
        in_body_by_pose: ``(K, 3, 9)``.
    """

    com: FloatArray
    com_by_pose: FloatArray
    moments: LegMoments
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
        turned = (rotation @ self.com_in_body(joints)[:, :, None])[..., 0]
        return np.asarray(poses[:, BODY] + turned)

    def com_in_body(self, joints: FloatArray) -> FloatArray:
        """The COM from the body centre, in the body frame ``(K, 3)`` [m].

        Args:
            joints: ``(K, 4, 3)`` [rad].
        """
        return self._in_body(self._moments(joints))

    def derivatives(
        self, poses: FloatArray, kinematics: LegKinematics, joints_by_pose: FloatArray
    ) -> ComDerivatives:
        """The COM with its first derivatives.

        Args:
            poses: ``(K, 9)``.
            kinematics: at these poses.
            joints_by_pose: derivative of all joints by the pose ``(K, 12, 9)``.
        """
        rotations, moments = kinematics.rotations, self._moments(kinematics.joints)
        in_body, by_joints = self._in_body(moments), self._by_joints(moments)
        in_body_by_pose = by_joints @ joints_by_pose
        by_pose = rotations.matrix @ in_body_by_pose
        by_pose[:, range(3), range(3)] += 1.0
        if rotations.first is not None:
            turned = (rotations.first @ in_body[:, :, None])[..., 0]
            by_pose[:, :, ORIENTATION] += turned.transpose(1, 2, 0)
        com = poses[:, BODY] + (rotations.matrix @ in_body[:, :, None])[..., 0]
        return ComDerivatives(com, by_pose, moments, in_body, by_joints, in_body_by_pose)

    def joint_weights(
        self, kinematics: LegKinematics, com: ComDerivatives, weights: FloatArray
    ) -> FloatArray:
        """Gradient of ``weights . com`` by the joints alone, the body at rest ``(K, 4, 3)``.

        Args:
            kinematics, com: at the poses.
            weights: ``(K, 3)``.
        """
        in_body = _in_body(kinematics, weights)
        return np.asarray((in_body[:, None] @ com.in_body_by_joints).reshape(-1, 4, 3))

    def joint_hessian(
        self, kinematics: LegKinematics, com: ComDerivatives, weights: FloatArray
    ) -> FloatArray:
        """Second derivative by the joints of ``weights . com``, body at rest ``(K, 4, 3, 3)``.

        Args:
            kinematics, com: at the poses.
            weights: ``(K, 3)``.
        """
        s, c, forward, up, (_, my, mz) = com.moments
        x, y, z = self._in_leg_frames(_in_body(kinematics, weights))
        sideways, upward = c * y + s * z, s * y - c * z
        out = np.empty((*s.shape, 3, 3))
        out[..., 0, 0] = -(my * sideways - mz * upward)
        out[..., 0, 1] = out[..., 1, 0] = forward.sum(axis=0) * sideways
        out[..., 0, 2] = out[..., 2, 0] = forward[1] * sideways
        out[..., 1, 1] = up.sum(axis=0) * upward - forward.sum(axis=0) * x
        out[..., 1, 2] = out[..., 2, 1] = out[..., 2, 2] = up[1] * upward - forward[1] * x
        return np.asarray(out * (self.signs[:, :, None] * self.signs[:, None, :]))

    def add_orientation(
        self, hessian: FloatArray, kinematics: LegKinematics, com: ComDerivatives,
        weights: FloatArray,
    ) -> None:  # fmt: skip
        """Add what turning the body does to the second derivative of ``weights . com`` by the pose.

        Args:
            hessian: ``(K, 9, 9)``; is changed.
            kinematics, com: at the poses.
            weights: ``(K, 3)``.
        """
        rotations = kinematics.rotations
        if rotations.first is None or rotations.second is None:
            return
        # By an angle of the body and anything that moves the COM in the body.
        turned = (weights[:, None] @ rotations.first)[:, :, 0].swapaxes(0, 1)
        mixed = turned @ com.in_body_by_pose
        hessian[:, ORIENTATION] += mixed
        hessian[:, :, ORIENTATION] += np.swapaxes(mixed, 1, 2)
        both = (weights[:, :, None] * com.in_body[:, None]).reshape(len(weights), 9)
        second = rotations.second.reshape(len(rotations.second), -1, 9)
        add_second_derivatives(hessian, (second * both).sum(axis=2))

    def _moments(self, joints: FloatArray) -> LegMoments:
        """The legs' moments at ``joints (K, 4, 3)`` [rad]."""
        roll, thigh, knee = (joints * self.signs).transpose(2, 0, 1)
        angles = np.stack([thigh, thigh + knee])
        s, c = np.sin(angles), np.cos(angles)
        x, z = self.parts[1:, None, :, 0], self.parts[1:, None, :, 2]
        forward, up = c * x + s * z, c * z - s * x
        moment = np.stack([
            self.parts[0, :, 0] + forward.sum(axis=0),
            np.broadcast_to(self.parts[:, :, 1].sum(axis=0), roll.shape),
            self.parts[0, :, 2] + up.sum(axis=0),
        ])  # fmt: skip
        return LegMoments(np.sin(roll), np.cos(roll), forward, up, moment)

    def _in_body(self, moments: LegMoments) -> FloatArray:
        """The COM from the body centre, in the body frame ``(K, 3)`` [m]."""
        rolled = moments.rolled
        flat = self.axes.swapaxes(1, 2).reshape(JOINTS, 3)
        return np.asarray(rolled.reshape(len(rolled), JOINTS) @ flat + self.body)

    def _by_joints(self, moments: LegMoments) -> FloatArray:
        """Derivative of :meth:`com_in_body` by the joints ``(K, 3, 12)``."""
        s, c, forward, up, (_, my, mz) = moments
        both_forward, both_up = forward.sum(axis=0), up.sum(axis=0)
        by_angle = np.zeros((*s.shape, 3, 3))
        by_angle[..., 1, 0], by_angle[..., 2, 0] = -s * my - c * mz, c * my - s * mz
        for column, (f, u) in enumerate(((both_forward, both_up), (forward[1], up[1])), start=1):
            by_angle[..., 0, column] = u
            by_angle[..., 1, column], by_angle[..., 2, column] = s * f, -c * f
        out = self.axes @ (by_angle * self.signs[:, None])
        return np.asarray(out.swapaxes(1, 2).reshape(len(s), 3, JOINTS))

    def _in_leg_frames(self, vectors: FloatArray) -> FloatArray:
        """x, y and z of vectors ``(K, 3)`` of the body frame in the leg frames ``(3, K, 4)``."""
        flat = self.axes.swapaxes(1, 2).reshape(JOINTS, 3)
        return np.asarray((vectors @ flat.T).reshape(-1, len(LEGS), 3).transpose(2, 0, 1))


def _in_body(kinematics: LegKinematics, vectors: FloatArray) -> FloatArray:
    """Vectors ``(K, 3)`` of the world in the body frame."""
    return np.asarray((vectors[:, None] @ kinematics.rotations.matrix)[:, 0])


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
