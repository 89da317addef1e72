"""Corners of the box and of the trapezoid over a convex section, whose sides are straight.

Coordinates are those of the plane of the section, ``(x, z)`` [m], and the foot goes from left to
right. The trapezoid's sides are tangents of the section, and its top is as high as the section's;
the box has vertical sides. The whole section is below each of these lines, so both clear it.

Source: [Shao2011], Section III.A and Fig. 3 (a)-(c) for the box. The paper names the trapezoid and
does not show it.
"""

from __future__ import annotations

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.swing.mixed_parabola import Corner, tangent_angle

_SAME = 1e-9
"""Differences of places [m] and of angles [rad] that count as rounding."""


def box_path_corners(
    start: FloatArray, end: FloatArray, core: FloatArray, radius: float
) -> list[Corner]:
    """Corners of the box: up to the section's top or to the higher end, across, and down.

    Args:
        start, end: ``(2,)`` [m], to the left and to the right of the section.
        core: corners of the section's core ``(k, 2)`` [m].
        radius: distance from the core up to which points belong to the section [m]. It also sets
            how far from a corner its outer two waypoints are.
    """
    top = max(core[:, 1].max() + radius, start[1], end[1])
    above = np.array([[start[0], top], [end[0], top]])
    return _corners([start, *above, end], radius)


def trapezoid_corners(
    start: FloatArray, end: FloatArray, core: FloatArray, radius: float
) -> list[Corner]:
    """Corners of the trapezoid; arguments as in :func:`box_path_corners`."""
    top = max(core[:, 1].max() + radius, start[1], end[1])
    mirror = np.array([-1.0, 1.0])
    left = _on_top(start, end, core, radius, top)
    right = _on_top(end * mirror, start * mirror, core * mirror, radius, top) * mirror
    return _corners([start, left, right, end], radius)


def _on_top(
    foot: FloatArray, other: FloatArray, core: FloatArray, radius: float, top: float
) -> FloatArray:
    """Where the steepest tangent from ``foot`` to the section on its right reaches the top [m]."""
    steepest = max(tangent_angle(foot, 0.0, corner, radius) for corner in core)
    # Where the other end is above the section, the line must not pass below it.
    steepest = max(steepest, tangent_angle(foot, 0.0, other, 0.0))
    if top - foot[1] < _SAME:
        return foot
    return np.array([foot[0] + (top - foot[1]) / np.tan(steepest), top])


def _corners(vertices: list[FloatArray], radius: float) -> list[Corner]:
    """The inner vertices of a polyline as corners that extend ``radius * tan(turn / 2)`` each way.

    Vertices that coincide count once.
    """
    kept = [vertices[0]]
    for vertex in vertices[1:]:
        if np.hypot(*(vertex - kept[-1])) > _SAME:
            kept.append(vertex)
    corners = []
    for before, tip, after in zip(kept, kept[1:], kept[2:], strict=False):
        back, on = before - tip, after - tip
        size = float(np.hypot(*back)), float(np.hypot(*on))
        turn = np.pi - np.arccos(np.clip(back @ on / (size[0] * size[1]), -1.0, 1.0))
        if turn < _SAME:
            continue
        cut = min(radius * float(np.tan(turn / 2.0)), size[0] / 2.0, size[1] / 2.0)
        corners.append(Corner(tip + cut / size[0] * back, tip, tip + cut / size[1] * on))
    return corners
