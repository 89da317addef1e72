"""Where the four feet touch the ground at many samples, and the Jacobians of these points."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from gaitopt.conventions import LEGS, BoolArray, FloatArray
from gaitopt.dynamics.contacts import grips, unit_normals
from gaitopt.errors import InputError
from gaitopt.inputs import check_shape
from gaitopt.robots.quadruped import Quadruped
from gaitopt.robots.rotations import quaternion_to_matrix
from gaitopt.robots.whole_body import feet_in_body


@dataclass(frozen=True, eq=False)
class ContactGeometry:
    """The four feet's contact points and their Jacobians; arrays are read-only.

    Attributes:
        points: contact points in the world ``(N, 4, 3)`` [m], one foot radius below the foot
            frames along the normals.
        normals: unit normals of the ground ``(N, 4, 3)``.
        grip: friction of each contact as a share of that of the limits ``(N, 4)``.
        jacobians: of the contact points' velocities in the world, by ``v`` ``(N, 4, 3, nv)``. The
            point belongs to the foot: it rolls with the ball.
    """

    points: FloatArray
    normals: FloatArray
    grip: FloatArray
    jacobians: FloatArray

    def __post_init__(self) -> None:
        for array in (self.points, self.normals, self.grip, self.jacobians):
            array.setflags(write=False)


def contact_geometry(
    robot: Quadruped,
    q: ArrayLike,
    normals: ArrayLike = (0.0, 0.0, 1.0),
    grip: ArrayLike = 1.0,
) -> ContactGeometry:
    """Contact points of the four feet and their Jacobians.

    Args:
        robot: the robot.
        q: Pinocchio's configurations ``(N, nq)``.
        normals, grip: as in :func:`gaitopt.dynamics.whole_body.equations_of_motion`.

    Raises:
        InputError: shapes do not fit, a number is not finite, or a normal has no direction.
    """
    places = check_table("q", q, robot.model.nq)
    shape = (len(places), len(LEGS), 3)
    try:
        up = np.array(np.broadcast_to(unit_normals(normals), shape))
    except ValueError as error:
        raise InputError(f"normals must fit {shape}, got {np.shape(normals)}: {error}") from error
    to_world = quaternion_to_matrix(places[:, 3:7]) @ robot.body_axes
    feet = feet_in_body(robot, places[:, 7:]) @ np.swapaxes(to_world, -1, -2)
    points = places[:, None, :3] + feet - robot.foot_radius * up
    spatial = _joint_jacobians(robot, places)
    jacobians = np.zeros((*shape, robot.model.nv))
    for foot, moved in enumerate(_moved_by(robot)):
        columns = np.flatnonzero(moved)
        (vx, vy, vz), (wx, wy, wz) = (
            spatial[:, :, columns].reshape(-1, 2, 3, len(columns)).transpose(1, 2, 0, 3)
        )
        x, y, z = points[:, foot].T[..., None]
        # Pinocchio's Jacobians give the velocity of the body's point at the world's origin.
        jacobians[:, foot, 0, columns] = vx + (wy * z - wz * y)
        jacobians[:, foot, 1, columns] = vy + (wz * x - wx * z)
        jacobians[:, foot, 2, columns] = vz + (wx * y - wy * x)
    return ContactGeometry(points, up, grips(grip, shape[:2]), jacobians)


def _joint_jacobians(robot: Quadruped, q: FloatArray) -> FloatArray:
    """Spatial velocities about the world's origin by ``v`` ``(N, 6, nv)``: linear, then angular.

    Each column is the velocity of whatever this joint carries.
    """
    import pinocchio as pin

    model, data = robot.model, robot.model.createData()
    out = np.empty((len(q), 6, model.nv))
    for i, sample in enumerate(q):
        out[i] = pin.computeJointJacobians(model, data, sample)
    return out


def _moved_by(robot: Quadruped) -> BoolArray:
    """Which columns of ``v`` move which foot ``(4, nv)``."""
    model = robot.model
    moved = np.zeros((len(LEGS), model.nv), dtype=np.bool_)
    for row, leg in zip(moved, LEGS, strict=True):
        joint = model.frames[model.getFrameId(robot.legs[leg].foot)].parentJoint
        for above in model.supports[joint]:
            if above:
                start = model.joints[above].idx_v
                row[start : start + model.joints[above].nv] = True
    return moved


def check_table(name: str, array: ArrayLike, width: int, length: int | None = None) -> FloatArray:
    """``array`` as finite numbers ``(N, width)``.

    Raises:
        InputError: it is not.
    """
    table = check_shape(name, array, width)
    if table.ndim != 2 or (length is not None and len(table) != length):
        rows = "N" if length is None else str(length)
        raise InputError(f"{name} must be ({rows}, {width}), got {table.shape}")
    if not np.isfinite(table).all():
        raise InputError(
            f"{name} must be finite; row {int(np.argwhere(~np.isfinite(table))[0, 0])} is not"
        )
    return table
