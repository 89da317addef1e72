"""Paths over obstacles: box, trapezoid and mixed parabola, and the curves flown through them."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from gaitopt.conventions import rotation_z
from gaitopt.errors import InputError, SolverError
from gaitopt.swing.clearance import CLEARANCE_TOLERANCE, clear_path, least_clearance
from gaitopt.swing.obstacle_paths import PATTERNS, Pattern, obstacle_path, path_lengths
from gaitopt.terrain.obstacles import (
    Obstacle,
    rectangular_obstacle,
    round_obstacle,
    triangular_obstacle,
)

BOARD = rectangular_obstacle(0.11, 0.04)
LOG = round_obstacle(0.11)
RIDGE = triangular_obstacle(0.11, 0.12)
SECTIONS = {"board": BOARD, "log": LOG, "ridge": RIDGE,
            "leaning ridge": triangular_obstacle(0.2, 0.1, apex=-0.08),
            "big log": round_obstacle(0.4)}  # fmt: skip
START, END = np.array([-0.2, 0.0, 0.0]), np.array([0.2, 0.0, 0.0])
MARGIN = 0.03

each_pattern = pytest.mark.parametrize("pattern", PATTERNS)
each_section = pytest.mark.parametrize("name", SECTIONS)


class Line:
    """Flown: a polyline through waypoints, each piece in one second."""

    def __init__(self, waypoints: Any) -> None:
        self.waypoints = np.asarray(waypoints, dtype=float)
        self.times = np.arange(len(self.waypoints), dtype=float)
        self.speeds = np.linalg.norm(np.diff(self.waypoints, axis=0), axis=1)

    def place(self, times: np.ndarray) -> np.ndarray:
        return np.column_stack([np.interp(times, self.times, c) for c in self.waypoints.T])


class Smooth:
    """Flown: a Cartesian cubic spline through waypoints, shifted by ``sag`` between its ends."""

    def __init__(self, waypoints: np.ndarray, sag: float = 0.0) -> None:
        from scipy.interpolate import CubicSpline

        dipped = waypoints.copy()
        dipped[1:-1, 2] -= sag
        self.times = np.arange(len(waypoints), dtype=float)
        self.curve = CubicSpline(self.times, dipped, bc_type="clamped")
        # The velocity lies within its Bernstein coefficients on each interval.
        c3, c2, c1, _ = self.curve.c
        bernstein = np.stack([c1, c1 + c2, c1 + 2 * c2 + 3 * c3])
        self.speeds = np.linalg.norm(np.abs(bernstein).max(axis=0), axis=-1)

    def place(self, times: np.ndarray) -> np.ndarray:
        return np.asarray(self.curve(times))


def from_polyline(points: np.ndarray, line: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Distance of each point from a polyline, and how far along it (in its pieces) that is."""
    start, side = line[:-1], np.diff(line, axis=0)
    along = ((points[:, None] - start) * side).sum(axis=-1) / (side**2).sum(axis=-1)
    along = np.clip(along, 0, 1)
    away = np.linalg.norm(points[:, None] - start - along[..., None] * side, axis=-1)
    piece = away.argmin(axis=1)
    every = np.arange(len(points))
    return away[every, piece], piece + along[every, piece]


# --- the path itself ----------------------------------------------------------------------------


@each_pattern
@each_section
@settings(max_examples=30)
@given(before=st.floats(0.0, 0.5), after=st.floats(0.0, 0.5), up=st.floats(-0.1, 0.5),
       down=st.floats(-0.1, 0.5), margin=st.floats(0.002, 0.1), back=st.booleans())  # fmt: skip
def test_path_keeps_the_margin_everywhere(
    name: str, pattern: Pattern, before: float, after: float, up: float, down: float,
    margin: float, back: bool,
) -> None:  # fmt: skip
    """By construction: ends anywhere beside the inflated section, at any heights, both ways."""
    obstacle = SECTIONS[name]
    low, high = obstacle.inflated(margin).extent
    ends = [np.array([low - before, 0.1, up]), np.array([high + after, -0.1, down])]
    start, end = ends[::-1] if back else ends
    path = obstacle_path(start, end, obstacle, margin, pattern=pattern, count=30)
    assert obstacle.distance(path.points(100)).min() > margin - 1e-9
    np.testing.assert_allclose(path.points()[[0, -1]], [start, end], rtol=0, atol=1e-12)


