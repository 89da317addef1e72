"""From a walk to its knots and its problem: unknowns, and inequalities at knots.

See :mod:`gaitopt.planners.time_optimal` for the problem as a whole.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.optimize.route.layout import TIME_UNIT_ROTATION, Rows
from gaitopt.optimize.route.legs import FOOT, JOINTS, ORIENTATION, POSE, StackedLegs
from gaitopt.optimize.route.problem import RouteProblem
from gaitopt.plan.settings.time_optimal import RouteSettings
from gaitopt.planners.time_optimal.balance import com_rows
from gaitopt.planners.time_optimal.flights import (
    FOOT_HEIGHT,
    Flights,
    knots_above_column,
    smooth_apex_knots,
)
from gaitopt.planners.time_optimal.guess import first_guess
from gaitopt.planners.time_optimal.knots import RouteKnots, route_knots
from gaitopt.planners.time_optimal.support import support_on_spans
from gaitopt.planners.time_optimal.walk import Route

MOST_TILT = 0.35
"""Largest roll, pitch and yaw of the body against level and heading, or against the postures that
the footholds ask for [rad]: 20 degrees."""
CUT_SHARE = 0.15
"""Height by which a turn at the clearance is raised at first, as a share of the clearance."""
FAR_LIMIT = 0.9
"""Position limits that are farther than this from all joint angles of the first guess are left out
of the problem [rad]; the certificate checks all of them."""


def build_route(route: Route) -> tuple[RouteKnots, RouteProblem]:
    """The knots and the problem of a walk, with the walk planned phase by phase as first guess."""
    settings = route.settings
    knots = route_knots(route.steps, settings.stance_knots, settings.swing_knots)
    legs = with_reach_limits(StackedLegs.of(route.robot), settings.reach_fraction)
    poses = first_guess(route, knots)
    joints = legs.joints(poses, knots.feet, knots.in_air).reshape(-1, JOINTS)
    distance = np.stack([joints.min(0) - legs.low.ravel(), legs.high.ravel() - joints.max(0)])
    problem = RouteProblem(
        legs=legs, feet=knots.feet, swing=knots.in_air, poses=poses,
        unknown=_number_unknowns(settings, knots), rows=_rows(route, knots, poses),
        # So written, a limit counts whose distance is not a number.
        used_limits=~(distance > FAR_LIMIT),
        time_unit=float(TIME_UNIT_ROTATION / legs.velocity_limits.min()),
        com=com_rows(route.robot, settings, knots) if settings.true_com else None,
    )  # fmt: skip
    return knots, problem


def with_reach_limits(legs: StackedLegs, reach_fraction: float) -> StackedLegs:
    """The legs with knees that bend to the side of their configuration, and not less than allowed.

    The distance of a foot from the leg's pitch axis falls as the knee bends. So a limit of this
    distance, a share ``reach_fraction`` of the straight leg's, is a limit of the knee angle.
    """
    low, high = legs.low.copy(), legs.high.copy()
    low[~np.isfinite(low)], high[~np.isfinite(high)] = -np.pi * 2, np.pi * 2
    knee, zero = legs.knee * legs.signs[:, 2], legs.zeros[:, 1] * legs.signs[:, 2]
    # The joint's angle is knee * bending - zero; the bending goes from 0 (straight) to pi.
    bending = np.sort(knee * (np.stack([low[:, 2], high[:, 2]]) + zero), axis=0)
    least, most = np.clip(bending, 0.0, np.pi)
    # Law of cosines, with the angle pi - bending between thigh and shank.
    squares = legs.upper**2 + legs.lower**2
    product = 2.0 * legs.upper * legs.lower
    longest = reach_fraction * np.sqrt(squares + product * np.cos(least))
    least = np.maximum(least, np.arccos(np.clip((longest**2 - squares) / product, -1.0, 1.0)))
    low[:, 2], high[:, 2] = np.sort(np.stack([knee * least, knee * most]), axis=0) - zero
    return replace(legs, low=low, high=high)


def _number_unknowns(settings: RouteSettings, knots: RouteKnots) -> np.ndarray:
    """Numbers of the poses' unknowns ``(K, 9)``; -1 for an entry that is fixed."""
    free = np.zeros((len(knots.feet), POSE), dtype=bool)
    free[1:, :2] = True
    free[1:, 2] = settings.free.height
    free[1:, ORIENTATION] = settings.free.posture
    free[:, FOOT] = (knots.in_air.sum(axis=1) > 0)[:, None] & settings.free.swing
    new = free.copy()
    if not settings.free.overlap:
        # The body stands still during swings: all knots of a swing share the pose of its first.
        new[1:, : FOOT.start] &= ~knots.is_swing[:, None]
    numbers = np.where(new, np.cumsum(new).reshape(new.shape) - 1, -1)
    for k in np.flatnonzero((free & ~new).any(axis=1)):
        shared = free[k] & ~new[k]
        numbers[k, shared] = numbers[k - 1, shared]
    return numbers


