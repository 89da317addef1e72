"""What is asked of the contact forces of a robot at rest, foot by foot, as rows of a matrix.

The joint torques of a leg are ``tau = g - J' f``: ``g`` holds its own links against gravity, and
``J`` is the Jacobian of its contact point. For fixed joint angles they are linear in the force on
this foot, and so are their limits [Orsolino2020]. Joint angles follow from the body's pose and the
places of the feet.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from gaitopt.conventions import GRAVITY, LEGS, BoolArray, FloatArray
from gaitopt.dynamics.contacts import Contacts, ForceLimits, unit_pyramid_rows
from gaitopt.dynamics.torque_limits import torque_bounds
from gaitopt.errors import InputError
from gaitopt.inputs import check_shape
from gaitopt.robots.quadruped import Quadruped
from gaitopt.robots.rotations import rpy_to_matrix, rpy_to_quaternion
from gaitopt.robots.whole_body import base_of_body, joints_from_feet_in_body

LARGEST_NORMAL_SHARE: Final = 10.0
"""Normal force of a foot, in units of the weight, above which a region counts as unbounded. Between
steep walls friction would allow forces of any size; a robot on level ground needs at most 1."""


FOOT_TOLERANCE: Final = 1e-8
"""A foot is reached when Pinocchio finds it this near to its place [m]: ten times what closed form
and Pinocchio may differ by, and what counts as within reach."""

ANGLE_TOLERANCE: Final = 1e-9
"""By how much an angle may exceed its limit [rad]: rounding of the closed form."""


class FootRows(NamedTuple):
    """Inequalities ``matrix f <= bounds`` of the force on each foot, in units of the weight.

    Attributes:
        matrix: ``(B, 4, r, 3)``, legs in the order of :data:`gaitopt.LEGS`.
        bounds: ``(B, 4, r)``.
    """

    matrix: FloatArray
    bounds: FloatArray


def friction_rows(contacts: Contacts, limits: ForceLimits) -> FootRows:
    """Friction pyramids, least normal forces, and :data:`LARGEST_NORMAL_SHARE`.

    Args:
        contacts: of the four feet ``(B, 4)``.
        limits: what is asked.
    """
    normals, sides = contacts.normals, limits.sides
    matrix = np.empty((*normals.shape[:-1], sides + 2, 3))
    matrix[..., :sides, :] = -unit_pyramid_rows(limits, normals, contacts.grip)
    matrix[..., sides, :], matrix[..., sides + 1, :] = -normals, normals
    bounds = np.zeros(matrix.shape[:-1])
    bounds[..., sides] = -limits.least_normal_shares(contacts.standing)
    bounds[..., sides + 1] = LARGEST_NORMAL_SHARE
    return FootRows(matrix, bounds)


@dataclass(frozen=True, eq=False)
class StandingLegs:
    """The robot at rest on its feet, in one posture for each stance.

    Attributes:
        postures: x, y, z [m], roll, pitch, yaw [rad] of the base ``(B, 6)``.
        com: horizontal place of the COM ``(B, 2)`` [m].
        gravity: torques that hold the legs' own links ``(B, 4, joints)`` [N m].
        columns: spatial velocity of each foot by each joint of its own leg, linear and then
            angular, of its point at the world's origin ``(B, 4, joints, 6)``.
        largest: torques that may be used ``(4, joints)`` [N m]; ``inf`` where no limit is known.
    """

    postures: FloatArray
    com: FloatArray
    gravity: FloatArray
    columns: FloatArray
    largest: FloatArray


def torque_rows(robot: Quadruped, contacts: Contacts, legs: StandingLegs) -> FootRows:
    """Torque limits of each leg's joints, each row in units of the limit.

    Args:
        robot: the robot.
        contacts: of the four feet ``(B, 4)``.
        legs: the robot on these contacts.
    """
    linear, angular = legs.columns[..., :3], legs.columns[..., 3:]
    x, y, z = np.moveaxis(contacts.points, -1, 0)[..., None]
    roll, pitch, yaw = np.moveaxis(angular, -1, 0)
    velocities = linear.copy()
    velocities[..., 0] += pitch * z - yaw * y
    velocities[..., 1] += yaw * x - roll * z
    velocities[..., 2] += roll * y - pitch * x
    # A joint without a known limit gets rows of zeros, which hold for all forces.
    by_force = velocities * (robot.mass * GRAVITY / legs.largest[..., None])
    own = legs.gravity / legs.largest
    return FootRows(
        matrix=np.concatenate([-by_force, by_force], axis=-2),
        bounds=np.concatenate([1.0 - own, 1.0 + own], axis=-1),
    )


def standing_legs(
    robot: Quadruped,
    contacts: Contacts,
    limits: ForceLimits,
    feet: FloatArray,
    postures: ArrayLike | None = None,
) -> StandingLegs | None:
    """The robot with its feet at ``feet``.

    Legs in the air reach for their feet where these are finite; the torques of the other legs do
    not depend on them.

    Args:
        robot: the robot.
        contacts: which feet stand ``(B, 4)``.
        limits: the share of the torques that may be used.
        feet: foot frames ``(B, 4, 3)`` [m].
        postures: of the base ``(B, 6)``, or one for all; :func:`level_postures` by default.

    Returns:
        ``None`` when no joint of the legs has a known limit.

    Raises:
        InputError: ``postures`` has another shape or is not finite, or a leg does not reach the
            foot on which it is to stand within its joint limits.
    """
    joints = robot.leg_joint_columns
    still = np.zeros(len(robot.joint_names))
    largest = torque_bounds(robot, limits, still)[1][joints].reshape(4, -1)
    if not np.isfinite(largest).any():
        return None
    if postures is None:
        base = level_postures(robot, contacts, feet)
    else:
        base = _checked_postures(postures, len(feet))
    q = _configurations(robot, feet, base)
    com, gravity, columns, places = _at_rest(robot, q)
    # A comparison with NaN is false.
    reached = np.linalg.norm(places - feet, axis=-1) <= FOOT_TOLERANCE
    low, high = robot.position_limits[:, joints]
    angles = q[:, 7 + joints]
    allowed = (angles >= low - ANGLE_TOLERANCE) & (angles <= high + ANGLE_TOLERANCE)
    allowed = allowed.reshape(*reached.shape, -1).all(axis=-1)
    _require(robot, contacts.standing, reached, allowed, feet, base)
    return StandingLegs(base, com, gravity, columns, largest)


def level_postures(robot: Quadruped, contacts: Contacts, feet: FloatArray) -> FloatArray:
    """A posture for each stance ``(B, 6)``: x, y, z [m], roll, pitch, yaw [rad] of the base.

    The body is level, its centre at the standing height over the middle of the standing feet, and
    turned so that the robot's own stance fits these feet best.

    Args:
        robot: the robot.
        contacts: which feet stand ``(B, 4)``.
        feet: foot frames ``(B, 4, 3)`` [m].
    """
    standing = contacts.standing[..., None]
    count = standing.sum(axis=-2)
    places = np.where(standing, feet, 0.0)
    middle = places.sum(axis=-2) / count
    own = np.array(
        [leg.hip + leg.axes[:, 1] * leg.lateral for leg in map(robot.legs.__getitem__, LEGS)]
    )
    own = np.where(standing, own, 0.0)
    # The feet's own middle drops out of both sums when it is taken from one side.
    arms = np.where(standing, places - middle[:, None], 0.0)
    cosine = (own[..., :2] * arms[..., :2]).sum(axis=(-2, -1))
    sine = (own[..., 0] * arms[..., 1] - own[..., 1] * arms[..., 0]).sum(axis=-1)
    turn = np.arctan2(sine, cosine)
    axes = np.zeros((len(turn), 3, 3))
    axes[:, 0, 0] = axes[:, 1, 1] = np.cos(turn)
    axes[:, 1, 0], axes[:, 0, 1] = np.sin(turn), -np.sin(turn)
    axes[:, 2, 2] = 1.0
    middle[:, 2] += robot.standing_height
    return base_of_body(robot, middle, axes)


def _configurations(robot: Quadruped, feet: FloatArray, postures: FloatArray) -> FloatArray:
    """Pinocchio's configurations ``(B, nq)`` with the legs towards their feet."""
    position, rpy = postures[:, :3], postures[:, 3:]
    to_world = rpy_to_matrix(rpy) @ robot.body_axes
    joints = joints_from_feet_in_body(robot, (feet - position[:, None]) @ to_world)
    q = np.empty((len(joints), 7 + joints.shape[1]))
    q[:, :3], q[:, 3:7] = position, rpy_to_quaternion(rpy)
    known = np.isfinite(joints)
    q[:, 7:] = joints if known.all() else np.where(known, joints, robot.neutral_joints())
    return q


