"""How high feet on a smooth motion fly outside their columns, and rows that keep them there.

A flying foot is a quadratic B-spline whose control points keep the clearance, but for those on the
ground. On the second span of a flight, and on the last but one, the spline cuts the corner between
ground and air; there the first and last knots in the air are raised until the foot is high enough
where it leaves the columns' radius.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.optimize.route.dynamic_problem import DynamicRouteProblem
from gaitopt.optimize.route.legs import FOOT
from gaitopt.plan.settings.time_optimal import RouteSettings
from gaitopt.planners.time_optimal.flights import KEPT, Flights, apexes, height_rows
from gaitopt.planners.time_optimal.smooth.motion import RouteMotion

if TYPE_CHECKING:
    pass

PARTS = 64
"""Parts of a span, on each of which a foot's parabola is bounded."""


def heights(motion: RouteMotion, skip: int, radius: float) -> FloatArray:
    """Lower bound of the foot's height over its higher foothold, outside both columns ``(K,)`` [m].

    The least on each span; infinite on spans of no flight, and where the foot is nowhere outside.

    Args:
        motion: the motion.
        skip: flights that begin before this knot are not looked at.
        radius: how far from a foothold a foot stands on it [m] (``Footholds.landing_radius``).
    """
    flights = Flights.of(motion.knots, skip)
    count = flights.land - flights.lift + 1
    owner = np.repeat(np.arange(len(count)), count)
    span = flights.lift[owner] + np.arange(len(owner)) - (np.cumsum(count) - count)[owner]
    out = np.full(len(motion.spans), np.inf)
    if not len(span):
        return out
    bend, speed, start = motion.pieces[:, span, FOOT][:, :, None]
    step = motion.spans[span] / PARTS
    t = (step[:, None] * np.arange(PARTS + 1))[..., None]
    foot = (bend * t + speed) * t + start
    # A parabola leaves its chord by a quarter of its leading coefficient times the step squared.
    bow = bend[:, 0] * step[:, None] ** 2 / 4.0
    away = foot[:, :, None, :2] - flights.ends[owner][:, None, :, :2]
    distance = np.linalg.norm(away, axis=3)
    # Discs are convex: a chord between two places inside stays inside.
    reach = np.maximum(distance[:, 1:], distance[:, :-1]).min(axis=2)
    outside = reach + np.linalg.norm(bow[:, :2], axis=1)[:, None] > radius
    low = np.minimum(foot[:, 1:, 2], foot[:, :-1, 2]) - np.maximum(bow[:, 2:], 0.0)
    out[span] = np.where(outside, low, np.inf).min(axis=1) - flights.top[owner]
    return out


def kept(motion: RouteMotion, skip: int, settings: RouteSettings, radius: float) -> bool:
    """Whether all flights keep the clearance; arguments as for :func:`heights`."""
    wanted = settings.clearance + KEPT * settings.clearance_reserve
    return bool(heights(motion, skip, radius).min() >= wanted)


def raised(
    problem: DynamicRouteProblem,
    motion: RouteMotion,
    skip: int,
    settings: RouteSettings,
    radius: float,
    haste: float | None = None,
) -> DynamicRouteProblem:
    """The problem with rows of height that make up for the corners that the motion cuts.

    Args:
        problem: whose solution gave the motion.
        motion: the solution's, with so many knots before it as ``skip`` says.
        skip: spans of the motion that are not the problem's.
        settings, radius: of the walk; the columns' radius [m].
        haste: rows are raised only, by so many times what is missing; by default they are lowered
            again, too, where there is more than enough.
    """
    found, flights = heights(motion, skip, radius), Flights.of(motion.knots, skip)
    wanted = settings.clearance + settings.clearance_reserve
    offset = problem.rows.offset.copy()
    for air, ground in ((flights.lift + 1, flights.lift), (flights.land - 1, flights.land)):
        least = np.minimum(found[air], found[ground])
        short = np.full(motion.knots.feet.shape[0], -np.inf)
        # Where the foot is nowhere outside the columns, nothing is missing.
        short[air] = np.where(np.isfinite(least), wanted - least, -np.inf)
        floor = np.full(len(short), -np.inf)
        floor[air] = flights.top + wanted
        apex = np.isin(air, np.concatenate(apexes(flights.lift, settings.swing_knots)))
        floor[air[apex]] = flights.top[apex] + max(settings.swing_height, wanted)
        rows = height_rows(problem.rows)
        rows = rows[np.isin(problem.rows.knot[rows] + skip, air)]
        at = problem.rows.knot[rows] + skip
        if haste is None:
            asked = np.maximum(floor[at], motion.poses[at, 8] + short[at])
        else:
            asked = haste * np.maximum(short[at], 0.0) - offset[rows]
        offset[rows] = -asked
    return replace(problem, rows=problem.rows._replace(offset=offset))
