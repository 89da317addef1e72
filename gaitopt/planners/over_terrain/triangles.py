"""Support triangles shrunken by a margin, and the places in them that are nearest to others."""

from __future__ import annotations

import numpy as np

from gaitopt.conventions import BoolArray, FloatArray
from gaitopt.stability.support import triangle_half_planes


def shrunken_triangles(
    corners: FloatArray, margin: float | FloatArray
) -> tuple[FloatArray, BoolArray]:
    """Triangles whose sides are moved inward ``(K, 3, 2)``, and which of them are left ``(K,)``.

    Args:
        corners: of the triangles ``(K, 3, 2)`` [m].
        margin: by how much the sides are moved [m]; one number, or one for each side ``(K, 3)``.
            Sides are in the order of :func:`gaitopt.stability.support.triangle_half_planes`.
    """
    normals, offsets = triangle_half_planes(corners)
    offsets = offsets + margin
    out = np.empty_like(corners)
    for k in range(3):
        i, j = k, (k + 1) % 3
        det = normals[:, i, 0] * normals[:, j, 1] - normals[:, i, 1] * normals[:, j, 0]
        det = np.where(np.abs(det) < 1e-12, 1e-12, det)
        out[:, k, 0] = (offsets[:, i] * normals[:, j, 1] - offsets[:, j] * normals[:, i, 1]) / det
        out[:, k, 1] = (offsets[:, j] * normals[:, i, 0] - offsets[:, i] * normals[:, j, 0]) / det
    # A triangle that is turned over by moving its sides has no room left.
    values = np.einsum("kij,kcj->kci", normals, out) - offsets[:, None]
    return out, np.asarray((values >= -1e-9).all(axis=(1, 2)))


def into_triangles(corners: FloatArray, points: FloatArray) -> FloatArray:
    """The places of triangles ``(K, 3, 2)`` that are nearest to points ``(K, 2)``."""
    ends = np.roll(corners, -1, axis=1)
    along = ends - corners
    share = ((points[:, None] - corners) * along).sum(axis=2)
    share = np.clip(share / np.maximum((along**2).sum(axis=2), 1e-18), 0.0, 1.0)
    on_sides = corners + share[..., None] * along
    away = np.linalg.norm(on_sides - points[:, None], axis=2)
    nearest = on_sides[np.arange(len(points)), away.argmin(axis=1)]
    side = along[..., 0] * (points[:, None, 1] - corners[..., 1])
    side = side - along[..., 1] * (points[:, None, 0] - corners[..., 0])
    inside = np.logical_or((side >= 0.0).all(axis=1), (side <= 0.0).all(axis=1))
    return np.where(inside.reshape(-1, 1), points, nearest)


def new_places(places: FloatArray, same: float) -> BoolArray:
    """Which of places ``(K, P, 2)`` are farther than ``same`` [m] from those before ``(K, P)``."""
    away = np.abs(places[:, :, None] - places[:, None]).max(axis=3)
    before = np.tril(np.ones(away.shape[1:], dtype=np.bool_), -1)
    return np.asarray(~(before & (away < same)).any(axis=2))