def _at_rest(robot: Quadruped, q: FloatArray) -> tuple[FloatArray, ...]:
    """COM ``(B, 2)``, gravity ``(B, 4, joints)``, columns ``(B, 4, joints, 6)``: see
    :class:`StandingLegs`; and the foot frames ``(B, 4, 3)`` [m]."""
    import pinocchio as pin

    model, data = robot.model, robot.own_data()
    frames = [model.getFrameId(robot.legs[leg].foot) for leg in LEGS]
    own = 6 + robot.leg_joint_columns
    com, places = np.empty((len(q), 2)), np.empty((len(q), 4, 3))
    gravity, columns = np.empty((len(q), len(own))), np.empty((len(q), len(own), 6))
    for i, sample in enumerate(q):
        gravity[i] = pin.computeGeneralizedGravity(model, data, sample)[own]
        columns[i] = pin.computeJointJacobians(model, data, sample).T[own]
        com[i] = pin.centerOfMass(model, data, sample, False)[:2]
        for k, frame in enumerate(frames):
            places[i, k] = pin.updateFramePlacement(model, data, frame).translation
    return com, gravity.reshape(len(q), 4, -1), columns.reshape(len(q), 4, -1, 6), places


def _require(
    robot: Quadruped,
    standing: BoolArray,
    reached: BoolArray,
    allowed: BoolArray,
    feet: FloatArray,
    postures: FloatArray,
) -> None:
    """Refuse the first standing foot that is not ``reached (B, 4)`` or not ``allowed``."""
    for sample, leg in np.argwhere(standing & ~(reached & allowed)):
        how = "within its joint limits " if reached[sample, leg] else ""
        raise InputError(
            f"{robot.name}: leg {LEGS[leg]} does not reach its foot {how}at "
            f"{np.round(feet[sample, leg], 4).tolist()} m from the base at "
            f"{np.round(postures[sample], 4).tolist()} (x, y, z, roll, pitch, yaw); give another "
            "posture, or ask with torques=False for the region without torque limits"
        )


def _checked_postures(postures: ArrayLike, count: int) -> FloatArray:
    """``postures`` as finite numbers ``(count, 6)``."""
    given = check_shape("posture", postures, 6)
    if not np.isfinite(given).all():
        raise InputError("posture must be finite: x, y, z, roll, pitch, yaw of the base")
    if given.shape not in ((6,), (1, 6), (count, 6)):
        raise InputError(f"posture must be (6,) or ({count}, 6), got {given.shape}")
    return np.array(np.broadcast_to(given, (count, 6)))
