"""Places of a map with room among known points."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike
from scipy.ndimage import distance_transform_edt

from gaitopt.conventions import FloatArray
from gaitopt.terrain.height_map import HeightMap


def unknown_near(ground: HeightMap, room: float, place: ArrayLike) -> bool:
    """Whether the map has unknown points within ``room`` [m] of a place ``(2,)``."""
    x, y = np.asarray(place)
    near = np.ix_(np.abs(ground.x - x) <= room, np.abs(ground.y - y) <= room)
    i, j = near[0].ravel(), near[1].ravel()
    away = np.hypot(ground.x[i, None] - x, ground.y[None, j] - y)
    return bool((~ground.known[near] & (away <= room)).any())


def on_known_ground(ground: HeightMap, room: float, place: FloatArray) -> FloatArray:
    """The place nearest to one ``(2,)`` with no unknown point, and no edge, within ``room`` [m].

    Where there is none, it is the one with the most room.
    """
    if not unknown_near(ground, room, place):
        return place
    distance = distance_transform_edt(np.pad(ground.known, 1))[1:-1, 1:-1] * ground.resolution
    best = min(room, float(distance.max()))
    i, j = np.nonzero(distance >= best)
    if not len(i):
        return place
    there = np.column_stack([ground.x[i], ground.y[j]])
    return np.asarray(there[int(np.linalg.norm(there - place, axis=1).argmin())])
