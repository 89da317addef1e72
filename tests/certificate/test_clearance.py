"""The clearance of free swings: what the certificate says of good plans and planted faults."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

import gaitopt
from gaitopt import LEGS, Footholds, MotionPath, Plan, Quadruped, Swing
from gaitopt.certificate.clearance import lowest_outside
from gaitopt.certificate.verify import verify
from gaitopt.plan.settings.time_optimal import RouteSettings
from gaitopt.planners.time_optimal.planner import plan_route


@pytest.fixture(scope="module")
def columns() -> Footholds:
    return gaitopt.s_columns(3, columns=3)


@pytest.fixture(scope="module")
def walk(wang: Quadruped, columns: Footholds) -> Plan:
    return plan_route(wang, columns, free="swing", timing="velocity")


def test_a_good_walk_keeps_it(walk: Plan) -> None:
    check = verify(walk, collisions=False)["swing clearance"]
    assert check.status == "ok"
    assert 0.02 <= check.worst < 0.021 and check.bound < 1e-4


def test_a_larger_clearance_than_was_flown_is_found(walk: Plan) -> None:
    assert isinstance(walk.settings, RouteSettings)
    more = dataclasses.replace(walk, settings=dataclasses.replace(walk.settings, clearance=0.09))
    check = verify(more, collisions=False)["swing clearance"]
    assert check.status == "violated" and check.worst < 0.0701


def test_a_foot_that_dips_on_its_way_is_found(walk: Plan) -> None:
    """A millimetre lower between two knots, once, at the lowest knot away from the columns."""
    motion = walk.at(walk.path.times)
    radius = walk.footholds.radius
    assert radius is not None
    lowest, knot, flown = np.inf, 0, ""
    for swing in walk.swings:
        ends = np.stack([swing.foot_start, swing.foot_end])
        foot = motion.feet[:, LEGS.index(swing.leg)]
        away = np.linalg.norm(foot[:, None, :2] - ends[:, :2], axis=2).min(axis=1)
        high = foot[:, 2] - ends[:, 2].max()
        far = (motion.t > swing.start) & (motion.t < swing.end) & (away > radius + 1e-3)
        k = int(np.argmin(np.where(far, high, np.inf)))
        if far[k] and high[k] < lowest:
            lowest, knot, flown = float(high[k]), k, swing.leg
    by = lowest - 0.019
    assert 0.001 < by < 0.01
    values = walk.path.knots().copy()
    # The whole body goes down with it, so that the leg's angles may stay.
    values[knot, 2] -= by
    dipped = dataclasses.replace(walk, path=MotionPath.polyline(walk.path.times, values))
    check = verify(dipped, collisions=False)["swing clearance"]
    assert check.status == "violated" and check.where == flown
    assert check.worst == pytest.approx(0.019, abs=2e-4)
    assert check.when == pytest.approx(float(walk.path.times[knot]), abs=0.05)


Array = NDArray[np.float64]


def height_and_distance(plan: Plan, swing: Swing, times: Array) -> tuple[Array, Array]:
    """The foot's height over its higher foothold, and its distance from the nearer one [m]."""
    foot = plan.at(times).feet[:, LEGS.index(swing.leg)]
    ends = np.stack([swing.foot_start, swing.foot_end])
    away = np.linalg.norm(foot[:, None, :2] - ends[:, :2], axis=2).min(axis=1)
    return foot[:, 2] - ends[:, 2].max(), away


def dipping(plan: Plan, swing: Swing, start: float, end: float, depth: float) -> Plan:
    """The plan with a flying foot that dips by ``depth`` [m] and is back within one piece."""
    times = np.unique(np.concatenate([plan.path.times, [start, end]]))
    old = np.searchsorted(plan.path.times, times[:-1], side="right") - 1
    slopes, values = plan.path.coefficients[:, old]
    values = values + slopes * (times[:-1] - plan.path.times[old])[:, None]
    bend = np.zeros_like(values)
    piece, half = int(np.searchsorted(times, start)), (end - start) / 2.0
    assert times[piece + 1] == end
    leg, columns = plan.robot.legs[swing.leg], list(plan.robot.leg_columns[swing.leg])
    angles = plan.at([start + half]).q[0, 7:][columns]
    turn = np.linalg.solve(leg.jacobian(angles), [0.0, 0.0, -depth])
    joints = [6 + c for c in columns]
    # turn (1 - ((t - half) / half)^2)
    bend[piece, joints] = -turn / half**2
    slopes = slopes.copy()
    slopes[piece, joints] += 2.0 * turn / half
    path = MotionPath(times, np.stack([bend, slopes, values]))
    return dataclasses.replace(plan, path=path)


