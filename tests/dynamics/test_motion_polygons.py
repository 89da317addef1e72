"""Polygons of path accelerations and squared speeds, against programs in all contact forces."""

from __future__ import annotations

import numpy as np
import pytest
from body_moves import COUNT, INTERVALS, Array, Move, has_forces, move
from numpy.typing import NDArray

from gaitopt import ForceLimits
from gaitopt.dynamics.chains.interval_programs import path_units
from gaitopt.dynamics.motion_polygons import MotionPolygons
from gaitopt.dynamics.place_tables import used

LIMITS = ForceLimits()


@pytest.fixture(scope="module", params=["a1", "anymal_c"])
def given(request: pytest.FixtureRequest) -> Move:
    return move(str(request.param), 0.08)


def at_rest(given: Move) -> MotionPolygons:
    robot, dynamics, timing = given
    units = path_units(robot, dynamics, INTERVALS, timing)
    return MotionPolygons.at_rest(robot, dynamics, INTERVALS, LIMITS, timing, units)


def some_points(polygons: MotionPolygons, count: int) -> tuple[NDArray[np.int_], Array]:
    rng = np.random.default_rng(0)
    places = rng.integers(0, len(polygons.resting), count)
    reach = 1.0 / np.abs(polygons.sides[places, :, 0]).max(axis=1)
    return places, np.column_stack([
        rng.uniform(-1.2, 1.2, count) * reach, rng.uniform(0.0, 60.0, count)
    ])  # fmt: skip


def test_neighbours_share_their_places(given: Move) -> None:
    places = at_rest(given).places
    assert len(places.samples) == COUNT + 1
    assert np.array_equal(places.begin[1:], places.end[:-1])


def test_sides_at_rest_bound_accelerations_at_rest(given: Move) -> None:
    polygons = at_rest(given)
    assert polygons.resting.all()
    for place in range(0, COUNT + 1, 3):
        unit = polygons.places.units[place]
        for side in polygons.sides[place][used(polygons.sides)[place]]:
            u = unit / side[0]
            assert has_forces(given, LIMITS, place, 0.999 * u, 0.0)
            assert not has_forces(given, LIMITS, place, 1.001 * u, 0.0)


def test_points_are_inside_where_forces_exist(given: Move) -> None:
    polygons = at_rest(given)
    places, points = some_points(polygons, 60)
    _, state = polygons.refined(places, points)
    assert (state >= 0).all() and 5 < (state == 1).sum() < 50
    for place, point, inside in zip(places, points, state == 1, strict=True):
        u, x = polygons.places.units[place] * point
        assert has_forces(given, LIMITS, int(place), float(u), float(x)) == inside


def test_what_was_learnt_answers_the_next_question(given: Move) -> None:
    """Sides leave out all points that were outside, and none that was inside."""
    places, points = some_points(at_rest(given), 60)
    polygons, state = at_rest(given).refined(places, points)
    use = (polygons.sides[places] @ points[..., None])[..., 0].max(axis=1)
    assert (use[state == 1] <= 1.0 + 1e-5).all() and (use[state == 0] > 1.0).all()
    again, same = polygons.refined(places, points)
    assert np.array_equal(same, state)
    assert again.sides.shape[1] >= polygons.sides.shape[1]
