"""Places of a map with room among known points."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike
from scipy.ndimage import distance_transform_edt

from gaitopt.conventions import FloatArray
from gaitopt.terrain.height_map import HeightMap

LACKING = 4.0
"""Metres of way that a metre of room is worth. With one or less, places at a straight border of
unknown ground would stay there."""


def unknown_near(ground: HeightMap, room: float, place: ArrayLike) -> bool:
    """Whether the map has unknown points within ``room`` [m] of a place ``(2,)``."""
    x, y = np.asarray(place)
    near = np.ix_(np.abs(ground.x - x) <= room, np.abs(ground.y - y) <= room)
    i, j = near[0].ravel(), near[1].ravel()
    away = np.hypot(ground.x[i, None] - x, ground.y[None, j] - y)
    return bool((~ground.known[near] & (away <= room)).any())


def on_known_ground(ground: HeightMap, room: float, place: FloatArray) -> FloatArray:
    """The place nearest to one ``(2,)`` with no unknown point, and no edge, within ``room`` [m].

    Where there is little room near by, it has less: the way there counts against the room that
    lacks. So on a map with unknown points everywhere it stays near.
    """
    if not unknown_near(ground, room, place):
        return place
    to_edges = _to_edges(ground, ground.x[:, None], ground.y)
    inside = to_edges >= min(room, float(_to_edges(ground, *place)))
    i, j = np.nonzero(ground.known & inside)
    if not len(i):
        return place
    away = distance_transform_edt(ground.known)[i, j] * ground.resolution
    there = np.column_stack([ground.x[i], ground.y[j]])
    lacks = np.maximum(room - away, 0.0)
    way = np.linalg.norm(there - place, axis=1)
    return np.asarray(there[int((way + LACKING * lacks).argmin())])


def _to_edges(ground: HeightMap, x: FloatArray, y: FloatArray) -> FloatArray:
    """How far places are from the nearest edge of the map [m]."""
    (x0, x1), (y0, y1) = ground.extent
    return np.minimum(np.minimum(x - x0, x1 - x), np.minimum(y - y0, y1 - y))
