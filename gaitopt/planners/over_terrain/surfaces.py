"""The ground as the search sees it: where balls of a size rest, and where feet may stand."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike
from scipy.ndimage import binary_dilation, grey_dilation, uniform_filter

from gaitopt.conventions import BoolArray, FloatArray, frozen
from gaitopt.terrain.height_map import HeightMap

RADIUS_STEP = 0.005
"""Radii of balls are rounded up to whole multiples of this [m], so that there are few tables."""
SLACK = 0.75
"""How far a place may be from the nearest point of the grid, in cells: half a diagonal, and a
little more."""
FINER, FINE, MOST_POINTS = 2, 0.5, 250_000
"""The tables have cells smaller by the first of these where those of the map are larger than the
second, as a share of the feet's radius, and the map has no more points than the third. Chosen:
beside a step tables with cells of 20 mm are too low for some balls of 25 mm, and too high for
others; those with cells of 10 mm are never too low. They take 0.1 s for a map of 4 m by 1.5 m, and
seconds for more points."""
BORDER = 0.02
"""Distance that all keeps from what is off the map or unknown while footholds are searched for [m]:
the planner's body may be some millimetres from where the search puts it."""
ACROSS = np.array([[[False] * 3] * 3, [[False, True, False], [True] * 3, [False, True, False]],
                   [[False] * 3] * 3])  # fmt: skip
"""Neighbours on the grid of a table, and none in the table of another size."""
STEEPEST = 0.8
"""Steepest contact as a share of what friction holds: forces also have to move the body."""


@dataclass(frozen=True, eq=False)
class Surfaces:
    """Heights at which balls clear the ground, in tables for balls of several sizes.

    Attributes:
        ground: the height map.
        steps: radii of the tables in multiples of :data:`RADIUS_STEP`, growing ``(C,)``.
        tables: heights of balls at all points of their grid, which may be finer than the map's,
            with a border of one point that is off the map ``(C, nx + 2, ny + 2)`` [m].
        cell: of this grid [m].
    """

    ground: HeightMap
    cell: float
    steps: np.ndarray
    tables: FloatArray

    @classmethod
    def of(cls, ground: HeightMap, radii: ArrayLike, foot: float = np.inf) -> Surfaces:
        """The tables of a map for balls of ``radii (n,)`` [m], and feet of a radius [m]."""
        coarse = ground.resolution > FINE * foot and ground.z.size <= MOST_POINTS
        fine = ground.resampled(ground.resolution / FINER) if coarse else ground
        steps = np.unique(_steps(radii))
        tables = [_dilated(fine, step * RADIUS_STEP) for step in steps.tolist()]
        return cls(ground, fine.resolution, steps, frozen(tables))

    def narrowed(self) -> Surfaces:
        """The same, with what is off the map or unknown reaching farther in by :data:`BORDER`."""
        cells = int(np.ceil(BORDER / self.cell))
        unknown = binary_dilation(~np.isfinite(self.tables), iterations=cells, structure=ACROSS)
        return replace(self, tables=frozen(np.where(unknown, np.inf, self.tables)))

    def sizes(self, radii: ArrayLike) -> np.ndarray:
        """Numbers of the tables for balls of ``radii (n,)`` [m], which are among those given."""
        return np.searchsorted(self.steps, _steps(radii))

    def clear_heights(self, places: FloatArray, sizes: np.ndarray) -> FloatArray:
        """Height at which the centre of a ball clears the ground ``(...)`` [m].

        It may be too high beside steps, by what the ground rises within a cell or so; on level
        ground it is exact. Infinite off the map and near unknown ground.

        Args:
            places: of the centres ``(..., 2)`` [m].
            sizes: numbers of the balls' tables, from :meth:`sizes`.
        """
        table = self.tables
        scale = 1.0 / self.cell
        x, y = self.ground.origin
        i = (places[..., 0] * scale + (1.5 - x * scale)).astype(np.intp)
        j = (places[..., 1] * scale + (1.5 - y * scale)).astype(np.intp)
        np.clip(i, 0, table.shape[1] - 1, out=i)
        np.clip(j, 0, table.shape[2] - 1, out=j)
        return np.asarray(table.reshape(-1)[(sizes * table.shape[1] + i) * table.shape[2] + j])


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

    def mean_heights(self, reach: float) -> FloatArray:
        """Mean height of the stands around each point of the grid ``(nx, ny)`` [m].

        NaN where there is none.

        Args:
            reach: how far around, in cells.
        """
        size = 2 * round(reach) + 1
        some = self.index >= 0
        heights = np.zeros(self.index.shape)
        heights[some] = self.centres[self.index[some], 2]
        heights = uniform_filter(heights, size)
        count = uniform_filter(some.astype(np.float64), size)
        least = 0.5 / size**2
        return np.where(count > least, heights / np.maximum(count, least), np.nan)

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


def _steps(radii: ArrayLike) -> np.ndarray:
    """Radii, rounded up to multiples of :data:`RADIUS_STEP`."""
    return np.maximum(np.ceil(np.asarray(radii) / RADIUS_STEP - 1e-9), 1).astype(int)


def _dilated(ground: HeightMap, radius: float) -> FloatArray:
    """Heights of balls at all points of the grid, with a border that is off the map."""
    cell = ground.resolution
    reach = int(np.floor(radius / cell + SLACK))
    steps = cell * np.arange(-reach, reach + 1)
    away = np.hypot(steps[:, None], steps[None, :])
    beside = np.maximum(away - SLACK * cell, 0.0)
    inside = beside < radius
    rise = np.where(inside, np.sqrt(np.maximum(radius**2 - beside**2, 0.0)), 0.0)
    z = np.pad(np.nan_to_num(ground.z, nan=np.inf), reach + 1, constant_values=np.inf)
    found = grey_dilation(z, footprint=inside, structure=rise, mode="nearest")
    return frozen(found[reach:-reach, reach:-reach] if reach else found)
