"""How high feet fly between knots on a straight walk, and rows that keep them high enough.

Between knots a flying leg moves along a straight line in joint space, so its foot follows an arc.
On the way up and down the arc may leave the space above the column while the foot is still low.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gaitopt.conventions import LEGS, FloatArray, rotation_z
from gaitopt.optimize.route.layout import Rows
from gaitopt.optimize.route.legs import FOOT
from gaitopt.plan.settings.time_optimal import RouteSettings
from gaitopt.planners.time_optimal.dense import RESERVE_KEPT, DensePath
from gaitopt.planners.time_optimal.flights import Flights, height_rows
from gaitopt.planners.time_optimal.knots import RouteKnots
from gaitopt.planners.time_optimal.walk import Route
from gaitopt.robots.rotations import rpy_to_matrix

CHORDS = 16
"""Chords into which a foot's arc is cut on each piece of a dense path."""
NARROWING = 2.0
"""How many times the distance by which a foot is outside its column is taken off the radius."""
LEAST_NARROWING = 1e-5
"""Least length that is taken off the radius [m]."""
LEAST_RADIUS_SHARE = 0.1
"""Share of a column's radius that is always left."""
EDGE_ROUNDING = 1e-9
"""Error by which a place on a disc's edge may be found inside it [m]: coordinates of up to 1e6 m
are rounded by 1e-10 m."""


class FlightHeights(NamedTuple):
    """What flying feet do on each interval of a problem.

    Attributes:
        lowest: least height above the higher foothold while the foot is outside both columns
            ``(K - 1,)`` [m]; infinite on intervals on which it never is.
        low_outside: largest distance from both columns while the foot is lower than the clearance
            ``(K - 1,)`` [m]; not more than 0 where it is then inside a column.
    """

    lowest: FloatArray
    low_outside: FloatArray


def flight_heights(route: Route, knots: RouteKnots, dense: DensePath) -> FlightHeights:
    """Heights of the flying feet on a dense path, interval by interval."""
    flights, radius = Flights.of(knots), route.footholds.landing_radius
    wanted = route.settings.clearance + RESERVE_KEPT * route.settings.clearance_reserve
    lowest, low_outside = np.full(len(knots.step), np.inf), np.zeros(len(knots.step))
    for i, (lift_off, touchdown) in enumerate(knots.flights.tolist()):
        pieces = slice(dense.at_knots[lift_off], dense.at_knots[touchdown] + 1)
        foot = _foot_places(route, LEGS[knots.leg[lift_off]], dense.values[pieces])
        foot[:, 2] -= flights.higher_foothold[i]
        intervals = slice(lift_off, touchdown)
        first_chord = CHORDS * (dense.at_knots[intervals] - dense.at_knots[lift_off])
        centres = flights.footholds[i, :, :2]
        lowest[intervals] = np.minimum.reduceat(_lowest_outside(foot, centres, radius), first_chord)
        distance = np.linalg.norm(foot[:-1, None, :2] - centres, axis=2).min(axis=1) - radius
        low_outside[intervals] = np.maximum.reduceat(
            np.where(foot[:-1, 2] < wanted, distance, 0.0), first_chord
        )
    return FlightHeights(lowest, low_outside)


def _foot_places(route: Route, leg: str, values: FloatArray) -> FloatArray:
    """Places of a foot along some pieces of a dense path, in the heading frame [m].

    Args:
        route: the walk.
        leg: the foot's leg.
        values: columns of the path at the ends of the pieces ``(n + 1, 6 + nj)``.

    Returns:
        ``(CHORDS n + 1, 3)``. Between two of these places the foot leaves their chord by less than
        a micrometre.
    """
    robot = route.robot
    share = np.linspace(0.0, 1.0, CHORDS, endpoint=False)[:, None]
    fine = (values[:-1, None] + np.diff(values, axis=0)[:, None] * share).reshape(
        -1, values.shape[1]
    )
    fine = np.concatenate([fine, values[-1:]])
    local = robot.legs[leg].forward(fine[:, [6 + c for c in robot.leg_columns[leg]]])
    turned = rpy_to_matrix(fine[:, 3:6]) @ robot.body_axes
    world = fine[:, :3] + np.einsum("nij,nj->ni", turned, local)
    return np.asarray(world @ rotation_z(-route.settings.heading).T)


