"""Continuous walks whose body tilts and turns, as footholds with postures ask for."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import gaitopt
from gaitopt import LEGS, Footholds, Plan
from gaitopt.gait.crawl import WANG_SEQUENCE
from gaitopt.optimize.route.legs import FOOT, ORIENTATION
from gaitopt.plan.record import RouteRecord
from gaitopt.plan.settings.time_optimal import RouteSettings
from gaitopt.planners.time_optimal.continuous import planner
from gaitopt.planners.time_optimal.continuous.asked import Asked
from gaitopt.planners.time_optimal.continuous.body import reach_discs
from gaitopt.planners.time_optimal.continuous.swings import with_flights
from gaitopt.planners.time_optimal.smooth.clearance import lowest_heights
from gaitopt.planners.time_optimal.smooth.motion import SplineMotion
from gaitopt.planners.time_optimal.walk import Route, prepare_route

GO2 = gaitopt.load_robot("go2")
HEADING = 0.4


@cache
def tilted(heading: float = HEADING) -> Footholds:
    """Level columns, and a body that rolls and pitches to and fro above them."""
    level = gaitopt.s_columns(0, columns=2, robot=GO2)
    c, s = np.cos(heading), np.sin(heading)
    turn = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    order = WANG_SEQUENCE
    count = level.steps + 1
    postures = np.zeros((count, 4))
    postures[:, 0] = level.array[..., 2].mean() + GO2.standing_height
    postures[:, 1] = 0.08 * np.sin(np.arange(count))
    postures[:, 2] = -0.15 + 0.05 * np.cos(np.arange(count))
    postures[:, 3] = heading
    return Footholds(
        {leg: level[leg] @ turn for leg in LEGS}, level.radius, order=order, postures=postures
    )


@cache
def route() -> Route:
    settings = RouteSettings.for_robot(GO2, free="dynamic", heading=HEADING, body_height=0.3)
    settings = settings.with_order_of(tilted(), False)
    return prepare_route(GO2, tilted(), settings)


@cache
def motion() -> SplineMotion:
    return planner._first_motion(route(), 1.0)


def test_at_rest_the_zero_moment_point_is_below_the_centre_of_mass() -> None:
    """What gravity asks for has no moment about the centre of mass, however the body is turned."""
    assert np.abs(motion().poses[:, ORIENTATION]).max() > 0.1
    asked = Asked.of(route(), motion())
    assert asked is not None
    assert asked.force[:, :, 2] == pytest.approx(
        np.broadcast_to([0.0, 0.0, 1.0], (len(asked.force), 3)), abs=1e-9
    )
    centres = motion().centres_of_mass[:, [0, -1]].reshape(-1, 2)
    assert asked.moment[:, :, 2] == pytest.approx(centres, abs=1e-9)


def test_at_the_edge_of_its_disc_a_knee_is_as_straight_as_it_may_be() -> None:
    """By the inverse kinematics of all knots, with the body moved until a foot is at the edge."""
    moved, discs = motion(), reach_discs(route(), motion())
    feet = moved.knots.feet_at_knots(moved.poses[:, FOOT])
    knots = len(moved.poses) - 1
    angle = np.linspace(0.0, 6.0, knots)
    around = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    for leg in range(len(LEGS)):
        own = slice(leg * knots, (leg + 1) * knots)
        poses = moved.poses[1:].copy()
        poses[:, :2] = discs.centre[own] + around * discs.radius[own, None]
        joints = moved.legs.joints(poses, feet[1:], np.zeros((knots, len(LEGS))))
        knees = joints[:, leg, 2]
        assert np.ptp(knees) < 1e-9
        assert knees[0] == pytest.approx(moved.legs.high[leg, 2], abs=0.02)


def test_flights_that_go_straight_up_keep_any_clearance_beside_narrow_footholds() -> None:
    """No other spline is at its top 1 mm beside the foothold."""
    lifts = route().steps.lifts
    settings = replace(route().settings, clearance=float(lifts.min()), clearance_reserve=0.0)
    for upright in (False, True):
        flown = with_flights(motion(), settings, lifts, 1e-3, upright=upright)
        lowest = lowest_heights(flown, 1e-3).min()
        assert (lowest >= settings.clearance - 1e-9) == upright


@cache
def crawl() -> Plan:
    return gaitopt.plan_crawl(GO2, tilted(), heading=HEADING)


@pytest.mark.parametrize("free", ["swing", "dynamic"])
def test_the_body_goes_through_the_postures_while_it_moves_on(free: str) -> None:
    plan = gaitopt.plan_route(GO2, tilted(), free=free, heading=HEADING)
    assert isinstance(plan.record, RouteRecord) and plan.record.instead is None
    gaitopt.verify(plan, collisions=False).raise_for_violations()
    assert crawl().duration / plan.duration > 1.2
    wanted = tilted().postures
    assert wanted is not None
    for swing, posture in zip(plan.swings, wanted[1:], strict=True):
        middle = plan.path.evaluate([(swing.start + swing.end) / 2.0])[0]
        assert middle[3:6] == pytest.approx(posture[1:], abs=0.01)
