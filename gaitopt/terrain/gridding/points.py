"""Heights of a grid from a cloud of points."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from gaitopt.conventions import FloatArray
from gaitopt.errors import GroundError
from gaitopt.inputs import check_array, check_choice
from gaitopt.terrain.gridding.grid import Grid, covering_grid

POINT_METHODS = ("highest", "median")
"""What is taken of the points near a point of the grid."""


def heights_of_points(points: ArrayLike, resolution: float, method: str) -> Grid:
    """Heights, resolution and origin of a grid over a cloud of points.

    Args:
        points: ``(n, 3)`` [m]; those with NaN are left out.
        resolution: distance of the grid's points [m].
        method: of :data:`POINT_METHODS`.

    Raises:
        GroundError: there are no points, or the grid has too few or too many.
        InputError: the method is unknown.
    """
    check_choice("method", method, POINT_METHODS)
    cloud = _cloud(points)
    shape, origin = covering_grid(
        cloud[:, :2].min(axis=0), cloud[:, :2].max(axis=0), resolution, inside=False
    )
    at = np.rint((cloud[:, :2] - origin) / resolution).astype(np.int64)
    at = np.clip(at, 0, np.array(shape) - 1)
    cell = at[:, 0] * shape[1] + at[:, 1]
    order = np.lexsort((cloud[:, 2], cell))
    heights = cloud[order, 2]
    cells, first, count = np.unique(cell[order], return_index=True, return_counts=True)
    z = np.full(shape[0] * shape[1], np.nan)
    if method == "highest":
        z[cells] = heights[first + count - 1]
    else:
        z[cells] = (heights[first + (count - 1) // 2] + heights[first + count // 2]) / 2.0
    return z.reshape(shape), resolution, origin


def _cloud(points: ArrayLike) -> FloatArray:
    """The points that have finite coordinates ``(n, 3)``."""
    try:
        cloud = check_array("points", points)
    except (TypeError, ValueError) as error:
        raise GroundError(f"points are no array of numbers: {error}") from error
    if cloud.ndim != 2 or cloud.shape[1] != 3:
        raise GroundError(f"points must have the shape (n, 3), got {cloud.shape}")
    cloud = cloud[np.isfinite(cloud).all(axis=1)]
    if not len(cloud):
        raise GroundError("there are no points with finite coordinates")
    return cloud
