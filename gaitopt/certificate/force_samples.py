"""What a motion asks of the ground and the joints at its samples, by a model of its own.

The base is a chain of six joints here: three translations, then yaw, pitch and roll. So the path's
columns are Pinocchio's configuration, velocity and acceleration themselves, and nothing is
converted. :mod:`gaitopt.dynamics.whole_body` works with a free-flying base; the certificate keeps
this second way on purpose: an error in one of them is seen by the other.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import lru_cache
from typing import Any

import numpy as np
import pinocchio as pin

from gaitopt.certificate.enclosure import Pieces
from gaitopt.certificate.placements import Placements, hinge_axis, times
from gaitopt.conventions import LEGS, FloatArray
from gaitopt.robots.at_many_poses.inverse_dynamics import inverse_dynamics
from gaitopt.robots.quadruped import Quadruped

_ORDER = [0, 1, 2, 5, 4, 3]
"""Columns of the path in the order of the chain: roll, pitch, yaw are turned round."""
SAME_MOTION = 1e-9
"""Difference of rates and of accelerations up to which one sample stands for both [m/s, rad/s, and
by the square of a second]. It moves a force by about 1e-10 of the weight."""


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
        jacobians: of the feet's contact points by their own legs' joints ``(N, 4, 3, j)`` [m]; see
            :func:`joints_of_legs`.
    """

    force: FloatArray
    moment: FloatArray
    base: FloatArray
    torques: FloatArray
    speeds: FloatArray
    feet: FloatArray
    jacobians: FloatArray

    def chosen(self, which: np.ndarray) -> ForceSamples:
        """Some of the samples, by a mask or their numbers."""
        return ForceSamples(*(getattr(self, f.name)[which] for f in fields(self)))


def chain_model(robot: Quadruped) -> Any:
    """The robot with six joints in a row as its base; it must not be changed."""
    return _chain_of(robot.urdf)


@lru_cache(maxsize=4)
def _chain_of(urdf: str) -> Any:
    root = pin.JointModelComposite(pin.JointModelTranslation())
    root.addJoint(pin.JointModelSphericalZYX())
    return pin.buildModelFromXML(urdf, root)


def sample_forces(
    robot: Quadruped, values: FloatArray, rates: FloatArray, accelerations: FloatArray
) -> ForceSamples:
    """Evaluate path values and their first two derivatives ``(N, 6 + nj)``, on level ground."""
    level = np.tile([0.0, 0.0, 1.0], (len(values), len(LEGS), 1))
    return _samples(robot, values, np.arange(len(values)), rates, accelerations, level)


def sample_ends(
    robot: Quadruped, pieces: Pieces, normals: FloatArray, phase: np.ndarray
) -> tuple[ForceSamples, np.ndarray]:
    """Samples at the starts and at the ends of pieces.

    Args:
        robot: the robot.
        pieces: of its path.
        normals: of the ground under the feet on each of them ``(P, 4, 3)``.
        phase: that each belongs to ``(P,)``.

    Returns:
        The samples, and which of them are at the starts and at the ends ``(2, P)``. Where one piece
        goes on from another in the same phase, with the same velocity and acceleration, one sample
        stands for both.
    """
    places = pieces.places()
    count = len(pieces.starts)
    on = (places.ends[1, :-1] == places.ends[0, 1:]) & (phase[:-1] == phase[1:])
    rates, accelerations = (pieces.at_ends(k) for k in (1, 2))
    for start, end in (rates, accelerations):
        # A comparison with NaN is false.
        on &= (np.abs(end[:-1] - start[1:]) <= SAME_MOTION).all(axis=1)
    own = np.flatnonzero(np.append(~on, True))
    last = np.arange(1, count + 1)
    last[own] = count + np.arange(len(own))
    v, a = (np.concatenate([start, end[own]]) for start, end in (rates, accelerations))
    under = np.concatenate([normals, normals[own]])
    at = np.concatenate([places.ends[0], places.ends[1, own]])
    samples = _samples(robot, places.values, at, v, a, under)
    return samples, np.stack([np.arange(count), last])


