"""The true centre of mass along a route: in closed form, with its gradient and curvature.

A leg turns about its roll axis and two parallel pitch axes, so the first moment of its three links
about the hip, in the leg frame of :mod:`gaitopt.robots.leg`, is ``Rx(q1) (A + Ry(q2) B + Ry(q2 +
q3) C)`` with three constant vectors; all else on the robot moves with the body. Derivatives are by
the nine numbers of a pose (:mod:`gaitopt.optimize.route.legs`), exact.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from gaitopt.conventions import LEGS, FloatArray
from gaitopt.optimize.route.legs import BODY, ORIENTATION, POSE, LegKinematics
from gaitopt.robots.quadruped import Quadruped
from gaitopt.robots.rotations import rpy_to_matrix

_PAIRS = [(a, b) for a in range(3) for b in range(a, 3)]


class Com(NamedTuple):
    """The centre of mass at many poses, with its derivatives.

    Attributes:
        points: in the frame of the poses ``(K, 3)`` [m].
        slopes: derivative by the pose ``(K, 3, 9)``.
        inner: derivative of its place in the body frame by the pose ``(K, 3, 9)``.
        local: that place, from the body centre ``(K, 3)`` [m].
        by_joints: its derivative by the joints ``(K, 3, 12)`` [m/rad].
    """

    points: FloatArray
    slopes: FloatArray
    inner: FloatArray
    local: FloatArray
    by_joints: FloatArray


@dataclass(frozen=True, eq=False)
class MassDistribution:
    """Mass distribution of a robot whose legs have three joints each.

    Vectors are first moments divided by the robot's whole mass [m].

    Attributes:
        body: of all that moves with the body, about the body centre, in the body frame ``(3,)``.
        parts: ``A``, ``B``, ``C`` of every leg in its leg frame ``(3, 4, 3)``.
        axes: leg frames' axes as columns in the body frame ``(4, 3, 3)``.
        signs: sense of the joints against their leg frames ``(4, 3)``.
    """

    body: FloatArray
    parts: FloatArray
    axes: FloatArray
    signs: FloatArray

    @classmethod
    def of(cls, robot: Quadruped) -> MassDistribution:
        """Read off the Pinocchio model, joints that no leg owns at their neutral angles."""
        import pinocchio as pin

        model, data = robot.model, robot.model.createData()
        q = pin.neutral(model)
        q[7:] = robot.neutral_joints()
        for columns in robot.leg_columns.values():
            q[7:][list(columns)] = 0.0
        pin.forwardKinematics(model, data, q)
        masses = np.array([inertia.mass for inertia in model.inertias])
        frames = robot.body_axes.T
        places = np.array(
            [frames @ m.act(i.lever) for m, i in zip(data.oMi, model.inertias, strict=True)]
        )
        joints = np.array([frames @ m.translation for m in data.oMi])
        body, parts = (masses[:, None] * places).sum(axis=0), np.zeros((3, 4, 3))
        for i, name in enumerate(LEGS):
            leg = robot.legs[name]
            links = [model.getJointId(joint) for joint in leg.joints]
            mass = masses[links]
            # From the hip, in the leg frame: centres of the links, and the two pitch joints.
            at = (places[links] - leg.hip) @ leg.axes
            pitch, knee = (joints[links[1:]] - leg.hip) @ leg.axes
            parts[0, i] = mass[0] * at[0] + (mass[1] + mass[2]) * pitch
            parts[1, i] = mass[1] * (at[1] - pitch) + mass[2] * (knee - pitch)
            parts[2, i] = mass[2] * (at[2] - knee)
            body += mass.sum() * leg.hip - mass @ places[links]
        total = masses.sum()
        return cls(
            body=body / total - robot.centre, parts=parts / total,
            axes=np.array([robot.legs[name].axes for name in LEGS]),
            signs=np.array([robot.legs[name].signs for name in LEGS]),
        )  # fmt: skip

    def points(self, poses: FloatArray, joints: FloatArray) -> FloatArray:
        """The centre of mass ``(K, 3)`` [m] at ``poses (K, 9)`` with ``joints (K, 4, 3)``."""
        turned = rpy_to_matrix(poses[:, ORIENTATION])
        return np.asarray(
            poses[:, BODY] + np.einsum("Kij,Kj->Ki", turned, self.com_in_body(joints))
        )

    def com_in_body(self, joints: FloatArray) -> FloatArray:
        """The centre of mass from the body centre, in the body frame ``(K, 3)`` [m]."""
        moved = _rolled(joints[..., 0] * self.signs[:, 0], self._bent(joints)[0])[0]
        return np.asarray(np.einsum("lij,Klj->Ki", self.axes, moved) + self.body)

    def at(self, poses: FloatArray, kinematics: LegKinematics, gradients: FloatArray) -> Com:
        """The centre of mass with its first derivatives.

        Args:
            poses: ``(K, 9)``.
            kinematics: their joints.
            gradients: of all joints by the pose ``(K, 12, 9)``.
        """
        local, by_joints = self.com_in_body(kinematics.joints), self._by_joints(kinematics.joints)
        turned, first, _ = kinematics.turned
        inner = by_joints @ gradients
        slopes = turned @ inner
        slopes[:, range(3), range(3)] += 1.0
        slopes[:, :, ORIENTATION] += np.einsum("aKij,Kj->Kia", first, local)
        points = poses[:, BODY] + np.einsum("Kij,Kj->Ki", turned, local)
        return Com(points, slopes, inner, local, by_joints)

    def on_joints(self, kinematics: LegKinematics, com: Com, weights: FloatArray) -> FloatArray:
        """``weights (K, 3) . com`` as weights on the joints ``(K, 4, 3)``, to first order."""
        pull = np.einsum("Kji,Kj->Ki", kinematics.turned[0], weights)
        return np.asarray(np.einsum("Kij,Ki->Kj", com.by_joints, pull).reshape(-1, 4, 3))

    def curvature(
        self, kinematics: LegKinematics, gradients: FloatArray, com: Com, weights: FloatArray
    ) -> FloatArray:
        """Second derivative by the pose of ``weights (K, 3) . com``: ``(K, 9, 9)``.

        Without that of the joints themselves, which is :meth:`StackedLegs.curvature` with the
        weights of :meth:`on_joints`.
        """
        turned, first, second = kinematics.turned
        pull = np.einsum("Kji,Kj->Ki", turned, weights)
        by_leg = gradients.reshape(len(weights), 4, 3, POSE)
        inner = np.swapaxes(by_leg, 2, 3) @ (
            self._joint_curvature(kinematics.joints, pull) @ by_leg
        )
        out = inner.sum(axis=1)
        twist = np.einsum("aKij,Ki->Kaj", first, weights) @ com.inner
        out[:, ORIENTATION] += twist
        out[:, :, ORIENTATION] += np.swapaxes(twist, 1, 2)
        for k, (a, b) in enumerate(_PAIRS):
            bow = np.einsum("Ki,Kij,Kj->K", weights, second[k], com.local)
            out[:, 3 + a, 3 + b] += bow
            if a != b:
                out[:, 3 + b, 3 + a] += bow
        return np.asarray(out)

    def _bent(self, joints: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """``A + Ry(q2) B + Ry(q2 + q3) C``, and derivatives of the terms with B and C.

        Returns:
            The sum ``(K, 4, 3)``, and the first and second derivatives by their angles of the term
            with B and of the one with C, each ``(2, K, 4, 3)``.
        """
        thigh = joints[..., 1] * self.signs[:, 1]
        angles = np.stack([thigh, thigh + joints[..., 2] * self.signs[:, 2]])
        s, c = np.sin(angles), np.cos(angles)
        x, y, z = np.moveaxis(self.parts[1:, None], -1, 0)
        along, up = c * x + s * z, c * z - s * x
        still = np.zeros_like(along)
        turned = np.stack([along, y + still, up], axis=-1)
        first = np.stack([up, still, -along], axis=-1)
        second = -np.stack([along, still, up], axis=-1)
        return self.parts[0] + turned.sum(axis=0), first, second

    def _by_joints(self, joints: FloatArray) -> FloatArray:
        """Derivative of :meth:`local` by the joints ``(K, 3, 12)``."""
        roll = joints[..., 0] * self.signs[:, 0]
        arm, (thigh, knee), _ = self._bent(joints)
        by_angle = np.stack(
            [_rolled(roll, arm)[1], _rolled(roll, thigh + knee)[0], _rolled(roll, knee)[0]], axis=-1
        )
        out = self.axes @ (by_angle * self.signs[:, None])
        return np.asarray(np.moveaxis(out, 1, 2).reshape(len(joints), 3, 12))

    def _joint_curvature(self, joints: FloatArray, pull: FloatArray) -> FloatArray:
        """Second derivative by the joints of ``pull (K, 3) . local``: ``(K, 4, 3, 3)``."""
        roll = joints[..., 0] * self.signs[:, 0]
        arm, (thigh, knee), (bow, low) = self._bent(joints)
        along = np.einsum("lji,Kj->Kli", self.axes, pull)
        rolled = [_rolled(roll, v) for v in (arm, thigh + knee, knee, bow + low, low)]
        parts = [rolled[0][2], rolled[1][1], rolled[2][1], rolled[3][0], rolled[4][0]]
        a, b, c, d, e = ((part * along).sum(axis=-1) for part in parts)
        rows = [np.stack(row, axis=-1) for row in ((a, b, c), (b, d, e), (c, e, e))]
        return np.asarray(
            np.stack(rows, axis=-2) * (self.signs[:, :, None] * self.signs[:, None, :])
        )


def _rolled(angle: FloatArray, v: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """``Rx(angle) v`` and its first two derivatives by the angle."""
    s, c = np.sin(angle), np.cos(angle)
    y, z = c * v[..., 1] - s * v[..., 2], s * v[..., 1] + c * v[..., 2]
    still = np.zeros_like(y)
    return (np.stack([v[..., 0] + still, y, z], axis=-1), np.stack([still, -z, y], axis=-1),
            -np.stack([still, y, z], axis=-1))  # fmt: skip


@dataclass(frozen=True, eq=False)
class ComRows:
    """Inequalities ``normal . com - offset >= 0`` on the centre of mass at single poses.

    Attributes:
        masses: of the robot.
        knot: the pose that each row looks at ``(M,)``.
        normal: ``(M, 2)``.
        offset: ``(M,)`` [m].
    """

    masses: MassDistribution
    knot: np.ndarray
    normal: FloatArray
    offset: FloatArray

    def values(self, points: FloatArray) -> FloatArray:
        """Values ``(M,)`` [m] of rows with the centre of mass at ``points (K, 3)``."""
        return np.asarray((self.normal * points[self.knot, :2]).sum(axis=1) - self.offset)

    def since(self, first: int) -> ComRows:
        """The rows from the pose ``first`` on, which is counted as pose 0."""
        kept = self.knot >= first
        return replace(self, knot=self.knot[kept] - first, normal=self.normal[kept],
                       offset=self.offset[kept])  # fmt: skip

    def slopes(self, com: Com) -> FloatArray:
        """Their derivatives by their poses ``(M, 9)``."""
        return np.asarray(np.einsum("mi,mic->mc", self.normal, com.slopes[self.knot, :2]))

    def pull(self, v: FloatArray, knots: int) -> FloatArray:
        """``sum of v (M,) * values`` as weights on the centre of mass at each knot ``(K, 3)``."""
        out = np.zeros((knots, 3))
        for axis in range(2):
            out[:, axis] = np.bincount(self.knot, v * self.normal[:, axis], minlength=knots)
        return out
