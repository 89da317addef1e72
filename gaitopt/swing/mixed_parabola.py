"""Corners of the mixed parabola: the shortest path over a convex section, with parabolic corners.

Coordinates are those of the plane of a section, ``(x, z)`` [m], and the foot goes from left to
right. The section is the set of all points within a radius of a convex polygon, its core. The
shortest path from the start over the section to the end consists of straight lines and of arcs
around corners of the core. Each arc is replaced by a parabola with the same tangents at its ends.
The parabola's curvature at its ends is ``cos(turn / 2)**2 / radius``, less than the arc's, and its
middle is farther out. So the parabola is outside the arc, and the path outside the section.

Source: [Shao2011], Section III.A and Fig. 3 (d)-(f), which names the shape ("mixed
parabola", three waypoints a corner) and gives no formula.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from gaitopt.conventions import FloatArray

LARGEST_TURN = np.pi / 2.0
"""Arcs that turn by more are divided into several parabolas: a single one would be far outside."""
LEAST_TURN = np.radians(8.0)
"""Corners that turn by less stay sharp and get a single waypoint, because three would nearly
coincide. Chosen: the corner is then 0.25 % of its radius outside the arc."""

_SAME_ANGLE = 1e-9
"""Difference of angles that counts as rounding [rad]."""


class Corner(NamedTuple):
    """A corner of a path in the plane of the section.

    Attributes:
        before: where the straight line before it ends ``(2,)`` [m].
        tip: where the straight lines before and after it would meet ``(2,)`` [m].
        after: where the straight line after it begins ``(2,)`` [m].
    """

    before: FloatArray
    tip: FloatArray
    after: FloatArray


def parabola_corners(
    start: FloatArray, end: FloatArray, core: FloatArray, radius: float
) -> list[Corner]:
    """Corners of the shortest path. The three points of each are the parabola's control points.

    Args:
        start, end: ``(2,)`` [m], outside the section, to its left and to its right.
        core: corners of the section's core ``(k, 2)`` [m].
        radius: distance from the core up to which points belong to the section [m].

    Returns:
        Corners from left to right; none where the straight line is free.
    """
    points = [*core, end]
    sizes = [radius] * len(core) + [0.0]
    corners: list[Corner] = []
    here, size, heading = start, 0.0, np.pi
    for _ in range(len(points)):
        after, chosen = _next_tangent(here, size, heading, points, sizes)
        if size > 0.0:
            corners += _arc_corners(here, size, heading, after)
        if chosen == len(core):
            break
        here, size, heading = points[chosen], sizes[chosen], after
    return corners


def tangent_angle(here: FloatArray, size: float, there: FloatArray, other: float) -> float:
    """Direction [rad] of the line that touches two discs, both on its right.

    Args:
        here, there: their centres ``(2,)`` [m].
        size, other: their radii [m]; 0 for a point.
    """
    away = there - here
    lean = np.arcsin(np.clip((size - other) / np.hypot(*away), -1.0, 1.0))
    return float(np.arctan2(away[1], away[0]) - lean)


def _next_tangent(
    here: FloatArray,
    size: float,
    heading: float,
    points: Sequence[FloatArray],
    sizes: Sequence[float],
) -> tuple[float, int]:
    """The tangent that turns least to the right of ``heading``, and the point it leads to."""
    found = []
    for i, (there, other) in enumerate(zip(points, sizes, strict=True)):
        distance = float(np.hypot(*(there - here)))
        if distance == 0.0:
            continue
        turn = (heading - tangent_angle(here, size, there, other)) % (2.0 * np.pi)
        if turn > 2.0 * np.pi - _SAME_ANGLE:  # straight on, save for rounding
            turn = 0.0
        # Of points in one direction the path's end counts first, then the farthest.
        rank = np.inf if i == len(points) - 1 else distance
        found.append((turn, -rank, i))
    least = min(turn for turn, _, _ in found)
    turn, _, chosen = min(
        (f for f in found if f[0] < least + _SAME_ANGLE), key=lambda candidate: candidate[1]
    )
    return heading - turn, chosen


def _arc_corners(
    centre: FloatArray, radius: float, arriving: float, leaving: float
) -> list[Corner]:
    """The corners that replace the arc around ``centre`` between two directions [rad]."""
    turn = arriving - leaving
    if turn < _SAME_ANGLE:
        return []
    parts = max(int(np.ceil(turn / LARGEST_TURN - _SAME_ANGLE)), 1)
    ends = np.linspace(arriving, leaving, parts + 1)
    out = radius / np.cos(turn / parts / 2.0)
    corners = []
    for first, last in pairwise(ends):
        tip = centre + out * _left_of((first + last) / 2.0)
        if turn < LEAST_TURN:
            return [Corner(tip, tip, tip)]
        corners.append(
            Corner(centre + radius * _left_of(first), tip, centre + radius * _left_of(last))
        )
    return corners


def _left_of(angle: float) -> FloatArray:
    """Unit vector ``(2,)`` to the left of a direction [rad]."""
    return np.array([-np.sin(angle), np.cos(angle)])
