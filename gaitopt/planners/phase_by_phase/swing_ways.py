"""The way of a foot between two footholds, by the name of a swing: a polyline that a crawl times.

A crawl flies every way as fast as its joints allow, so of a swing curve only the shape counts, and
not the law of motion that it has by itself.
"""

from __future__ import annotations

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.swing.box import box_corners
from gaitopt.swing.catalogue import PATTERNS, swing_curve
from gaitopt.swing.obstacle_paths import Pattern, obstacle_path
from gaitopt.terrain.obstacles import rectangular_obstacle

CORNERS = 33
"""Points of a curved way, both ends included; an odd number, so that the apex is one."""


def swing_ways(name: str, starts: FloatArray, ends: FloatArray, height: float) -> FloatArray:
    """Corners of the ways of many swings ``(S, n, 3)`` [m].

    Args:
        name: one of :data:`SWINGS`. ``"trapezoid path"`` and ``"parabola path"`` go over a board
            in the middle of the step, a quarter of the step wide.
        starts, ends: footholds ``(S, 3)`` [m].
        height: swing height above the higher of both ends [m].
    """
    if name == "box" or not len(starts):
        return box_corners(starts, ends, height)
    if name in PATTERNS:
        return np.stack([
            _over_a_board(PATTERNS[name], a, b, height)
            for a, b in zip(starts, ends, strict=True)
        ])  # fmt: skip
    curve = swing_curve(name, starts, ends, height, 1.0)
    points = curve.position(np.linspace(0.0, 1.0, CORNERS)[:, None])
    return np.ascontiguousarray(points.transpose(1, 0, 2))


def _over_a_board(
    pattern: Pattern, start: FloatArray, end: FloatArray, height: float
) -> FloatArray:
    """Points ``(CORNERS, 3)`` of a way over an obstacle that asks for just this swing height."""
    step = (end - start)[:2]
    length = float(np.hypot(*step))
    if length < 1e-3 or height < 1e-3:
        corners = box_corners(start, end, height)
        return np.repeat(corners, [1, 1, CORNERS - 3, 1], axis=0)
    ground = float(min(start[2], end[2]))
    top = float(max(start[2], end[2])) + height
    margin = min(length / 8.0, (top - ground) / 2.0)
    middle = (start + end) / 2.0
    board = rectangular_obstacle(
        top - margin - ground, length / 4.0, position=(float(middle[0]), float(middle[1]), ground),
        yaw=float(np.arctan2(step[1], step[0])),
    )  # fmt: skip
    points = obstacle_path(start, end, board, margin, pattern=pattern, count=21).points()
    # Evenly along its length: a crawl works on all swings at once, with as many points each.
    way = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    share = np.linspace(0.0, way[-1], CORNERS)
    even = np.column_stack([np.interp(share, way, points[:, i]) for i in range(3)])
    even[CORNERS // 2, 2] = top
    return even