def _samples(
    robot: Quadruped, places: FloatArray, at: np.ndarray, rates: FloatArray,
    accelerations: FloatArray, normals: FloatArray,
) -> ForceSamples:  # fmt: skip
    """Samples of motions that are at the places with the numbers ``at (N,)``.

    Under the feet the ground has the ``normals (N, 4, 3)``.
    """
    model = chain_model(robot)
    q = _chain(places)
    feet, level, turning = _contact_geometry(robot, places)
    jacobians = level[at]
    # From the point straight below the foot's frame to that one radius against the normal.
    beside = robot.foot_radius * (np.array([0.0, 0.0, 1.0]) - normals)
    if beside.any():
        jacobians += np.swapaxes(across(turning[at].mT, beside[:, :, None]), 2, 3)
    forces = inverse_dynamics(model, q[at], _chain(rates), _chain(accelerations))
    # The chain's model knows no motors.
    torques = forces[:, 6:] + robot.motor_inertia * accelerations[:, 6:]
    values = places[at]
    return ForceSamples(
        forces[:, :3], _moments(values, forces[:, 3:6]), values[:, :3], torques, rates[:, 6:],
        feet[at], jacobians,
    )  # fmt: skip


def _chain(rows: FloatArray) -> FloatArray:
    return np.concatenate([rows[:, _ORDER], rows[:, 6:]], axis=1)


def _contact_geometry(
    robot: Quadruped, values: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Foot frames ``(N, 4, 3)`` [m], and Jacobians of the points one radius straight below them.

    The latter of velocity and of angular velocity, by the joints of the foot's own leg
    ``(N, 4, 3, j)`` each [m], [1]. A hinge turns what it carries about its axis, so the velocity of
    a point is the axis times the arm from the hinge to the point.

    Args:
        robot: the robot.
        values: of the path ``(N, 6 + nj)``.
    """
    model = robot.model
    placed, columns = Placements.of(model, values), joints_of_legs(robot)
    feet = np.empty((4, 3, len(values)))
    moving, turning = (np.zeros((*columns.shape, 3, len(values))) for _ in range(2))
    for k, leg in enumerate(LEGS):
        frame = model.frames[model.getFrameId(robot.legs[leg].foot)]
        feet[k] = placed.points(int(frame.parentJoint), frame.placement.translation).T
        # The contact lies below the ball's centre, and turns with the foot.
        point = feet[k] - np.array([[0.0], [0.0], [robot.foot_radius]])
        for n, name in enumerate(robot.legs[leg].joints):
            joint = int(model.getJointId(name))
            axis = times(placed.rotations[joint], hinge_axis(model, joint)).T
            turning[k, n] = axis
            moving[k, n] = across(axis.T, point.T - placed.origins[joint]).T
    by_sample = [np.ascontiguousarray(np.transpose(part, (3, 0, 2, 1)))
                 for part in (moving, turning)]  # fmt: skip
    return np.ascontiguousarray(np.moveaxis(feet, -1, 0)), by_sample[0], by_sample[1]


def joints_of_legs(robot: Quadruped) -> np.ndarray:
    """Numbers of each leg's joints ``(4, j)``; one beyond the last where others have more joints.

    A leg has two or three.
    """
    each = [robot.leg_columns[leg] for leg in LEGS]
    most, none = max(map(len, each)), len(robot.joint_names)
    return np.array([[*own, *[none] * (most - len(own))] for own in each])


def across(one: FloatArray, other: FloatArray) -> FloatArray:
    """Cross products of vectors ``(..., 3)``: NumPy's own take five times as long."""
    (a, b, c), (x, y, z) = np.moveaxis(one, -1, 0), np.moveaxis(other, -1, 0)
    return np.stack([b * z - c * y, c * x - a * z, a * y - b * x], axis=-1)


def _moments(values: FloatArray, generalised: FloatArray) -> FloatArray:
    """Moments in the world's axes from those about the axes of yaw, pitch and roll ``(N, 3)``.

    The axis of yaw is vertical, that of pitch level, and that of roll points ahead and down.
    """
    pitch, yaw = values[:, 4], values[:, 5]
    upright, aside, along = generalised.T
    ahead = (along + np.sin(pitch) * upright) / np.cos(pitch)
    x, y = np.cos(yaw), np.sin(yaw)
    return np.stack([x * ahead - y * aside, y * ahead + x * aside, upright], axis=1)
