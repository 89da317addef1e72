"""What a search for footholds tried, as a scene: places for feet, and the way asked for."""

from __future__ import annotations

from typing import Final

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.viewing.ground_search import GroundSearch
from gaitopt.viewing.replay.keyframes import kept_samples
from gaitopt.viewing.replay.scene import (
    Appearance,
    Dots,
    Draped,
    FramePath,
    Heights,
    Node,
    Part,
    Scene,
)
from gaitopt.viewing.replay.solids import strips_along

SEARCH: Final[FramePath] = ("search",)
TRIED = "#c2410c"
DOT, LINE = 0.006, 0.008
"""Widths of a dot and of the line of the way [m]."""
MOST_DOTS = 20_000
"""Most places that are drawn: 320 kB in a page."""
RAISED = 0.004
"""How far above the ground a dot is drawn [m]."""


def search_scene(search: GroundSearch, heights: Heights, foot_radius: float) -> Scene:
    """Where the search tried to put feet, and the way of the body that it was asked for."""
    tried = tried_places(search) - [0.0, 0.0, foot_radius - RAISED]
    parts = []
    if len(tried):
        parts.append(Part(Dots(tried, DOT), Appearance(TRIED, lit=False, casts_shadow=False)))
    way = np.asarray(search.course.poses, dtype=np.float64)[:, :2]
    strips = strips_along(
        way[kept_samples(np.arange(len(way), dtype=np.float64), way, LINE / 8.0)], LINE
    )
    if strips:
        look = Appearance(TRIED, 0.7, lit=False, casts_shadow=False, layer=4)
        parts.append(Part(Draped(heights, strips), look))
    return Scene((Node(SEARCH, tuple(parts)),))


def tried_places(search: GroundSearch) -> FloatArray:
    """Different places that were tried ``(n, 3)`` [m], evenly thinned to :data:`MOST_DOTS`."""
    tried = np.unique(np.asarray(search.tried, dtype=np.float64).reshape(-1, 3), axis=0)
    tried = tried[np.isfinite(tried).all(axis=1)]
    every = max(1, int(np.ceil(len(tried) / MOST_DOTS)))
    return np.asarray(tried[::every])
