"""All contact forces that make a motion's base wrench, and what is asked of them, as rows.

Samples with the same standing feet form one group, and arrays over it need no loop. The base's six
equations are eliminated: forces that solve them are ``f = particular + directions @ z`` with any
``z``, which has six numbers on four feet, three on three feet, and one on two feet, where it is the
force along the line that joins them. Forces are in units of the weight.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from gaitopt.conventions import BoolArray, FloatArray
from gaitopt.dynamics.contacts import ForceLimits, pyramid_rows
from gaitopt.dynamics.small_programs import NO_BOUND
from gaitopt.dynamics.whole_body import EquationsOfMotion
from gaitopt.robots.quadruped import Quadruped

RANK: Final = 1e-7
"""Share of the largest singular value below which one counts as zero. Rounding leaves 1e-16; three
feet are on one line for this purpose if they are within 0.1 um of it."""


@dataclass(frozen=True, eq=False)
class ForceProblem:
    """Contact forces that are looked for, at ``N`` samples.

    Build one with :func:`gaitopt.dynamics.forces.build_force_problem`.

    Arrays are read-only.

    Attributes:
        robot: the robot.
        equations: the equations of motion.
        standing: which feet stand ``(N, 4)``.
        limits: what is asked of forces and torques.
        torque_low, torque_high: limits of the joint torques ``(N, nj)`` [N m]; infinite for joints
            without a known limit.
        times: of the samples ``(N,)`` [s].
        weight: of the robot, the unit of forces [N].
        length: half the stance [m]; with ``weight`` the unit of moments.
        most: largest normal forces as shares of the weight ``(N, 4)``; infinite for none.
    """

    robot: Quadruped
    equations: EquationsOfMotion
    standing: BoolArray
    limits: ForceLimits
    torque_low: FloatArray
    torque_high: FloatArray
    times: FloatArray
    weight: float
    length: float
    most: FloatArray

    def __post_init__(self) -> None:
        for array in (self.standing, self.torque_low, self.torque_high, self.times, self.most):
            array.setflags(write=False)

    def __len__(self) -> int:
        return len(self.standing)


@dataclass(frozen=True, eq=False)
class ForceSpace:
    """The contact forces ``particular + directions @ z`` of ``n`` samples on the same ``k`` feet.

    Attributes:
        samples: positions in the problem ``(n,)``.
        feet: indices of the standing feet ``(k,)``.
        particular: the forces of least norm ``(n, 3 k)``. Where no forces make the base's wrench,
            those that come nearest to it.
        directions: orthonormal ``(n, 3 k, d)``.
    """

    samples: np.ndarray
    feet: np.ndarray
    particular: FloatArray
    directions: FloatArray

    def forces(self, z: FloatArray) -> FloatArray:
        """Forces ``(n, k, 3)`` in units of the weight, of coordinates ``z (n, d)``."""
        flat = self.particular + np.einsum("nfd,nd->nf", self.directions, z)
        return np.asarray(flat.reshape(len(flat), len(self.feet), 3))


@dataclass(frozen=True, eq=False)
class ForceRows:
    """What is asked of ``z``: ``low <= matrix @ z <= high``.

    Attributes:
        matrix: ``(n, r, d)``.
        low, high: ``(n, r)``; ``NO_BOUND`` stands for infinity.
        constraints: for each row the constraint to which it belongs ``(r,)``: that a foot does
            not slip has several rows, all others have one.
        columns: where each constraint stands in a table of conflicts ``(c,)``; see
            :attr:`ContactForces.conflict_table`.
        normal: which rows are normal forces ``(r,)``, in units of the weight.
        torque_matrix: torques as shares of the joints' limits, of ``z`` ``(n, t, d)``.
        torque_offset: the same at ``z = 0`` ``(n, t)``.
    """

    matrix: FloatArray
    low: FloatArray
    high: FloatArray
    constraints: np.ndarray
    columns: np.ndarray
    normal: BoolArray
    torque_matrix: FloatArray
    torque_offset: FloatArray


def force_spaces(problem: ForceProblem) -> list[ForceSpace]:
    """The forces that solve the base's equations, one group for each set of standing feet.

    Samples in flight are in no group.
    """
    found = []
    patterns, member = np.unique(problem.standing, axis=0, return_inverse=True)
    for i, pattern in enumerate(patterns):
        if pattern.any():
            samples, feet = np.flatnonzero(member.ravel() == i), np.flatnonzero(pattern)
            found.extend(_spaces(problem, samples, feet))
    return found


def _spaces(problem: ForceProblem, samples: np.ndarray, feet: np.ndarray) -> list[ForceSpace]:
    """The same for samples on the same feet: a group for each rank of the equations."""
    wrench, grasp = _base_equations(problem, samples, feet)
    left, values, right = np.linalg.svd(grasp, full_matrices=True)
    ranks = (values > RANK * values[:, :1]).sum(axis=1)
    out = []
    for rank in np.unique(ranks):
        own = np.flatnonzero(ranks == rank)
        share = np.einsum("nij,ni->nj", left[own, :, :rank], wrench[own]) / values[own, :rank]
        particular = np.einsum("nji,nj->ni", right[own, :rank], share)
        directions = np.ascontiguousarray(np.swapaxes(right[own, rank:], 1, 2))
        out.append(ForceSpace(samples[own], feet, particular, directions))
    return out


def _base_equations(
    problem: ForceProblem, samples: np.ndarray, feet: np.ndarray
) -> tuple[FloatArray, FloatArray]:
    """The base's six equations ``grasp @ forces = wrench``, in units of weight and length.

    Moments are taken about the middle of the contact points. What two feet cannot make is then a
    moment alone, about the line that joins them, and forces that come nearest to the equations
    leave nothing else.

    Returns:
        The wrench ``(n, 6)`` and the grasp matrices ``(n, 6, 3 k)``.
    """
    equations = problem.equations
    jacobians = equations.contacts.jacobians[np.ix_(samples, feet)]
    # (n, 6, k, 3): force and moment about the base's origin, of a force on each foot.
    grasp = np.moveaxis(jacobians[..., :6], -1, 1)
    wrench = equations.base_forces[samples]
    # The force rows are rotations into the base's axes, the same for every foot. The mean of the
    # moment rows, turned back, is the cross product with the middle of the contact points.
    lever = grasp[:, 3:].mean(axis=2) @ np.swapaxes(grasp[:, :3, 0], 1, 2)
    force, moment = wrench[:, :3], wrench[:, 3:]
    moment = (moment - (lever @ force[..., None])[..., 0]) / problem.length
    turning = grasp[:, 3:] - np.einsum("nij,njfk->nifk", lever, grasp[:, :3])
    return (
        np.concatenate([force, moment], axis=1) / problem.weight,
        np.concatenate([grasp[:, :3], turning / problem.length], axis=1).reshape(
            len(samples), 6, 3 * len(feet)
        ),
    )


def force_rows(problem: ForceProblem, space: ForceSpace) -> ForceRows:
    """What is asked of the forces of a group, as rows of ``z``."""
    count, feet = len(space.samples), len(space.feet)
    contacts, own = problem.equations.contacts, np.ix_(space.samples, space.feet)
    normals = contacts.normals[own]
    pyramids = pyramid_rows(problem.limits, normals, contacts.grip[own])
    shares = problem.limits.least_normal_shares(problem.standing[space.samples])[:, space.feet]
    bases = space.directions.reshape(count, feet, 3, -1)
    offset = space.particular.reshape(count, feet, 3)
    sides = problem.limits.sides
    slip = (pyramids @ bases).reshape(count, feet * sides, -1)
    slip_low = -(pyramids @ offset[..., None]).reshape(count, -1)
    press = np.einsum("nfi,nfid->nfd", normals, bases)
    press_low = shares - np.einsum("nfi,nfi->nf", normals, offset)
    # Largest normal forces have rows of their own, where there are any.
    most = problem.most[own]
    bounded = np.flatnonzero(np.isfinite(most).any(axis=0))
    most_low = np.maximum((shares - press_low - most)[:, bounded], -NO_BOUND)
    joints, torque, torque_offset, low, high = _torque_rows(problem, space)
    unbounded = np.full((count, feet * (sides + 1) + len(bounded)), NO_BOUND)
    return ForceRows(
        matrix=np.concatenate([slip, press, -press[:, bounded], torque], axis=1),
        low=np.concatenate([slip_low, press_low, most_low, low - torque_offset], axis=1),
        high=np.concatenate([unbounded, high - torque_offset], axis=1),
        constraints=np.concatenate(
            [
                np.repeat(np.arange(feet), sides),
                feet + np.arange(feet),
                feet + bounded,
                2 * feet + np.arange(len(joints)),
            ]
        ),
        columns=np.concatenate([space.feet, 4 + space.feet, 8 + joints]),
        normal=np.repeat([False, True, False], [feet * sides, feet, len(bounded) + len(joints)]),
        torque_matrix=torque,
        torque_offset=torque_offset,
    )


def _torque_rows(
    problem: ForceProblem, space: ForceSpace
) -> tuple[np.ndarray, FloatArray, FloatArray, FloatArray, FloatArray]:
    """Torques of the joints that contact forces load, in units of their limits.

    Returns:
        The joints ``(t,)``; their torques by ``z`` ``(n, t, d)`` and at ``z = 0`` ``(n, t)``; and
        their limits, each ``(n, t)``.
    """
    legs = problem.equations.contacts.jacobians[np.ix_(space.samples, space.feet)][..., 6:]
    low, high = problem.torque_low[space.samples], problem.torque_high[space.samples]
    largest = np.maximum(-low, high).max(axis=0)
    chosen = np.flatnonzero((legs != 0.0).any(axis=(0, 1, 2)) & np.isfinite(largest))
    unit = largest[chosen]
    flat = legs[..., chosen].reshape(len(legs), 3 * len(space.feet), len(chosen))
    by_force = problem.weight * np.swapaxes(flat, 1, 2) / unit[:, None]
    matrix = -(by_force @ space.directions)
    alone = problem.equations.joint_forces[space.samples][:, chosen] / unit
    offset = alone - np.einsum("ntf,nf->nt", by_force, space.particular)
    return chosen, matrix, offset, low[:, chosen] / unit, high[:, chosen] / unit
