"""What a motion asks of the ground and the joints: the equations of motion over many samples.

The equations of motion of a robot whose feet touch the ground are::

    M(q) a + h(q, v) = S' tau + sum over the standing feet of J' f

with Pinocchio's configuration ``q``, velocity ``v`` and acceleration ``a``; joint torques ``tau``,
which ``S'`` puts below six zeros, for no motor moves the base; contact forces ``f`` in the world's
axes; and Jacobians ``J`` of the contact points. The left side is computed by Pinocchio's inverse
dynamics [Carpentier2019]. The first six rows are a wrench in the frame of the base, about its
origin: only contact forces can make it. The other rows then give the torques.

Along a path ``q(s)`` the left side is linear in the path's acceleration ``u = s''`` and squared
speed ``x = s'^2``: it is ``A(s) u + B(s) x + g(s)`` [Hauser2014]. That form is
:class:`PathDynamics`.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from gaitopt.conventions import FloatArray
from gaitopt.dynamics.contact_geometry import ContactGeometry, check_table, contact_geometry
from gaitopt.errors import InputError
from gaitopt.robots.at_many_poses.inverse_dynamics import inverse_dynamics
from gaitopt.robots.quadruped import Quadruped
from gaitopt.robots.whole_body import configuration
from gaitopt.robots.whole_body_rates import base_twist, base_twist_rate


class Motion(NamedTuple):
    """A motion in Pinocchio's vectors.

    Attributes:
        q: configurations ``(N, nq)``: base position, quaternion x, y, z, w, joints.
        v: velocities ``(N, nv)``: twist of the base in its own frame, joint velocities.
        a: accelerations ``(N, nv)``: the time derivative of ``v``, number by number.
    """

    q: FloatArray
    v: FloatArray
    a: FloatArray


def motion_of_path(
    robot: Quadruped, values: ArrayLike, first: ArrayLike, second: ArrayLike
) -> Motion:
    """Pinocchio's vectors of the columns of a path.

    The columns are x, y, z of the base in the world [m], its roll, pitch, yaw [rad], and the
    joints [rad] in the order of :attr:`Quadruped.joint_names`.

    Args:
        robot: the robot.
        values: ``(N, 6 + nj)``.
        first: their first time derivative ``(N, 6 + nj)``.
        second: their second time derivative ``(N, 6 + nj)``.

    Raises:
        InputError: shapes do not fit, or a number is not finite.
    """
    columns = 6 + len(robot.joint_names)
    y, dy, ddy = (
        check_table(name, array, columns)
        for name, array in (("values", values), ("first", first), ("second", second))
    )
    if not len(y) == len(dy) == len(ddy):
        raise InputError(
            f"values and derivatives must have one length: {len(y)}, {len(dy)}, {len(ddy)}"
        )
    rpy = y[:, 3:6]
    twist = base_twist(rpy, dy[:, :3], dy[:, 3:6])
    twist_rate = base_twist_rate(rpy, dy[:, :3], dy[:, 3:6], ddy[:, :3], ddy[:, 3:6])
    return Motion(
        q=configuration(robot, y[:, :3], rpy, y[:, 6:]),
        v=np.concatenate([twist, dy[:, 6:]], axis=1),
        a=np.concatenate([twist_rate, ddy[:, 6:]], axis=1),
    )


@dataclass(frozen=True, eq=False)
class EquationsOfMotion:
    """The equations of motion of ``N`` samples; arrays are read-only.

    Attributes:
        forces: ``M a + h``, the generalised forces that contact forces and torques must make
            together ``(N, nv)``.
        contacts: where the contact forces act.
    """

    forces: FloatArray
    contacts: ContactGeometry

    def __post_init__(self) -> None:
        self.forces.setflags(write=False)

    def __len__(self) -> int:
        return len(self.forces)

    @property
    def base_forces(self) -> FloatArray:
        """Wrench on the base that contact forces must make ``(N, 6)``: force [N], moment [N m].

        Along the axes of the base, about its origin.
        """
        return self.forces[:, :6]

    @property
    def joint_forces(self) -> FloatArray:
        """Torques of all joints were there no contact forces ``(N, nj)`` [N m]."""
        return self.forces[:, 6:]

    def residuals(self, contact_forces: FloatArray) -> FloatArray:
        """What is left of the base's six equations ``(N, 6)``: force [N] and moment [N m].

        Args:
            contact_forces: ``(N, 4, 3)`` in the world's axes [N]; zero for feet in the air.
        """
        base = self.contacts.jacobians[..., :6]
        return np.asarray(self.base_forces - np.einsum("nlkv,nlk->nv", base, contact_forces))

    def torques(self, contact_forces: FloatArray) -> FloatArray:
        """Joint torques ``(N, nj)`` [N m] that belong to contact forces.

        Args:
            contact_forces: as in :meth:`residuals`.
        """
        legs = self.contacts.jacobians[..., 6:]
        return np.asarray(self.joint_forces - np.einsum("nlkv,nlk->nv", legs, contact_forces))


@dataclass(frozen=True, eq=False)
class PathDynamics:
    """The equations of motion along a path ``q(s)``; arrays are read-only.

    With ``u = s''`` and ``x = s'^2`` the generalised forces are
    ``acceleration * u + speed * x + gravity``.

    Attributes:
        acceleration: ``A`` ``(N, nv)``.
        speed: ``B`` ``(N, nv)``.
        gravity: ``g`` ``(N, nv)``.
        contacts: where the contact forces act.
        kept: what was computed from it and may be asked for again, by keys of those who keep it.
    """

    acceleration: FloatArray
    speed: FloatArray
    gravity: FloatArray
    contacts: ContactGeometry
    kept: dict[tuple[Any, ...], Any] = field(default_factory=dict, repr=False)

    def __post_init__(self) -> None:
        for array in (self.acceleration, self.speed, self.gravity):
            array.setflags(write=False)

    def __len__(self) -> int:
        return len(self.gravity)

    def at(self, u: ArrayLike, x: ArrayLike) -> EquationsOfMotion:
        """The equations of motion at path accelerations and squared path speeds.

        Args:
            u: ``s''`` ``(N,)``, or one for all.
            x: ``s'^2`` ``(N,)``, or one for all.
        """
        acceleration, square = (
            np.broadcast_to(np.asarray(value, np.float64), (len(self),))[:, None]
            for value in (u, x)
        )
        forces = self.acceleration * acceleration + self.speed * square + self.gravity
        return EquationsOfMotion(forces, self.contacts)


def equations_of_motion(
    robot: Quadruped,
    motion: Motion,
    normals: ArrayLike = (0.0, 0.0, 1.0),
    grip: ArrayLike = 1.0,
) -> EquationsOfMotion:
    """The equations of motion of ``robot`` at every sample of ``motion``.

    Args:
        robot: the robot.
        motion: in Pinocchio's vectors.
        normals: of the ground below the feet, of any length, broadcast to ``(N, 4, 3)``.
        grip: friction of each contact as a share of that of the limits, broadcast to ``(N, 4)``.

    Raises:
        InputError: shapes do not fit, a number is not finite or out of its range, or a normal has
            no direction.
    """
    q = check_table("q", motion.q, robot.model.nq)
    v = check_table("v", motion.v, robot.model.nv, len(q))
    a = check_table("a", motion.a, robot.model.nv, len(q))
    contacts = contact_geometry(robot, q, normals, grip)
    return EquationsOfMotion(inverse_dynamics(robot.model, q, v, a), contacts)


def path_dynamics(
    robot: Quadruped,
    values: ArrayLike,
    first: ArrayLike,
    second: ArrayLike,
    normals: ArrayLike = (0.0, 0.0, 1.0),
    grip: ArrayLike = 1.0,
) -> PathDynamics:
    """The equations of motion along a path, linear in its acceleration and squared speed.

    Args:
        robot: the robot.
        values: columns of the path ``(N, 6 + nj)``, as in :func:`motion_of_path`.
        first: their first derivative by the path's parameter ``s``.
        second: their second derivative by ``s``.
        normals, grip: as in :func:`equations_of_motion`.

    Source: [Hauser2014]; with three calls of inverse dynamics a sample.

    Raises:
        InputError: shapes do not fit, a number is not finite, or a normal has no direction.
    """
    q, slope, curvature = motion_of_path(robot, values, first, second)
    rest = np.zeros_like(slope)
    gravity = inverse_dynamics(robot.model, q, rest, rest)
    # Velocity and acceleration are v = slope s' and a = slope s'' + curvature s'^2. Inverse
    # dynamics is gravity, plus what is linear in a, plus what is quadratic in v.
    return PathDynamics(
        acceleration=inverse_dynamics(robot.model, q, rest, slope) - gravity,
        speed=inverse_dynamics(robot.model, q, slope, curvature) - gravity,
        gravity=gravity,
        contacts=contact_geometry(robot, q, normals, grip),
    )
