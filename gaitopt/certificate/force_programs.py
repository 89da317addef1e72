"""Contact forces at samples by linear programs: those whose tightest limit leaves the most.

Forces that solve the equations of the base are ``f = G^+ w + N z``, with the matrices of
:class:`gaitopt.certificate.force_margins.Stances`. The unknowns of a program are ``z`` and what
the tightest limit leaves. Its answer is not believed: what the forces leave is computed afresh.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gaitopt.certificate.force_margins import Stances, TorqueLimits
from gaitopt.conventions import FloatArray
from gaitopt.dynamics.many_programs import last_points
from gaitopt.dynamics.small_programs import NO_BOUND, solve_linear


@dataclass(frozen=True, eq=False)
class ForcePrograms:
    """The programs of ``n`` samples; forces are in units of the weight.

    Attributes:
        stances: the standing feet, and their limits.
        owner: the phase of each sample ``(n,)``.
        plain: forces of least norm ``(n, 3 k)`` [N].
        rows, low: of ``rows @ (z, left) >= low``, ``(n, r, d + 1)`` and ``(n, r)``.
    """

    stances: Stances
    owner: np.ndarray
    plain: FloatArray
    rows: FloatArray
    low: FloatArray

    @classmethod
    def of(
        cls, stances: Stances, owner: np.ndarray, wrench: FloatArray, free: FloatArray,
        jacobians: FloatArray, torques: TorqueLimits, most: FloatArray,
    ) -> ForcePrograms:  # fmt: skip
        """The programs of samples.

        Args:
            stances: the standing feet.
            owner: the phase of each sample ``(n,)``.
            wrench: force and moment about the centre ``(n, 6)``.
            free: torques of the standing legs' joints without contact forces ``(n, k j)`` [N m].
            jacobians: of the standing feet by their own joints ``(n, k, 3, j)``.
            torques: limits of the torques of these joints.
            most: largest normal forces ``(n, k)`` [N], or ``(n, 0)`` for none.
        """
        plain = (stances.inverse[owner] @ wrench[:, :, None])[..., 0]
        if not stances.directions.shape[2]:
            # Nothing can be chosen, of one foot or none.
            nothing = np.empty((len(plain), 0, 1)), np.empty((len(plain), 0))
            return cls(stances, owner, plain, *nothing)
        rows, low = _rows(stances, owner, plain, free, jacobians, torques, most)
        return cls(stances, owner, plain, rows, np.maximum(low / stances.weight, -NO_BOUND))

    def solve(self) -> FloatArray:
        """Coordinates ``z (n, d)`` of all samples, of which nothing is proven."""
        if not self._free:
            return np.zeros((len(self.plain), 0))
        found = last_points(self._costs, self.rows, self.low)[:, :-1]
        return np.asarray(np.where(np.isfinite(found), found, 0.0))

    def solve_again(self, z: FloatArray, which: np.ndarray) -> FloatArray:
        """The same with proven minimisers at some samples, as far as there are any ``(n, d)``."""
        out = np.array(z)
        high = np.full(self.rows.shape[1], NO_BOUND)
        for i in which if self._free else ():
            program = (self._costs, self.rows[i], self.low[i], high)
            found = solve_linear(*program) or solve_linear(*program, by_highs=True)
            if found is not None:
                out[i] = found.point[:-1]
        return out

    def forces(self, z: FloatArray) -> FloatArray:
        """Contact forces ``(n, k, 3)`` [N]."""
        chosen = (self.stances.directions[self.owner] @ z[:, :, None])[..., 0]
        forces = self.plain + self.stances.weight * chosen
        return np.asarray(forces.reshape(len(forces), self.stances.feet.shape[1], 3))

    @property
    def _free(self) -> int:
        """How many coordinates forces have."""
        return int(self.stances.directions.shape[2])

    @property
    def _costs(self) -> FloatArray:
        """The largest of what is left is looked for."""
        return np.append(np.zeros(self._free), -1.0)


def _rows(
    stances: Stances, owner: np.ndarray, plain: FloatArray, free: FloatArray,
    jacobians: FloatArray, torques: TorqueLimits, most: FloatArray,
) -> tuple[FloatArray, FloatArray]:  # fmt: skip
    """Rows ``A (n, r, d + 1)`` and ``b (n, r)`` of ``A (z, s) >= b``, in units of forces."""
    count, limited = len(plain), most.shape[1]
    phases, feet = stances.feet.shape
    by_foot = stances.directions.reshape(phases, feet, 3, -1)
    friction = (stances.friction_rows @ by_foot).reshape(phases, -1, by_foot.shape[3])
    level = (stances.normals[:, :, None] @ by_foot)[:, :, 0]
    fixed = np.concatenate([friction, level, -level[:, :limited]], axis=1)
    legs, at_feet = np.swapaxes(jacobians, 2, 3), plain.reshape(count, feet, 3)
    joints = free.shape[1]
    moved = (legs @ by_foot[owner] / stances.reach).reshape(count, joints, by_foot.shape[3])
    torque = free - (legs @ at_feet[..., None]).reshape(free.shape)
    matrix = np.full((count, fixed.shape[1] + 2 * joints, moved.shape[2] + 1), -1.0)
    of_ground, of_torques = matrix[:, : fixed.shape[1]], matrix[:, fixed.shape[1] :]
    of_ground[..., :-1] = fixed[owner]
    of_torques[:, :joints, :-1] = moved
    of_torques[:, joints:, :-1] = -moved
    pressing = np.einsum("nkd,nkd->nk", at_feet, stances.normals[owner])
    low = np.concatenate([
        -stances.sides_of(at_feet, owner), stances.least_normals[owner] - pressing,
        pressing[:, :limited] - most,
        (torque - torques.high) / stances.reach,
        (torques.low - torque) / stances.reach,
    ], axis=1)  # fmt: skip
    return matrix, low
