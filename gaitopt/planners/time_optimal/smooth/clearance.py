"""How high feet fly on a smooth motion, and rows of height that keep them high enough.

The path of a flying foot is a quadratic B-spline. Its control points in the air keep the clearance,
those at lift-off and touchdown are on the ground. So on the second span of a flight, and on the
last but one, the spline cuts the corner between ground and air. There the first and the last
control point in the air are raised until the foot is high enough where it is not above a column.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.optimize.route.dynamic_problem import DynamicRouteProblem
from gaitopt.optimize.route.legs import FOOT
from gaitopt.planners.time_optimal.dense import RESERVE_KEPT
from gaitopt.planners.time_optimal.flights import (
    FOOT_HEIGHT,
    Flights,
    height_rows,
    knots_above_column,
    smooth_apex_knots,
)
from gaitopt.planners.time_optimal.smooth.between import LIMIT_OVERCORRECTION
from gaitopt.planners.time_optimal.smooth.motion import SplineMotion
from gaitopt.planners.time_optimal.smooth.window import SmoothWindow

LOWERED_SHARE = 0.5
"""Share of a height above what is wanted by which a row is lowered, where forces set the timing."""
FORCE_RESERVE_KEPT = 0.2
"""Share of the reserve that is left on paths whose timing forces set. They follow the spline within
a hundredth of a millimetre, and the default reserve is half a millimetre."""
PIECES_PER_SPAN = 64
"""Pieces of a span on each of which a foot's parabola is bounded by its chord."""


def lowest_heights(motion: SplineMotion, radius: float, first_knot: int = 0) -> FloatArray:
    """Lower bound of a flying foot's height above its higher foothold on each span ``(K,)`` [m].

    Where the foot is above one of its two columns its height does not count. Infinite on spans on
    which no foot flies, or the foot is above a column all the time.

    Args:
        motion: the motion.
        radius: how far from a foothold a foot stands on it [m] (``Footholds.landing_radius``).
        first_knot: flights that begin before this knot are left out.
    """
    flights = Flights.of(motion.knots, first_knot)
    count = flights.touchdown - flights.lift_off + 1
    flight = np.repeat(np.arange(len(count)), count)
    number = np.arange(len(flight)) - (np.cumsum(count) - count)[flight]
    span = flights.lift_off[flight] + number
    out = np.full(len(motion.spans), np.inf)
    if not len(span):
        return out
    a, b, c = motion.parabolas[:, span, FOOT][:, :, None]
    piece = motion.spans[span] / PIECES_PER_SPAN
    t = (piece[:, None] * np.arange(PIECES_PER_SPAN + 1))[..., None]
    foot = (a * t + b) * t + c
    # A parabola is at most a quarter of its first coefficient times the piece's time squared away
    # from the chord of a piece.
    from_chord = a[:, 0] * piece[:, None] ** 2 / 4.0
    from_axes = foot[:, :, None, :2] - flights.footholds[flight][:, None, :, :2]
    distance = np.linalg.norm(from_axes, axis=3)
    # A disc is convex: a chord between two places in it lies in it.
    farthest = np.maximum(distance[:, 1:], distance[:, :-1]).min(axis=2)
    outside = farthest + np.linalg.norm(from_chord[:, :2], axis=1)[:, None] > radius
    low = np.minimum(foot[:, 1:, 2], foot[:, :-1, 2]) - np.maximum(from_chord[:, 2:], 0.0)
    lowest = np.where(outside, low, np.inf).min(axis=1)
    out[span] = lowest - flights.higher_foothold[flight]
    return out


def clearance_is_kept(window: SmoothWindow, motion: SplineMotion) -> bool:
    """Whether all flights of a motion keep the clearance, and a share of its reserve."""
    settings, radius = window.route.settings, window.route.footholds.landing_radius
    share = FORCE_RESERVE_KEPT if settings.forces else RESERVE_KEPT
    wanted = settings.clearance + share * settings.clearance_reserve
    return bool(lowest_heights(motion, radius, window.first_knot).min() >= wanted)


def with_raised_heights(
    problem: DynamicRouteProblem,
    window: SmoothWindow,
    motion: SplineMotion,
    *,
    only_upward: bool,
) -> DynamicRouteProblem:
    """The problem with other heights in the rows of the first and last knots in the air.

    Args:
        problem: whose solution gave the motion.
        window: what is planned.
        motion: the window's, through the solution.
        only_upward: raise rows only, by more than what is missing; else rows are also lowered
            where there is more than enough.
    """
    settings, first_knot = window.route.settings, window.first_knot
    found = lowest_heights(motion, window.route.footholds.landing_radius, first_knot)
    flights = Flights.of(motion.knots, first_knot)
    wanted = settings.clearance + settings.clearance_reserve
    offset = problem.rows.offset.copy()
    apexes = np.concatenate(smooth_apex_knots(flights.lift_off, settings.swing_knots))
    above = knots_above_column(settings)
    for in_air, before in (
        (flights.lift_off + above, flights.lift_off + above - 1),
        (flights.touchdown - above, flights.touchdown - above + 1),
    ):
        # Rows of these knots, and the flight of each.
        rows = height_rows(problem.rows)
        rows = rows[np.isin(problem.rows.knot[rows] + first_knot, in_air)]
        knot = problem.rows.knot[rows] + first_knot
        flight = np.searchsorted(in_air, knot)
        lowest = np.minimum(found[in_air], found[before])[flight]
        # Where the foot is above a column all the time nothing is missing.
        missing = np.where(np.isfinite(lowest), wanted - lowest, -np.inf)
        if only_upward:
            offset[rows] = -(LIMIT_OVERCORRECTION * np.maximum(missing, 0.0) - offset[rows])
            continue
        apex = np.maximum(window.route.steps.lifts[flight], wanted)
        least = np.where(np.isin(knot, apexes), apex, wanted)
        least = flights.higher_foothold[flight] + least
        if settings.forces:
            # Few rounds: less is taken back than there is too much, more is added than is missing.
            missing *= np.where(missing > 0.0, LIMIT_OVERCORRECTION, LOWERED_SHARE)
        offset[rows] = -np.maximum(least, motion.poses[knot, FOOT_HEIGHT] + missing)
    return replace(problem, rows=problem.rows._replace(offset=offset))
