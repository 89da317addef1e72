"""The knots of a walk, and parts of them."""

from __future__ import annotations

import numpy as np
import pytest

from gaitopt import Footholds, Quadruped
from gaitopt.plan.settings.freedoms import VARIANTS
from gaitopt.plan.settings.time_optimal import RouteSettings
from gaitopt.planners.time_optimal.knots import RouteKnots, route_knots
from gaitopt.planners.time_optimal.walk import Route, prepare_route

STANCE, SWING = 3, 8


@pytest.fixture(scope="module")
def route(wang: Quadruped, short: Footholds) -> Route:
    settings = RouteSettings(
        free=VARIANTS["swing"], stance_knots=STANCE, swing_knots=SWING, timing="velocity"
    )
    return prepare_route(wang, short, settings)


@pytest.fixture(scope="module")
def knots(route: Route) -> RouteKnots:
    return route_knots(route.steps, STANCE, SWING)


def test_a_foot_stands_at_lift_off_and_touchdown_and_is_in_the_air_between(
    route: Route, knots: RouteKnots
) -> None:
    for step, (lift_off, touchdown) in enumerate(knots.flights.tolist()):
        leg = int(route.steps.indices[step])
        assert knots.feet[lift_off, leg] == pytest.approx(route.steps.feet[step, leg])
        assert knots.feet[touchdown, leg] == pytest.approx(route.steps.targets[step])
        assert touchdown - lift_off == SWING
        in_air = knots.in_air[lift_off : touchdown + 1]
        assert not in_air[[0, -1]].any()
        assert (in_air[1:-1] == np.eye(4)[leg]).all()


def test_intervals_belong_to_the_phase_between_their_knots(knots: RouteKnots) -> None:
    assert np.bincount(knots.step).tolist() == [STANCE + SWING] * 8
    for lift_off, touchdown in knots.flights.tolist():
        assert not knots.is_swing[lift_off - STANCE : lift_off].any()
        assert knots.is_swing[lift_off:touchdown].all()


def test_a_foot_flies_on_the_spans_from_lift_off_to_touchdown(knots: RouteKnots) -> None:
    flying = knots.flying_on_spans
    spans = np.zeros(len(knots.feet), dtype=bool)
    for lift_off, touchdown in knots.flights.tolist():
        spans[lift_off : touchdown + 1] = True
        assert (flying.leg[lift_off : touchdown + 1] == knots.leg[lift_off]).all()
    assert np.array_equal(flying.flies, spans)
    assert (flying.stands.sum(axis=1) == np.where(spans, 3, 4)).all()


def test_the_ground_is_the_mean_height_of_standing_feet(knots: RouteKnots) -> None:
    flying = knots.flying_on_spans
    for k in (0, STANCE, STANCE + 1, len(knots.feet) - 1):
        feet = [i for i in range(4) if not (flying.flies[k] and i == flying.leg[k])]
        assert knots.ground_on_spans[k] == pytest.approx(knots.feet[k, feet, 2].mean())


@pytest.mark.parametrize(("first", "last"), [(0, 44), (9, 33), (11, 55), (20, 66), (31, 88)])
def test_parts_of_a_walk_know_which_foot_flies(knots: RouteKnots, first: int, last: int) -> None:
    """Cut anywhere within or between swings, every span has the leg of the whole."""
    whole, part = knots.flying_on_spans, knots.between(first, last).flying_on_spans
    assert np.array_equal(part.flies, whole.flies[first : last + 1])
    assert np.array_equal(part.leg[part.flies], whole.leg[first : last + 1][part.flies])


def test_a_window_of_a_route_has_its_steps_and_knots(route: Route, knots: RouteKnots) -> None:
    window = route.window(2, 5)
    part = route_knots(window.steps, STANCE, SWING)
    inside = slice(2 * route.intervals, 5 * route.intervals + 1)
    assert window.count == 3 and window.first_step == 2
    assert np.array_equal(part.feet, knots.feet[inside])
    assert np.array_equal(part.in_air, knots.in_air[inside])
    assert np.array_equal(window.cogs, route.cogs[2:6])
    assert window.window(1, 2).first_step == 3
