"""What a motion asks of the ground and the joints at its samples, by a model of its own.

The base is a chain of six joints here: three translations, then yaw, pitch and roll. So the path's
columns are Pinocchio's configuration, velocity and acceleration themselves, and nothing is
converted. :mod:`gaitopt.dynamics.whole_body` works with a free-flying base; the certificate keeps
this second way on purpose: an error in one of them is seen by the other.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any

import numpy as np
import pinocchio as pin

from gaitopt.conventions import LEGS, FloatArray
from gaitopt.robots.quadruped import Quadruped

_ORDER = [0, 1, 2, 5, 4, 3]
"""Columns of the path in the order of the chain: roll, pitch, yaw are turned round."""


@dataclass(frozen=True, eq=False)
class ForceSamples:
    """Samples of a motion.

    Attributes:
        force: that contact forces must make together ``(N, 3)`` [N].
        moment: that they must make about the base's origin ``(N, 3)`` [N m].
        base: the base's origin ``(N, 3)`` [m].
        torques: of the joints, were there no contact forces ``(N, nj)`` [N m].
        feet: foot frames ``(N, 4, 3)`` [m].
        jacobians: of the feet's contact points by the joints ``(N, 4, 3, nj)`` [m].
    """

    force: FloatArray
    moment: FloatArray
    base: FloatArray
    torques: FloatArray
    feet: FloatArray
    jacobians: FloatArray

    def chosen(self, which: np.ndarray) -> ForceSamples:
        """Some of the samples, by a mask or their numbers."""
        return ForceSamples(*(getattr(self, f.name)[which] for f in fields(self)))


def chain_model(robot: Quadruped) -> Any:
    """The robot with six joints in a row as its base."""
    root = pin.JointModelComposite(pin.JointModelTranslation())
    root.addJoint(pin.JointModelSphericalZYX())
    return pin.buildModelFromXML(robot.urdf, root)


def sample_forces(
    robot: Quadruped, values: FloatArray, rates: FloatArray, accelerations: FloatArray
) -> ForceSamples:
    """Evaluate path values and their first two derivatives ``(N, 6 + nj)``."""
    model = chain_model(robot)
    data = model.createData()
    frames = [model.getFrameId(robot.legs[leg].foot) for leg in LEGS]
    count, joints = len(values), len(robot.joint_names)
    forces = np.empty((count, 6 + joints))
    feet, whole = np.empty((count, 4, 3)), np.empty((count, 4, 6, joints))
    for i in range(count):
        q, v, a = (_chain(part[i]) for part in (values, rates, accelerations))
        forces[i] = pin.rnea(model, data, q, v, a)
        pin.computeJointJacobians(model, data, q)
        pin.updateFramePlacements(model, data)
        for k, frame in enumerate(frames):
            feet[i, k] = data.oMf[frame].translation
            jacobian = pin.getFrameJacobian(model, data, frame, pin.LOCAL_WORLD_ALIGNED)
            whole[i, k] = jacobian[:, 6:]
    # The contact lies below the ball's centre, and turns with the foot: v + w x (0, 0, -r).
    jacobians = whole[:, :, :3].copy()
    jacobians[:, :, 0] -= robot.foot_radius * whole[:, :, 4]
    jacobians[:, :, 1] += robot.foot_radius * whole[:, :, 3]
    return ForceSamples(
        forces[:, :3], _moments(values, forces[:, 3:6]), values[:, :3], forces[:, 6:], feet,
        jacobians,
    )  # fmt: skip


def _chain(row: FloatArray) -> FloatArray:
    return np.concatenate([row[_ORDER], row[6:]])


def _moments(values: FloatArray, generalised: FloatArray) -> FloatArray:
    """Moments in the world's axes from those about the axes of yaw, pitch and roll ``(N, 3)``."""
    pitch, yaw = values[:, 4], values[:, 5]
    zero, one, level = np.zeros_like(yaw), np.ones_like(yaw), np.cos(pitch)
    axes = np.stack([
        np.stack([zero, zero, one], axis=1),
        np.stack([-np.sin(yaw), np.cos(yaw), zero], axis=1),
        np.stack([np.cos(yaw) * level, np.sin(yaw) * level, -np.sin(pitch)], axis=1),
    ], axis=1)  # fmt: skip
    return np.asarray(np.linalg.solve(axes, generalised[..., None])[..., 0])
