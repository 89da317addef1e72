"""Feet that land beside their footholds, so that a body on two feet does not fall over."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

import gaitopt
from gaitopt import Plan
from gaitopt.control.build import build_reference
from gaitopt.control.gains import ControlGains
from gaitopt.control.reference import Reference
from gaitopt.control.stepping import SETTLED, Stepping, landing_shift
from gaitopt.conventions import GRAVITY

DT = 0.006
LARGEST = 0.01


@pytest.fixture(scope="module")
def pace() -> Plan:
    """A pace of go1 that begins and ends at rest."""
    return gaitopt.plan_gait(
        gaitopt.load_robot("go1"), gaitopt.pace(0.4), velocity=0.2, distance=0.2, ramp=0.3
    )


@pytest.fixture(scope="module")
def reference(pace: Plan) -> Reference:
    return build_reference(pace, ControlGains.for_plan(pace), DT)


def test_an_error_is_gone_after_the_step() -> None:
    """The inverted pendulum about a line that was moved, in closed form."""
    rate, lasts, error = 6.0, 0.2, 0.01
    line = landing_shift(error, rate, lasts)
    assert line > error
    assert line + (error - line) * np.exp(rate * lasts) == pytest.approx(0.0, abs=1e-15)


def test_only_paces_move_their_footholds(pace: Plan, a1_walk: Plan) -> None:
    assert ControlGains.for_plan(pace).foothold_shift == 0.5 * pace.footholds.landing_radius == 0.01
    assert ControlGains.for_plan(a1_walk).foothold_shift == 0.0
    assert ControlGains.for_plan(pace, foothold_shift=0.0).foothold_shift == 0.0


def step_begin(reference: Reference) -> int:
    """The tick with which a step on the feet of one side begins, in the middle of the pace."""
    two = (reference.standing.sum(axis=1) == 2) & (reference.standing[:, 0] == 1)
    begins = np.flatnonzero(np.diff(two.astype(int)) > 0) + 1
    return int(begins[len(begins) // 2])


def moved(pace: Plan, reference: Reference, tick: int, by: float) -> tuple[np.ndarray, np.ndarray]:
    """The plan's state, with feet and body as they are but for the body's speed to the left."""
    motion = pace.at([(tick - reference.lead + 0.5) * DT])
    q, v = np.array(motion.q[0]), np.array(motion.v[0])
    v[:3] += reference.rotation[tick].T @ np.array([0.0, by, 0.0])
    return q, v


def landing(pace: Plan, reference: Reference, tick: int, speed: float) -> np.ndarray:
    """Where the feet will be beside the reference ``(4, 3)``, were the error always the same."""
    stepping = Stepping(pace.robot, reference, LARGEST)
    for _ in range(50):
        found = stepping.shifts(tick, *moved(pace, reference, tick, speed))
    return found


@pytest.mark.parametrize("speed", [0.004, -0.004])
def test_feet_land_where_the_error_will_be_gone(
    pace: Plan, reference: Reference, speed: float
) -> None:
    tick = step_begin(reference)
    standing = reference.standing[tick]
    found = landing(pace, reference, tick, speed)
    assert (found[standing] == 0.0).all()
    # The plan's feet do not roll, and those of the reference do.
    found = (found - landing(pace, reference, tick, 0.0))[~standing]
    motion = pace.at([(tick - reference.lead) * DT])
    com = pin.centerOfMass(pace.robot.model, pace.robot.model.createData(), motion.q[0])
    height = float(com[2] - motion.feet[0, standing, 2].mean()) + pace.robot.foot_radius
    rate = float(np.sqrt(GRAVITY / height))
    wanted = landing_shift(speed / rate * np.exp(rate * 0.2), rate, 0.2)
    assert 0.002 < abs(wanted) < 0.8 * LARGEST
    assert found[:, 1] == pytest.approx(wanted, rel=0.05)
    assert np.abs(found[:, [0, 2]]).max() < 0.05 * abs(wanted)


def test_no_foot_lands_farther_away_than_it_may(pace: Plan, reference: Reference) -> None:
    found = landing(pace, reference, step_begin(reference), 0.1)
    assert np.linalg.norm(found, axis=1).max() == pytest.approx(LARGEST, rel=1e-3)


def test_just_before_a_landing_nothing_is_changed(pace: Plan, reference: Reference) -> None:
    tick, stepping = step_begin(reference), Stepping(pace.robot, reference, LARGEST)
    late = tick + round((0.2 - 0.5 * SETTLED) / DT)
    assert (reference.standing[late] == reference.standing[tick]).all()
    assert (stepping.shifts(late, *moved(pace, reference, late, 0.1)) == 0.0).all()


def test_with_no_distance_feet_stay_in_their_places(pace: Plan, reference: Reference) -> None:
    tick, stepping = step_begin(reference), Stepping(pace.robot, reference, 0.0)
    assert (stepping.shifts(tick, *moved(pace, reference, tick, 0.1)) == 0.0).all()


def test_a_pace_is_followed_in_physics_and_falls_without_it(pace: Plan) -> None:
    result = gaitopt.simulate(pace)
    assert result.passed and np.degrees(result.tilt) < 2.5
    assert result.landing_error < pace.footholds.landing_radius
    falls = gaitopt.simulate(pace, gains=ControlGains.for_plan(pace, foothold_shift=0.0))
    assert not falls.passed and falls.status == "fell"
