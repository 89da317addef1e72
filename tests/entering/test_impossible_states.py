"""States from which no plan begins: the error names the limit, by how much, and when."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import gaitopt
from gaitopt import LEGS, InputError, Plan, State, plan_crawl
from gaitopt.errors import InfeasibleStateError


def changed(state: State, **fields: Any) -> State:
    given = {"q": state.q, "v": state.v, "support": state.support,
             "joint_names": state.joint_names}  # fmt: skip
    return State(**{**given, **fields})


def standing(plan: Plan) -> State:
    return State.standing(plan.robot, np.array([plan.footholds[leg][0] for leg in LEGS]))


def test_a_joint_that_is_too_fast(a1_walk: Plan) -> None:
    time = (a1_walk.swings[0].start + a1_walk.swings[0].end) / 2.0
    state = a1_walk.state(time)
    joint = int(a1_walk.robot.leg_columns[a1_walk.swings[0].leg][2])
    v = np.array(state.v)
    v[6 + joint] = 1.5 * a1_walk.robot.velocity_limits[joint]
    with pytest.raises(InfeasibleStateError, match=r"1\.5 times its limit") as caught:
        plan_crawl(a1_walk.robot, a1_walk.footholds_ahead(time), start=changed(state, v=v))
    assert caught.value.limit == f"joint velocity {a1_walk.robot.joint_names[joint]}"
    assert caught.value.value == pytest.approx(1.5 * caught.value.allowed)
    assert caught.value.time == 0.0


def test_a_joint_beyond_its_limit(a1_walk: Plan) -> None:
    state = standing(a1_walk)
    joint = int(a1_walk.robot.leg_columns["RF"][2])
    q = np.array(state.q)
    q[7 + joint] = a1_walk.robot.position_limits[0][joint] - 0.2
    with pytest.raises(InfeasibleStateError, match=r"0\.2 rad beyond its limit") as caught:
        plan_crawl(a1_walk.robot, a1_walk.footholds, start=changed(state, q=q))
    assert caught.value.limit == f"joint position {a1_walk.robot.joint_names[joint]}"


def test_a_foot_that_is_not_on_the_ground(a1_walk: Plan) -> None:
    feet = np.array([a1_walk.footholds[leg][0] for leg in LEGS])
    feet[2, 2] += 0.03
    with pytest.raises(InfeasibleStateError, match=r"foot RH stands 30\.0 mm above") as caught:
        plan_crawl(a1_walk.robot, a1_walk.footholds, start=State.standing(a1_walk.robot, feet))
    assert caught.value.limit == "contact RH"


def test_a_foot_that_slides(a1_walk: Plan) -> None:
    state = standing(a1_walk)
    v = np.array(state.v)
    v[0] = 0.3
    with pytest.raises(InfeasibleStateError, match=r"stands, and moves at 0\.300 m/s"):
        plan_crawl(a1_walk.robot, a1_walk.footholds, start=changed(state, v=v))


def moving(plan: Plan, speed: float) -> State:
    """The standing robot whose body moves ahead above its feet."""
    from gaitopt.robots.whole_body_rates import base_twist, joint_rates

    state, robot = standing(plan), plan.robot
    twist = base_twist(state.columns[3:6], [speed, 0.0, 0.0], np.zeros(3))
    rates = joint_rates(robot, state.columns[3:6], state.q[7:], twist, np.zeros((4, 3)))
    return changed(state, v=np.concatenate([twist, rates]))


def test_a_body_too_fast_to_be_stopped(a1_walk: Plan) -> None:
    """The feet end 0.2 m ahead of the body: what moves at 1.2 m/s at 0.25 m falls over them."""
    slow = plan_crawl(a1_walk.robot, a1_walk.footholds, start=moving(a1_walk, 0.2))
    assert slow.begins_moving
    with pytest.raises(InfeasibleStateError, match="no way to rest on four feet") as caught:
        plan_crawl(a1_walk.robot, a1_walk.footholds, start=moving(a1_walk, 1.4))
    kinds = ("normal force", "friction", "torque", "joint", "reach", "balance")
    assert caught.value.limit.startswith(kinds)
    assert np.isfinite(caught.value.value)


def test_a_body_beside_its_feet(a1_walk: Plan) -> None:
    """No forces hold a robot at rest whose centre of mass is outside its support."""
    feet = np.array([a1_walk.footholds[leg][0] for leg in LEGS])
    state = standing(a1_walk)
    place = state.q[:3] + np.array([0.0, 0.16, -0.02])
    joints = gaitopt.joints_from_feet(a1_walk.robot, place, state.columns[3:6], feet)
    beside = State.of(a1_walk.robot, place, state.columns[3:6], joints)
    with pytest.raises(InfeasibleStateError, match="outside the polygon of the feet") as caught:
        plan_crawl(a1_walk.robot, a1_walk.footholds, start=beside)
    centre = gaitopt.plan.com_margin.true_com(a1_walk.robot, beside.q[None])
    outside = -gaitopt.static_stability_margin(feet, centre[0])
    assert caught.value.value == pytest.approx(-outside, abs=1e-9)
    assert caught.value.limit == "support margin" and caught.value.time == 0.0


def test_the_state_of_another_robot(a1_walk: Plan, wang: Any) -> None:
    with pytest.raises(InputError, match="state of a robot with the joints"):
        plan_crawl(a1_walk.robot, a1_walk.footholds, start=State.standing(wang))
    with pytest.raises(InputError, match="start must be a State"):
        plan_crawl(a1_walk.robot, a1_walk.footholds, start="here")  # type: ignore[arg-type]


def test_a_knee_on_the_other_side(a1_walk: Plan) -> None:
    state = standing(a1_walk)
    columns = list(a1_walk.robot.leg_columns["LF"])
    leg = a1_walk.robot.legs["LF"]
    q = np.array(state.q)
    low, high = a1_walk.robot.position_limits
    # Mirror the knee about the line from shoulder to foot: the foot stays where it is.
    thigh, knee = q[7:][columns[1:]]
    foot = leg.forward(q[7:][columns])
    for offset in np.linspace(-3.0, 3.0, 601):
        other = np.array([q[7:][columns[0]], thigh + offset, -knee])
        if np.linalg.norm(leg.forward(other) - foot) < 2e-3:
            break
    q[7:][columns] = other
    beyond = ((q[7:] < low - 1e-6) | (q[7:] > high + 1e-6)).any()
    words = "beyond its limit" if beyond else "bent to the other side"
    with pytest.raises(InfeasibleStateError, match=words):
        plan_crawl(a1_walk.robot, a1_walk.footholds, start=changed(state, q=q))


def test_joints_that_may_not_turn_faster_so_soon(wang_walk: Plan, a1_walk: Plan) -> None:
    """An acceleration limit holds from the first instant on, or the state is refused."""
    time = 0.45 * wang_walk.duration
    goes_on = gaitopt.plan_route(
        wang_walk.robot, wang_walk.footholds_ahead(time), start=wang_walk.state(time),
        acceleration_limit=5.0,
    )  # fmt: skip
    assert goes_on.entry > 0
    assert gaitopt.verify(goes_on, collisions=False).ok
    time = 0.45 * a1_walk.duration
    ahead, state = a1_walk.footholds_ahead(time), a1_walk.state(time)
    advice = r"joint acceleration .* raise acceleration_limit, or stop with gaitopt\.plan_stand_up"
    with pytest.raises(InfeasibleStateError, match=advice) as caught:
        gaitopt.plan_route(a1_walk.robot, ahead, start=state, acceleration_limit=5.0)
    assert caught.value.allowed == 5.0
    assert caught.value.value > 5.0
    # The advice, followed: stop without that limit, and begin there.
    stop = gaitopt.plan_stand_up(a1_walk.robot, state, ahead)
    rests = stop.state(stop.duration)
    begun = gaitopt.plan_route(a1_walk.robot, ahead, start=rests, acceleration_limit=5.0)
    assert not begun.begins_moving
