"""Solids from points: rounded bars, discs, and strips."""

from __future__ import annotations

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.viewing.replay.scene import Appearance, Ball, Cylinder, Part, Surface, pose

SHORTEST = 1e-6
"""Length below which a bar is a point [m]."""
LEAST_SINE, LONGEST_CORNER = 0.05, 6
"""Limits of a border's corner: the sine of its angle, and its length over the border's width.
Chosen here: corners of support polygons below 10 degrees, which are rare, are cut off."""


def rounded_bar(
    start: FloatArray, end: FloatArray, radius: float, appearance: Appearance
) -> list[Part]:
    """A cylinder from ``start (3,)`` to ``end (3,)`` [m] with a ball at each end.

    There are no parts where the ends are less than :data:`SHORTEST` apart.
    """
    line = np.asarray(end, dtype=np.float64) - start
    length = float(np.linalg.norm(line))
    if length < SHORTEST:
        return []
    middle = np.asarray(start) + line / 2.0
    return [
        Part(Cylinder(radius, length), appearance, pose(middle, _rotation_to(line / length))),
        Part(Ball(radius), appearance, pose(start)),
        Part(Ball(radius), appearance, pose(end)),
    ]


def disc(radius: float, sides: int = 32) -> Surface:
    """A flat disc in the plane z = 0 around the origin, with a ``radius`` [m]."""
    angle = 2.0 * np.pi * np.arange(sides) / sides
    corners = radius * np.column_stack([np.cos(angle), np.sin(angle), np.zeros(sides)])
    return filled_polygon(corners)


def filled_polygon(corners: FloatArray) -> Surface:
    """A convex polygon with ``corners (n, 3)`` [m], ``n >= 3``: triangles that share a corner."""
    rest = np.arange(1, len(corners) - 1)
    return Surface(corners, np.column_stack([np.zeros_like(rest), rest, rest + 1]))


def border_strips(corners: FloatArray, width: float) -> tuple[FloatArray, ...]:
    """The border of a convex polygon, ``corners (n, 2)`` [m], as quadrangles ``(4, 2)``."""
    outer = np.column_stack([corners, np.zeros(len(corners))])
    inner = _inner_corners(outer, width)[:, :2]
    following = np.roll(corners, -1, axis=0), np.roll(inner, -1, axis=0)
    return tuple(np.stack([corners, following[0], following[1], inner], axis=1))


def _inner_corners(corners: FloatArray, width: float) -> FloatArray:
    """Corners ``(n, 3)`` of a polygon whose sides are ``width`` [m] further inside."""
    sides = np.roll(corners, -1, axis=0) - corners
    sides = sides / np.maximum(np.linalg.norm(sides, axis=1, keepdims=True), 1e-12)
    before = np.roll(sides, 1, axis=0)
    # An inner corner is where two sides meet that are moved inward. At sharp corners that is far
    # away: there the distance is limited.
    sine = np.abs(np.cross(before, sides)[:, 2])[:, None]
    distance = np.minimum(width / np.maximum(sine, LEAST_SINE), LONGEST_CORNER * width)
    return np.asarray(corners + distance * (sides - before))


def strips_along(line: FloatArray, width: float) -> tuple[FloatArray, ...]:
    """A line ``(n, 2)`` [m] as rectangles of a ``width`` [m], each ``(4, 2)``."""
    along = np.diff(line, axis=0)
    lengths = np.linalg.norm(along, axis=1)
    kept = lengths > SHORTEST
    along = along[kept] / lengths[kept, None]
    aside = 0.5 * width * np.column_stack([-along[:, 1], along[:, 0]])
    start, end = line[:-1][kept], line[1:][kept]
    return tuple(np.stack([start - aside, end - aside, end + aside, start + aside], axis=1))


def _rotation_to(axis: FloatArray) -> FloatArray:
    """A rotation ``(3, 3)`` that takes z to the unit vector ``axis (3,)``."""
    side = np.cross(axis, np.eye(3)[int(np.argmin(np.abs(axis)))])
    side /= np.linalg.norm(side)
    return np.column_stack([side, np.cross(axis, side), axis])
