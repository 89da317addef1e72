"""Contact forces at samples by linear programs: those whose tightest limit leaves the most.

Forces that solve the equations of the base are ``f = G^+ w + N z``, with the constant matrices of
a :class:`gaitopt.certificate.force_margins.Stance`. The unknowns of a program are ``z`` and what
the tightest limit leaves. Its answer is not believed: what the forces leave is computed afresh.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gaitopt.certificate.force_margins import Stance, TorqueLimits
from gaitopt.conventions import FloatArray
from gaitopt.dynamics.small_programs import NO_BOUND, last_points, solve_linear


@dataclass(frozen=True, eq=False)
class ForcePrograms:
    """The programs of ``n`` samples; forces are in units of the weight.

    Attributes:
        stance: the standing feet.
        plain: forces of least norm ``(n, 3 k)`` [N].
        rows, low: of ``rows @ (z, left) >= low``, ``(n, r, d + 1)`` and ``(n, r)``.
    """

    stance: Stance
    plain: FloatArray
    rows: FloatArray
    low: FloatArray

    @classmethod
    def of(
        cls, stance: Stance, wrench: FloatArray, free: FloatArray, jacobians: FloatArray,
        torques: TorqueLimits, most: FloatArray,
    ) -> ForcePrograms:  # fmt: skip
        """The programs of samples.

        Args:
            stance: the standing feet.
            wrench: force and moment about the centre ``(n, 6)``.
            free: joint torques without contact forces ``(n, nj)`` [N m].
            jacobians: of the standing feet ``(n, k, 3, nj)``.
            torques: limits of the joint torques.
            most: largest normal forces ``(n, k)`` [N], or ``(n, 0)`` for none.
        """
        plain = wrench @ stance.inverse.T
        if not stance.directions.shape[1]:
            # Nothing can be chosen, of one foot or none.
            return cls(stance, plain, np.empty((len(plain), 0, 1)), np.empty((len(plain), 0)))
        flat = jacobians.reshape(*plain.shape, free.shape[1])
        rows, low = _rows(stance, plain, free, flat, torques, most)
        return cls(stance, plain, rows, low / stance.weight)

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
        forces = self.plain + self.stance.weight * (z @ self.stance.directions.T)
        return np.asarray(forces.reshape(len(forces), len(self.stance.feet), 3))

    @property
    def _free(self) -> int:
        """How many coordinates forces have."""
        return int(self.stance.directions.shape[1])

    @property
    def _costs(self) -> FloatArray:
        """The largest of what is left is looked for."""
        return np.append(np.zeros(self._free), -1.0)


def _rows(
    stance: Stance, plain: FloatArray, free: FloatArray, jacobians: FloatArray,
    torques: TorqueLimits, most: FloatArray,
) -> tuple[FloatArray, FloatArray]:  # fmt: skip
    """Rows ``A (n, r, d + 1)`` and ``b (n, r)`` of ``A (z, s) >= b``, in units of forces."""
    count, feet, basis = len(plain), len(stance.feet), stance.directions
    by_foot = basis.reshape(feet, 3, basis.shape[1])
    friction = np.einsum("ksd,kdf->ksf", stance.friction_rows, by_foot)
    friction = friction.reshape(-1, basis.shape[1])
    now = stance.sides_of(plain.reshape(count, feet, 3))
    level = np.einsum("kd,kdf->kf", stance.normals, by_foot)
    ground = np.einsum("nkd,kd->nk", plain.reshape(count, feet, 3), stance.normals)
    known = np.isfinite(torques.high).all(axis=0) & (jacobians != 0.0).any(axis=(0, 1))
    legs = np.swapaxes(jacobians[:, :, known], 1, 2)
    moved = legs @ basis / stance.reach
    torque = free[:, known] - (legs @ plain[:, :, None])[..., 0]
    limited = most.shape[1]
    fixed = np.concatenate([friction, level, -level[:limited]])
    matrix = np.full((count, len(fixed) + 2 * moved.shape[1], basis.shape[1] + 1), -1.0)
    matrix[:, : len(fixed), :-1] = fixed
    matrix[:, len(fixed) :, :-1] = np.concatenate([moved, -moved], axis=1)
    low = np.concatenate([
        -now.reshape(count, now.shape[1] * now.shape[2]), stance.least_normals - ground,
        ground[:, :limited] - most,
        (torque - torques.high[:, known]) / stance.reach,
        (torques.low[:, known] - torque) / stance.reach,
    ], axis=1)  # fmt: skip
    return matrix, low
