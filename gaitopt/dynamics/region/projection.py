"""Projection of a polytope onto the plane, between an inner and an outer polygon.

A linear program in the direction ``d`` gives a point of the image that lies farthest in this
direction. It is a vertex of the inner polygon, and no point of the image lies beyond the line
through it, a side of the outer polygon. More directions, square to the sides of the inner polygon,
are asked for until the outer polygon is nowhere farther from it than a tolerance. Vertices are
exact; only those are missing that stand out by less than the tolerance. Source: [Bretl2008].
"""

from __future__ import annotations

from dataclasses import dataclass
from math import hypot, sqrt
from typing import Final, NamedTuple

import numpy as np

from gaitopt.conventions import FloatArray, frozen
from gaitopt.dynamics.region.programs import (
    Daqp,
    Highs,
    Optimum,
    Polytope,
    has_slack,
)
from gaitopt.errors import SolverError

LEAST_TOLERANCE: Final = 1e-5
"""Smallest tolerance of a projection [m]: five times what is kept of it for :data:`ACCEPTED_GAP`
and for :func:`feasible_points`."""

ACCEPTED_GAP: Final = 1e-6
"""Largest distance of a solver's point from its outer side [m] up to which it is taken. By DAQP it
is about 1e-8, the product of its damping with the radius of the polytope."""

ACCEPTED_VIOLATION: Final = 1e-7
"""Largest violation of an inequality by a solver's point up to which it is taken, and then removed
by :func:`feasible_points`. DAQP and HiGHS are asked for 1e-10, and mostly keep to it; where the
limits of a foot almost coincide DAQP left 2e-7."""

EMPTY_SLACK: Final = 1e-9
"""A polytope whose inequalities cannot all be kept by this much, and in which neither solver found
a point, counts as empty."""

CLEARANCE: Final = 1e-12
"""By how much repaired points keep the inequalities: more than the rounding of a sum of a dozen
numbers of order one."""

REPAIRABLE: Final = 1e-4
"""Slack of an inequality at the mean of the points above which its violations are repaired. A point
then moves by a thousandth of its distance from the mean at most, and by a millionth mostly. An
inequality with less slack holds nearly with equality at all points."""

MOST_PROGRAMS: Final = 500
"""Most linear programs for a region. A region of four feet takes about 20 at a tolerance of
0.5 mm."""

SIXTY_DEGREES: Final = sqrt(0.75)
"""Sine of 60 degrees."""


class Support(NamedTuple):
    """The farthest point of the image in one direction.

    Attributes:
        x_direction, y_direction: the direction, of length one.
        x, y: the point [m].
        height: how far it lies in this direction [m].
        optimum: point of the polytope whose image it is, and the multipliers that prove it.
    """

    x_direction: float
    y_direction: float
    x: float
    y: float
    height: float
    optimum: Optimum


class Corner(NamedTuple):
    """A vertex of the outer polygon, where the outer sides of two supports meet.

    Attributes:
        x, y: the vertex [m].
        distance: from the side of the inner polygon between the supports [m].
    """

    x: float
    y: float
    distance: float


@dataclass(frozen=True, eq=False)
class Projection:
    """The image of a polytope, from inside and from outside.

    Attributes:
        points: points of the polytope ``(k, n)``. The hull of their images is the inner polygon;
            they come counter-clockwise around it, and some may lie on a side or coincide.
        outer: vertices of the outer polygon ``(k, 2)`` [m], counter-clockwise; some may coincide.
        gap: largest distance of an outer vertex from the inner polygon [m].
    """

    points: FloatArray
    outer: FloatArray
    gap: float


def project(polytope: Polytope, tolerance: float) -> Projection | None:
    """The image of a polytope; ``None`` when the polytope is empty.

    Args:
        polytope: it may have no interior.
        tolerance: largest distance between inner and outer polygon [m], at least
            :data:`LEAST_TOLERANCE`.

    Raises:
        SolverError: neither DAQP nor HiGHS solved the linear programs.
    """
    for solver in (Daqp(polytope), Highs(polytope)):
        projection = _projected(polytope, solver, tolerance)
        if projection is not None:
            return projection
        if not has_slack(polytope, EMPTY_SLACK):
            return None
    raise SolverError("neither DAQP nor HiGHS solved the linear programs of a region")


def feasible_points(polytope: Polytope, points: FloatArray) -> FloatArray:
    """``points (k, n)`` moved towards their mean until every inequality holds.

    The mean of points that are not all on one face lies inside. What solvers leave is so small
    that the points move by nanometres. Inequalities that have no slack at the mean are not looked
    at; they keep the violation that the solver left.
    """
    mean = points.mean(axis=0)
    slack = polytope.bounds - polytope.rows @ mean
    inside = slack > REPAIRABLE
    excess = (points @ polytope.rows.T - polytope.bounds)[:, inside] + CLEARANCE
    excess = np.maximum(excess, 0.0)
    share = (excess / (excess + slack[inside])).max(axis=1, initial=0.0)
    return np.asarray(points + share[:, None] * (mean - points))