def _lowest_outside(line: FloatArray, centres: FloatArray, radius: float) -> FloatArray:
    """Least height of each chord of a line outside two discs, as seen from above ``(N - 1,)`` [m].

    On a chord the height is least at an end, or where the chord leaves or enters a disc. Infinite
    for a chord that lies within the discs.

    Args:
        line: corners of the line ``(N, 3)`` [m].
        centres: of the discs ``(2, 2)`` [m].
        radius: of the discs [m].
    """
    chord = np.diff(line, axis=0)
    from_centre = line[:-1, None, :2] - centres
    # |from_centre + s chord|^2 = radius^2 is a quadratic equation for the share s of the chord.
    a = (chord[:, :2] ** 2).sum(axis=1)[:, None]
    b = np.einsum("nci,ni->nc", from_centre, chord[:, :2])
    with np.errstate(divide="ignore", invalid="ignore"):
        root = np.sqrt(b**2 - a * ((from_centre**2).sum(axis=2) - radius**2))
        crossings = np.concatenate([(-b - root) / a, (-b + root) / a], axis=1)
    share = np.concatenate([np.zeros_like(a), np.ones_like(a), crossings], axis=1)
    on_chord = (share >= 0.0) & (share <= 1.0)
    place = line[:-1, None] + chord[:, None] * np.where(on_chord, share, 0.0)[..., None]
    distance = np.linalg.norm(place[:, :, None, :2] - centres, axis=3).min(axis=2)
    outside = on_chord & (distance >= radius - EDGE_ROUNDING)
    return np.asarray(np.where(outside, place[..., 2], np.inf).min(axis=1))


def clearance_is_kept(heights: FlightHeights, settings: RouteSettings) -> bool:
    """Whether feet keep the clearance, and the share of its reserve that they are to keep."""
    return not (_missing_heights(heights, settings) > 0.0).any()


def with_stricter_clearance(
    rows: Rows, knots: RouteKnots, heights: FlightHeights, settings: RouteSettings
) -> Rows:
    """Rows that ask for more where feet lose their clearance between knots.

    On the first and the last interval of a flight the radius is narrowed within which the foot
    has to be at its first and last knot in the air. Elsewhere the rows of the height are raised at
    both knots beside the interval.

    Args:
        rows: of a problem with these knots.
        knots: its knots.
        heights: of the motion through its solution, from :func:`flight_heights`.
        settings: of the walk.
    """
    missing, flights = _missing_heights(heights, settings), Flights.of(knots)
    narrowing, raise_by = np.zeros(len(knots.feet)), np.zeros(len(knots.feet))
    for interval, in_air in (
        (flights.lift_off, flights.lift_off + 1),
        (flights.touchdown - 1, flights.touchdown - 1),
    ):
        narrowing[in_air] = np.where(
            missing[interval] > 0.0,
            NARROWING * heights.low_outside[interval] + LEAST_NARROWING,
            0.0,
        )
        missing[interval] = 0.0
    np.maximum(raise_by[:-1], missing, out=raise_by[:-1])
    np.maximum(raise_by[1:], missing, out=raise_by[1:])
    offset = rows.offset.copy()
    height = height_rows(rows)
    offset[height] -= raise_by[rows.knot[height]]
    column = np.flatnonzero(rows.square[:, FOOT.start] < 0.0)
    offset[column] = _narrowed_offsets(rows.chosen(column), narrowing)
    return rows._replace(offset=offset)


def _missing_heights(heights: FlightHeights, settings: RouteSettings) -> FloatArray:
    """By how much feet are lower than rows ask for ``(K - 1,)`` [m]; 0 where they are high enough.

    High enough is what keeps the clearance and :data:`RESERVE_KEPT` of its reserve.
    """
    reserve = settings.clearance_reserve
    missing = settings.clearance + reserve - heights.lowest
    return np.where(missing > (1.0 - RESERVE_KEPT) * reserve, missing, 0.0)


def _narrowed_offsets(rows: Rows, narrowing: FloatArray) -> FloatArray:
    """Offsets of rows that hold feet above their columns, with narrower columns ``(M,)``.

    Args:
        rows: from :func:`gaitopt.planners.time_optimal.build.build_route`, perhaps narrowed before.
        narrowing: what to take off the radius at each knot ``(K,)`` [m].
    """
    # A row is (r^2 - |f - c|^2) / (2 R) with the column's radius R and the row's radius r. It is
    # largest for a foot f at the column's centre c, where it is r^2 / (2 R).
    linear, square = rows.linear[:, FOOT], rows.square[:, FOOT]
    full = -1.0 / square[:, 0]
    centre_part = (linear[:, :2] ** 2).sum(axis=1) * full / 2.0
    old = np.sqrt(2.0 * full * np.maximum(rows.offset + centre_part, 0.0))
    new = np.maximum(old - narrowing[rows.knot], np.minimum(old, LEAST_RADIUS_SHARE * full))
    return np.asarray(new**2 / (2.0 * full) - centre_part)
