"""Whether vertical forces alone hold a robot on three feet: quick, and enough in most cases.

Vertical forces on three feet are unique. Each is a linear function of the horizontal place of the
centre of mass, and so are the joint torques. So a few products tell whether all limits are kept at
every place of a disc. Where they are not, forces with horizontal parts may still hold the robot
(:mod:`gaitopt.dynamics.feasible_region`).
"""

from __future__ import annotations

import numpy as np

from gaitopt.conventions import OTHER_LEGS, BoolArray, FloatArray
from gaitopt.dynamics.contacts import (
    LEVEL_GROUND,
    ContactGround,
    Contacts,
    ForceLimits,
    pyramid_rows,
)
from gaitopt.dynamics.region.rows import standing_legs, torque_rows
from gaitopt.robots.quadruped import Quadruped
from gaitopt.stability.support import triangle_half_planes


def vertical_forces_hold(
    robot: Quadruped,
    feet: FloatArray,
    flying: np.ndarray,
    postures: FloatArray,
    coms: FloatArray,
    limits: ForceLimits,
    room: FloatArray,
    ground: ContactGround = LEVEL_GROUND,
) -> BoolArray:
    """Whether vertical forces hold the robot with its COM anywhere near given places ``(B,)``.

    The feet may stand at different heights.

    Args:
        robot: the robot.
        feet: foot frames ``(B, 4, 3)`` [m].
        flying: index of the leg that does not stand ``(B,)``.
        postures: x, y, z [m], roll, pitch, yaw [rad] of the base ``(B, 6)``.
        coms: horizontal places of the COM ``(B, n, 2)`` [m].
        limits: least normal forces, friction, and share of the torques.
        room: distance from those places up to which the forces are asked for ``(B,)`` [m].
        ground: below the feet. A vertical force on a slope needs friction.

    Raises:
        InputError: a standing leg does not reach its foot within its joint limits.
    """
    own = np.arange(len(feet))[:, None]
    others = OTHER_LEGS[flying]
    standing = np.ones(feet.shape[:2], dtype=np.bool_)
    standing[own[:, 0], flying] = False
    contacts = Contacts.below_feet(feet, standing, robot.foot_radius, *ground)
    corners = contacts.points[own, others, :2]
    normals, offsets = triangle_half_planes(corners)
    # The side 0-1 is opposite to the corner 2, and so on.
    opposite = np.roll(corners, 1, axis=1)
    heights = (normals * opposite).sum(axis=-1) - offsets
    shares = (np.einsum("bij,bnj->bni", normals, coms) - offsets[:, None]) / heights[:, None]
    change = room[:, None] / heights
    least, most = shares.min(axis=1) - change, shares.max(axis=1) + change
    asked = limits.least_normal_shares(standing).max(axis=1, keepdims=True)
    # Comparisons with NaN are false.
    carrying = np.roll(others, 1, axis=1)
    upright = contacts.normals[own, carrying, 2]
    held = (least * upright >= asked).all(axis=1)
    sides = pyramid_rows(limits, contacts.normals[own, carrying], contacts.grip[own, carrying])
    held &= (sides[..., 2] >= 0.0).all(axis=(1, 2))
    legs = standing_legs(robot, contacts, limits, feet, postures)
    if legs is None:
        return np.asarray(held)
    rows = torque_rows(robot, contacts, legs)
    by_share, bounds = rows.matrix[own, carrying, :, 2], rows.bounds[own, carrying]
    for carried in (least, most):
        held &= (by_share * carried[..., None] <= bounds).all(axis=(1, 2))
    return np.asarray(held)
