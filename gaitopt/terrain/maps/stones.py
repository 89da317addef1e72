"""Rubble, and stepping stones over a pit."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.terrain.maps.site import GroundKind, Site, Size

BLOCK = Size("block", "usual width of a stone", 0.6, 0.45, low=1e-3)
"""Two to three footholds on a stone of go2, 16 to 12 cm wide. Chosen."""
DEPTH = Size("depth", "depth of the pit", 1.5, 1.5)
"""Depth of pits: deeper than a leg is long."""


def rubble(site: Site, sizes: Mapping[str, float]) -> FloatArray:
    """Stones side by side, with heights from 0 to ``height`` and tops that are tilted.

    The stones are the Voronoi cells of random places.
    """
    places = site.jittered(sizes["block"], 0.35)
    heights = site.rng.uniform(0.0, sizes["height"], len(places))
    tilts = np.tan(sizes["tilt"]) * site.rng.uniform(-1.0, 1.0, (len(places), 2)) / np.sqrt(2.0)
    stone = site.nearest(places)
    away = np.stack(np.broadcast_arrays(site.x, site.y), axis=-1) - places[stone]
    return np.asarray(heights[stone] + (tilts[stone] * away).sum(axis=-1))


def stepping_stones(site: Site, sizes: Mapping[str, float]) -> FloatArray:
    """Square stones whose tops differ by ``relief`` up or down, some missing, over a pit."""
    pitch = sizes["block"] + sizes["gap"]
    # Neighbours come nearer to one another by no more than half of the gap between them.
    places = site.jittered(pitch, 0.25 * sizes["gap"] / pitch)
    tops = site.rng.uniform(-sizes["relief"], sizes["relief"], len(places))
    tops[site.rng.uniform(size=len(places)) < sizes["missing"]] = -sizes["depth"]
    stone = site.nearest(places, norm=np.inf)
    away = np.maximum(np.abs(site.x - places[stone, 0]), np.abs(site.y - places[stone, 1]))
    return np.where(away <= sizes["block"] / 2.0, tops[stone], -sizes["depth"])


RUBBLE = GroundKind(
    "stones side by side, of different heights",
    rubble,
    (
        Size("height", "height of the highest stones", 0.0, 0.55),
        BLOCK,
        Size("tilt", "largest slope of the stones' tops", 0.0, 0.14, "", "rad", high=1.0),
    ),
)
"""At difficulty 1 it is 15 cm high for go2, and tops are tilted by up to 8 degrees."""
STEPPING_STONES = GroundKind(
    "stones with a pit between them; some are missing",
    stepping_stones,
    (
        BLOCK,
        Size("gap", "usual distance between stones", 0.1, 0.3),
        Size("relief", "how much higher or lower than the start the stones are", 0.0, 0.185),
        Size("missing", "share of stones that are missing", 0.0, 0.1, "", "", high=0.9),
        DEPTH,
    ),
)
"""At difficulty 1, for go2: 12 cm stones with gaps of 8 cm, 5 cm up or down, 10 % missing."""
