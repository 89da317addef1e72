"""Meshes in convex parts, where one convex hull is much larger than they are.

A mesh is cut by planes across its longest axis, and each slab counts as the convex hull of what
lies in it. The slabs hold all of the surface, so nothing that touches the mesh is missed. Where the
parts have at least :data:`WORTH` of the hull's volume, the mesh keeps its one hull. Only trunks are
cut (:func:`gaitopt.robots.files.hulls.find_hulls`): legs move in their hollows.
"""

from __future__ import annotations

import itertools
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from gaitopt.conventions import FloatArray, frozen
from gaitopt.robots.files.meshes import changed_at, mesh_hull, mesh_triangles

WORTH = 0.6
"""Parts count in place of one hull where their volumes add up to less than this share of its own.
Chosen: trunks whose hulls keep legs from walking have 0.59; those of robots that walk with their
hulls, as HyQ and Solo 12, have 0.62 or more, and stay as they are."""
MOST_PARTS = 5
"""Most parts of a mesh."""
STATIONS = 24
"""Places of cuts that are tried along the longest axis."""
FLAT = 1e-4
"""Least volume of a part, as a share of its length to the third power. Chosen: numbers of hulls are
rounded, and one that is flat then cannot be judged."""
MOST_TRIANGLES = 200_000
"""A mesh with more of them keeps its one hull, so that loading a robot takes no minutes."""


class _Slab(NamedTuple):
    """Corners of a convex hull ``(n, 3)``, and its volume; no corners where nothing is.

    Flat ones have an endless volume, so that they are joined with others.
    """

    corners: FloatArray
    volume: float


def mesh_parts(path: Path) -> tuple[FloatArray, ...]:
    """Corners ``(n, 3)`` of the convex hulls that stand for a mesh, in the file's units.

    One hull, or up to :data:`MOST_PARTS` where these are much smaller. None where the file cannot
    be read, or the mesh is flat.
    """
    stamp = changed_at(path)
    return () if stamp is None else _parts(path, stamp)


@lru_cache(maxsize=256)
def _parts(path: Path, changed: int) -> tuple[FloatArray, ...]:
    """The parts of a file as it was ``changed``."""
    hull = mesh_hull(path)
    if hull is None:
        return ()
    triangles = mesh_triangles(path)
    if triangles is None or not 0 < len(triangles) <= MOST_TRIANGLES:
        return (hull,)
    return cut_in_parts(triangles, hull)


def cut_in_parts(triangles: FloatArray, hull: FloatArray) -> tuple[FloatArray, ...]:
    """Corners of the hulls of a mesh's parts; ``hull`` itself where they are not much smaller.

    Args:
        triangles: of the mesh ``(T, 3, 3)``.
        hull: corners of the hull of all ``(n, 3)``.
    """
    axis = int(np.ptp(hull, axis=0).argmax())
    cuts = _stations(triangles[..., axis])
    slabs = [_convex(slab(triangles, axis, *ends)) for ends in itertools.pairwise(cuts)]
    worth = WORTH * _convex(hull).volume
    # No joining of slabs makes them smaller.
    if sum(part.volume for part in slabs if np.isfinite(part.volume)) >= worth:
        return (hull,)
    volume, parts = _least(_joined(slabs), len(slabs))
    return tuple(frozen(part) for part in parts) if volume < worth else (hull,)


def _stations(along: FloatArray) -> FloatArray:
    """Planes between slabs ``(k,)``, the outer two infinitely far away.

    They are at corners, for a section of a mesh changes suddenly there only.
    """
    known = np.unique(along)
    even = np.linspace(known[0], known[-1], STATIONS + 1)
    near = known[np.abs(known[:, None] - even[None, :]).argmin(axis=0)]
    apart = (known[-1] - known[0]) / (4.0 * STATIONS)
    cuts = [float(known[0])]
    for place in near[1:-1].tolist():
        if place - cuts[-1] > apart and known[-1] - place > apart:
            cuts.append(place)
    # What lies in the planes at the two ends is in a slab, whatever the order of its corners.
    return np.array([-np.inf, *cuts[1:], np.inf])


def slab(triangles: FloatArray, axis: int, low: float, high: float) -> FloatArray:
    """Corners ``(n, 3)`` of what triangles have between two planes across an axis.

    A triangle that only touches a plane belongs to its own side. One that lies in a plane belongs
    to the side that it closes, which the order of its corners tells.

    Args:
        triangles: ``(T, 3, 3)``.
        axis: 0, 1 or 2.
        low, high: places of the planes.
    """
    along = triangles[..., axis]
    least, most = along.min(axis=1), along.max(axis=1)
    inside = (most > low) & (least < high)
    flat = least == most
    if flat.any():
        one, two = triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
        upwards = np.cross(one, two)[:, axis] > 0.0
        inside |= flat & (((least == high) & upwards) | ((least == low) & ~upwards))
    chosen = triangles[inside]
    starts, ends = chosen.reshape(-1, 3), np.roll(chosen, -1, axis=1).reshape(-1, 3)
    a, b = starts[:, axis], ends[:, axis]
    points = [starts[(a >= low) & (a <= high)]]
    for cut in (low, high):
        crosses = (np.minimum(a, b) < cut) & (np.maximum(a, b) > cut)
        from_, to = starts[crosses], ends[crosses]
        share = (cut - from_[:, axis]) / (to[:, axis] - from_[:, axis])
        at = from_ + share[:, None] * (to - from_)
        at[:, axis] = cut
        points.append(at)
    return np.concatenate(points)


def _convex(points: FloatArray) -> _Slab:
    """The hull of points; they themselves with an endless volume where they are nearly flat."""
    from scipy.spatial import ConvexHull, QhullError  # late: few robots have meshes

    if not len(points):
        return _Slab(points, 0.0)
    try:
        hull: Any = ConvexHull(points)
    except (QhullError, ValueError):
        return _Slab(points, np.inf)
    flat = hull.volume < FLAT * np.ptp(points, axis=0).max() ** 3
    return _Slab(points[hull.vertices], np.inf if flat else float(hull.volume))


def _joined(slabs: list[_Slab]) -> dict[tuple[int, int], _Slab]:
    """The hulls of all runs of slabs that are not flat, by the first and the one after the last."""
    out = {}
    for first, start in enumerate(slabs):
        run = out[first, first + 1] = start
        for last in range(first + 1, len(slabs)):
            run = _convex(np.concatenate([run.corners, slabs[last].corners]))
            out[first, last + 1] = run
    return {ends: run for ends, run in out.items() if np.isfinite(run.volume)}


def _least(runs: dict[tuple[int, int], _Slab], count: int) -> tuple[float, list[FloatArray]]:
    """The runs with the least volume that make up all slabs, at most :data:`MOST_PARTS`.

    Fewer parts go before more where their volumes differ by less than a hundredth.
    """
    best: list[dict[int, tuple[float, tuple[tuple[int, int], ...]]]] = [{0: (0.0, ())}]
    for _ in range(MOST_PARTS):
        row: dict[int, tuple[float, tuple[tuple[int, int], ...]]] = {}
        for (first, last), part in runs.items():
            if first in best[-1]:
                volume, before = best[-1][first]
                new = (volume + part.volume, (*before, (first, last)))
                row[last] = min(row.get(last, (np.inf, ())), new)
        best.append(row)
    ways = [row[count] for row in best if count in row]
    if not ways:
        return np.inf, []
    least = min(volume for volume, _ in ways)
    volume, taken = next(way for way in ways if way[0] <= 1.01 * least)
    return volume, [runs[run].corners for run in taken if len(runs[run].corners)]
