"""The part of each shank that is next to its foot, as points.

Balls about a shank reach a little beyond it. Next to a foot that stands they would touch the ground
always, so :mod:`gaitopt.planners.over_terrain.links.link_spheres` leaves them out, and points on
the surface of the shank take their place.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gaitopt.conventions import FloatArray

SPACING, COARSE = 0.25, 0.6
"""Distance of the points, in radii of the foot, for plans and while footholds are searched for.
Chosen: between the fine ones a shank is deeper in the edge of a stone by a fraction of a
millimetre; with them a search takes a third longer."""
OWN = 1.25
"""A shape that lies within this many radii of the middle of the foot is the foot itself."""
CLEAR = 5e-4
"""Height above the ground from which a point counts as clear [m]."""


def points_near_foot(
    hulls: Sequence[tuple[FloatArray, FloatArray]], foot: FloatArray, radius: float, most: float
) -> FloatArray:
    """Points next to a foot, and outside its ball ``(n, 3)`` [m].

    Args:
        hulls: corners of each shape that moves with the foot ``(c, 3)``, and points on its surface
            ``(p, 3)`` [m].
        foot: middle of the foot ``(3,)`` [m].
        radius: of the foot [m].
        most: how far from the middle of the foot they are at most [m].
    """
    kept = [np.empty((0, 3))]
    for corners, points in hulls:
        if np.linalg.norm(corners - foot, axis=1).max() <= OWN * radius:
            continue
        away = np.linalg.norm(points - foot, axis=1)
        kept.append(points[(away > radius) & (away <= most)])
    # Meshes have many small triangles.
    return thinned(np.concatenate(kept), SPACING * radius)


def thinned(points: FloatArray, side: float) -> FloatArray:
    """One of the points ``(n, 3)`` in each cube with sides of this length [m]."""
    cubes = np.floor(points / side).astype(int)
    return points[np.unique(cubes, axis=0, return_index=True)[1]]
