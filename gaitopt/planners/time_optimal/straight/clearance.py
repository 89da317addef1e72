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
FLIGHTS_AT_ONCE = 64
"""Most flights of a leg that are looked at in one go, for the sake of memory."""
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
    flights, values = Flights.of(knots), dense.values
    lowest, low_outside = np.full(len(knots.step), np.inf), np.zeros(len(knots.step))
    legs = knots.leg[flights.lift_off]
    for leg in range(len(LEGS)):
        of_leg = np.flatnonzero(legs == leg)
        for first in range(0, len(of_leg), FLIGHTS_AT_ONCE):
            some = of_leg[first : first + FLIGHTS_AT_ONCE]
            chosen = Flights(flights.lift_off[some], flights.touchdown[some],
                             flights.footholds[some])  # fmt: skip
            intervals, heights = _some_heights(route, LEGS[leg], chosen, values, dense.at_knots)
            lowest[intervals], low_outside[intervals] = heights
    return FlightHeights(lowest, low_outside)


def _some_heights(
    route: Route, leg: str, flights: Flights, values: FloatArray, at_knots: np.ndarray
) -> tuple[np.ndarray, FlightHeights]:
    """The intervals of some flights of a leg ``(n,)``, and the heights on them.

    Args:
        route: the walk.
        leg: that flies.
        flights: its flights.
        values, at_knots: of the dense path.
    """
    intervals, flight = _numbers(flights.lift_off, flights.touchdown)
    pieces, interval = _numbers(at_knots[intervals], at_knots[intervals + 1])
    foot = _foot_places(route, leg, values[pieces], values[pieces + 1])
    of_piece = flight[interval]
    foot[..., 2] -= flights.higher_foothold[of_piece, None]
    centres = np.repeat(flights.footholds[of_piece, :, :2], CHORDS, axis=0)
    start, end = foot[:, :-1].reshape(-1, 3), foot[:, 1:].reshape(-1, 3)
    radius = route.footholds.landing_radius
    first_chord = CHORDS * np.searchsorted(interval, np.arange(len(intervals)))
    lowest = np.minimum.reduceat(_lowest_outside(start, end, centres, radius), first_chord)
    wanted = route.settings.clearance + RESERVE_KEPT * route.settings.clearance_reserve
    distance = np.linalg.norm(start[:, None, :2] - centres, axis=2).min(axis=1) - radius
    low = np.where(start[:, 2] < wanted, distance, 0.0)
    return intervals, FlightHeights(lowest, np.maximum.reduceat(low, first_chord))


def _numbers(first: np.ndarray, last: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Whole numbers from each ``first`` up to, not including, ``last``; and of which pair each is.

    Args:
        first, last: ``(n,)``, each first one below its last one.
    """
    count = last - first
    which = np.repeat(np.arange(len(count)), count)
    before = np.cumsum(count) - count
    return np.arange(len(which)) - before[which] + first[which], which


def _foot_places(route: Route, leg: str, start: FloatArray, end: FloatArray) -> FloatArray:
    """Places of a foot along some pieces of a dense path, in the heading frame [m].

    Args:
        route: the walk.
        leg: the foot's leg.
        start, end: columns of the path at both ends of the pieces ``(n, 6 + nj)``.

    Returns:
        ``(n, CHORDS + 1, 3)``. Between two of these places the foot leaves their chord by less than
        a micrometre.
    """
    robot = route.robot
    columns = [*range(6), *(6 + c for c in robot.leg_columns[leg])]
    start, end = start[:, columns], end[:, columns]
    share = np.linspace(0.0, 1.0, CHORDS + 1)[:, None]
    fine = start[:, None] + (end - start)[:, None] * share
    fine[:, -1] = end
    fine = fine.reshape(-1, len(columns))
    local = robot.legs[leg].forward(fine[:, 6:])
    turned = rpy_to_matrix(fine[:, 3:6]) @ robot.body_axes
    world = fine[:, :3] + np.einsum("nij,nj->ni", turned, local)
    places = world @ rotation_z(-route.settings.heading).T
    return np.asarray(places.reshape(len(start), CHORDS + 1, 3))


def _lowest_outside(
    start: FloatArray, end: FloatArray, centres: FloatArray, radius: float
) -> FloatArray:
    """Least height of each of some chords outside two discs, as seen from above ``(n,)`` [m].

    On a chord the height is least at an end, or where the chord leaves or enters a disc. Infinite
    for a chord that lies within the discs.

    Args:
        start, end: of the chords ``(n, 3)`` [m].
        centres: of each chord's discs ``(n, 2, 2)`` [m].
        radius: of the discs [m].
    """
    out = np.full(len(start), np.inf)
    # Both ends of a chord within one disc: so is the chord.
    far = [((one[:, None, :2] - centres) ** 2).sum(axis=2) for one in (start, end)]
    cross = np.flatnonzero((np.maximum(*far) >= (radius - EDGE_ROUNDING) ** 2).all(axis=1))
    out[cross] = np.minimum(start[cross, 2], end[cross, 2])
    # And both so far outside that no chord reaches a disc: its lower end is the lowest place.
    length = np.linalg.norm(end[cross, :2] - start[cross, :2], axis=1)
    nearest = np.sqrt(np.minimum(*far)[cross].min(axis=1))
    near = cross[nearest - length <= radius]
    out[near] = _lowest_beside(start[near], end[near], centres[near], radius)
    return out


def _lowest_beside(
    start: FloatArray, end: FloatArray, centres: FloatArray, radius: float
) -> FloatArray:
    """The same as :func:`_lowest_outside` of chords that may cross the edges of their discs."""
    chord, from_centre = end - start, start[:, None, :2] - centres
    # |from_centre + s chord|^2 = radius^2 is a quadratic equation for the share s of the chord.
    a = (chord[:, :2] ** 2).sum(axis=1)[:, None]
    b = np.einsum("nci,ni->nc", from_centre, chord[:, :2])
    with np.errstate(divide="ignore", invalid="ignore"):
        root = np.sqrt(b**2 - a * ((from_centre**2).sum(axis=2) - radius**2))
        crossings = np.concatenate([(-b - root) / a, (-b + root) / a], axis=1)
    share = np.concatenate([np.zeros_like(a), np.ones_like(a), crossings], axis=1)
    on_chord = (share >= 0.0) & (share <= 1.0)
    place = start[:, None] + chord[:, None] * np.where(on_chord, share, 0.0)[..., None]
    distance = np.linalg.norm(place[:, :, None, :2] - centres[:, None], axis=3).min(axis=2)
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
