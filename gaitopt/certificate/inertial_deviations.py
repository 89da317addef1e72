"""How far inertial forces and moments leave their chords between samples, for all links at once."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gaitopt.certificate.derivative_bounds import ORDER, LinkBounds
from gaitopt.certificate.enclosure import Pieces, chord_deviation
from gaitopt.certificate.force_samples import chain_model
from gaitopt.conventions import LEGS, FloatArray
from gaitopt.robots.quadruped import Quadruped


@dataclass(frozen=True, eq=False)
class InertialDeviations:
    """Bounds on ``P`` pieces of a path; series are over the order of the derivative.

    Attributes:
        force, moment: how far what contact forces have to make leaves its chord ``(P,)`` [N],
            [N m]; the moment is about the middle of the contact points.
        joint_moments: series of the moment about each joint of what it carries ``(3, nj, P)``.
        arms: series of the vector from each leg's joint to the foot's contact ``(5, nj, P)``; 0
            for joints that no leg owns.
        axes: series of the rotation of each joint's frame ``(5, nj, P)``.
        motors: how far the torque that turns each joint's motor leaves its chord ``(nj, P)`` [N m].
    """

    force: FloatArray
    moment: FloatArray
    joint_moments: FloatArray
    arms: FloatArray
    axes: FloatArray
    motors: FloatArray

    @classmethod
    def of(cls, robot: Quadruped, pieces: Pieces, off: FloatArray) -> InertialDeviations:
        """Bounds for the motion of ``pieces``.

        Args:
            robot: the robot.
            pieces: of its path.
            off: how far the base is from the middle of the contact points at the start of each
                piece ``(P,)`` [m].
        """
        bounds = LinkBounds.of(chain_model(robot), pieces)
        model, lengths = bounds.model, pieces.lengths
        links = range(1, model.njoints)
        base = bounds.base.copy()
        base[0] += off
        force = np.sum([bounds.inertial_force(j)[2] for j in links], axis=0)
        moment = np.sum([
            bounds.inertial_moment(j, base + bounds.lever(j, 1, model.inertias[j].lever))[2]
            for j in links
        ], axis=0)  # fmt: skip
        joints = [int(model.getJointId(name)) for name in robot.joint_names]
        moments = np.stack([
            np.sum([
                bounds.inertial_moment(i, bounds.lever(i, joint, model.inertias[i].lever))
                for i in bounds.carried(joint)
            ], axis=0)
            for joint in joints
        ], axis=1)  # fmt: skip
        # The torque is the motor's inertia times the second derivative of the joint's angle.
        fourth = robot.motor_inertia[:, None] * pieces.largest(ORDER)[:, 6:].T
        return cls(
            chord_deviation(force, lengths), chord_deviation(moment, lengths), moments,
            _arms(robot, bounds, len(lengths)), np.stack([bounds.rotations[j] for j in joints], 1),
            chord_deviation(fourth, lengths),
        )  # fmt: skip


def _arms(robot: Quadruped, bounds: LinkBounds, pieces: int) -> FloatArray:
    """Series of the vector from each leg's joint to the foot's contact ``(5, nj, P)`` [m]."""
    model = bounds.model
    out = np.zeros((ORDER + 1, len(robot.joint_names), pieces))
    for name in LEGS:
        frame = model.frames[model.getFrameId(robot.legs[name].foot)]
        for column in robot.leg_columns[name]:
            joint = int(model.getJointId(robot.joint_names[column]))
            arm = bounds.lever(frame.parentJoint, joint, frame.placement.translation)
            arm[0] += robot.foot_radius
            out[:, column] = arm
    return out
