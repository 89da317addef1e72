"""The path of a swing foot between two footholds as a polyline, by the name of its shape.

A crawl swings each foot as fast as the joints allow. So only the shape of a swing curve counts
here, and not how the curve itself is timed.
"""

from __future__ import annotations

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.swing.box import box_corners
from gaitopt.swing.catalogue import PATTERNS, swing_curve
from gaitopt.swing.obstacle_paths import Pattern, obstacle_path
from gaitopt.terrain.obstacles import rectangular_obstacle

POINTS = 33
"""Points of a curved path, both ends included. An odd number, so that one of them is the apex.
The chords of a sine arch of height h leave it by h pi^2 / (8 * 32^2) at most, which is below 0.1 mm
for the 70 mm of [Wang2020]."""
SHORTEST = 1e-3
"""Steps that are shorter, and swings that are lower, go along a box [m]. Chosen here: a path over
an obstacle of a millimetre has no use, and its corners would lie too close to each other."""
PATH_POINTS = 21
"""Waypoints of a path over an obstacle, before it is resampled to :data:`POINTS`. Chosen here: more
than the 13 of [Shao2011], since here no spline smooths the path."""


def swing_polylines(
    name: str, starts: FloatArray, ends: FloatArray, heights: float | FloatArray
) -> FloatArray:
    """Corners of the foot paths of many swings ``(S, n, 3)`` [m], with as many corners each.

    Args:
        name: one of :data:`gaitopt.swing.catalogue.SWINGS`. ``"trapezoid path"`` and
            ``"parabola path"`` go over a board in the middle of the step, a quarter of the step
            wide.
        starts, ends: footholds ``(S, 3)`` [m].
        heights: swing heights above the higher of both ends ``(S,)`` [m], or one for all.
    """
    if name == "box" or not len(starts):
        return box_corners(starts, ends, heights)
    if name in PATTERNS:
        return np.stack([
            _over_a_board(PATTERNS[name], a, b, float(height))
            for a, b, height in zip(
                starts, ends, np.broadcast_to(heights, len(starts)), strict=True
            )
        ])  # fmt: skip
    curve = swing_curve(name, starts, ends, heights, 1.0)
    points = curve.position(np.linspace(0.0, 1.0, POINTS)[:, None])
    return np.ascontiguousarray(points.transpose(1, 0, 2))


def _over_a_board(
    pattern: Pattern, start: FloatArray, end: FloatArray, height: float
) -> FloatArray:
    """Points ``(POINTS, 3)`` of a path over a board for which the foot rises by ``height`` [m]."""
    step = (end - start)[:2]
    length = float(np.hypot(*step))
    if length < SHORTEST or height < SHORTEST:
        corners = box_corners(start, end, height)
        return np.repeat(corners, [1, 1, POINTS - 3, 1], axis=0)
    ground = float(min(start[2], end[2]))
    top = float(max(start[2], end[2])) + height
    margin = min(length / 8.0, (top - ground) / 2.0)
    middle = (start + end) / 2.0
    board = rectangular_obstacle(
        top - margin - ground, length / 4.0, position=(float(middle[0]), float(middle[1]), ground),
        yaw=float(np.arctan2(step[1], step[0])),
    )  # fmt: skip
    points = obstacle_path(start, end, board, margin, pattern=pattern, count=PATH_POINTS).points()
    # Spaced equally along its length: a crawl computes all swings at once, so that all of them need
    # the same number of points.
    lengths = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    places = np.linspace(0.0, lengths[-1], POINTS)
    resampled = np.column_stack([np.interp(places, lengths, points[:, i]) for i in range(3)])
    resampled[POINTS // 2, 2] = top
    return resampled
