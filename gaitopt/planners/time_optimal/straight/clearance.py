"""How high feet fly between knots, and rows that keep them there."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gaitopt.conventions import LEGS, FloatArray, rotation_z
from gaitopt.optimize.route.layout import Rows
from gaitopt.optimize.route.legs import FOOT
from gaitopt.plan.settings.time_optimal import RouteSettings
from gaitopt.planners.time_optimal.dense import Dense
from gaitopt.planners.time_optimal.flights import KEPT, Flights, height_rows
from gaitopt.planners.time_optimal.knots import RouteKnots
from gaitopt.planners.time_optimal.walk import Route
from gaitopt.robots.rotations import rpy_to_matrix

CHORDS = 16
"""Chords of each part of a path that is straight in joint space."""
NARROWING = 2.0
"""How many times what a foot strays outside its column is taken off the column's radius."""
LEAST_RADIUS = 0.1
"""Share of it that is always left."""
_HAIR = 1e-9
_LEAST = 1e-5


class Seen(NamedTuple):
    """What feet do between knots, on a path that is straight in joint space.

    Attributes:
        low: least height over the higher foothold outside both columns ``(K - 1,)`` [m]; infinite
            in intervals in which no foot is there.
        stray: how far outside both columns a foot is where it is too low ``(K - 1,)`` [m].
    """

    low: FloatArray
    stray: FloatArray


def dense_heights(route: Route, knots: RouteKnots, dense: Dense) -> Seen:
    """Flying feet of a dense path, in the intervals of its problem.

    Between the :data:`CHORDS` samples of each part a foot's chord counts, which it leaves by less
    than a micrometre.
    """
    robot, flights = route.robot, Flights.of(knots, 0)
    radius = route.footholds.landing_radius
    wanted = route.settings.clearance + KEPT * route.settings.clearance_reserve
    values = np.concatenate([dense.body, dense.joints], axis=1)
    back = rotation_z(-route.settings.heading)
    share = np.linspace(0.0, 1.0, CHORDS, endpoint=False)[:, None]
    seen = Seen(np.full(len(knots.step), np.inf), np.zeros(len(knots.step)))
    for s, (lift, land) in enumerate(zip(flights.lift, flights.land, strict=True)):
        mine = values[dense.knots[lift] : dense.knots[land] + 1]
        fine = (mine[:-1, None] + np.diff(mine, axis=0)[:, None] * share).reshape(-1, mine.shape[1])
        fine = np.concatenate([fine, mine[-1:]])
        leg = LEGS[knots.leg[lift]]
        local = robot.legs[leg].forward(fine[:, [6 + c for c in robot.leg_columns[leg]]])
        turned = rpy_to_matrix(fine[:, 3:6]) @ robot.body_axes
        foot = (fine[:, :3] + np.einsum("nij,nj->ni", turned, local)) @ back.T
        foot[:, 2] -= flights.top[s]
        first = CHORDS * (dense.knots[lift:land] - dense.knots[lift])
        centres = flights.ends[s, :, :2]
        low = _lowest_outside(foot, centres, radius)
        away = np.linalg.norm(foot[:-1, None, :2] - centres, axis=2).min(axis=1) - radius
        seen.low[lift:land] = np.minimum.reduceat(low, first)
        seen.stray[lift:land] = np.maximum.reduceat(
            np.where(foot[:-1, 2] < wanted, away, 0.0), first
        )
    return seen


def _lowest_outside(line: FloatArray, centres: FloatArray, radius: float) -> FloatArray:
    """Least height of each chord of ``line (N, 3)`` outside all discs about ``centres (2, 2)``.

    On a chord it is at an end, or where the chord leaves a disc. Infinite inside ``(N - 1,)``.
    """
    way = np.diff(line, axis=0)
    gap = line[:-1, None, :2] - centres
    a = (way[:, :2] ** 2).sum(axis=1)[:, None]
    b = np.einsum("nci,ni->nc", gap, way[:, :2])
    with np.errstate(divide="ignore", invalid="ignore"):
        root = np.sqrt(b**2 - a * ((gap**2).sum(axis=2) - radius**2))
        cuts = np.concatenate([(-b - root) / a, (-b + root) / a], axis=1)
    share = np.concatenate([np.zeros_like(a), np.ones_like(a), cuts], axis=1)
    there = (share >= 0.0) & (share <= 1.0)
    place = line[:-1, None] + way[:, None] * np.where(there, share, 0.0)[..., None]
    away = np.linalg.norm(place[:, :, None, :2] - centres, axis=3).min(axis=2)
    return np.asarray(np.where(there & (away >= radius - _HAIR), place[..., 2], np.inf).min(axis=1))


def narrowed(rows: Rows, knots: RouteKnots, seen: Seen, settings: RouteSettings) -> Rows | None:
    """Rows that keep feet higher, or nearer to their columns, where they lose their clearance.

    ``None`` where they lose it nowhere. Legs that move straight in joint space bow out on their way
    up and down: there the rows of the columns' radius are narrowed.
    """
    short = settings.clearance + settings.clearance_reserve - seen.low
    short = np.where(short > (1.0 - KEPT) * settings.clearance_reserve, short, 0.0)
    if not short.any():
        return None
    flights = Flights.of(knots, 0)
    more, less = np.zeros(len(knots.feet)), np.zeros(len(knots.feet))
    for interval, air in ((flights.lift, flights.lift + 1), (flights.land - 1, flights.land - 1)):
        less[air] = np.where(short[interval] > 0.0, NARROWING * seen.stray[interval] + _LEAST, 0.0)
        short[interval] = 0.0
    np.maximum(more[:-1], short, out=more[:-1])
    np.maximum(more[1:], short, out=more[1:])
    offset = rows.offset.copy()
    lifted, inside = height_rows(rows), np.flatnonzero(rows.square[:, FOOT.start] < 0.0)
    offset[lifted] -= more[rows.knot[lifted]]
    # Such a row's largest value is that of its column's axis: the radius that it keeps squared,
    # over twice the column's.
    linear, square = rows.linear[inside, FOOT], rows.square[inside, FOOT]
    full = -1.0 / square[:, 0]
    axis = (linear[:, :2] ** 2).sum(axis=1) * full / 2.0
    old = np.sqrt(2.0 * full * np.maximum(offset[inside] + axis, 0.0))
    new = np.maximum(old - less[rows.knot[inside]], np.minimum(old, LEAST_RADIUS * full))
    offset[inside] = new**2 / (2.0 * full) - axis
    return rows._replace(offset=offset)
