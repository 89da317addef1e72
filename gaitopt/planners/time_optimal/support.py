"""Sides of the support polygon, for many intervals or spans at once, and at the knots of a walk."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gaitopt.conventions import OTHER_LEGS, BoolArray, FloatArray
from gaitopt.planners.time_optimal.knots import Flying, RouteKnots
from gaitopt.stability.support import pair_lines, triangle_half_planes

MOST_SIDES = 12
"""Room for the sides of one polygon: there are 12 lines through ordered pairs of four feet."""


class SupportSides(NamedTuple):
    """Sides of many support polygons: the half-planes ``normal . (x, y) >= offset``.

    Attributes:
        normal: unit normals that point inward ``(N, 12, 2)``; zero where there is no side.
        offset: ``(N, 12)`` [m]; minus infinity where there is no side.
    """

    normal: FloatArray
    offset: FloatArray

    @property
    def exists(self) -> BoolArray:
        """Where there is a side ``(N, 12)``."""
        return np.isfinite(self.offset)


class SupportRows(NamedTuple):
    """Sides that belong to knots: ``normal . (x, y) >= offset``.

    Attributes:
        knot: the knot that each side belongs to ``(M,)``, ascending.
        normal: ``(M, 2)``.
        offset: ``(M,)`` [m].
    """

    knot: np.ndarray
    normal: FloatArray
    offset: FloatArray


def support_sides(feet: FloatArray, flying: Flying) -> SupportSides:
    """Sides of the triangle of three feet where one flies, and of the polygon of all four else.

    Args:
        feet: where the feet stand ``(N, 4, 3)`` [m].
        flying: which of them flies.
    """
    normal = np.zeros((len(feet), MOST_SIDES, 2))
    offset = np.full((len(feet), MOST_SIDES), -np.inf)
    three, four = np.flatnonzero(flying.flies), np.flatnonzero(~flying.flies)
    standing_legs = OTHER_LEGS[flying.leg[three]]
    corners = np.take_along_axis(feet[three], standing_legs[..., None], axis=1)[..., :2]
    normal[three, :3], offset[three, :3] = triangle_half_planes(corners)
    lines, offsets, is_side = pair_lines(feet[four][:, :, :2])
    normal[four] = np.where(is_side[..., None], lines, 0.0)
    offset[four] = np.where(is_side, offsets, -np.inf)
    return SupportSides(normal, offset)


def support_on_spans(knots: RouteKnots) -> SupportRows:
    """The sides of the support polygon on the span of every knot.

    A knot at which a foot lifts off or touches down has the triangle of the three other feet. This
    triangle lies within the polygon of all four, so the knot has no sides of the latter.
    """
    sides = support_sides(knots.feet, knots.flying_on_spans)
    knot, side = np.nonzero(sides.exists)
    return SupportRows(knot, sides.normal[knot, side], sides.offset[knot, side])
