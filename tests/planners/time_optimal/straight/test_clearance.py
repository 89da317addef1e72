"""Rows that make up for feet that are too low between the knots of a straight walk."""

from __future__ import annotations

import numpy as np
import pytest

from gaitopt import Footholds, Quadruped
from gaitopt.optimize.route.legs import FOOT
from gaitopt.plan.settings.freedoms import VARIANTS
from gaitopt.plan.settings.time_optimal import RouteSettings
from gaitopt.planners.time_optimal.build import build_route
from gaitopt.planners.time_optimal.flights import FOOT_HEIGHT, height_rows
from gaitopt.planners.time_optimal.straight.clearance import (
    NARROWING,
    FlightHeights,
    clearance_is_kept,
    with_stricter_clearance,
)
from gaitopt.planners.time_optimal.walk import prepare_route

SETTINGS = RouteSettings(free=VARIANTS["swing"], timing="velocity")
WANTED = SETTINGS.clearance + SETTINGS.clearance_reserve


def test_half_of_the_reserve_is_enough() -> None:
    for lowest, kept in ((SETTINGS.clearance, False), (WANTED - 0.4 * 5e-4, True)):
        heights = FlightHeights(np.array([np.inf, lowest]), np.zeros(2))
        assert clearance_is_kept(heights, SETTINGS) == kept


def test_a_foot_that_is_low_in_the_middle_raises_the_rows_beside(
    wang: Quadruped, short: Footholds
) -> None:
    knots, problem = build_route(prepare_route(wang, short, SETTINGS))
    interval = int(knots.flights[2, 0]) + 3
    lowest = np.full(len(knots.step), np.inf)
    lowest[interval] = WANTED - 0.002
    rows = with_stricter_clearance(
        problem.rows, knots, FlightHeights(lowest, np.zeros(len(lowest))), SETTINGS
    )
    changed = rows.offset - problem.rows.offset
    height = height_rows(rows)
    raised = height[np.abs(changed[height]) > 1e-6]
    assert rows.knot[raised].tolist() == [interval, interval + 1]
    assert changed[raised] == pytest.approx(-0.002)


def test_a_foot_that_leaves_its_column_low_is_held_nearer_to_its_axis(
    wang: Quadruped, short: Footholds
) -> None:
    """The row's value is zero at a radius that is smaller by twice what the foot was outside."""
    knots, problem = build_route(prepare_route(wang, short, SETTINGS))
    lift_off = int(knots.flights[2, 0])
    lowest, outside = np.full(len(knots.step), np.inf), np.zeros(len(knots.step))
    lowest[lift_off], outside[lift_off] = 0.001, 0.003
    rows = with_stricter_clearance(problem.rows, knots, FlightHeights(lowest, outside), SETTINGS)
    at = np.flatnonzero((rows.knot == lift_off + 1) & (rows.square[:, FOOT.start] < 0.0))
    poses = problem.poses.copy()
    centre = knots.feet[lift_off, knots.leg[lift_off]]
    radius = short.landing_radius - NARROWING * 0.003
    for distance, kept in ((radius - 1e-4, True), (radius + 1e-4, False)):
        poses[lift_off + 1, FOOT] = centre + np.array([distance, 0.0, 0.05])
        assert (rows.chosen(at).values(poses) > 0.0).all() == kept
    height = height_rows(rows)
    assert rows.offset[height] == pytest.approx(problem.rows.offset[height])
    assert rows.linear[height, FOOT_HEIGHT] == pytest.approx(1.0)
