"""Heights of a grid from surfaces: the top of triangles, and of columns."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from gaitopt.conventions import FloatArray
from gaitopt.errors import GroundError
from gaitopt.inputs import check_array
from gaitopt.terrain.gridding.grid import Grid, covering_grid, window_points

BORDER = 1e-9
"""How far outside of a triangle a point may come out by rounding, as a share of the triangle."""
ON_A_LINE = 1e-4
"""Corners of triangles that are as near to a line of the grid lie on it, in cells. Files hold
32-bit coordinates, and the border of a mesh at 1.4 m is then at 1.39999998 m."""
UPRIGHT = 1e-12
"""Triangles whose area seen from above is a smaller share of their sides' squares stand upright."""


def heights_of_triangles(triangles: ArrayLike, resolution: float) -> Grid:
    """Heights, resolution and origin of a grid over the top of triangles.

    Points of the grid that no triangle lies above or below are NaN. Triangles that stand upright
    have no top.

    Args:
        triangles: corners ``(n, 3, 3)`` [m].
        resolution: distance of the grid's points [m].

    Raises:
        GroundError: corners are missing or not finite, or the grid has too few or too many points.
    """
    try:
        corners = check_array("triangles", triangles)
    except (TypeError, ValueError) as error:
        raise GroundError(f"corners of triangles are no array of numbers: {error}") from error
    if corners.ndim != 3 or corners.shape[1:] != (3, 3) or not len(corners):
        raise GroundError(f"triangles must have the shape (n, 3, 3), got {corners.shape}")
    if not np.isfinite(corners).all():
        raise GroundError("corners of triangles must be finite numbers")
    cells = corners[..., :2] / resolution
    lines = np.rint(cells)
    cells = np.where(np.abs(cells - lines) <= ON_A_LINE, lines, cells)
    flat = cells.reshape(-1, 2) * resolution
    shape, origin = covering_grid(flat.min(axis=0), flat.max(axis=0), resolution, inside=True)
    plan = cells - origin / resolution
    one, two = plan[:, 1] - plan[:, 0], plan[:, 2] - plan[:, 0]
    area = one[:, 0] * two[:, 1] - one[:, 1] * two[:, 0]
    lying = np.abs(area) > UPRIGHT * ((one**2).sum(axis=1) + (two**2).sum(axis=1))
    plan, one, two, area, tall = (a[lying] for a in (plan, one, two, area, corners[..., 2]))
    low = np.maximum(np.ceil(plan.min(axis=1) - BORDER), 0).astype(np.int64)
    high = np.minimum(np.floor(plan.max(axis=1) + BORDER), np.array(shape) - 1).astype(np.int64)
    top = np.full(shape, -np.inf)
    for k, i, j in window_points(low, high):
        x, y = i - plan[k, 0, 0], j - plan[k, 0, 1]
        second = (x * two[k, 1] - y * two[k, 0]) / area[k]
        third = (y * one[k, 0] - x * one[k, 1]) / area[k]
        over = np.minimum(np.minimum(second, third), 1.0 - second - third) >= -BORDER
        k, second, third = k[over], second[over], third[over]
        z = tall[k]
        height = z[:, 0] + second * (z[:, 1] - z[:, 0]) + third * (z[:, 2] - z[:, 0])
        # Triangles that stand almost upright have weights with large errors of rounding.
        height = np.clip(height, z.min(axis=1), z.max(axis=1))
        np.maximum.at(top, (i[over], j[over]), height)
    return np.where(np.isfinite(top), top, np.nan), resolution, origin


class Columns(Protocol):
    """What is needed of :class:`gaitopt.Footholds`."""

    @property
    def radius(self) -> float | None:
        """Radius of the columns [m]; ``None`` for open ground."""

    def touching(self, radius: float) -> FloatArray:
        """Where feet of a radius [m] touch the columns ``(4, n, 3)`` [m]."""


def heights_of_columns(
    footholds: Columns, foot_radius: float, resolution: float, depth: float
) -> Grid:
    """Heights, resolution and origin of a grid over round columns.

    Args:
        footholds: on the columns.
        foot_radius: of the feet, whose centres the footholds are [m].
        resolution: distance of the grid's points [m].
        depth: how far the floor is below the lowest top [m].

    Raises:
        GroundError: there are no columns, or the grid has too many points.
    """
    if footholds.radius is None:
        raise GroundError(
            "these footholds have no columns; give them a radius: footholds.with_(radius=0.02)"
        )
    radius, tops = footholds.radius, footholds.touching(foot_radius).reshape(-1, 3)
    # A border of one cell shows that the columns end.
    reach = radius + 2.0 * resolution
    shape, origin = covering_grid(
        tops[:, :2].min(axis=0) - reach, tops[:, :2].max(axis=0) + reach, resolution, inside=True
    )
    z = np.full(shape, tops[:, 2].min() - depth)
    at = (tops[:, :2] - origin) / resolution
    share = radius / resolution
    low, high = np.ceil(at - share).astype(np.int64), np.floor(at + share).astype(np.int64)
    for k, i, j in window_points(low, high):
        within = np.hypot(i - at[k, 0], j - at[k, 1]) <= share + BORDER
        np.maximum.at(z, (i[within], j[within]), tops[k[within], 2])
    return z, resolution, origin
