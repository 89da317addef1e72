"""The ground as the search sees it: where balls of a size rest, and where feet may stand."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from scipy.ndimage import grey_dilation

from gaitopt.conventions import BoolArray, FloatArray, frozen
from gaitopt.terrain.height_map import HeightMap

RADIUS_STEP = 0.005
"""Radii of balls are rounded up to whole multiples of this [m], so that there are few tables."""
SLACK = 0.75
"""How far a place may be from the nearest point of the grid, in cells: half a diagonal, and a
little more."""
STEEPEST = 0.8
"""Steepest contact as a share of what friction holds: forces also have to move the body."""


@dataclass(frozen=True, eq=False)
class Surfaces:
    """Heights at which balls clear the ground, in tables.

    Attributes:
        ground: the height map.
    """

    ground: HeightMap
    _tables: dict[int, FloatArray] = field(default_factory=dict, init=False, repr=False)

    def clear_height(self, places: FloatArray, radius: float) -> FloatArray:
        """Height at which the centre of a ball clears the ground ``(...)`` [m].

        It may be too high beside steps, by what the ground rises within a cell or so; on level
        ground it is exact. Infinite off the map and near unknown ground.

        Args:
            places: of the centres ``(..., 2)`` [m].
            radius: of the ball [m].
        """
        table = self._table(int(np.ceil(radius / RADIUS_STEP - 1e-9)))
        at = (places - self.ground.origin) / self.ground.resolution
        # The table has a border of one point, which is off the map.
        i = np.clip(np.rint(at[..., 0]) + 1, 0, table.shape[0] - 1).astype(np.intp)
        j = np.clip(np.rint(at[..., 1]) + 1, 0, table.shape[1] - 1).astype(np.intp)
        return np.asarray(table[i, j])

    def _table(self, size: int) -> FloatArray:
        if size not in self._tables:
            self._tables[size] = self._dilated(max(size, 1) * RADIUS_STEP)
        return self._tables[size]

    def _dilated(self, radius: float) -> FloatArray:
        """Heights of balls at all points of the grid, with a border that is off the map."""
        cell = self.ground.resolution
        reach = int(np.floor(radius / cell + SLACK))
        steps = cell * np.arange(-reach, reach + 1)
        away = np.hypot(steps[:, None], steps[None, :])
        beside = np.maximum(away - SLACK * cell, 0.0)
        inside = beside < radius
        rise = np.where(inside, np.sqrt(np.maximum(radius**2 - beside**2, 0.0)), 0.0)
        z = np.pad(np.nan_to_num(self.ground.z, nan=np.inf), reach + 1, constant_values=np.inf)
        found = grey_dilation(z, footprint=inside, structure=rise, mode="nearest")
        return frozen(found[reach:-reach, reach:-reach] if reach else found)


@dataclass(frozen=True, eq=False)
class Stands:
    """Where feet may stand: points of the grid, with the foot's ball on them.

    Attributes:
        centres: of the balls ``(n, 3)`` [m].
        normals: of the ground there ``(n, 3)``.
        penalties: how bad each is, from 0 for the best ``(n,)``.
        index: number of the stand at each point of the grid ``(nx, ny)``; -1 where none is.
    """

    centres: FloatArray
    normals: FloatArray
    penalties: FloatArray
    index: np.ndarray

    @classmethod
    def of(
        cls, ground: HeightMap, radius: float, steppable: BoolArray, penalties: FloatArray,
        friction: float,
    ) -> Stands:  # fmt: skip
        """The stands of a map.

        Args:
            ground: the map.
            radius: of the feet [m].
            steppable: which points of the grid feet may stand on ``(nx, ny)``.
            penalties: of all points ``(nx, ny)``.
            friction: coefficient of friction: a foot whose contact is steeper has no stand.
        """
        i, j = np.nonzero(steppable)
        ball = ground.ball(np.column_stack([ground.x[i], ground.y[j]]), radius)
        # A comparison with NaN is false.
        known = ball.normals[:, 2] >= 1.0 / np.hypot(1.0, STEEPEST * friction)
        index = np.full(ground.shape, -1)
        index[i[known], j[known]] = np.arange(int(known.sum()))
        return cls(ball.centres[known], ball.normals[known], penalties[i[known], j[known]], index)

    def near(self, ground: HeightMap, place: FloatArray, radius: float) -> np.ndarray:
        """Numbers of the stands within ``radius`` [m] of a horizontal place ``(2,)`` [m]."""
        at = (place - ground.origin) / ground.resolution
        span = radius / ground.resolution
        low = np.clip(np.floor(at - span), 0, ground.shape).astype(int)
        high = np.clip(np.ceil(at + span) + 1, 0, ground.shape).astype(int)
        found = self.index[low[0] : high[0], low[1] : high[1]].ravel()
        found = found[found >= 0]
        away = np.hypot(*(self.centres[found, :2] - place).T)
        return np.asarray(found[away <= radius])
