"""From steps to the knots, unknowns and inequalities of a time-optimal route."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from gaitopt.conventions import OTHER_LEGS, FloatArray
from gaitopt.optimize.route.layout import TIME_UNIT_ROTATION, Rows
from gaitopt.optimize.route.legs import BODY, JOINTS, POSE, StackedLegs
from gaitopt.optimize.route.problem import RouteProblem
from gaitopt.planners.time_optimal.balance import balance_rows
from gaitopt.planners.time_optimal.knots import RouteKnots, lay_knots
from gaitopt.planners.time_optimal.walk import Route
from gaitopt.robots.quadruped import Quadruped
from gaitopt.stability.support import pair_lines, triangle_half_planes
from gaitopt.swing.box import box_corners

if TYPE_CHECKING:
    from gaitopt.plan.settings.time_optimal import RouteSettings
    from gaitopt.planners.phase_by_phase.steps import CrawlSteps

MOST_TILT = 0.35
"""Most roll, pitch and yaw of the body against level and heading [rad]."""
NEAR_LIMIT = 0.9
"""Joint limits farther than this from the first guess are checked, not planned with [rad]."""


def build_route(
    robot: Quadruped,
    steps: CrawlSteps,
    settings: RouteSettings,
    cogs: FloatArray,
    radius: float,
) -> tuple[RouteKnots, RouteProblem]:
    """The problem of a whole route, with the per-phase plan as its first guess.

    Args:
        robot, steps, settings: what is walked.
        cogs: body centre before and after each stance phase of a feasible walk ``(S + 1, 3)`` [m].
        radius: how far from a foothold a foot stands on it [m] (``Footholds.landing_radius``).
    """
    knots = lay_knots(steps, settings.stance_knots, settings.swing_knots)
    legs = limited(StackedLegs.of(robot), settings.reach_fraction)
    poses = first_guess(steps, settings, knots, cogs)
    joints = legs.joints(poses, knots.feet, knots.flying).reshape(-1, JOINTS)
    room = np.stack([joints.min(0) - legs.low.ravel(), legs.high.ravel() - joints.max(0)])
    problem = RouteProblem(
        legs=legs, feet=knots.feet, swing=knots.flying, poses=poses,
        unknown=_unknowns(settings, knots),
        rows=_rows(steps, settings, knots, radius),
        used_limits=~(room > NEAR_LIMIT),
        time_unit=float(TIME_UNIT_ROTATION / legs.velocity_limits.min()),
        com=balance_rows(robot, settings, knots) if settings.true_com else None,
    )  # fmt: skip
    return knots, problem


def limited(legs: StackedLegs, reach_fraction: float) -> StackedLegs:
    """The legs with their knees' limits narrowed to the reach that may be used, on one side.

    A leg's stretch is a falling function of its knee's bend, so reach is a limit of the knee.
    """
    low, high = legs.low.copy(), legs.high.copy()
    low[~np.isfinite(low)], high[~np.isfinite(high)] = -np.pi * 2, np.pi * 2
    knee, zero = legs.knee * legs.signs[:, 2], legs.zeros[:, 1] * legs.signs[:, 2]
    # The knee's joint angle is side * bend - zero, its bend from 0 (straight) to pi.
    bends = np.sort(knee * (np.stack([low[:, 2], high[:, 2]]) + zero), axis=0)
    least, most = np.clip(bends, 0.0, np.pi)
    square = legs.upper**2 + legs.lower**2
    twice = 2.0 * legs.upper * legs.lower
    longest = reach_fraction * np.sqrt(square + twice * np.cos(least))
    least = np.maximum(least, np.arccos(np.clip((longest**2 - square) / twice, -1.0, 1.0)))
    ends = np.sort(np.stack([knee * least, knee * most]), axis=0) - zero
    low[:, 2], high[:, 2] = ends
    return replace(legs, low=low, high=high)


def _unknowns(settings: RouteSettings, knots: RouteKnots) -> np.ndarray:
    """Numbers of the unknowns ``(K, 9)``, -1 for what is fixed."""
    count = len(knots.feet)
    free = np.zeros((count, POSE), dtype=bool)
    free[1:, :2] = True
    free[1:, 2] = settings.free.height
    free[1:, 3:6] = settings.free.posture
    free[:, 6:] = (knots.flying.sum(axis=1) > 0)[:, None] & (settings.free.swing)
    fresh = free.copy()
    if not settings.free.overlap:
        # The body stands still: all knots of a swing share the pose of its first.
        fresh[1:, :6] &= ~knots.swings[:, None]
    number = np.cumsum(fresh).reshape(fresh.shape) - 1
    out = np.where(fresh, number, -1)
    for k in np.flatnonzero((free & ~fresh).any(axis=1)):
        shared = free[k] & ~fresh[k]
        out[k, shared] = out[k - 1, shared]
    return out


def first_guess(
    steps: CrawlSteps, settings: RouteSettings, knots: RouteKnots, cogs: FloatArray
) -> FloatArray:
    """Poses ``(K, 9)`` of the per-phase walk."""
    poses = np.zeros((len(knots.feet), POSE))
    stance, swing = settings.stance_knots, settings.swing_knots
    share = np.arange(1, stance + 1)[:, None] / stance
    moves = cogs[:-1, None] + np.diff(cogs, axis=0)[:, None] * share
    body = np.concatenate([moves, np.repeat(cogs[1:, None], swing, axis=1)], axis=1)
    poses[:, BODY] = np.concatenate([cogs[:1], body.reshape(-1, 3)])
    starts = steps.feet[np.arange(len(steps.legs)), steps.indices]
    shares = box_shares(swing) if not settings.free.swing else arch_shares(settings)
    corners = box_corners(starts, steps.targets, settings.swing_height)
    edge = np.minimum(shares.astype(int), 2)
    along = (shares - edge)[None, :, None]
    way = corners[:, edge] * (1.0 - along) + corners[:, edge + 1] * along
    if settings.free.swing:
        way[:, 1:-1, 2] += 2e-3
    inside = knots.flying.sum(axis=1) > 0
    poses[inside, 6:] = way[:, 1:-1].reshape(-1, 3)
    return poses


def box_shares(swing: int) -> FloatArray:
    """Places of knots along a box ``(swing + 1,)``: whole numbers are its corners.

    Dense at both ends of every edge, as for the walk whose phases are planned one by one.
    """
    up = max(swing // 3, 1)
    counts = (up, swing - 2 * up, up)
    pieces = [e + (1.0 - np.cos(np.pi * np.arange(n) / n)) / 2.0 for e, n in enumerate(counts)]
    return np.append(np.concatenate(pieces), 3.0)


def arch_shares(settings: RouteSettings) -> FloatArray:
    """Where along the box the knots of a free swing begin."""
    swing = settings.swing_knots
    edge = min(0.9, (settings.clearance + 0.01) / max(settings.swing_height, 1e-3))
    inner = np.linspace(edge, 3.0 - edge, swing - 1)
    return np.concatenate([[0.0], inner, [3.0]])


def _rows(steps: CrawlSteps, settings: RouteSettings, knots: RouteKnots, radius: float) -> Rows:
    """All inequalities on single poses."""
    parts = []
    if not settings.true_com:
        parts.append(_margins(settings, knots))
    if settings.free.posture:
        at = np.repeat(np.arange(1, len(knots.feet)), 6)
        turn = np.tile(np.repeat(np.arange(3, 6), 2), len(knots.feet) - 1)
        sign = np.tile([1.0, -1.0], len(at) // 2)
        parts.append(_row(at, [(turn, sign)], np.full(len(at), MOST_TILT)))
    if settings.free.swing and len(steps.legs):
        parts.append(_flights(steps, settings, knots, radius))
    return Rows.joined(parts)


def _row(at: np.ndarray, terms: list[tuple[np.ndarray, FloatArray]], offset: FloatArray) -> Rows:
    linear = np.zeros((len(at), POSE))
    for column, factor in terms:
        linear[np.arange(len(at)), column] = factor
    return Rows(at, linear, np.zeros_like(linear), offset)


def _margins(settings: RouteSettings, knots: RouteKnots) -> Rows:
    """The body centre keeps its margin over three feet, and over four.

    Knots at which a phase ends keep the margins of both phases; four feet hold what three do.
    """
    margin = settings.stability_margin + settings.margin_reserve
    spans = np.flatnonzero(knots.swings)
    others = OTHER_LEGS[knots.leg[spans]]
    corners = np.take_along_axis(knots.feet[spans], others[..., None], axis=1)[..., :2]
    normals, offsets = triangle_half_planes(corners)
    parts = [_lines(spans + 1, normals, offsets, margin)]
    first = spans[~np.isin(spans - 1, spans) | (knots.step[spans] != knots.step[spans - 1])]
    chosen = np.isin(spans, first)
    parts.append(_lines(first, normals[chosen], offsets[chosen], margin))
    standing = np.flatnonzero(~knots.swings[:-1] & ~knots.swings[1:])
    feet = knots.feet[standing][:, :, :2]
    lines, heights, sides = pair_lines(feet)
    knot, side = np.nonzero(sides)
    parts.append(
        _lines(standing[knot] + 1, lines[knot, side][:, None], heights[knot, side][:, None], margin)
    )
    return Rows.joined(parts)


def _lines(at: np.ndarray, normals: FloatArray, offsets: FloatArray, margin: float) -> Rows:
    """``normals . (x, y) >= offsets + margin`` for the body centre at knots ``at``."""
    sides = normals.shape[1]
    flat = normals.reshape(-1, 2)
    return _row(
        np.repeat(at, sides), [(np.array(0), flat[:, 0]), (np.array(1), flat[:, 1])],
        -offsets.ravel() - margin,
    )  # fmt: skip


def _flights(steps: CrawlSteps, settings: RouteSettings, knots: RouteKnots, radius: float) -> Rows:
    """Flying feet: clearance at every knot in the air, apex in the middle, columns at both ends.

    The first and last knots in the air are where the foot leaves the cylinder above its column;
    their times are free, so this loses nothing. Between them it keeps the clearance.
    """
    swing, stance = settings.swing_knots, settings.stance_knots
    each = swing + stance
    starts = steps.feet[np.arange(len(steps.legs)), steps.indices]
    top = np.maximum(starts[:, 2], steps.targets[:, 2])
    base = np.arange(len(steps.legs)) * each + stance
    inner = np.arange(1, swing)
    at = (base[:, None] + inner).ravel()
    need = np.full((len(steps.legs), swing - 1), settings.clearance + settings.clearance_reserve)
    # A smooth curve does not pass through its control points, but between two of them.
    tops = 2 if settings.smooth else 1
    need[:, swing // 2 - 1 : swing // 2 - 1 + tops] = max(settings.swing_height, settings.clearance)
    parts = [_row(at, [(np.array(8), np.ones(len(at)))], -(top[:, None] + need).ravel())]
    for knot, centre in ((base + 1, starts), (base + swing - 1, steps.targets)):
        # (r^2 - |f - c|^2) / 2 r, in metres near the edge.
        linear, square = np.zeros((len(knot), POSE)), np.zeros((len(knot), POSE))
        linear[:, 6:8] = centre[:, :2] / radius
        square[:, 6:8] = -1.0 / radius
        offset = radius / 2.0 - (centre[:, :2] ** 2).sum(axis=1) / (2.0 * radius)
        parts.append(Rows(knot, linear, square, offset))
    return Rows.joined(parts)


def knots_of(route: Route, first: int, last: int) -> RouteKnots:
    """The knots of the steps from ``first`` up to, not including, ``last``."""
    return lay_knots(route.part(first, last), route.settings.stance_knots,
                     route.settings.swing_knots)  # fmt: skip


def problem_of(route: Route, first: int, last: int) -> RouteProblem:
    return build_route(
        route.robot, route.part(first, last), route.settings, route.cogs[first : last + 1],
        route.footholds.landing_radius,
    )[1]  # fmt: skip
