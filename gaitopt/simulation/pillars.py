"""Columns whose tops differ in height and which stand close together: who stands on which."""

from __future__ import annotations

import numpy as np

from gaitopt.conventions import LEGS, FloatArray
from gaitopt.errors import FootholdsError
from gaitopt.terrain.footholds import Footholds

GIVES_WAY = 1e-3
"""A foot that is lifted by no more than this from its own column stands on it [m]: contacts give
way by about as much."""

LEAST_PLATE = 0.005
"""Least radius of a plate below a foothold of open ground [m]. Chosen: about the largest landing
error of walks that pass."""


def column_radii(footholds: Footholds, foot: float) -> FloatArray:
    """Radius of the column under each foothold ``(4, n)`` [m], such that feet stand on their own.

    Columns have the radius of the footholds. Where two overlap, a foot in its place on the lower
    one must not touch the higher one; where they do not, it may, and physics tells what comes of
    it. On open ground, where the columns are plates that nobody has asked for, the higher one is
    made smaller instead, down to :data:`LEAST_PLATE`.

    Args:
        footholds: where the columns stand.
        foot: radius of the balls at the feet [m].

    Raises:
        FootholdsError: columns overlap, and a foot in its place would touch the higher one.
    """
    from scipy.spatial import cKDTree

    places = [(leg, k) for leg in LEGS for k in range(footholds.counts[leg])]
    points = np.concatenate([footholds[leg] for leg in LEGS])
    radius = footholds.landing_radius
    pairs = cKDTree(points[:, :2]).query_pairs(radius + foot, output_type="ndarray")
    # The second one of each pair is the higher one.
    swapped = points[pairs[:, 0], 2] > points[pairs[:, 1], 2]
    pairs[swapped] = pairs[swapped][:, ::-1]
    low, high = points[pairs[:, 0]], points[pairs[:, 1]]
    apart = np.linalg.norm((low - high)[:, :2], axis=1)
    # From the centre of the lower ball to the higher column.
    sideways = np.maximum(apart - radius, 0.0)
    above = np.maximum(foot - (high - low)[:, 2], 0.0)
    touching = np.flatnonzero(np.hypot(sideways, above) < foot - GIVES_WAY)
    found = np.full(len(points), radius)
    if footholds.radius is None:
        room = np.maximum(apart - foot, LEAST_PLATE)
        np.minimum.at(found, pairs[touching, 1], room[touching])
    elif (apart[touching] < 2.0 * radius).any():
        touching = touching[apart[touching] < 2.0 * radius]
        pair = pairs[touching[0]]
        (leg, k), (other, m) = (places[int(p)] for p in pair)
        raise FootholdsError(
            f"columns of foothold {k} of {leg} and foothold {m} of {other} overlap: they are "
            f"{1e3 * apart[touching[0]]:.1f} mm apart, and their heights differ by "
            f"{1e3 * (points[pair[1], 2] - points[pair[0], 2]):.1f} mm: a foot with a radius of "
            f"{1e3 * foot:.1f} mm on the lower one touches the higher one, whose radius is "
            f"{1e3 * radius:.1f} mm; give smaller columns, or a height map (ground=)"
        )
    out = np.full(footholds.array.shape[:2], radius)
    for (leg, k), value in zip(places, found, strict=True):
        out[LEGS.index(leg), k] = value
    return out
