"""Convex polygons of a few corners: their hull, half-planes, area, and distances from them."""

from __future__ import annotations

from collections.abc import Sequence
from math import hypot
from typing import Final

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.stability.support import HalfPlanes

SAME_PLACE: Final = 1e-9
"""Corners that stand out of the polygon of the others by no more than this are left out [m]."""


def hull_indices(points: FloatArray) -> list[int]:
    """Which of ``points (k, 2)`` are the corners of their hull, counter-clockwise.

    Corners are left out that stand out by less than :data:`SAME_PLACE`. Two indices are returned
    when the points lie on a segment, one when they coincide.
    """
    places = [(x, y) for x, y in points.tolist()]
    order = sorted(range(len(places)), key=places.__getitem__)
    chain = _half_hull(places, order)[:-1] + _half_hull(places, order[::-1])[:-1]
    return corner_indices(points, chain)


def corner_indices(points: FloatArray, order: Sequence[int] | None = None) -> list[int]:
    """Which of ``points (k, 2)`` around a convex polygon are its corners: :func:`hull_indices`.

    Args:
        points: [m].
        order: the points on the border, counter-clockwise; all, as they are, by default. Some may
            coincide or lie on a side.
    """
    places = [(x, y) for x, y in points.tolist()]
    corners, before = list(range(len(places)) if order is None else order), -1
    while len(corners) != before and len(corners) >= 3:
        before = len(corners)
        corners = _without_flat(places, corners)
    if len(corners) >= 3:
        return corners
    first, second = _farthest_pair(points)
    apart = float(np.linalg.norm(points[first] - points[second]))
    return [first, second] if apart > SAME_PLACE else [first]


def polygon_half_planes(vertices: FloatArray) -> HalfPlanes:
    """Half-planes of the polygon with these vertices, counter-clockwise ``(k, 2)`` [m].

    Of a segment or a point they are four: two along it and two across its ends.
    """
    corners = np.asarray(vertices)
    count = len(corners)
    if count >= 3:
        along = np.roll(corners, -1, axis=0) - corners
        normals = _turned_left(along / np.linalg.norm(along, axis=1, keepdims=True))
        edges = tuple((i, (i + 1) % count) for i in range(count))
        return HalfPlanes(normals, (normals * corners).sum(axis=1), edges)
    first, last = corners[0], corners[-1]
    length = float(np.linalg.norm(last - first))
    along = (last - first) / length if count == 2 else np.array([1.0, 0.0])
    across = _turned_left(along)
    normals = np.stack([across, -across, along, -along])
    offsets = np.array([across @ first, -across @ last, along @ first, -along @ last])
    end = count - 1
    return HalfPlanes(normals, offsets, ((0, end), (end, 0), (0, 0), (end, end)))


def polygon_area(vertices: FloatArray) -> float:
    """Area of the polygon with these vertices, counter-clockwise ``(k, 2)`` [m^2]."""
    if len(vertices) < 3:
        return 0.0
    arms = vertices[1:] - vertices[0]
    return float(0.5 * (arms[:-1, 0] * arms[1:, 1] - arms[:-1, 1] * arms[1:, 0]).sum())


def polygon_margin(vertices: FloatArray, places: FloatArray) -> FloatArray:
    """Signed distance of ``places (..., 2)`` from the border of a polygon ``(...)`` [m].

    Positive inside, and minus the distance from the polygon outside. Of a segment or a point it is
    minus the distance; without vertices it is minus infinity.

    Args:
        vertices: counter-clockwise ``(k, 2)`` [m].
        places: [m].
    """
    if len(vertices) == 0:
        return np.full(places.shape[:-1], -np.inf)
    starts = vertices
    along = np.roll(vertices, -1, axis=0) - starts
    square = (along**2).sum(axis=1)
    away = places[..., None, :] - starts
    share = (away * along).sum(axis=-1) / np.where(square > 0.0, square, 1.0)
    nearest = away - np.clip(share, 0.0, 1.0)[..., None] * along
    outside = -np.sqrt((nearest**2).sum(axis=-1)).min(axis=-1)
    if len(vertices) < 3:
        return np.asarray(outside)
    normals = _turned_left(along) / np.sqrt(square)[:, None]
    inside = (away * normals).sum(axis=-1).min(axis=-1)
    return np.asarray(np.where(inside >= 0.0, inside, outside))


def _half_hull(places: Sequence[tuple[float, float]], order: Sequence[int]) -> list[int]:
    """The right-hand chain of the hull from the first to the last of sorted points."""
    chain: list[int] = []
    for index in order:
        while len(chain) >= 2 and _turn(places, chain[-2], chain[-1], index) <= 0.0:
            chain.pop()
        chain.append(index)
    return chain


def _turn(places: Sequence[tuple[float, float]], a: int, b: int, c: int) -> float:
    """Twice the signed area of the triangle ``a b c``: positive for a left turn [m^2]."""
    (ax, ay), (bx, by), (cx, cy) = places[a], places[b], places[c]
    return (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)


def _without_flat(places: Sequence[tuple[float, float]], corners: list[int]) -> list[int]:
    """``corners`` without those that hardly stand out over the line between their neighbours.

    A corner whose neighbour is left out is judged by the next one.
    """
    kept: list[int] = []
    for i, here in enumerate(corners):
        before = kept[-1] if kept else corners[-1]
        after = corners[i + 1] if i + 1 < len(corners) else (kept or corners)[0]
        (ax, ay), (bx, by) = places[before], places[after]
        length = hypot(bx - ax, by - ay)
        if _turn(places, before, here, after) > SAME_PLACE * length:
            kept.append(here)
    return kept


def _farthest_pair(points: FloatArray) -> tuple[int, int]:
    apart = np.linalg.norm(points[:, None] - points, axis=-1)
    first, second = np.unravel_index(int(apart.argmax()), apart.shape)
    return int(first), int(second)


def _turned_left(vectors: FloatArray) -> FloatArray:
    return np.stack([-vectors[..., 1], vectors[..., 0]], axis=-1)