@each_pattern
@each_section
def test_waypoints_are_as_many_as_asked_for_and_on_the_path(name: str, pattern: Pattern) -> None:
    start, end = START * 2, END * 2
    for count in (11, 13, 14, 15, 40):
        path = obstacle_path(start, end, SECTIONS[name], MARGIN, pattern=pattern, count=count)
        assert path.waypoints.shape == (count, 3)
        np.testing.assert_allclose(path.waypoints[[0, -1]], [start, end], rtol=0, atol=1e-12)
        distance, place = from_polyline(path.waypoints, path.points(500))
        assert distance.max() < 1e-7
        assert (np.diff(place) > 0).all()  # in the order of flight


def test_papers_path_has_three_waypoints_at_each_of_two_corners() -> None:
    """13 in all: 2 ends, 6 at corners, 2 on each flank and 1 on the top."""
    path = obstacle_path(START, END, BOARD, MARGIN)
    x, _, z = path.waypoints.T
    np.testing.assert_allclose(x, -x[::-1], rtol=0, atol=1e-12)
    np.testing.assert_allclose(z, z[::-1], rtol=0, atol=1e-12)
    on_top = np.isclose(z, 0.14, rtol=0, atol=1e-12)
    assert x[on_top] == pytest.approx([-0.02, 0.0, 0.02], abs=1e-12)
    # The middle of a parabola: half-way between its tip and the middle of its chord.
    (corner,) = (c for c in path.controls if np.ptp(c[:, 2]) and c[2, 0] == pytest.approx(-0.02))
    middle = (corner[1] + (corner[0] + corner[2]) / 2) / 2
    assert np.linalg.norm(path.waypoints - middle, axis=1).min() < 1e-12
    assert BOARD.distance(corner[0]) == pytest.approx(MARGIN, abs=1e-12)
    assert BOARD.distance(corner[2]) == pytest.approx(MARGIN, abs=1e-12)
    assert MARGIN < BOARD.distance(middle) < 1.03 * MARGIN


@each_pattern
def test_straight_pieces_are_tangent_to_the_corners_of_the_parabola_only(pattern: Pattern) -> None:
    """What the paper blames the box for: its direction jumps."""
    points = obstacle_path(START, END, BOARD, MARGIN, pattern=pattern).points(4000)
    steps = np.diff(points, axis=0)
    steps /= np.linalg.norm(steps, axis=1, keepdims=True)
    turn = np.degrees(np.arccos(np.clip((steps[1:] * steps[:-1]).sum(axis=1), -1, 1))).max()
    assert turn < 0.1 if pattern == "parabola" else turn > 30


@each_section
def test_trapezoid_is_the_tightest_of_its_kind(name: str) -> None:
    """Each of its sides touches the inflated section."""
    path = obstacle_path(START * 3, END * 3, SECTIONS[name], MARGIN, pattern="trapezoid", count=20)
    distance = SECTIONS[name].distance(path.points(3000)) - MARGIN
    third = len(distance) // 3
    z = path.points(3000)[:, 2]
    top = np.isclose(z, z.max(), rtol=0, atol=1e-12)
    for side in (distance[: top.argmax()], distance[top], distance[~top][-third:]):
        assert side.min() < 1e-6