def _rows(route: Route, knots: RouteKnots, poses: FloatArray) -> Rows:
    """All inequalities at single knots, but those of the true centre of mass.

    Args:
        route, knots: the walk.
        poses: the first guess ``(K, 9)``.
    """
    parts = []
    if not route.settings.true_com:
        parts.append(_support_rows(route.settings, knots))
    if route.settings.free.posture:
        parts.append(_tilt_rows(poses))
    if route.settings.free.swing and route.count:
        parts += [_height_rows(route, knots), *_column_rows(route, knots)]
    return Rows.joined(parts)


def _support_rows(settings: RouteSettings, knots: RouteKnots) -> Rows:
    """The body centre keeps the stability margin at every knot but the first, which is fixed."""
    margin = settings.stability_margin + settings.margin_reserve
    sides = support_on_spans(knots)
    later = sides.knot > 0
    linear = np.zeros((int(later.sum()), POSE))
    linear[:, :2] = sides.normal[later]
    return Rows(sides.knot[later], linear, np.zeros_like(linear), -sides.offset[later] - margin)


def _tilt_rows(poses: FloatArray) -> Rows:
    """Roll, pitch and yaw are within :data:`MOST_TILT` of those of a first guess ``(K, 9)``."""
    knot = np.repeat(np.arange(1, len(poses)), 6)
    each = np.zeros((len(poses) - 1, 3, 2, POSE))
    for i, column in enumerate(range(ORIENTATION.start, ORIENTATION.stop)):
        each[:, i, :, column] = [1.0, -1.0]
    linear = each.reshape(-1, POSE)
    guessed = (linear * poses[knot]).sum(axis=1)
    return Rows(knot, linear, np.zeros_like(linear), MOST_TILT - guessed)


def _height_rows(route: Route, knots: RouteKnots) -> Rows:
    """A foot keeps its clearance at all knots in the air, and the swing height in the middle.

    Both are counted from the higher one of its footholds. Where two knots of a flight are above a
    column, the one next to its foothold is only not below it. The other is a little higher than the
    clearance, as the spline cuts the turn there.
    """
    settings, flights = route.settings, Flights.of(knots)
    count, above = settings.swing_knots, knots_above_column(settings)
    in_air = np.arange(1, count)
    height = np.full((route.count, len(in_air)), settings.clearance + settings.clearance_reserve)
    apex = np.maximum(route.steps.lifts, settings.clearance)[:, None]
    middle = smooth_apex_knots(np.zeros(1, dtype=int), count)
    for knot in middle if settings.smooth else middle[:1]:
        height[:, knot - 1] = apex
    least = flights.higher_foothold[:, None] + height
    if above > 1:
        least[:, 0], least[:, -1] = flights.footholds[:, 0, 2], flights.footholds[:, 1, 2]
        least[:, [1, -2]] += CUT_SHARE * settings.clearance
    knot = (flights.lift_off[:, None] + in_air).ravel()
    linear = np.zeros((len(knot), POSE))
    linear[:, FOOT_HEIGHT] = 1.0
    return Rows(knot, linear, np.zeros_like(linear), -least.ravel())


def _column_rows(route: Route, knots: RouteKnots) -> list[Rows]:
    """At its first and last knots in the air a foot is above the column that it leaves or reaches.

    Below the clearance a foot is only allowed above its columns. Times between knots are free, so
    one may fix without loss at which knots the foot leaves and enters the space above a column.
    """
    radius, flights = route.footholds.landing_radius, Flights.of(knots)
    parts = []
    above = 1 + np.arange(knots_above_column(route.settings))
    ends = [(flights.lift_off + n, 0) for n in above]
    for knot, number in ends + [(flights.touchdown - n, 1) for n in above]:
        centre = flights.footholds[:, number, :2]
        # (r^2 - |f - c|^2) / 2 r: near the edge this is the distance from it in metres.
        linear, square = np.zeros((len(knot), POSE)), np.zeros((len(knot), POSE))
        linear[:, 6:8] = centre / radius
        square[:, 6:8] = -1.0 / radius
        offset = radius / 2.0 - (centre**2).sum(axis=1) / (2.0 * radius)
        parts.append(Rows(knot, linear, square, offset))
    return parts
