"""Grids that cover what is put on them, and the points of a grid within many small windows."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from gaitopt.conventions import FloatArray
from gaitopt.errors import GroundError
from gaitopt.inputs import as_text, check_known
from gaitopt.terrain.height_map_checks import FARTHEST, check_size

IndexArray = NDArray[np.int64]
Grid = tuple[FloatArray, float, FloatArray]
"""Heights ``(nx, ny)``, resolution, and origin ``(2,)`` of a grid [m]."""

MOST_PAIRS = 400_000_000
"""Most points of a grid that are looked at, each counted as often as a window holds it: about half
a minute."""
CHUNK = 2_000_000
"""Points that are looked at together: 100 MB."""


def covering_grid(
    low: FloatArray, high: FloatArray, resolution: float, inside: bool
) -> tuple[tuple[int, int], FloatArray]:
    """A grid over a rectangle, whose points are whole multiples of the resolution.

    Args:
        low, high: corners of the rectangle ``(2,)`` [m].
        resolution: distance of the points [m].
        inside: whether all points lie in the rectangle; otherwise the nearest ones to all places in
            it are there.

    Returns:
        Number of points along x and y, and the place of the first one ``(2,)`` [m].

    Raises:
        GroundError: the grid would have too few or too many points.
    """
    if not (np.abs([low, high]) <= FARTHEST).all():
        raise GroundError(
            f"the ground reaches from {low.tolist()} to {high.tolist()}; coordinates must be "
            f"below {FARTHEST:g} m"
        )
    first, last = low / resolution, high / resolution
    # Rounding must not lose a point at the border.
    start = np.ceil(first - 1e-6) if inside else np.rint(first)
    count = (np.floor(last + 1e-6) if inside else np.rint(last)) - start + 1
    check_size(int(count[0]), int(count[1]))
    return (int(count[0]), int(count[1])), start * resolution


def window_points(
    low: IndexArray, high: IndexArray
) -> Iterator[tuple[IndexArray, IndexArray, IndexArray]]:
    """All points of a grid within windows, part by part.

    Args:
        low, high: lowest and highest indices of each window ``(n, 2)``.

    Yields:
        Numbers of the windows, and indices of the points along x and y, ``(k,)`` each.

    Raises:
        GroundError: there are too many.
    """
    sides = np.maximum(high - low + 1, 0)
    counts = sides[:, 0] * sides[:, 1]
    ends = np.cumsum(counts)
    if len(ends) and ends[-1] > MOST_PAIRS:
        raise GroundError(
            f"{ends[-1]:,} points would have to be looked at, and at most {MOST_PAIRS:,} are; take "
            "a coarser resolution"
        )
    begin = 0
    while begin < len(counts):
        done = ends[begin] - counts[begin]
        end = max(int(np.searchsorted(ends, done + CHUNK, side="right")), begin + 1)
        part = np.arange(begin, end)
        window = np.repeat(part, counts[part])
        at = np.arange(len(window)) - np.repeat(ends[part] - counts[part] - done, counts[part])
        yield (
            window,
            low[window, 0] + at // sides[window, 1],
            low[window, 1] + at % sides[window, 1],
        )
        begin = end


def points_within(
    places: FloatArray, limits: tuple[float, float] | None, resolution: float
) -> NDArray[np.intp]:
    """Which of the places along one side of a grid lie within limits [m]; all without limits.

    Raises:
        GroundError: fewer than two do.
    """
    given = [-np.inf, np.inf] if limits is None else check_known("limits", limits)
    if np.shape(given) != (2,):
        raise GroundError(f"limits of a map are two numbers, got {as_text(limits)}")
    low, high = given
    slack = 1e-9 * resolution
    found = np.flatnonzero((places >= low - slack) & (places <= high + slack))
    if len(found) < 2:
        raise GroundError(
            f"the map reaches from {places[0]:g} to {places[-1]:g} m, and {len(found)} of its "
            f"points lie from {low:g} to {high:g} m; at least two must"
        )
    return found


def grid_places(
    shape: tuple[int, int], resolution: float, origin: tuple[float, float], other: float
) -> FloatArray:
    """Places ``(nx, ny, 2)`` of the points of a grid of another resolution in the same extent [m].

    Raises:
        GroundError: it would have too few or too many points.
    """
    counts = [int((n - 1) * resolution / other + 1e-9) + 1 for n in shape]
    check_size(*counts)
    x, y = (start + other * np.arange(n) for start, n in zip(origin, counts, strict=True))
    return np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1)
