"""How feet fly in a continuous walk: control points of splines from foothold to foothold."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.optimize.route.legs import FOOT
from gaitopt.plan.settings.time_optimal import RouteSettings
from gaitopt.planners.time_optimal.flights import Flights
from gaitopt.planners.time_optimal.smooth.clearance import lowest_heights
from gaitopt.planners.time_optimal.smooth.motion import SplineMotion

RISE = (0.5, 0.85)
"""Heights of the first control points in the air, as shares of the way up; all between them and the
last ones, which come down in the same way, are at the top. A foot that rises more gently lets the
walk be faster, but it is then too fast for physics: of four walks of go2 over 16 steps (1.38 s with
0.35 and 0.75, 1.54 s with these, 1.82 s with 0.65 and 1; seeds 0 to 3) two, four and four pass."""
STEEP_RISE = (0.9, 1.0)
"""The same of a flight that does not keep the clearance otherwise."""
SPREAD = (0.25, 0.0)
"""Shares of an even pace along the way; the largest that keeps the clearance is taken. With 0 a
foot is above its foothold at its first control point in the air. With 0.5 the same walks take
1.51 s, and two of them pass."""
UPRIGHT_RISE = (1.0, 1.0)
"""Rise of a flight over a map that does not keep the clearance otherwise, as up a riser. Its two
first control points in the air are above the foothold, and so is the foot until it is at the top.
"""


def with_flights(
    motion: SplineMotion, settings: RouteSettings, lifts: FloatArray, radius: float,
    upright: bool = False,
) -> SplineMotion:  # fmt: skip
    """The motion with flights that keep the clearance.

    Args:
        motion: its footholds count.
        settings: with the clearance and the number of knots of a swing.
        lifts: how far the foot rises above the higher end of each swing ``(S,)`` [m].
        radius: how far from a foothold a foot stands on it [m].
        upright: whether flights may also go straight up and down.
    """
    wanted = settings.clearance + settings.clearance_reserve
    flights = Flights.of(motion.knots)
    # Of every flight the first span and the one after its last.
    ends = np.stack([flights.lift_off, flights.touchdown + 1], axis=1).ravel()
    low = np.ones(len(flights.lift_off), dtype=np.bool_)
    shapes = [(rise, spread, 1) for rise in (RISE, STEEP_RISE) for spread in SPREAD]
    if upright:
        shapes.append((UPRIGHT_RISE, 0.0, 2))
    for rise, spread, above in shapes:
        poses = motion.poses.copy()
        at, feet = _control_points(flights, settings, lifts, spread, rise, above)
        poses[at[low], FOOT] = feet[low]
        motion = replace(motion, poses=poses)
        heights = np.append(lowest_heights(motion, radius), np.inf)
        low = np.minimum.reduceat(heights, ends)[::2] < wanted
        if not low.any():
            return motion
    return motion


def _control_points(
    flights: Flights,
    settings: RouteSettings,
    lifts: FloatArray,
    spread: float,
    rise: tuple[float, ...],
    above: int,
) -> tuple[np.ndarray, FloatArray]:
    """Knots in the air ``(S, n - 1)``, and the foot's control points ``(S, n - 1, 3)`` [m].

    With no spread, ``above`` of them at either end are above the foothold there.
    """
    intervals = settings.swing_knots
    number = np.arange(1, intervals)
    pause = np.clip((number - above) / max(intervals - 2 * above, 1), 0.0, 1.0)
    along = (1.0 - spread) * pause + spread * number / intervals
    from_end = np.minimum(number, intervals - number)
    up = np.where(from_end <= len(rise), np.take(rise, from_end - 1, mode="clip"), 1.0)
    start, end = flights.footholds[:, 0], flights.footholds[:, 1]
    feet = start[:, None] + (end - start)[:, None] * along[:, None]
    # The way up begins at the foothold that is nearer in time.
    base = np.where(2 * number <= intervals, start[:, 2:], end[:, 2:])
    top = flights.higher_foothold + np.maximum(lifts, settings.clearance)
    feet[..., 2] = base + (top[:, None] - base) * up
    return flights.lift_off[:, None] + number, feet
