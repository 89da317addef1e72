"""Checks of heights and places, before :class:`gaitopt.HeightMap` takes them."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from gaitopt.conventions import FloatArray, frozen
from gaitopt.errors import GroundError
from gaitopt.inputs import as_plain_array, as_text, check_array, is_masked

MOST_POINTS = 16_000_000
"""Most points of a map: 80 m by 80 m at 2 cm, 128 MB."""
FARTHEST = 1e6
"""Coordinates beyond this are taken for a mistake [m]."""


def checked_heights(z: ArrayLike) -> FloatArray:
    """The heights of a map as a read-only array.

    Raises:
        GroundError: they are no array ``(nx, ny)`` of numbers, or no height is known.
    """
    hidden = np.ma.getmaskarray(np.ma.asarray(z)) if is_masked(z) else None
    array = as_plain_array(z if hidden is None else np.ma.getdata(z))
    if array is None:
        raise GroundError(f"heights of a map are no array of numbers: {as_text(z)}")
    if array.dtype.kind not in "iuf":
        raise GroundError(
            f"heights of a map are no array of numbers, but of {array.dtype}; give NaN where a "
            "height is not known"
        )
    if array.ndim != 2:
        raise GroundError(f"heights of a map must have the shape (nx, ny), got {array.shape}")
    check_size(array.shape[0], array.shape[1])
    # What a mask hides is not known.
    heights = frozen(array if hidden is None else np.where(hidden, np.nan, array))
    if not np.isfinite(heights).any():
        raise GroundError("no height of the map is known: all are NaN or infinite")
    far = np.argwhere(np.abs(heights) > FARTHEST)
    if far.size:
        i, j = (int(k) for k in far[0])
        raise GroundError(
            f"z[{i}, {j}] is {heights[i, j]:g}; heights must be below {FARTHEST:g} m, and NaN "
            "where they are unknown"
        )
    return heights


def check_size(nx: int, ny: int) -> None:
    """Refuse a map that has too few points, or too many.

    Raises:
        GroundError: it says what to do.
    """
    if min(nx, ny) < 2 or nx * ny > MOST_POINTS:
        raise GroundError(
            f"the shape of a map must be at least 2 by 2 points, and at most {MOST_POINTS:,} in "
            f"all, got {nx:,} by {ny:,}; take a {'finer' if min(nx, ny) < 2 else 'coarser'} "
            "resolution, or another part of the ground"
        )


def checked_place(origin: ArrayLike) -> tuple[float, float]:
    """The origin of a map.

    Raises:
        GroundError: it is no pair of finite numbers.
    """
    try:
        place = check_array("origin", origin)
    except (TypeError, ValueError):
        place = np.empty(0)
    if place.shape != (2,) or not (np.abs(place) <= FARTHEST).all():
        raise GroundError(
            f"origin must be two numbers (x, y) in metres below {FARTHEST:g}, got {as_text(origin)}"
        )
    return float(place[0]), float(place[1])
