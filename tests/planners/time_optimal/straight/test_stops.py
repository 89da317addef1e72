"""Lines from rest to rest: the fastest passage by hand, and boxes with bounded accelerations."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import gaitopt
from gaitopt import Footholds, Quadruped
from gaitopt.plan.settings.freedoms import ROWS
from gaitopt.plan.settings.time_optimal import RouteSettings
from gaitopt.planners.time_optimal.build import knots_of, problem_of
from gaitopt.planners.time_optimal.planner import plan_route
from gaitopt.planners.time_optimal.straight.stops import GRID, fastest_passage, straight_lines
from gaitopt.planners.time_optimal.walk import prepared


@pytest.fixture(scope="module")
def short() -> Footholds:
    """Two cycles, eight steps."""
    return gaitopt.s_columns(3, columns=3)


def duration(squares: np.ndarray, grid: np.ndarray) -> float:
    """Time of a passage with constant accelerations from place to place."""
    speed = np.sqrt(squares)
    return float((2.0 * np.diff(grid) / (speed[1:] + speed[:-1])).sum())


@settings(max_examples=10)
@given(st.floats(0.1, 3.0), st.floats(0.2, 2.0), st.floats(0.5, 10.0))
def test_a_straight_joint_goes_by_the_trapezoid(way: float, rate: float, limit: float) -> None:
    """Time of a move from rest to rest: way / v + v / a, or 2 sqrt(way / a) below full speed."""
    grid = (1.0 - np.cos(np.pi * np.linspace(0.0, 1.0, 101))) / 2.0
    slope = np.full((101, 1, 1), way)
    squares = fastest_passage(slope, np.zeros_like(slope), grid, np.array([rate]), limit)[:, 0]
    full = way >= rate**2 / limit
    known = way / rate + rate / limit if full else 2.0 * np.sqrt(way / limit)
    assert duration(squares, grid) == pytest.approx(known, rel=3e-2)
    assert duration(squares, grid) >= known * (1 - 1e-6)


def test_bent_ways_keep_their_limits() -> None:
    """Two joints along a circle: velocity and acceleration at every place, and both are used."""
    grid = (1.0 - np.cos(np.pi * np.linspace(0.0, 1.0, 201))) / 2.0
    angle = np.pi * grid[:, None, None]
    slope = np.pi * np.concatenate([-np.sin(angle), np.cos(angle)], axis=2)
    bend = -(np.pi**2) * np.concatenate([np.cos(angle), np.sin(angle)], axis=2)
    rates, limit = np.array([1.0, 1.0]), 2.0
    squares = fastest_passage(slope, bend, grid, rates, limit)
    pull = np.diff(squares, axis=0) / (2.0 * np.diff(grid)[:, None])
    assert squares[0] == squares[-1] == 0.0
    use = np.abs(slope) * np.sqrt(squares)[..., None]
    starts = slope[:-1] * pull[..., None] + bend[:-1] * squares[:-1, :, None]
    ends = slope[1:] * pull[..., None] + bend[1:] * squares[1:, :, None]
    assert use.max() <= 1.0 + 1e-9
    assert max(np.abs(starts).max(), np.abs(ends).max()) <= limit * (1 + 1e-6)
    # At every place a joint is at its limit of velocity or acceleration, or the limit changes.
    busy = np.maximum(
        use[:-1].max(axis=2), np.maximum(np.abs(starts), np.abs(ends)).max(axis=2) / 2.0
    )
    assert busy.min() > 0.95 and np.median(busy) > 0.999


def test_lines_end_where_directions_change(wang: Quadruped, short: Footholds) -> None:
    """A still body and a box: three lines of the foot for every step, and one of the body's."""
    route = prepared(wang, short, RouteSettings(free=ROWS["route"], stance_knots=2), None)
    poses = problem_of(route, 0, 8).poses
    knots = knots_of(route, 0, 8)
    lines = straight_lines(knots, poses)
    # The body may stay where it is.
    moves = np.abs(np.diff(poses[knots.ends[::2], :2], axis=0)).max(axis=1) > 1e-9
    counts = np.column_stack([moves, np.full(8, 3)]).ravel()
    assert moves.any()
    assert np.array_equal(lines.after[knots.ends], [0, *np.cumsum(counts)])


@pytest.mark.parametrize("row", ["route", "overlap"])
def test_a_box_with_bounded_accelerations_is_certified(
    wang: Quadruped, short: Footholds, row: str
) -> None:
    """It costs time, the less the higher the limit, and stops at the corners."""
    free = plan_route(wang, short, free=row)
    plans = [plan_route(wang, short, free=row, acceleration_limit=a) for a in (500.0, 6.0)]
    for plan in plans:
        gaitopt.verify(plan).raise_for_violations()
        assert plan.path.jumps(1).max() < 1e-6
    assert free.duration < plans[0].duration < plans[1].duration < 1.25 * free.duration
    bends = np.abs(plans[1].path.evaluate(np.linspace(0, plans[1].duration, 20001), 2)[:, 6:])
    assert 5.7 < bends.max() <= 6.0 * (1 + 1e-9)


def test_the_stops_of_a_box(wang: Quadruped, short: Footholds) -> None:
    """With a still body every swing takes off, turns twice and lands at rest: four rests."""
    plan = plan_route(wang, short, free="route", acceleration_limit=6.0)
    for swing in plan.swings:
        times = np.linspace(swing.start, swing.end, 4001)
        speed = np.abs(plan.path.evaluate(times, 1)).max(axis=1)
        rests = np.flatnonzero((speed < 2e-2) & (np.gradient(speed) ** 2 < 1.0))
        groups = 1 + int((np.diff(times[rests]) > 0.05).sum())
        assert groups == 4
    assert GRID[0] == 0.0 and GRID[-1] == 1.0


def test_without_steps_body_and_time_stand_still(wang: Quadruped) -> None:
    plan = plan_route(wang, gaitopt.s_columns(0, columns=1), free="route", acceleration_limit=6.0)
    assert plan.duration == 0.0