def outer_heights(
    polytope: Polytope, objectives: FloatArray, multipliers: FloatArray
) -> FloatArray:
    """Numbers ``(k,)`` that ``objectives (k, n)`` exceed nowhere in the polytope: weak duality.

    Args:
        polytope: the polytope.
        objectives: ``(k, n)``.
        multipliers: any; the better, the smaller are the numbers ``(k, r)``.
    """
    duals = np.maximum(multipliers, 0.0)
    # objective x = duals A x + rest x <= duals b + |rest| |x|.
    rest = objectives - duals @ polytope.rows
    return np.asarray(duals @ polytope.bounds + polytope.radius * np.linalg.norm(rest, axis=1))


def _projected(polytope: Polytope, solver: Daqp | Highs, tolerance: float) -> Projection | None:
    """The image by one solver; ``None`` when a program was not solved well enough."""
    supports = _supports(polytope, solver, tolerance - 2.0 * ACCEPTED_GAP)
    if supports is None:
        return None
    directions = np.array([support[:2] for support in supports])
    points = np.array([support.optimum.point for support in supports])
    multipliers = np.array([support.optimum.multipliers for support in supports])
    objectives = directions @ polytope.map
    heights = outer_heights(polytope, objectives, multipliers)
    error = (heights - (objectives * points).sum(axis=1)).max()
    violation = (points @ polytope.rows.T - polytope.bounds).max()
    # A comparison with NaN is false.
    if not (error <= ACCEPTED_GAP and violation <= ACCEPTED_VIOLATION):
        return None
    proven = [
        Support(x, y, at_x, at_y, max(height, bound), optimum)
        for (x, y, at_x, at_y, height, optimum), bound in zip(
            supports, (heights + directions @ polytope.place).tolist(), strict=True
        )
    ]
    corners = [outer_corner(a, b) for a, b in zip(proven, proven[1:] + proven[:1], strict=True)]
    repaired = feasible_points(polytope, points)
    moved = float(np.linalg.norm((repaired - points) @ polytope.map.T, axis=1).max())
    gap = max(corner.distance for corner in corners) + moved
    if gap > tolerance:
        return None
    outer = frozen([(corner.x, corner.y) for corner in corners])
    return Projection(frozen(repaired), outer, gap)


def _supports(polytope: Polytope, solver: Daqp | Highs, tolerance: float) -> list[Support] | None:
    """Supports once around the image, dense enough; ``None`` when a program was not solved."""
    across, up = polytope.map
    middle_x, middle_y = polytope.place.tolist()
    maximise, image = solver.maximise, polytope.map.dot

    def support(x: float, y: float) -> Support | None:
        optimum = maximise(x * across + y * up)
        if optimum is None:
            return None
        place_x, place_y = image(optimum.point).tolist()
        place_x += middle_x
        place_y += middle_y
        return Support(x, y, place_x, place_y, x * place_x + y * place_y, optimum)

    first = support(1.0, 0.0)
    start = [first, *(support(-0.5, sign * SIXTY_DEGREES) for sign in (1.0, -1.0)), first]
    waiting: list[Support] = []
    for one in reversed(start):
        if one is None:
            return None
        waiting.append(one)
    found: list[Support] = []
    while len(waiting) > 1:
        this, following = waiting[-1], waiting[-2]
        if outer_corner(this, following).distance <= tolerance:
            found.append(waiting.pop())
            continue
        between = support(*direction_between(this, following))
        if between is None or len(found) + len(waiting) > MOST_PROGRAMS:
            return None
        waiting.insert(-1, between)
    return found


def outer_corner(a: Support, b: Support) -> Corner:
    """Where the outer sides of two supports meet; ``b`` is the next one counter-clockwise."""
    along_x, along_y = b.x - a.x, b.y - a.y
    length = hypot(along_x, along_y)
    sine = a.x_direction * b.y_direction - a.y_direction * b.x_direction
    cosine = a.x_direction * b.x_direction + a.y_direction * b.y_direction
    if length == 0.0 or sine <= 0.0:
        return Corner(b.x, b.y, 0.0)
    along_x, along_y = along_x / length, along_y / length
    x = (a.height * b.y_direction - b.height * a.y_direction) / sine - a.x
    y = (b.height * a.x_direction - a.height * b.x_direction) / sine - a.y
    along, above = along_x * x + along_y * y, along_y * x - along_x * y
    # Where the sides are almost parallel their intersection is lost in rounding. Over a length,
    # two lines that meet at this angle reach no higher than this, and not beyond its ends if the
    # angle is acute.
    above = min(max(above, 0.0), 0.5 * length * sine / (1.0 + cosine))
    beyond = 0.0
    if not 0.0 <= along <= length:
        end = 0.0 if along < 0.0 else length
        along, beyond = (along, along - end) if cosine < 0.0 else (end, 0.0)
    x, y = a.x + along * along_x + above * along_y, a.y + along * along_y - above * along_x
    return Corner(x, y, hypot(above, beyond))


def direction_between(a: Support, b: Support) -> tuple[float, float]:
    """The direction square to the side from ``a`` to ``b``, of length one, out of the polygon.

    The middle between both directions where rounding puts it outside of them.
    """
    x, y = b.y - a.y, a.x - b.x
    before = a.x_direction * y - a.y_direction * x
    after = x * b.y_direction - y * b.x_direction
    if not (before > 0.0 and after > 0.0):
        x, y = a.x_direction + b.x_direction, a.y_direction + b.y_direction
    length = hypot(x, y)
    return x / length, y / length
