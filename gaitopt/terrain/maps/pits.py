"""Gaps and beams: flat ground with pits, whose floors are no places to stand."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.errors import InputError
from gaitopt.terrain.maps.site import GroundKind, Site, Size

DEPTH = Size("depth", "depth of the pit", 1.5, 1.5)
"""Deeper than a leg is long."""


def gaps(site: Site, sizes: Mapping[str, float]) -> FloatArray:
    """Level ground with straight gaps across, each at an angle.

    Raises:
        InputError: there is no room for one.
    """
    z, gap, room = site.flat, sizes["gap"], sizes["distance"]
    turn = sizes["turn"]
    half = (site.y[0, -1] - site.y[0, 0]) / 2.0
    # A gap that is turned reaches this much farther along x at the borders of the map.
    reach = half * np.tan(turn)
    at = site.start + site.rng.uniform(0.0, 0.5) * room + reach
    if at + gap + reach > site.end:
        raise InputError(
            f"gaps have no room: with this seed length must be at least "
            f"{site.start + at + gap + reach:.2f} m, for the ground about start and goal is flat"
        )
    while at + gap + reach <= site.end:
        across = np.tan(site.rng.uniform(-turn, turn)) * site.y
        z[np.broadcast_to((site.x - across > at) & (site.x - across < at + gap), z.shape)] = -1.0
        at += gap + room * site.rng.uniform(0.8, 1.5)
    return z * sizes["depth"]


def beams(site: Site, sizes: Mapping[str, float]) -> FloatArray:
    """Two beams along x, below the left and the right feet, in pieces that are not in line."""
    z = site.flat - sizes["depth"]
    for side in (-1.0, 1.0):
        begin = site.start
        while begin < site.end:
            length = sizes["piece"] * site.rng.uniform(0.7, 1.3)
            beside = site.rng.uniform(-sizes["offset"], sizes["offset"])
            middle = side * site.robot.stance_width / 2.0 + beside
            inside = (site.x >= begin) & (site.x <= begin + length)
            inside = inside & (np.abs(site.y - middle) <= sizes["beam"] / 2.0)
            z[inside] = np.maximum(z[inside], site.rng.uniform(-1.0, 1.0) * sizes["relief"])
            begin += length
    return z


GAPS = GroundKind(
    "level ground with gaps across",
    gaps,
    (
        Size("gap", "length of a gap", 0.05, 0.3, "stance_length"),
        Size("distance", "usual distance from gap to gap", 1.2, 1.2, "stance_length", low=0.01),
        Size("turn", "largest angle of a gap to the y axis", 0.0, 0.26, "", "rad", high=1.0),
        DEPTH,
    ),
)
"""At difficulty 1 gaps are 0.3 stance lengths long, and turned by up to 15 degrees."""
BEAMS = GroundKind(
    "two beams along x over a pit, one for the left feet and one for the right",
    beams,
    (
        Size("beam", "width of a beam", 0.7, 0.3, low=1e-3),
        Size("piece", "usual length of a piece", 1.5, 1.0, low=0.01),
        Size("offset", "how far a piece lies beside the line of the feet", 0.0, 0.12),
        Size("relief", "how much higher or lower than the start a piece is", 0.0, 0.12),
        DEPTH,
    ),
)
"""At difficulty 1, for go2: beams of 8 cm, with pieces up to 3 cm beside and 3 cm up or down."""
