"""Gaits that begin in a state, and robots that stand up or stop from any: on two feet as well."""

from __future__ import annotations

import numpy as np
import pytest
from continuing import assert_certified, assert_continues

import gaitopt
from gaitopt import LEGS, ForceLimits, InputError, Plan, State, plan_gait, plan_stand_up
from gaitopt.errors import InfeasibleStateError
from gaitopt.plan.com_margin import true_com
from gaitopt.robots.whole_body_rates import base_twist, joint_rates


@pytest.fixture(scope="session")
def trotting() -> Plan:
    robot = gaitopt.load_robot("a1")
    return plan_gait(robot, gaitopt.trot(0.5), velocity=0.4, duration=0.3)


def on_two_feet(plan: Plan, share: float) -> float:
    """An instant of the third swing."""
    swing = plan.swings[4]
    return swing.start + share * swing.duration


@pytest.mark.parametrize("share", [0.3, 0.8])
def test_a_trot_stops_on_four_feet(trotting: Plan, share: float) -> None:
    """On two feet the robot falls about their line; the feet in the air come down in time."""
    state = trotting.state(on_two_feet(trotting, share))
    assert len(state.support) == 2 and np.linalg.norm(state.v[:2]) > 0.2
    plan = plan_stand_up(trotting.robot, state)
    assert_continues(plan, state)
    assert_certified(plan)
    assert plan.entry == len(plan.phases) and not plan.phases[-1].flying
    # Level, above the middle of the feet, at the standing height.
    feet = np.array([plan.footholds[leg][0] for leg in LEGS])
    end = plan.at([plan.duration])
    wanted = feet.mean(axis=0) + np.array([0.0, 0.0, trotting.robot.standing_height])
    assert np.allclose(end.cog[0], wanted, atol=1e-9)
    assert np.allclose(end.feet[0], feet, atol=1e-5)


def test_a_trot_goes_on_from_a_trot(trotting: Plan) -> None:
    state = trotting.state(on_two_feet(trotting, 0.8))
    plan = plan_gait(trotting.robot, gaitopt.trot(0.5), velocity=0.3, duration=0.2, start=state)
    assert_continues(plan, state)
    assert_certified(plan)
    feet = trotting.at([on_two_feet(trotting, 0.8)]).feet[0]
    for leg in state.support:
        assert np.allclose(plan.footholds[leg][0], feet[LEGS.index(leg)], atol=1e-9)


def test_a_gait_goes_in_the_direction_that_the_body_faces() -> None:
    robot = gaitopt.load_robot("a1")
    state = State.standing(robot, heading=1.0)
    plan = plan_gait(robot, gaitopt.trot(0.5), velocity=0.2, duration=0.2, start=state)
    assert_continues(plan, state)
    ends = plan.at([0.0, plan.duration]).cog
    assert np.arctan2(*(ends[1] - ends[0])[1::-1]) == pytest.approx(1.0, abs=0.02)


@pytest.mark.parametrize("name", ["a1", "anymal_c", "wang2020"])
def test_robots_stand_up_from_half_their_height(name: str) -> None:
    robot = gaitopt.load_robot(name)
    low = State.standing(robot, height=0.6 * robot.standing_height, heading=0.2)
    plan = plan_stand_up(robot, low)
    assert_continues(plan, low)
    assert_certified(plan)
    rise = plan.at([plan.duration]).cog[0, 2] - plan.at([0.0]).cog[0, 2]
    assert rise == pytest.approx(0.4 * robot.standing_height, abs=1e-6)
    back = plan_stand_up(
        robot, plan.state(plan.duration), height=0.6 * robot.standing_height, heading=0.2
    )
    assert_certified(back)
    assert np.allclose(back.path.evaluate([back.duration]), low.columns, atol=1e-6)


def test_too_weak_joints_do_not_lift_the_body() -> None:
    robot = gaitopt.load_robot("wang2020")
    low = State.standing(robot, height=0.5 * robot.standing_height)
    with pytest.raises(InfeasibleStateError, match="torque") as caught:
        plan_stand_up(robot, low, forces=ForceLimits(torque_share=0.2))
    assert "torque" in caught.value.limit and caught.value.value > 0.0


def test_a_robot_in_free_flight_is_refused() -> None:
    robot = gaitopt.load_robot("a1")
    state = State.standing(robot)
    flying = State(state.q + np.eye(len(state.q))[2], state.v, (), robot.joint_names)
    with pytest.raises(InfeasibleStateError, match="stands on 0 feet"):
        plan_stand_up(robot, flying)


def test_what_is_no_state_or_robot_is_refused() -> None:
    robot = gaitopt.load_robot("a1")
    with pytest.raises(InputError, match="state must be a State"):
        plan_stand_up(robot, "low")  # type: ignore[arg-type]
    with pytest.raises(InputError, match="start must be a State"):
        plan_gait(robot, gaitopt.trot(0.5), velocity=0.2, duration=0.2, start=1)  # type: ignore[arg-type]
    with pytest.raises(InputError, match="height must be a number"):
        plan_stand_up(robot, State.standing(robot), height=-1.0)


def test_a_body_beside_its_feet_that_moves_over_them_is_caught() -> None:
    """At rest it would fall over; at this speed a pendulum of its height comes back."""
    robot = gaitopt.load_robot("a1")
    standing = State.standing(robot)
    feet = gaitopt.feet_from_joints(
        robot, standing.q[:3], standing.columns[3:6], standing.q[7:]
    ) * [0.4, 1.0, 1.0]
    place = standing.q[:3] + np.array([0.1, 0.0, 0.0])
    joints = gaitopt.joints_from_feet(robot, place, np.zeros(3), feet)
    twist = base_twist(np.zeros(3), [-0.4, 0.0, 0.0], np.zeros(3))
    rates = joint_rates(robot, np.zeros(3), joints, twist, np.zeros((4, 3)))
    states = [
        State.of(robot, place, np.zeros(3), joints, linear=[speed, 0.0, 0.0], rates=share * rates)
        for speed, share in ((0.0, 0.0), (-0.4, 1.0))
    ]
    outside = -gaitopt.static_stability_margin(feet, true_com(robot, states[0].q[None])[0])
    assert outside > 0.005
    with pytest.raises(InfeasibleStateError, match="outside the polygon of the feet"):
        plan_stand_up(robot, states[0])
    plan = plan_stand_up(robot, states[1])
    assert_continues(plan, states[1])
    assert_certified(plan)
    assert plan.margin == pytest.approx(-outside, abs=1e-6)
