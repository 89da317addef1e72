"""Four legs at once along a route: joint angles, their gradients, and their curvature.

A *pose* is nine numbers: the body centre (3) [m], the body's roll, pitch and yaw (3) [rad], and
the place of the foot that swings (3) [m]. All derivatives are exact and in closed form; a test
holds them against CasADi and against differences.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from gaitopt.conventions import LEGS, FloatArray
from gaitopt.robots.leg import wrap_angle
from gaitopt.robots.quadruped import Quadruped
from gaitopt.robots.rotations import rpy_derivatives, rpy_to_matrix

POSE, JOINTS = 9, 12
"""Numbers of a pose, and joints of four legs."""
BODY, ORIENTATION, FOOT = slice(0, 3), slice(3, 6), slice(6, 9)
_SINGULAR = 1e-9
_PAIRS = [(a, b) for a in range(3) for b in range(a, 3)]


class LegKinematics(NamedTuple):
    """Angles of all legs at many poses, with what their derivatives need.

    Attributes:
        joints: angles ``(K, 4, 3)`` [rad], each leg's joints from body to foot.
        joints_by_foot: derivative of the angles by the foot's place in the body frame
            ``(K, 4, 3, 3)``.
        place: derivative of that place by the pose ``(K, 4, 3, 9)``.
        turned: the body's rotation ``(K, 3, 3)``, its derivatives by roll, pitch, yaw
            ``(3, K, 3, 3)``, and its second ones ``(6, K, 3, 3)``.
        arms: from body centre to feet ``(K, 4, 3)`` [m].
        swing: 1 where the leg swings and its foot is part of the pose ``(K, 4)``.
    """

    joints: FloatArray
    joints_by_foot: FloatArray
    place: FloatArray
    turned: tuple[FloatArray, FloatArray, FloatArray]
    arms: FloatArray
    swing: FloatArray

    def joints_by_pose(self) -> FloatArray:
        """Derivative of all angles by the pose ``(K, 12, 9)``."""
        out = self.joints_by_foot @ self.place
        return np.asarray(out.reshape(len(out), 12, POSE))


@dataclass(frozen=True, eq=False)
class StackedLegs:
    """Constants of the four legs, stacked in the order of :data:`gaitopt.LEGS`.

    Attributes:
        hips ``(4, 3)``, axes ``(4, 3, 3)``, lateral, drop, upper, lower, knee ``(4,)``, signs
        ``(4, 3)``, zeros ``(4, 2)``, centres ``(4, 3)``: as in :class:`gaitopt.Leg`.
        body: the body centre in the body frame ``(3,)`` [m].
        low, high: position limits ``(4, 3)`` [rad].
        rates: velocity limits ``(4, 3)`` [rad/s].
    """

    hips: FloatArray
    axes: FloatArray
    lateral: FloatArray
    drop: FloatArray
    upper: FloatArray
    lower: FloatArray
    knee: FloatArray
    signs: FloatArray
    zeros: FloatArray
    centres: FloatArray
    body: FloatArray
    low: FloatArray
    high: FloatArray
    velocity_limits: FloatArray

    @property
    def reach(self) -> FloatArray:
        """Length of the straight legs from their pitch axes ``(4,)`` [m]."""
        return self.upper + self.lower

    @classmethod
    def of(cls, robot: Quadruped) -> StackedLegs:
        """Constants of a robot whose legs have three joints each."""
        legs = [robot.legs[name] for name in LEGS]

        def stack(name: str) -> FloatArray:
            return np.array([getattr(leg, name) for leg in legs], dtype=np.float64)

        limits = stack("position_limits")
        bounded = np.asarray(np.isfinite(limits).all(axis=1))
        centres = np.where(bounded, np.where(bounded[:, None], limits, 0.0).mean(axis=1), 0.0)
        return cls(
            hips=stack("hip"), axes=stack("axes"), lateral=stack("lateral"), drop=stack("drop"),
            upper=stack("upper"), lower=stack("lower"), knee=stack("knee"), signs=stack("signs"),
            zeros=stack("zeros"), centres=centres, body=np.array(robot.centre),
            low=limits[:, 0], high=limits[:, 1], velocity_limits=stack("velocity_limits"),
        )  # fmt: skip

    def kinematics(self, poses: FloatArray, feet: FloatArray, swing: FloatArray) -> LegKinematics:
        """Angles and first derivatives.

        Args:
            poses: ``(K, 9)``.
            feet: where the feet stand ``(K, 4, 3)`` [m]; the swinging one's is not looked at.
            swing: 1 for the leg whose foot is part of the pose ``(K, 4)``, else 0.
        """
        flying = swing[..., None]
        arms = np.where(flying > 0, poses[:, None, FOOT], feet) - poses[:, None, BODY]
        angles = poses[:, ORIENTATION]
        turned = (rpy_to_matrix(angles), *rpy_derivatives(angles))
        back = np.swapaxes(turned[0], 1, 2)
        local = arms @ turned[0] + self.body
        joints = self.inverse(local)
        place = np.zeros((*arms.shape, POSE))
        place[..., BODY] = -back[:, None]
        # p = R' arm: its derivative by an angle is (dR)' arm.
        place[..., ORIENTATION] = np.einsum("aKij,Kli->Klja", turned[1], arms)
        place[..., FOOT] = back[:, None] * flying[..., None]
        return LegKinematics(joints, self.joints_by_foot(joints), place, turned, arms, swing)

    def joints(self, poses: FloatArray, feet: FloatArray, swing: FloatArray) -> FloatArray:
        """Angles alone ``(K, 4, 3)`` [rad]."""
        arms = np.where(swing[..., None] > 0, poses[:, None, FOOT], feet) - poses[:, None, BODY]
        return self.inverse(arms @ rpy_to_matrix(poses[:, ORIENTATION]) + self.body)

    def inverse(self, local: FloatArray) -> FloatArray:
        """Angles ``(K, 4, 3)`` of feet at ``local (K, 4, 3)``; NaN out of reach."""
        x, y, z = np.moveaxis(np.einsum("lji,Klj->Kli", self.axes, local - self.hips), -1, 0)
        with np.errstate(invalid="ignore"):
            hang = -np.sqrt(y * y + z * z - self.lateral**2)
            down = hang + self.drop
            square = x * x + down * down
            straight, folded = (self.upper + self.lower) ** 2, (self.upper - self.lower) ** 2
            bend = 2.0 * self.knee * np.arctan2(
                np.sqrt(straight - square), np.sqrt(square - folded)
            )  # fmt: skip
        roll = np.arctan2(z, y) - np.arctan2(hang, self.lateral)
        thigh = np.arctan2(-x, -down) - np.arctan2(
            self.lower * np.sin(bend), self.upper + self.lower * np.cos(bend)
        )
        angles = np.stack([roll, thigh - self.zeros[:, 0], bend - self.zeros[:, 1]], axis=-1)
        return np.asarray(wrap_angle(self.signs * angles, self.centres))

    def joints_by_foot(self, joints: FloatArray) -> FloatArray:
        """Derivative of the angles by the foot's place in the body frame ``(K, 4, 3, 3)``.

        The inverse of the Jacobian, in closed form: in the frame turned by the roll angle, the
        roll alone moves the foot along y, and the pitch joints move it in the plane of x and z.
        A straight or folded leg, where the inverse has none, gets large but finite ones.
        """
        roll, ux, uz, lx, lz, hang = self._arms(joints)
        s, c = np.sin(roll), np.cos(roll)
        spanned, least = ux * lz - lx * uz, _SINGULAR * self.upper * self.lower
        # The knee's side gives the sign: the area is -upper lower sin(bend).
        area = 1.0 / np.where(np.abs(spanned) < least, -self.knee * least, spanned)
        level = _SINGULAR * self.lower
        around = -1.0 / np.where(np.abs(hang) < level, -level, hang)
        push = self.lateral * around * area
        zero = np.zeros_like(s)
        rows = [
            (zero, around, zero),
            (lz * area, lx * push, -lx * area),
            (-uz * area, -ux * push, ux * area),
        ]
        # Columns along y' = c y + s z and z' = -s y + c z, turned back to y and z.
        turned = [np.stack([a, c * b - s * d, s * b + c * d], axis=-1) for a, b, d in rows]
        out = np.stack(turned, axis=-2) * self.signs[..., None]
        return np.asarray(out @ np.swapaxes(self.axes, 1, 2))

    def _arms(self, joints: FloatArray) -> tuple[FloatArray, ...]:
        """Roll, how thigh and knee move the foot along x and ``hang``, and ``hang`` itself."""
        roll, thigh, bend = np.moveaxis(joints * self.signs, -1, 0)
        thigh, shank = thigh + self.zeros[:, 0], bend + thigh + self.zeros.sum(axis=1)
        lx, lz = -self.lower * np.cos(shank), self.lower * np.sin(shank)
        ux, uz = lx - self.upper * np.cos(thigh), lz + self.upper * np.sin(thigh)
        return roll, ux, uz, lx, lz, ux - self.drop

    def curvature(self, kinematics: LegKinematics, weights: FloatArray) -> FloatArray:
        """Second derivative by the pose of ``sum of weights (K, 4, 3) * angles``: ``(K, 9, 9)``.

        From ``forward(inverse(p)) = p``: the inverse's second derivative is minus that of the
        forward map, pulled back through the slopes.
        """
        pull = np.einsum("Klji,Klj->Kli", kinematics.joints_by_foot, weights)
        inner = -np.swapaxes(kinematics.joints_by_foot, 2, 3) @ self._forward_curvature(
            kinematics.joints, pull
        )
        inner = inner @ kinematics.joints_by_foot
        out = (np.swapaxes(kinematics.place, 2, 3) @ (inner @ kinematics.place)).sum(axis=1)
        _, first, second = kinematics.turned
        moved = np.einsum("aKij,Klj->Klia", first, pull)
        for k, (a, b) in enumerate(_PAIRS):
            twist = np.einsum("Kli,Kij,Klj->K", kinematics.arms, second[k], pull)
            out[:, 3 + a, 3 + b] += twist
            if a != b:
                out[:, 3 + b, 3 + a] += twist
        body, foot = -moved.sum(axis=1), (moved * kinematics.swing[..., None, None]).sum(axis=1)
        for where, block in ((BODY, body), (FOOT, foot)):
            out[:, where, ORIENTATION] += block
            out[:, ORIENTATION, where] += np.swapaxes(block, 1, 2)
        return np.asarray(out)

    def _forward_curvature(self, joints: FloatArray, pull: FloatArray) -> FloatArray:
        """Second derivative by the angles of ``pull (K, 4, 3) . foot``: ``(K, 4, 3, 3)``."""
        roll, ux, uz, lx, lz, hang = self._arms(joints)
        s, c = np.sin(roll), np.cos(roll)
        fx, fy, fz = np.moveaxis(np.einsum("lji,Klj->Kli", self.axes, pull), -1, 0)
        along, across = c * fz - s * fy, -(c * fy + s * fz)
        out = np.empty((*joints.shape, 3))
        # The foot is (px, d cos - hang sin, d sin + hang cos): turning it twice gives minus it.
        out[..., 0, 0] = across * self.lateral - along * hang
        out[..., 0, 1] = out[..., 1, 0] = across * uz
        out[..., 0, 2] = out[..., 2, 0] = across * lz
        out[..., 1, 1] = fx * uz - along * ux
        out[..., 1, 2] = out[..., 2, 1] = out[..., 2, 2] = fx * lz - along * lx
        return np.asarray(out * (self.signs[:, :, None] * self.signs[:, None, :]))