def test_parabola_is_outside_its_arc_and_no_cut_corner_is() -> None:
    """A parabola between the same tangents, but wider, would cut in: half an arc more to a side."""
    path = obstacle_path(START, END, LOG, MARGIN)
    (corner,) = (c for c in path.controls if np.ptp(np.diff(c, axis=0), axis=0).max() > 1e-9)
    s = np.linspace(0, 1, 500)[:, None]

    def curve(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> np.ndarray:
        return np.asarray((1 - s) ** 2 * a + 2 * s * (1 - s) * b + s**2 * c)

    assert (LOG.distance(curve(*corner)) - MARGIN).min() > -1e-12
    a, b, c = corner
    wider = curve(b + 1.5 * (a - b), b, b + 1.5 * (c - b))
    assert (LOG.distance(wider) - MARGIN).min() < -1e-3


def test_way_that_is_free_is_straight() -> None:
    path = obstacle_path(START + np.array([0, 0, 0.3]), END + np.array([0, 0, 0.2]), BOARD, MARGIN)
    assert path.length == pytest.approx(np.hypot(0.4, 0.1), rel=1e-12)
    np.testing.assert_allclose(np.diff(path.waypoints, 2, axis=0), 0, atol=1e-12)


@each_pattern
@each_section
def test_walking_back_is_the_same_path_reversed(name: str, pattern: Pattern) -> None:
    there = obstacle_path(START * 2, END * 3, SECTIONS[name], MARGIN, pattern=pattern, count=16)
    back = obstacle_path(END * 3, START * 2, SECTIONS[name], MARGIN, pattern=pattern, count=16)
    assert there.length == pytest.approx(back.length, rel=1e-12)
    np.testing.assert_allclose(there.points(9), back.points(9)[::-1], rtol=0, atol=1e-12)


@each_pattern
@given(yaw=st.floats(-4.0, 4.0), x=st.floats(-5.0, 5.0), y=st.floats(-5.0, 5.0))
def test_turned_and_moved_world_has_the_turned_and_moved_path(
    pattern: Pattern, yaw: float, x: float, y: float
) -> None:
    shift = np.array([x, y, 0.1])
    start, end = np.array([-0.25, 0.05, 0.02]), np.array([0.2, -0.1, 0.0])
    here = obstacle_path(start, end, BOARD, MARGIN, pattern=pattern)
    moved = rectangular_obstacle(0.11, 0.04, position=(x, y, 0.1), yaw=yaw)
    turn = rotation_z(yaw)
    there = obstacle_path(turn @ start + shift, turn @ end + shift, moved, MARGIN, pattern=pattern)
    np.testing.assert_allclose(there.waypoints, here.waypoints @ turn.T + shift, rtol=0, atol=1e-12)


@each_pattern
def test_oblique_swing_stays_in_the_upright_plane_through_its_ends(pattern: Pattern) -> None:
    start, end = np.array([-0.2, -0.3, 0.0]), np.array([0.3, 0.1, 0.05])
    path = obstacle_path(start, end, BOARD, MARGIN, pattern=pattern)
    along = (end - start)[:2] / np.linalg.norm((end - start)[:2])
    away = (path.points() - start)[:, :2] @ np.array([-along[1], along[0]])
    assert np.abs(away).max() < 1e-12
    assert BOARD.distance(path.points()).min() > MARGIN - 1e-9


def test_path_of_corners_alone_has_no_place_for_more_waypoints() -> None:
    """Half around a log, from the height of its axis: two quarter turns that share the top."""
    start, end = np.array([-0.085, 0, 0.055]), np.array([0.085, 0, 0.055])
    path = obstacle_path(start, end, LOG, MARGIN, count=5)
    assert path.waypoints[2] == pytest.approx([0, 0, 0.14], abs=1e-8)
    with pytest.raises(InputError, match=r"number from 5, .* to 5; got 13"):
        obstacle_path(start, end, LOG, MARGIN)


# --- lengths ------------------------------------------------------------------------------------


def thread_length(start: np.ndarray, radius: float, core: Any) -> float:
    """A taut thread from ``start`` over the left corner of a symmetric board to its middle."""
    corner = np.array(core)
    away = corner - start
    distance = float(np.hypot(*away))
    straight = math.sqrt(distance**2 - radius**2)
    slope = math.atan2(away[1], away[0]) + math.asin(radius / distance)
    return straight + radius * slope + abs(corner[0])


def test_lengths_for_the_papers_board() -> None:
    """Box 680 mm, trapezoid by its angle, mixed parabola least and just over the taut thread."""
    lengths = path_lengths(START, END, BOARD, MARGIN)
    assert tuple(lengths) == PATTERNS
    assert lengths["box"] == pytest.approx(0.40 + 2 * 0.14, rel=1e-12)
    slope = math.atan2(0.11, 0.18) + math.asin(0.03 / math.hypot(0.11, 0.18))
    flank, top = 0.14 / math.sin(slope), 2 * (0.20 - 0.14 / math.tan(slope))
    assert lengths["trapezoid"] == pytest.approx(2 * flank + top, rel=1e-12)
    thread = 2 * thread_length(START[[0, 2]], 0.03, (-0.02, 0.11))
    assert thread < lengths["parabola"] < thread * 1.0001
    assert lengths["box"] > 1.3 * lengths["trapezoid"] > 1.3 * lengths["parabola"]


@each_pattern
@each_section
def test_length_is_that_of_a_fine_polyline(name: str, pattern: Pattern) -> None:
    path = obstacle_path(START * 2, END * 2, SECTIONS[name], MARGIN, pattern=pattern, count=20)
    steps = np.linalg.norm(np.diff(path.points(2000), axis=0), axis=1)
    assert path.length == pytest.approx(steps.sum(), rel=1e-7)


@each_section
@settings(max_examples=30)
@given(before=st.floats(0.0, 0.6), after=st.floats(0.0, 0.6), margin=st.floats(0.005, 0.08))
def test_patterns_come_in_the_order_of_their_lengths(
    name: str, before: float, after: float, margin: float
) -> None:
    """From level ground the mixed parabola is never longer than the trapezoid, nor that than
    the box; by a thousandth where a parabola is longer than the arc that the trapezoid touches."""
    low, high = SECTIONS[name].inflated(margin).extent
    ends = np.array([[low - before, 0, 0], [high + after, 0, 0]])
    lengths = path_lengths(*ends, SECTIONS[name], margin)
    assert lengths["parabola"] <= lengths["trapezoid"] * 1.001
    assert lengths["trapezoid"] <= lengths["box"] * (1 + 1e-12)


# --- the curve that is flown --------------------------------------------------------------------


@given(x=st.floats(-0.3, 0.3), height=st.floats(0.0, 1.0), slope=st.floats(-1.0, 1.0))
def test_clearance_of_a_straight_flight_over_a_log(x: float, height: float, slope: float) -> None:
    """By the distance of a point from a line."""
    away = np.array([1.0, slope]) / math.hypot(1, slope)
    ends = np.array([x, 0.1 + height]) + np.array([[-2.0], [2.0]]) * away
    flown = Line(np.column_stack([ends[:, 0], [0, 0], ends[:, 1]]))
    log = round_obstacle(0.2)
    true = abs(np.array([x, height]) @ np.array([-away[1], away[0]])) - 0.1
    found = least_clearance(flown, log)
    assert found.proven <= true + 1e-12 and true <= found.seen + 1e-12
    assert found.seen - found.proven <= CLEARANCE_TOLERANCE * (1 + 1e-9)
    at = flown.place(np.array([found.time]))
    assert log.distance(at)[0] == pytest.approx(found.seen, abs=1e-12)


def test_dip_between_samples_is_not_missed() -> None:
    """A thousandth of a second long, in a flight of a hundred."""
    knots = [[-1, 0, 0.5], [0, 0, 0.5], [0, 0, 0.2], [0, 0, 0.5], [1, 0, 0.5]]
    flown = Line(knots)
    flown.times = np.array([0.0, 61.803, 61.8035, 61.804, 100.0])
    flown.speeds = flown.speeds / np.diff(flown.times)
    found = least_clearance(flown, BOARD)
    assert found.proven <= 0.09 <= found.seen <= 0.09 + CLEARANCE_TOLERANCE
    assert found.time == pytest.approx(61.8035, abs=1e-4)


def test_curve_that_is_not_finite_is_refused() -> None:
    flown = Line([[-1, 0, 1], [1, 0, np.nan]])
    flown.speeds = np.ones(1)
    with pytest.raises(SolverError, match="clearance of a flown curve was not found"):
        least_clearance(flown, BOARD)


def flight(sag: float) -> Callable[[np.ndarray], Smooth]:
    return lambda waypoints: Smooth(waypoints, sag)


@each_pattern
@each_section
@pytest.mark.parametrize("sag", [0.0, 0.004])
def test_flown_curve_clears_where_its_first_try_did_not(
    name: str, pattern: Pattern, sag: float
) -> None:
    obstacle, (start, end) = SECTIONS[name], (START * 2, END * 2)
    first = flight(sag)(
        obstacle_path(start, end, obstacle, MARGIN, pattern=pattern, count=16).waypoints
    )
    path, flown, clearance = clear_path(
        flight(sag), start, end, obstacle, MARGIN, pattern=pattern, count=16
    )
    grid = np.linspace(0, flown.times[-1], 50_001)
    before = np.linspace(0, first.times[-1], 50_001)
    if sag:
        assert obstacle.distance(first.place(before)).min() < MARGIN
    least = obstacle.distance(flown.place(grid)).min() - MARGIN
    assert 0.0 <= clearance.proven <= least + 1e-9
    assert clearance.seen <= least + 1e-6
    assert path.margin >= MARGIN + sag / 3


def test_little_room_is_made_up_for_by_more_waypoints() -> None:
    """The ends stand 2 mm beyond the margin; the flight sags by 40 mm over its waypoints."""

    def sagging(waypoints: np.ndarray) -> Smooth:
        return Smooth(waypoints, 0.04 / len(waypoints))

    start, end = np.array([-0.052, 0, 0]), np.array([0.052, 0, 0])
    few = obstacle_path(start, end, BOARD, MARGIN, pattern="box", count=8).waypoints
    assert least_clearance(sagging(few), BOARD.inflated(MARGIN)).seen < -0.002
    path, _, clearance = clear_path(sagging, start, end, BOARD, MARGIN, pattern="box", count=8)
    assert len(path.waypoints) > 8 and clearance.proven >= 0
    assert path.margin <= MARGIN + 0.002


def test_flight_that_cannot_clear_is_an_error_with_its_depth() -> None:
    def straight(waypoints: np.ndarray) -> Line:
        return Line(waypoints[[0, -1]])

    with pytest.raises(SolverError) as caught:
        up = np.array([0, 0, 0.05])
        clear_path(straight, START + up, END + up, BOARD, MARGIN)
    assert str(caught.value).startswith(
        "the curve flown over the obstacle comes up to 0.05 m into its margin of 0.03 m at 0.5 s, "
        "after 8 attempts"
    )


# --- refusals -----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"pattern": "hop"}, "pattern 'hop' is unknown; there are box, trapezoid, parabola"),
        ({"pattern": None}, "pattern None is unknown"),
        ({"count": 7}, "count must be a whole number from 8, for the corners and ends of this "
                       "parabola path, to 1000; got 7"),
        ({"count": 13.0}, "count must be a whole number from 8"),
        ({"count": 1001}, "count must be a whole number from 8"),
        ({"margin": 0.0}, "margin must be a positive length in metres, got 0.0"),
        ({"margin": math.nan}, "margin must be a positive length"),
        ({"margin": "wide"}, "margin must be a positive length"),
        ({"start": [0.0, 0.0]}, "start and end must be three finite numbers"),
        ({"end": [math.inf, 0.0, 0.0]}, "start and end must be three finite numbers"),
        ({"start": ["-0.2", "0", "0"]}, "start and end must be three finite numbers"),
        ({"end": np.ma.masked_equal([0.2, 0.0, 1.0], 1.0)}, "start and end must be three finite"),
        ({"start": [-0.04, 0.0, 0.0]}, "start and end are 0.02 and 0.18 m beside the obstacle's "
                                       "core, and need 0.03 m"),
        ({"end": [-0.3, 0.0, 0.0]}, "on opposite sides of it"),
    ],
)  # fmt: skip
def test_bad_swing_is_refused(change: dict[str, Any], words: str) -> None:
    arguments: dict[str, Any] = {"start": START, "end": END, "margin": MARGIN, **change}
    with pytest.raises(InputError) as caught:
        obstacle_path(arguments.pop("start"), arguments.pop("end"), BOARD, **arguments)
    assert words in str(caught.value)


