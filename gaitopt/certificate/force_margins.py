"""What friction, normal forces and torques leave over in one phase, with the best contact forces.

In a phase the contact points stand still, so the equations of the base ``G f = w`` have a constant
matrix ``G``. Forces that solve them are ``f = G^+ w + N z``. A linear program looks for the ``z``
whose tightest limit leaves the most; what it leaves is computed afresh from its forces.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from gaitopt.conventions import GRAVITY, LEGS, FloatArray
from gaitopt.dynamics.contacts import ForceLimits, effort_limits, pyramid_rows
from gaitopt.dynamics.small_programs import NO_BOUND, solve_linear
from gaitopt.robots.quadruped import Quadruped

RANK = 1e-9
"""Share of the largest singular value below which one is zero: rounding leaves about 1e-16."""


@dataclass(frozen=True, eq=False)
class Stance:
    """The feet that stand in a phase, and what is asked of their forces.

    Attributes:
        robot, limits: the robot, and what is asked.
        feet: indices of the standing feet ``(k,)``.
        points: their contact points ``(k, 3)`` [m].
    """

    robot: Quadruped
    limits: ForceLimits
    feet: np.ndarray
    points: FloatArray

    @cached_property
    def centre(self) -> FloatArray:
        """Reference of moments: the middle of the contact points ``(3,)`` [m]."""
        return self.points.mean(axis=0) if len(self.feet) else np.zeros(3)

    @property
    def weight(self) -> float:
        """Weight of the robot [N]."""
        return self.robot.mass * GRAVITY

    @cached_property
    def reach(self) -> float:
        """Length that makes forces of torques: the reach of a leg [m]."""
        return float(max(leg.reach for leg in self.robot.legs.values()))

    @cached_property
    def grasp(self) -> FloatArray:
        """``G``: from contact forces to force and moment about the centre ``(6, 3 k)``."""
        out = np.zeros((6, 3 * len(self.feet)))
        for i, (x, y, z) in enumerate(self.points - self.centre):
            out[:3, 3 * i : 3 * i + 3] = np.eye(3)
            out[3:, 3 * i : 3 * i + 3] = [[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]]
        return out

    @cached_property
    def _split(self) -> tuple[FloatArray, FloatArray]:
        """Pseudo-inverse ``(3 k, 6)`` and null space ``(3 k, d)`` of ``G``."""
        scale = np.repeat([1.0, self.reach], 3)
        left, values, right = np.linalg.svd(self.grasp / scale[:, None])
        rank = int((values > RANK * values.max(initial=1.0)).sum())
        inverse = right[:rank].T @ ((left[:, :rank] / values[:rank]).T / scale)
        return inverse, right[rank:].T

    @property
    def makes_any_wrench(self) -> bool:
        """Whether the standing feet can make every wrench, were there no limits."""
        return bool(3 * len(self.feet) - self.directions.shape[1] == 6)

    @property
    def inverse(self) -> FloatArray:
        """Pseudo-inverse of ``G`` ``(3 k, 6)``."""
        return np.asarray(self._split[0])

    @property
    def directions(self) -> FloatArray:
        """Forces without resultant ``(3 k, d)``."""
        return self._split[1]

    def correction(self, force: FloatArray, moment: FloatArray) -> FloatArray:
        """How much forces change at most to make up for a wrench ``(P, k)`` [N].

        Args:
            force, moment: bounds on its parts ``(P,)`` [N], [N m].
        """
        blocks = self.inverse.reshape(len(self.feet), 3, 6)
        by_force = np.linalg.norm(blocks[:, :, :3], ord=2, axis=(1, 2))
        by_moment = np.linalg.norm(blocks[:, :, 3:], ord=2, axis=(1, 2))
        return np.asarray(force[:, None] * by_force + moment[:, None] * by_moment)

    @cached_property
    def friction_rows(self) -> FloatArray:
        """Sides of the friction pyramid, of unit length ``(sides, 3)``."""
        rows = pyramid_rows(self.limits)
        return np.asarray(rows / np.linalg.norm(rows, axis=1, keepdims=True))

    @cached_property
    def least_normals(self) -> FloatArray:
        """Least normal force of each standing foot ``(k,)`` [N]."""
        standing = np.isin(np.arange(len(LEGS)), self.feet)
        return np.asarray(self.weight * self.limits.least_normal_shares(standing)[self.feet])

    @cached_property
    def torque_limits(self) -> FloatArray:
        """Torque that each joint may use ``(nj,)`` [N m]; infinite where it is not known."""
        return np.asarray(self.limits.torque_share * effort_limits(self.robot).limits)

    @cached_property
    def names(self) -> list[str]:
        """What each column of :meth:`left` is about."""
        legs = [LEGS[i] for i in self.feet]
        sides = len(self.friction_rows)
        return [
            *(f"friction {leg}" for leg in legs for _ in range(sides)),
            *(f"normal force {leg}" for leg in legs),
            *(f"torque {name}" for name in self.robot.joint_names),
        ]

    def left(self, forces: FloatArray, torques: FloatArray) -> FloatArray:
        """What each limit leaves ``(n, r)`` [N].

        Args:
            forces: contact forces ``(n, k, 3)`` [N].
            torques: of the joints ``(n, nj)`` [N m].
        """
        count = len(forces)
        friction = np.einsum("sd,nkd->nks", self.friction_rows, forces).reshape(count, -1)
        normal = forces[:, :, 2] - self.least_normals
        torque = (self.torque_limits - np.abs(torques)) / self.reach
        return np.concatenate([friction, normal, torque], axis=1)

    def best_forces(
        self, wrench: FloatArray, free: FloatArray, jacobians: FloatArray
    ) -> FloatArray:
        """Contact forces whose tightest limit leaves the most ``(n, k, 3)`` [N].

        Args:
            wrench: force and moment about the centre ``(n, 6)``.
            free: joint torques without contact forces ``(n, nj)`` [N m].
            jacobians: of the standing feet ``(n, k, 3, nj)``.
        """
        count, feet = len(wrench), len(self.feet)
        plain = wrench @ self.inverse.T
        if not self.directions.shape[1]:
            return np.asarray(plain.reshape(count, feet, 3))
        rows, low = self._rows(plain, free, jacobians.reshape(count, 3 * feet, -1))
        costs = np.zeros(rows.shape[2])
        costs[-1] = -1.0
        high = np.full(rows.shape[1], NO_BOUND)
        out = plain.copy()
        for i in range(count):
            program = (costs, rows[i], low[i] / self.weight, high)
            found = solve_linear(*program) or solve_linear(*program, by_highs=True)
            if found is not None:
                out[i] += self.weight * (self.directions @ found.point[:-1])
        return np.asarray(out.reshape(count, feet, 3))

    def _rows(
        self, plain: FloatArray, free: FloatArray, jacobians: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Rows ``A (n, r, d + 1)`` and ``b (n, r)`` of ``A (z, s) >= b``, in units of forces."""
        count, feet, basis = len(plain), len(self.feet), self.directions
        friction = np.einsum("sd,kdf->ksf", self.friction_rows, basis.reshape(feet, 3, -1))
        friction = friction.reshape(-1, basis.shape[1])
        now = np.einsum("sd,nkd->nks", self.friction_rows, plain.reshape(count, feet, 3))
        level, ground = basis[2::3], plain[:, 2::3]
        known = np.isfinite(self.torque_limits) & (np.abs(jacobians).max(axis=(0, 1)) > 0.0)
        moved = np.swapaxes(jacobians[:, :, known], 1, 2) @ basis / self.reach
        torque = free[:, known] - np.einsum("nfj,nf->nj", jacobians[:, :, known], plain)
        limit = self.torque_limits[known]
        fixed = np.concatenate([friction, level])
        matrix = np.concatenate(
            [np.broadcast_to(fixed, (count, *fixed.shape)), moved, -moved], axis=1
        )
        low = np.concatenate([
            -now.reshape(count, -1), self.least_normals - ground,
            -(limit - torque) / self.reach, -(limit + torque) / self.reach,
        ], axis=1)  # fmt: skip
        slack = np.full((*matrix.shape[:2], 1), -1.0)
        return np.concatenate([matrix, slack], axis=2), low
