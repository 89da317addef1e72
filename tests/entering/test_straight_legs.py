"""How straight legs become on the way from a state."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import gaitopt
from gaitopt import LEGS, Plan
from gaitopt.entering.braking import Braking
from gaitopt.entering.joint_limits import bent_knees


@pytest.mark.parametrize("name", ["a1", "hyq", "wang2020"])
def test_at_the_limit_a_leg_has_the_share_of_its_reach(name: str) -> None:
    robot = gaitopt.load_robot(name)
    joints = gaitopt.State.standing(robot).q[7:]
    usual, bent = robot.position_limits, bent_knees(robot, 0.95, joints)
    for leg_name in LEGS:
        leg, columns = robot.legs[leg_name], list(robot.leg_columns[leg_name])
        narrower = np.flatnonzero(usual[:, columns[-1]] != bent[:, columns[-1]])
        assert len(narrower) == 1, "one end of the knee's range"
        knee = bent[narrower[0], columns[-1]]
        # The leg hangs down: the distance from the hip is that of the foot below it.
        at = np.linalg.norm(_length(leg, joints[columns], knee))
        assert at == pytest.approx(0.95 * leg.reach, abs=1e-9)


def _length(leg: gaitopt.Leg, angles: np.ndarray, knee: float) -> np.ndarray:
    """From the pitch axis to the foot, with a knee's angle."""
    points = leg.joint_points(np.array([*angles[:-1], knee]))
    return np.asarray(points[3] - points[1])


def test_a_leg_that_is_straighter_at_the_begin_may_stay_so() -> None:
    robot = gaitopt.load_robot("a1")
    tall = gaitopt.State.standing(robot, height=0.985 * robot.legs["LF"].reach).q[7:]
    low, high = bent_knees(robot, 0.9, tall)
    assert (low <= tall + 1e-12).all() and (tall <= high + 1e-12).all()
    assert np.array_equal(bent_knees(robot, 1.0, tall), robot.position_limits)


def test_a_body_that_sinks_while_it_brakes_moves_as_its_derivatives_say() -> None:
    base = np.array([[0.1, 0.0, 0.3, 0.0, 0.0, 0.2], [0.2, 0.1, -0.05, 0.0, 0.1, 0.0]])
    body, small = Braking(base, 0.4, 3, 0.1, sinks=0.02), 1e-6
    times = np.array([0.03, 0.13, 0.2, 0.37, 0.45])
    before, now, after = (body.at(times + step) for step in (-small, 0.0, small))
    for order in range(2):
        slope = (after[order] - before[order]) / (2.0 * small)
        assert now[order + 1] == pytest.approx(slope, abs=1e-6)
    ends = body.at(np.array([0.0, body.duration]))
    assert ends[0][0] == pytest.approx(base[0]) and ends[1][0] == pytest.approx(base[1])
    still = replace(body, sinks=0.0).at(np.array([body.duration]))
    assert ends[0][1] == pytest.approx(still[0][0] - np.eye(6)[2] * 0.02)
    assert np.abs(ends[1][1]).max() == 0.0


@pytest.mark.slow
def test_a_stride_from_a_state_keeps_its_reach_fraction(a1_walk: Plan) -> None:
    """At this instant of a stride a hind leg was 0.46 mm too straight while the body braked."""
    robot, obstacle = a1_walk.robot, gaitopt.rectangular_obstacle(0.02, 0.02)
    first = gaitopt.plan_stride(robot, obstacle, leave=0)
    again = gaitopt.plan_stride(robot, obstacle, leave=0, start=first.state(1.7082035816385612))
    found = gaitopt.verify(again)
    assert found.outcome == "certified", found.violations


def test_a_leg_that_becomes_too_straight_on_the_way_is_found(a1_walk: Plan) -> None:
    plan = replace(a1_walk, settings=replace(a1_walk.settings, reach_fraction=0.7))
    assert "reach" in [found.name for found in gaitopt.verify(plan).violations]