def test_ends_on_the_margin_are_refused_for_flight_only() -> None:
    start, end = np.array([-0.05, 0, 0]), np.array([0.05, 0, 0])
    assert obstacle_path(start, end, BOARD, MARGIN).length > 0.3
    with pytest.raises(InputError, match=r"stand .* beyond the margin of 0.03 m .* need 0.0001 m"):
        clear_path(flight(0.0), start, end, BOARD, MARGIN)


def test_paths_are_read_only() -> None:
    path = obstacle_path(START, END, BOARD, MARGIN)
    for array in (path.waypoints, path.controls):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0.0


@given(seed=st.integers(0, 10_000))
def test_any_convex_core_is_cleared(seed: int) -> None:
    """Random triangles and rectangles, random ends: no pattern ever cuts in."""
    rng = np.random.default_rng(seed)
    corners = rng.uniform(-0.2, 0.2, (3, 2))
    a, b = corners[1] - corners[0], corners[2] - corners[0]
    turn = a[0] * b[1] - a[1] * b[0]
    assume(abs(turn) > 1e-3)
    core = corners if turn > 0 else corners[::-1]
    obstacle = Obstacle("triangular", tuple(map(tuple, core.tolist())), 0.0, length=10.0)
    margin = rng.uniform(0.005, 0.1)
    low, high = obstacle.inflated(margin).extent
    start = np.array([low - rng.uniform(0, 0.3), rng.uniform(-1, 1), rng.uniform(-0.4, 0.4)])
    end = np.array([high + rng.uniform(0, 0.3), rng.uniform(-1, 1), rng.uniform(-0.4, 0.4)])
    for pattern in PATTERNS:
        path = obstacle_path(start, end, obstacle, margin, pattern=pattern, count=30)
        assert obstacle.distance(path.points(50)).min() > margin - 1e-9
