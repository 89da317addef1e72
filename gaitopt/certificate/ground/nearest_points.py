"""The nearest points of the faces and edges of a grid of triangles."""

from __future__ import annotations

import numpy as np

from gaitopt.conventions import FloatArray

ON_EDGE = 1e-9
"""How far outside of a triangle a point counts as inside, and how far a place may lie off the map,
as a share of a cell: rounding of places 1 km away is a hundredth of it."""


def on_faces(corners: FloatArray, size: float) -> FloatArray:
    """Where perpendiculars from the origin meet the faces ``(N, 2 * cells^2, 3)``; else NaN.

    Args:
        corners: of a grid, seen from the origin ``(N, n, n, 3)``.
        size: length of a cell.
    """
    low, high = corners[:, :-1, :-1], corners[:, 1:, 1:]
    found = []
    for below in (True, False):
        third = (corners[:, 1:, :-1] if below else corners[:, :-1, 1:])[..., 2]
        ahead, aside = (third - low[..., 2]) / size, (high[..., 2] - third) / size
        slope_x, slope_y = (ahead, aside) if below else (aside, ahead)
        level = low[..., 2] - slope_x * low[..., 0] - slope_y * low[..., 1]
        share = level / (1.0 + slope_x**2 + slope_y**2)
        foot = np.stack([-slope_x * share, -slope_y * share, share], axis=-1)
        u, v = ((foot[..., k] - low[..., k]) / size for k in (0, 1))
        small, large = (v, u) if below else (u, v)
        inside = (small >= -ON_EDGE) & (large <= 1.0 + ON_EDGE) & (large - small >= -ON_EDGE)
        found.append(np.where(inside[..., None], foot, np.nan).reshape(len(corners), -1, 3))
    return np.concatenate(found, axis=1)


def on_edges(corners: FloatArray) -> FloatArray:
    """The points of all edges of a grid that are nearest to the origin ``(N, edges, 3)``.

    NaN for edges of which no triangle is known. What lies on the rim of the grid is left out.
    """
    z = corners[..., 2]
    lower = z[:, :-1, :-1] + z[:, 1:, :-1] + z[:, 1:, 1:]
    upper = z[:, :-1, :-1] + z[:, :-1, 1:] + z[:, 1:, 1:]
    inner = slice(1, -1)
    found = []
    for start, end, one, other in (
        (corners[:, :-1, inner], corners[:, 1:, inner], lower[:, :, 1:], upper[:, :, :-1]),
        (corners[:, inner, :-1], corners[:, inner, 1:], upper[:, 1:], lower[:, :-1]),
        (corners[:, :-1, :-1], corners[:, 1:, 1:], lower, upper),
    ):
        edge = end - start
        share = -(start * edge).sum(axis=-1) / (edge**2).sum(axis=-1)
        point = start + np.clip(share, 0.0, 1.0)[..., None] * edge
        alone = np.isnan(one) & np.isnan(other)
        found.append(np.where(alone[..., None], np.nan, point).reshape(len(corners), -1, 3))
    return np.concatenate(found, axis=1)
