"""The first guess of a time-optimal walk: the walk planned phase by phase, at the knots."""

from __future__ import annotations

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.optimize.route.legs import BODY, FOOT, ORIENTATION, POSE
from gaitopt.plan.settings.time_optimal import RouteSettings
from gaitopt.planners.time_optimal.knots import RouteKnots
from gaitopt.planners.time_optimal.walk import Route
from gaitopt.swing.box import box_corners

LAST_CORNER = 3.0
"""Place of the last corner along a box, where places at its four corners are whole numbers."""
GUESS_CLEARANCE = 0.01
"""Height above the clearance at which the first guess of a free swing has its first knot in the
air [m]."""
GUESS_LIFT = 2e-3
"""Height by which all knots in the air of a free swing are moved up in the first guess [m]."""
LEAST_SWING_HEIGHT = 1e-3
"""Swing height that stands for a smaller one where it is divided by [m]."""
HIGHEST_SHARE = 0.9
"""Largest share of the way up at which the first guess has its first knot in the air."""


def first_guess(route: Route, knots: RouteKnots) -> FloatArray:
    """Poses at all knots ``(K, 9)`` of the walk planned phase by phase.

    In each stance phase the body moves evenly to its target; then it stands still, and the foot
    flies along a box.
    """
    steps, settings = route.steps, route.settings
    poses = np.zeros((len(knots.feet), POSE))
    poses[:, BODY] = _evenly(route, route.cogs)
    if steps.tilts is not None:
        poses[:, ORIENTATION] = _evenly(route, steps.tilts)
    lift_offs = steps.feet[np.arange(route.count), steps.indices]
    corners = box_corners(lift_offs, steps.targets, steps.lifts)
    box = _places_along_box(settings.swing_knots)
    places = np.array([
        _places_along_free_swing(settings, lift) if settings.free.swing else box
        for lift in steps.lifts.tolist()
    ]).reshape(route.count, -1)  # fmt: skip
    edge = np.minimum(places.astype(int), 2)
    along, number = (places - edge)[..., None], np.arange(route.count)[:, None]
    feet = corners[number, edge] * (1.0 - along) + corners[number, edge + 1] * along
    if settings.free.swing:
        feet[:, 1:-1, 2] += GUESS_LIFT
    in_air = knots.in_air.sum(axis=1) > 0
    poses[in_air, FOOT] = feet[:, 1:-1].reshape(-1, 3)
    return poses


def _evenly(route: Route, targets: FloatArray) -> FloatArray:
    """Values at all knots ``(K, 3)`` that change evenly in stance phases, and not in swings.

    Args:
        route: the walk.
        targets: values at the start and during each swing ``(S + 1, 3)``.
    """
    settings = route.settings
    share = np.arange(1, settings.stance_knots + 1)[:, None] / settings.stance_knots
    stance = targets[:-1, None] + np.diff(targets, axis=0)[:, None] * share
    swing = np.repeat(targets[1:, None], settings.swing_knots, axis=1)
    return np.concatenate([targets[:1], np.concatenate([stance, swing], axis=1).reshape(-1, 3)])


def _places_along_box(swing_intervals: int) -> FloatArray:
    """Places of the knots of a swing along its box ``(n + 1,)``; corners are whole numbers.

    They are dense at both ends of every edge, as in the walk planned phase by phase: there the
    joints' velocities change fastest.
    """
    up = max(swing_intervals // 3, 1)
    counts = (up, swing_intervals - 2 * up, up)
    edges = [e + (1.0 - np.cos(np.pi * np.arange(n) / n)) / 2.0 for e, n in enumerate(counts)]
    return np.append(np.concatenate(edges), LAST_CORNER)


def _places_along_free_swing(settings: RouteSettings, lift: float) -> FloatArray:
    """Places of the knots of a free swing along a box ``(n + 1,)``, for the first guess.

    The foot rises by ``lift`` [m].

    The first knot in the air is a little above the clearance on the way up, and the last one on the
    way down; the others are spread evenly between them.
    """
    height = max(lift, LEAST_SWING_HEIGHT)
    first = min(HIGHEST_SHARE, (settings.clearance + GUESS_CLEARANCE) / height)
    in_air = np.linspace(first, LAST_CORNER - first, settings.swing_knots - 1)
    return np.concatenate([[0.0], in_air, [LAST_CORNER]])
