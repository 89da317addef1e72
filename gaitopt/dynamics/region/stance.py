"""A robot at rest on some of its feet: the polytope of the contact forces that hold it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from gaitopt.conventions import GRAVITY, FloatArray
from gaitopt.dynamics.contacts import Contacts, ForceLimits
from gaitopt.dynamics.region.balance import BalancedForces, balanced_forces
from gaitopt.dynamics.region.programs import Polytope
from gaitopt.dynamics.region.rows import LARGEST_NORMAL_SHARE, FootRows
from gaitopt.robots.quadruped import Quadruped

LEVEL: Final = 1e-12
"""Contacts whose heights differ by no more than this are on one level [m]: rounding."""


@dataclass(frozen=True, eq=False)
class Stance:
    """One stance on ``m`` feet. Forces are in units of the weight.

    Attributes:
        sample: its position among all stances.
        weight: of the robot [N].
        feet: which feet stand, as indices ``(m,)``.
        points: contact points ``(m, 3)`` [m].
        level: whether the ground is level: all contacts at one height, with vertical normals.
        least: least normal force of each foot.
        radius: largest norm of the coordinates of ``balanced``.
        balanced: all forces that hold the robot.
        friction: inequalities of the forces on each foot: matrices ``(m, r, 3)`` and bounds
            ``(m, r)``.
        torques: the same for the torques of its leg; ``None`` where they are not limited.
    """

    sample: int
    weight: float
    feet: np.ndarray
    points: FloatArray
    level: bool
    least: float
    radius: float
    balanced: BalancedForces
    friction: FootRows
    torques: FootRows | None

    @property
    def rows(self) -> list[FootRows]:
        """All inequalities."""
        return [self.friction] if self.torques is None else [self.friction, self.torques]

    def polytope(self, rows: Sequence[FootRows]) -> Polytope:
        """The forces that hold the robot and keep ``rows``, in coordinates of the balanced ones."""
        matrix = np.concatenate([row.matrix for row in rows], axis=1)
        bounds = np.concatenate([row.bounds for row in rows], axis=1)
        balanced = self.balanced
        return Polytope(
            rows=(matrix @ balanced.basis).reshape(-1, balanced.basis.shape[-1]),
            bounds=(bounds - (matrix @ balanced.forces[..., None])[..., 0]).ravel(),
            place=balanced.com,
            map=balanced.com_basis,
            radius=self.radius,
        )

    def violation(self, forces: FloatArray) -> float:
        """Largest violation of an inequality by ``forces (k, m, 3)``; not above 0 if all hold."""
        return max(
            float((np.einsum("mri,kmi->kmr", row.matrix, forces) - row.bounds).max())
            for row in self.rows
        )

    def residual(self, forces: FloatArray, coms: FloatArray) -> float:
        """Largest error of the equations of rest, with ``forces (k, m, 3)`` and the COM at
        ``coms (k, 2)``: of force, and of torque divided by the weight [m]."""
        x, y, z = (self.points - np.append(self.balanced.com, 0.0)).T
        # Force and torque of unit forces on the feet.
        wrench = np.zeros((len(x), 3, 6))
        wrench[:, 0, 0] = wrench[:, 1, 1] = wrench[:, 2, 2] = 1.0
        wrench[:, 2, 3], wrench[:, 1, 3] = y, -z
        wrench[:, 0, 4], wrench[:, 2, 4] = z, -x
        wrench[:, 1, 5], wrench[:, 0, 5] = x, -y
        wanted = np.zeros((len(coms), 6))
        wanted[:, 2] = 1.0
        wanted[:, 3:5] = (coms - self.balanced.com)[:, ::-1] * (1.0, -1.0)
        found = forces.reshape(len(coms), -1) @ wrench.reshape(-1, 6)
        return float(np.abs(found - wanted).max())


def stances(
    robot: Quadruped,
    contacts: Contacts,
    limits: ForceLimits,
    friction: FootRows,
    torques: FootRows | None,
) -> Iterator[Stance]:
    """The stances of all samples, in groups of those on the same number of feet.

    Args:
        robot: the robot.
        contacts: of the four feet ``(B, 4)``, two of which stand at least.
        limits: from which the rows were made.
        friction: of the four feet ``(B, 4)``.
        torques: of the four legs ``(B, 4)``, or ``None``.
    """
    count = contacts.standing.sum(axis=1)
    for m in np.unique(count):
        samples = np.flatnonzero(count == m)
        yield from _on_feet(robot, contacts, limits, friction, torques, samples, int(m))


def _on_feet(
    robot: Quadruped,
    contacts: Contacts,
    limits: ForceLimits,
    friction: FootRows,
    torques: FootRows | None,
    samples: np.ndarray,
    m: int,
) -> Iterator[Stance]:
    """The stances of ``samples (b,)``, on ``m`` feet each."""
    standing = contacts.standing[samples]
    feet = np.argsort(~standing, axis=1, kind="stable")[:, :m]
    chosen = samples[:, None], feet
    points, normals = contacts.points[chosen], contacts.normals[chosen]
    balanced = balanced_forces(points)
    level = (normals[..., :2] == 0.0).all(axis=(1, 2)) & (np.ptp(points[..., 2], axis=1) <= LEVEL)
    least = limits.least_normal_shares(standing).max(axis=1)
    # Forces differ from the equal ones by no more than the largest of them is long.
    radius = 1.0 + LARGEST_NORMAL_SHARE * np.sqrt(m * (1.0 + limits.friction**2))
    for i, sample in enumerate(samples):
        own = sample, feet[i]
        yield Stance(
            sample=int(sample),
            weight=robot.mass * GRAVITY,
            feet=feet[i],
            points=points[i],
            level=bool(level[i]),
            least=float(least[i]),
            radius=float(radius),
            balanced=BalancedForces(*(part[i] for part in balanced)),
            friction=FootRows(friction.matrix[own], friction.bounds[own]),
            torques=None if torques is None else FootRows(torques.matrix[own], torques.bounds[own]),
        )
