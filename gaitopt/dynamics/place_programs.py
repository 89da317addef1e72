"""Programs that look for forces at places of a path, along rays from rest.

All places on the same standing feet are one group. A ray is the multiples of a pair ``(u, x)`` of
path acceleration and squared path speed. The largest multiple that has forces lies on a side of the
polygon of all such pairs; multipliers tell the side, and the few rows that hold it back.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gaitopt.conventions import BoolArray, FloatArray
from gaitopt.dynamics.many_programs import solve_linear_programs
from gaitopt.dynamics.small_programs import NO_BOUND, PROGRAM_TOLERANCE

MOST_HOLDING = 7
"""Most rows that hold a side back: one more than the free coordinates of forces on four feet."""
NEVER_ZERO = 1e-12
"""What is added to squares of rows, so that those that hold nothing back can be left out."""


class Sides(NamedTuple):
    """What rays meet.

    Attributes:
        multiples: at which they leave their polygons ``(n,)``.
        lines: sides that they meet, half-planes ``a u + b x <= 1`` ``(n, 2)``; zeros where none is
            that near.
        holding: numbers of the rows that hold the sides back, from 1 on, and negative at a row's
            lower limit ``(n, MOST_HOLDING)``; zeros for none.
        forces: free coordinates of the forces where rays leave ``(n, d)``.
        proven: whether all this is proven ``(n,)``.
    """

    multiples: FloatArray
    lines: FloatArray
    holding: np.ndarray
    forces: FloatArray
    proven: BoolArray


class PlacePrograms(NamedTuple):
    """Rows of the places on the same feet: ``low <= by_motion (u, x) + by_force z <= high``.

    Attributes:
        places: ``(n,)``.
        by_motion: in the units of the places ``(n, r, 2)``.
        by_force: ``(n, r, d)``.
        low, high: ``(n, r)``.
    """

    places: np.ndarray
    by_motion: FloatArray
    by_force: FloatArray
    low: FloatArray
    high: FloatArray

    def sides(self, own: np.ndarray, rays: FloatArray, far: FloatArray) -> Sides:
        """Sides that rays from (0, 0) hit.

        Args:
            own: positions in this group ``(m,)``.
            rays: points on them ``(m, 2)``.
            far: the largest multiple of these points that is looked at ``(m,)``.
        """
        by_motion, free = self.by_motion[own], self.by_force.shape[2]
        count, length = by_motion.shape[:2]
        rows = np.zeros((count, length + 1, 1 + free))
        rows[:, :length, 0] = _times(by_motion, rays)
        rows[:, :length, 1:] = self.by_force[own]
        rows[:, length, 0] = 1.0
        low = np.concatenate([self.low[own], np.full((count, 1), -NO_BOUND)], axis=1)
        high = np.concatenate([self.high[own], far[:, None]], axis=1)
        found = solve_linear_programs(-np.eye(1 + free)[0], rows, low, high)
        multiples, weights = found.points[:, 0], found.multipliers[:, :length]
        near = found.proven & (multiples > 0.0) & (found.multipliers[:, length] <= 0.0)
        lines = (weights[:, None] @ by_motion)[:, 0]
        lines = np.where(near[:, None], lines / np.where(near, multiples, 1.0)[:, None], 0.0)
        return Sides(
            multiples, lines, _holding(weights, free + 1), found.points[:, 1:], found.proven
        )

    def have_forces(self, own: np.ndarray, points: FloatArray, holding: np.ndarray) -> BoolArray:
        """Whether the rows that hold a side back lead to forces at points on it ``(m,)``.

        Where they do not there may be others.

        Args:
            own: positions in this group ``(m,)``.
            points: ``(m, 2)``.
            holding: rows that hold back the side that they lie on, as in :class:`Sides`.
        """
        holding = holding[:, : self.by_force.shape[2] + 1]
        index, there, row = np.abs(holding) - 1, holding != 0, own[:, None]
        matrix = self.by_force[row, index] * there[..., None]
        limit = np.where(holding > 0, self.high[row, index], self.low[row, index])
        moved = _times(self.by_motion[own], points)
        left = np.where(there, limit - np.take_along_axis(moved, index, axis=1), 0.0)
        turned = np.swapaxes(matrix, 1, 2)
        squares = turned @ matrix + NEVER_ZERO * np.eye(matrix.shape[2])
        forces = np.linalg.solve(squares, turned @ left[..., None])[..., 0]
        return self.keep(own, points, forces)

    def keep(self, own: np.ndarray, points: FloatArray, forces: FloatArray) -> BoolArray:
        """Whether given forces keep all rows at points ``(m,)``.

        Args:
            own: positions in this group ``(m,)``.
            points: ``(m, 2)``.
            forces: free coordinates of the forces ``(m, d)``.
        """
        values = _times(self.by_motion[own], points) + _times(self.by_force[own], forces)
        kept = (values >= self.low[own] - PROGRAM_TOLERANCE) & (
            values <= self.high[own] + PROGRAM_TOLERANCE
        )
        return np.asarray(kept.all(axis=1))


def _holding(weights: FloatArray, most: int) -> np.ndarray:
    """Numbers of the rows with the largest multipliers ``(n, MOST_HOLDING)``, as in Sides."""
    out = np.zeros((len(weights), MOST_HOLDING), dtype=np.int16)
    if weights.shape[1] > most:
        largest = np.argpartition(-np.abs(weights), most - 1, axis=1)[:, :most]
        signs = np.sign(np.take_along_axis(weights, largest, axis=1))
        out[:, :most] = signs * (largest + 1)
    return out


def _times(matrix: FloatArray, vector: FloatArray) -> FloatArray:
    """Products of matrices ``(n, r, k)`` and vectors ``(n, k)``: ``(n, r)``."""
    return np.asarray((matrix @ vector[..., None])[..., 0])
