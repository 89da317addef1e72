"""How high feet on a smooth motion fly outside their columns, and rows that keep them there.

A flying foot is a quadratic B-spline whose control points keep the clearance, but for those on the
ground. On the second span of a flight, and on the last but one, the spline cuts the corner between
ground and air; there the first and last knots in the air are raised until the foot is high enough
where it leaves the columns' radius.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from gaitopt.conventions import LEGS, FloatArray, rotation_z
from gaitopt.optimize.route_dynamics import RouteDynamics
from gaitopt.optimize.route_legs import FOOT, POSE
from gaitopt.optimize.route_problem import Rows
from gaitopt.planning.route_knots import OPEN_RADIUS, RouteKnots
from gaitopt.planning.route_motion import RouteMotion
from gaitopt.planning.route_settings import RouteSettings
from gaitopt.robots.rotations import rpy_to_matrix

if TYPE_CHECKING:
    from gaitopt.planning.route_assembly import Dense
    from gaitopt.planning.route_steps import Route

PARTS = 64
"""Parts of a span, on each of which a foot's parabola is bounded."""
CHORDS = 16
"""Chords of each part of a path that is straight in joint space."""
NARROWING = 2.0
"""How many times what a foot strays outside its column is taken off the column's radius."""
LEAST_RADIUS = 0.1
"""Share of it that is always left."""
KEPT = 0.5
"""Share of the rows' reserve that a motion keeps at least."""
_HAIR = 1e-9
_LEAST = 1e-5


class Flights(NamedTuple):
    """The flights of a motion.

    Attributes:
        lift, land: knots at which the feet lift off and land ``(S,)``.
        ends: the two footholds ``(S, 2, 3)`` [m].
    """

    lift: np.ndarray
    land: np.ndarray
    ends: FloatArray

    @classmethod
    def of(cls, knots: RouteKnots, skip: int) -> Flights:
        """Those that begin at knot ``skip`` or later."""
        pairs = knots.ends[1:].reshape(-1, 2)
        pairs = pairs[pairs[:, 0] >= skip]
        leg = knots.leg[pairs[:, 0]]
        return cls(pairs[:, 0], pairs[:, 1], knots.feet[pairs, leg[:, None]])

    @property
    def top(self) -> FloatArray:
        """Height of the higher foothold ``(S,)`` [m]."""
        return np.asarray(self.ends[..., 2].max(axis=1))


def heights(motion: RouteMotion, skip: int, radius: float | None) -> FloatArray:
    """Lower bound of the foot's height over its higher foothold, outside both columns ``(K,)`` [m].

    The least on each span; infinite on spans of no flight, and where the foot is nowhere outside.

    Args:
        motion: the motion.
        skip: flights that begin before this knot are not looked at.
        radius: of the columns [m]; ``None`` on open ground.
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
    outside = reach + np.linalg.norm(bow[:, :2], axis=1)[:, None] > (radius or OPEN_RADIUS)
    low = np.minimum(foot[:, 1:, 2], foot[:, :-1, 2]) - np.maximum(bow[:, 2:], 0.0)
    out[span] = np.where(outside, low, np.inf).min(axis=1) - flights.top[owner]
    return out


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
    radius = route.footholds.radius or OPEN_RADIUS
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


def kept(motion: RouteMotion, skip: int, settings: RouteSettings, radius: float | None) -> bool:
    """Whether all flights keep the clearance; arguments as for :func:`heights`."""
    wanted = settings.clearance + KEPT * settings.clearance_reserve
    return bool(heights(motion, skip, radius).min() >= wanted)


def raised(
    problem: RouteDynamics,
    motion: RouteMotion,
    skip: int,
    settings: RouteSettings,
    radius: float | None,
    haste: float | None = None,
) -> RouteDynamics:
    """The problem with rows of height that make up for the corners that the motion cuts.

    Args:
        problem: whose answer gave the motion.
        motion: the answer's, with so many knots before it as ``skip`` says.
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


def apexes(lift: np.ndarray, swing_knots: int) -> tuple[np.ndarray, np.ndarray]:
    """The two knots between whose control points a smooth flight is highest."""
    return lift + swing_knots // 2, lift + swing_knots // 2 + 1


def height_rows(rows: Rows) -> np.ndarray:
    """The rows that look at the flying foot's height alone, by their numbers."""
    alone = np.arange(POSE) == FOOT.start + 2
    return np.flatnonzero(((rows.linear == alone) & (rows.square == 0.0)).all(axis=1))
