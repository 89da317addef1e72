"""Kinematics of four legs at many poses: joint angles, and their first and second derivatives.

A *pose* is nine numbers: the body centre (3) [m], the body's roll, pitch and yaw (3) [rad], and the
place of the foot that swings (3) [m]. The feet that stand have given places. So a pose determines
all joint angles.

The formulas are those of :mod:`gaitopt.robots.leg`, with the trigonometry of
:mod:`gaitopt.robots.leg_angles`. What stands here in addition is what a solver needs and a single
:class:`~gaitopt.robots.leg.Leg` has not: all legs and poses in one array operation, out-of-reach
feet as NaN, the derivative of the *inverse* kinematics, and its second derivative. Legs with other
axes than roll-pitch-pitch do not have these formulas.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from gaitopt.conventions import LEGS, FloatArray
from gaitopt.errors import InputError
from gaitopt.robots.leg_angles import PitchDerivatives, pitch_angles, roll_and_height, wrap_angle
from gaitopt.robots.quadruped import Quadruped
from gaitopt.robots.rotations import rpy_derivatives, rpy_to_matrix

POSE, JOINTS = 9, 12
"""Numbers of a pose, and joints of four legs."""
BODY, ORIENTATION, FOOT = slice(0, 3), slice(3, 6), slice(6, 9)
"""Where the body centre, roll, pitch and yaw, and the swinging foot stand in a pose."""
_SINGULAR = 1e-9
"""Least determinant of the two pitch joints' Jacobian, as a share of its largest value, and least
distance of a foot from its roll axis, as a share of the lower leg. Nearer to a singularity these
values are used, so that derivatives stay finite. A knee at 1e-9 rad counts as straight for any
purpose, and the square of 1e9 is still far from overflow."""


def check_square_legs(robot: Quadruped) -> None:
    """Refuse a robot with legs that are not roll-pitch-pitch.

    Raises:
        InputError: names the first such leg, and the planner that takes it.
    """
    for name, leg in robot.legs.items():
        if leg.is_general:
            raise InputError(
                f"{robot.name}: the axes of leg {name} ({', '.join(leg.joints)}) are not "
                "roll-pitch-pitch, and the time-optimal planner (plan_route, objective='time') "
                "needs the closed form of such legs; take plan_crawl with its usual objective"
            )


class Rotations(NamedTuple):
    """Rotation matrices from body to world, and their derivatives by roll, pitch and yaw.

    Attributes:
        matrix: ``(K, 3, 3)``.
        first: by each of the angles ``(3, K, 3, 3)``; ``None`` where they are fixed.
        second: by each pair of angles ``(6, K, 3, 3)``, in the order of
            :func:`gaitopt.robots.rotations.rpy_derivatives`.
    """

    matrix: FloatArray
    first: FloatArray | None = None
    second: FloatArray | None = None

    @classmethod
    def of(cls, angles: FloatArray, fixed: bool = False) -> Rotations:
        """Of roll, pitch and yaw ``(K, 3)`` [rad].

        Args:
            angles: the angles.
            fixed: whether nothing is to be derived by them.
        """
        return cls(rpy_to_matrix(angles), *(() if fixed else rpy_derivatives(angles)))


class LegPlanes(NamedTuple):
    """Legs in their own planes, each an array ``(K, 4)``.

    The plane is the leg frame's plane of x and z turned by the roll angle.

    Attributes:
        sine, cosine: of the roll angle.
        pitch: derivatives of the foot's place by the pitch angles.
        height: of the foot over the roll axis [m].
    """

    sine: FloatArray
    cosine: FloatArray
    pitch: PitchDerivatives
    height: FloatArray


class LegKinematics(NamedTuple):
    """Joint angles of all legs at many poses, with what their derivatives need.

    Attributes:
        joints: angles ``(K, 4, 3)`` [rad], each leg's joints from body to foot.
        joints_by_foot: their derivative by the foot's place in the body frame ``(K, 4, 3, 3)``.
        foot_by_pose: derivative of that place by the pose ``(K, 4, 3, 9)``.
        rotations: of the body.
        body_to_feet: from body centre to feet, in the world ``(K, 4, 3)`` [m].
        swing: 1 where the leg swings and its foot is part of the pose, else 0 ``(K, 4)``.
        in_plane: the legs in their own planes.
    """

    joints: FloatArray
    joints_by_foot: FloatArray
    foot_by_pose: FloatArray
    rotations: Rotations
    body_to_feet: FloatArray
    swing: FloatArray
    in_plane: LegPlanes

    def joints_by_pose(self) -> FloatArray:
        """Derivative of all angles by the pose ``(K, 12, 9)``."""
        out = self.joints_by_foot @ self.foot_by_pose
        return np.asarray(out.reshape(len(out), JOINTS, POSE))


@dataclass(frozen=True, eq=False)
class StackedLegs:
    """Constants of the four legs, stacked in the order of :data:`gaitopt.LEGS`.

    Attributes:
        hips ``(4, 3)``, axes ``(4, 3, 3)``, lateral, drop, upper, lower, knee ``(4,)``, signs
        ``(4, 3)``, zeros ``(4, 2)``: as in :class:`gaitopt.robots.leg.Leg`.
        centres: middles of the joints' ranges ``(4, 3)`` [rad]; 0 for joints without limits. Angles
            are given within half a turn of it.
        body: the body centre in the body frame ``(3,)`` [m].
        low, high: position limits ``(4, 3)`` [rad].
        velocity_limits: ``(4, 3)`` [rad/s].
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
        """Constants of a robot whose legs are roll-pitch-pitch.

        Raises:
            InputError: a leg has other axes.
        """
        check_square_legs(robot)
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

    def joints(self, poses: FloatArray, feet: FloatArray, swing: FloatArray) -> FloatArray:
        """Joint angles ``(K, 4, 3)`` [rad]; NaN where a foot is out of reach.

        Args:
            poses: ``(K, 9)``.
            feet: where the feet stand ``(K, 4, 3)`` [m]; that of a swinging foot is not used.
            swing: 1 for the leg whose foot is part of the pose, else 0 ``(K, 4)``.
        """
        rotation = rpy_to_matrix(poses[:, ORIENTATION])
        return self.inverse(_body_to_feet(poses, feet, swing) @ rotation + self.body)

    def kinematics(
        self, poses: FloatArray, feet: FloatArray, swing: FloatArray, level: bool = False,
        known: FloatArray | None = None,
    ) -> LegKinematics:  # fmt: skip
        """Joint angles with their derivatives; arguments as for :meth:`joints`.

        Args:
            poses, feet, swing: as there.
            level: nothing is derived by the body's angles, which are fixed; such derivatives are 0.
            known: the joint angles, where they are known ``(K, 4, 3)`` [rad].
        """
        body_to_feet = _body_to_feet(poses, feet, swing)
        rotations = Rotations.of(poses[:, ORIENTATION], level)
        joints = known
        if joints is None:
            joints = self.inverse(body_to_feet @ rotations.matrix + self.body)
        to_body = np.swapaxes(rotations.matrix, 1, 2)
        foot_by_pose = np.zeros((*body_to_feet.shape, POSE))
        foot_by_pose[..., BODY] = -to_body[:, None]
        if rotations.first is not None:
            # The foot in the body frame is R' (foot - body centre): by an angle, R gets derived.
            foot_by_pose[..., ORIENTATION] = (body_to_feet @ rotations.first).transpose(1, 2, 3, 0)
        foot_by_pose[..., FOOT] = to_body[:, None] * swing[..., None, None]
        in_plane = self.in_plane(joints)
        return LegKinematics(
            joints, self.joints_by_foot(in_plane), foot_by_pose, rotations, body_to_feet, swing,
            in_plane,
        )  # fmt: skip

    def inverse(self, feet: FloatArray) -> FloatArray:
        """Joint angles ``(K, 4, 3)`` [rad] of feet in the body frame; NaN out of reach.

        Args:
            feet: ``(K, 4, 3)`` [m].
        """
        x, y, z = self.in_leg_frames(feet - self.hips)
        with np.errstate(invalid="ignore"):
            roll, height = roll_and_height(y, z, self.lateral, clamp=False)
            thigh, knee = pitch_angles(
                x, height + self.drop, self.upper, self.lower, self.knee, clamp=False
            )
        angles = np.stack([roll, thigh - self.zeros[:, 0], knee - self.zeros[:, 1]], axis=-1)
        return np.asarray(wrap_angle(self.signs * angles, self.centres))

    def joints_by_foot(self, in_plane: LegPlanes) -> FloatArray:
        """Derivative of the angles by the foot's place in the body frame ``(K, 4, 3, 3)``.

        This is the inverse of :meth:`gaitopt.robots.leg.Leg.jacobian` in closed form. In the leg
        frame turned by the roll angle, the roll joint moves the foot along y alone, and the pitch
        joints move it along x and z. Where the Jacobian has no inverse (:data:`_SINGULAR`), the
        result is large, but finite.

        Args:
            in_plane: the legs at the angles.
        """
        s, c, pitch, height = in_plane
        determinant = pitch.thigh_x * pitch.knee_z - pitch.knee_x * pitch.thigh_z
        # It is -upper lower sin(knee), so that the knee's side tells its sign.
        least = _SINGULAR * self.upper * self.lower
        inverse = 1.0 / np.where(np.abs(determinant) < least, -self.knee * least, determinant)
        least_height = _SINGULAR * self.lower
        roll_by_y = -1.0 / np.where(np.abs(height) < least_height, -least_height, height)
        # Rolling also lifts a foot that is beside its roll axis; the pitch joints undo that.
        lift = self.lateral * roll_by_y * inverse
        rows = [
            (None, roll_by_y, None),
            (pitch.knee_z * inverse, pitch.knee_x * lift, -pitch.knee_x * inverse),
            (-pitch.thigh_z * inverse, -pitch.thigh_x * lift, pitch.thigh_x * inverse),
        ]
        out = np.zeros((*s.shape, 3, 3))
        # Back from the turned axes y' = c y + s z and z' = -s y + c z.
        for row, (x, y, z) in zip(np.moveaxis(out, 2, 0), rows, strict=True):
            row[..., 1], row[..., 2] = c * y, s * y
            if x is not None and z is not None:
                row[..., 0] = x
                row[..., 1] -= s * z
                row[..., 2] += c * z
        out *= self.signs[..., None]
        return out if self._along_body else np.asarray(out @ np.swapaxes(self.axes, 1, 2))

    def in_plane(self, joints: FloatArray) -> LegPlanes:
        """The legs in their own planes, which are turned by the roll angles.

        Args:
            joints: ``(K, 4, 3)`` [rad].
        """
        roll, thigh, knee = np.ascontiguousarray((joints * self.signs).transpose(2, 0, 1))
        pitch = PitchDerivatives.at(
            thigh + self.zeros[:, 0], knee + self.zeros[:, 1], self.upper, self.lower
        )
        return LegPlanes(np.sin(roll), np.cos(roll), pitch, pitch.thigh_x - self.drop)

    @cached_property
    def _along_body(self) -> bool:
        """Whether all leg frames have the body's axes, so that nothing is to be turned."""
        return bool((self.axes == np.eye(3)).all())

    def in_leg_frames(self, vectors: FloatArray) -> FloatArray:
        """x, y and z of vectors ``(K, 4, 3)`` of the body frame in the leg frames ``(3, K, 4)``."""
        turned = vectors
        if not self._along_body:
            turned = np.einsum("lji,Klj->Kli", self.axes, vectors)
        return np.ascontiguousarray(turned.transpose(2, 0, 1))


def _body_to_feet(poses: FloatArray, feet: FloatArray, swing: FloatArray) -> FloatArray:
    """From body centre to feet, in the world ``(K, 4, 3)`` [m]."""
    places = np.where(swing[..., None] > 0, poses[:, None, FOOT], feet)
    return places - poses[:, None, BODY]