def test_a_foot_that_dips_while_it_crosses_the_edge_between_two_samples_is_found(
    walk: Plan,
) -> None:
    """30 um within less than a millisecond, where the foot leaves the radius of its column."""
    radius, swing = walk.footholds.landing_radius, walk.swings[2]
    times = np.linspace(swing.start, swing.start + swing.duration / 2.0, 100_001)
    crossing = float(times[np.argmax(height_and_distance(walk, swing, times)[1] > radius)])
    half = 4e-4
    assert np.abs(walk.path.times - crossing).min() > half
    dipped = dipping(walk, swing, crossing - half, crossing + half, 3e-5)
    fine = np.linspace(crossing - half, crossing + half, 20_001)
    high, away = height_and_distance(dipped, swing, fine)
    least = float(high[away > radius].min())
    ends = height_and_distance(dipped, swing, fine[[0, -1]])[0]
    assert least < ends[1] - 1e-5
    asked = dataclasses.replace(walk.settings, clearance=least + 2e-6)
    check = verify(dataclasses.replace(dipped, settings=asked), collisions=False)["swing clearance"]
    assert check.status == "violated" and check.worst <= least


def test_a_chord_counts_from_where_it_leaves_the_columns() -> None:
    """Two columns of 20 mm, 100 mm apart; a foot rises by as much as it goes ahead."""
    centres = np.array([[0.0, 0.0], [0.1, 0.0]])

    def lowest(start: list[float], end: list[float], deviation: float = 0.0) -> float:
        foot = np.array([[start], [end]])
        return float(lowest_outside(foot, np.array([deviation]), centres, 0.02)[0])

    assert lowest([0.0, 0.0, 0.0], [0.01, 0.0, 0.01]) == np.inf
    assert lowest([0.0, 0.0, 0.0], [0.05, 0.0, 0.05]) == pytest.approx(0.02)
    assert lowest([0.0, 0.0, 0.0], [0.05, 0.0, 0.05], 1e-3) == pytest.approx(0.019 - 1e-3)
    assert lowest([0.05, 0.0, 0.05], [0.1, 0.0, 0.0]) == pytest.approx(0.02)
    assert lowest([0.0, 0.0, 0.0], [0.1, 0.0, 0.1]) == pytest.approx(0.02)
    assert lowest([-0.05, 0.0, -0.05], [0.1, 0.0, 0.1]) == pytest.approx(-0.05)
    assert lowest([0.05, 0.0, 0.3], [0.05, 0.0, 0.1]) == pytest.approx(0.1)
    assert lowest([0.01, 0.0, 0.3], [0.01, 0.0, 0.1]) == np.inf


@given(st.integers(0, 10_000))
def test_no_place_outside_the_columns_is_lower_than_the_bound(seed: int) -> None:
    """Random parabolas, which leave their chords by an eighth of their second derivative."""
    rng = np.random.default_rng(seed)
    centres, radius = rng.uniform(-0.05, 0.05, (2, 2)), rng.uniform(0.01, 0.05)
    start, end = rng.uniform(-0.08, 0.08, (2, 3))
    second = rng.normal(size=3) * rng.choice([0.0, 1e-3, 0.1])
    share = np.linspace(0.0, 1.0, 2001)[:, None]
    curve = start + (end - start) * share - second * share * (1.0 - share) / 2.0
    away = np.linalg.norm(curve[:, None, :2] - centres, axis=2).min(axis=1)
    seen = curve[away > radius, 2].min(initial=np.inf)
    deviation = np.array([np.linalg.norm(second) / 8.0])
    bound = lowest_outside(np.stack([start, end])[:, None], deviation, centres, radius)[0]
    assert bound <= seen
    if deviation[0] == 0.0 and np.isfinite(seen):
        assert bound >= seen - 1e-3


def test_walks_that_promise_none_are_held_against_the_columns(
    wang: Quadruped, columns: Footholds
) -> None:
    """A box carries the foot at its whole height over all that lies between level columns."""
    for plan in (
        gaitopt.plan_crawl(wang, columns, timing="velocity"),
        plan_route(wang, columns, free="overlap", timing="velocity"),
    ):
        check = verify(plan, collisions=False)["swing clearance"]
        assert check.status == "ok"
        assert check.limit == 0.0
        assert check.worst == pytest.approx(plan.settings.swing_height, abs=5e-4)


def test_on_open_ground_nothing_says_how_high_it_is(wang: Quadruped, columns: Footholds) -> None:
    plan = gaitopt.plan_crawl(wang, Footholds(columns.points), timing="velocity")
    assert "swing clearance" not in {c.name for c in verify(plan, collisions=False)}
