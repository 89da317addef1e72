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

from gaitopt.certificate.enclosure import Pieces
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
        torques: of the joints, were there no contact forces ``(N, nj)`` [N m]; those that turn
            motors and gears are among them.
        speeds: of the joints ``(N, nj)`` [rad/s].
        feet: foot frames ``(N, 4, 3)`` [m].
        jacobians: of the feet's contact points by the joints ``(N, 4, 3, nj)`` [m].
    """

    force: FloatArray
    moment: FloatArray
    base: FloatArray
    torques: FloatArray
    speeds: FloatArray
    feet: FloatArray
    jacobians: FloatArray

    @classmethod
    def joined(cls, *parts: ForceSamples) -> ForceSamples:
        """The samples of all parts, one after the other."""
        return cls(*(np.concatenate([getattr(p, f.name) for p in parts]) for f in fields(cls)))

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
    """Evaluate path values and their first two derivatives ``(N, 6 + nj)``, on level ground."""
    level = np.tile([0.0, 0.0, 1.0], (len(values), len(LEGS), 1))
    return _samples(robot, values, np.arange(len(values)), rates, accelerations, level)


def sample_ends(
    robot: Quadruped, pieces: Pieces, normals: FloatArray
) -> tuple[ForceSamples, ForceSamples]:
    """Samples at the starts and at the ends of pieces.

    Args:
        robot: the robot.
        pieces: of its path.
        normals: of the ground under the feet on each of them ``(P, 4, 3)``.

    Where one piece goes on from another they share their place, and velocity and acceleration,
    which may jump there, are each one's own.
    """
    places = pieces.places()
    rates, accelerations = (np.concatenate(pieces.at_ends(k)) for k in (1, 2))
    under = np.concatenate([normals, normals])
    both = _samples(robot, places.values, places.ends.ravel(), rates, accelerations, under)
    starts = np.arange(len(pieces.starts))
    return both.chosen(starts), both.chosen(starts + len(starts))


def _samples(
    robot: Quadruped, places: FloatArray, at: np.ndarray, rates: FloatArray,
    accelerations: FloatArray, normals: FloatArray,
) -> ForceSamples:  # fmt: skip
    """Samples of motions that are at the places with the numbers ``at (N,)``.

    Under the feet the ground has the ``normals (N, 4, 3)``.
    """
    model = chain_model(robot)
    q = _chain(places)
    feet, level, turning = _contact_geometry(robot, model, q)
    # From the point straight below the foot's frame to that one radius against the normal.
    beside = robot.foot_radius * (np.array([0.0, 0.0, 1.0]) - normals)
    jacobians = level[at] + np.cross(turning[at], beside[..., None], axis=2)
    forces = _inverse_dynamics(model, q[at], _chain(rates), _chain(accelerations))
    # The chain's model knows no motors.
    torques = forces[:, 6:] + robot.motor_inertia * accelerations[:, 6:]
    values = places[at]
    return ForceSamples(
        forces[:, :3], _moments(values, forces[:, 3:6]), values[:, :3], torques, rates[:, 6:],
        feet[at], jacobians,
    )  # fmt: skip


def _chain(rows: FloatArray) -> FloatArray:
    return np.concatenate([rows[:, _ORDER], rows[:, 6:]], axis=1)


def _inverse_dynamics(model: Any, q: FloatArray, v: FloatArray, a: FloatArray) -> FloatArray:
    """Generalised forces without contact forces ``(N, 6 + nj)``."""
    data = model.createData()
    out = np.empty_like(q)
    for row, sample in enumerate(zip(q, v, a, strict=True)):
        out[row] = pin.rnea(model, data, *sample)
    return out


def _contact_geometry(
    robot: Quadruped, model: Any, q: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Foot frames ``(N, 4, 3)`` [m], and Jacobians of the points one radius straight below them.

    The latter of velocity and of angular velocity, by the joints ``(N, 4, 3, nj)`` each [m], [1].
    """
    data = model.createData()
    frames = [model.getFrameId(robot.legs[leg].foot) for leg in LEGS]
    feet, spatial = np.empty((len(q), 4, 3)), np.empty((len(q), 6, model.nv))
    # Views of Pinocchio's memory, which every sample overwrites.
    seen = [data.oMf[frame].translation for frame in frames]
    for row, place in enumerate(q):
        spatial[row] = pin.computeJointJacobians(model, data, place)
        for k, frame in enumerate(frames):
            pin.updateFramePlacement(model, data, frame)
            feet[row, k] = seen[k]
    # The contact lies below the ball's centre, and turns with the foot. Pinocchio's Jacobians tell
    # the velocity of the body's point at the world's origin: v + w x p.
    points = feet - np.array([0.0, 0.0, robot.foot_radius])
    jacobians = np.zeros((len(q), 4, 3, len(robot.joint_names)))
    turning = np.zeros_like(jacobians)
    for k, leg in enumerate(LEGS):
        columns = list(robot.leg_columns[leg])
        linear, angular = np.split(spatial[:, :, 6:][:, :, columns], 2, axis=1)
        x, y, z = points[:, k, :, None].swapaxes(0, 1)
        turned = [angular[:, 1] * z - angular[:, 2] * y, angular[:, 2] * x - angular[:, 0] * z,
                  angular[:, 0] * y - angular[:, 1] * x]  # fmt: skip
        jacobians[:, k][:, :, columns] = linear + np.stack(turned, axis=1)
        turning[:, k][:, :, columns] = angular
    return feet, jacobians, turning


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
