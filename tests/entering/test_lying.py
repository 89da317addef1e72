"""Robots that lie or sit, and states that are a little beyond what plans may begin in."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import gaitopt
from benchmarks.physics.lying import played, sunk, world_of
from gaitopt import LEGS, Footholds, HeightMap, Plan, State
from gaitopt.conventions import GRAVITY
from gaitopt.entering.standing_up import footholds_of
from gaitopt.errors import InfeasibleStateError
from gaitopt.motion.bounds import largest_sizes
from gaitopt.motion.path import MotionPath
from gaitopt.robots.whole_body import feet_from_joints


@pytest.fixture(scope="module")
def lying_a1() -> tuple[Any, Any, State, Footholds]:
    """a1 after it was switched off, on the floor of MuJoCo: its knees are beyond their limits."""
    pytest.importorskip("mujoco")
    robot = gaitopt.load_robot("a1")
    data, sim = world_of(robot)
    return (data, sim, *sunk(robot, data, sim))


@pytest.fixture(scope="module")
def lying_plan() -> Plan:
    """anymal_c rises from its belly, over a map of the floor."""
    pytest.importorskip("mujoco")
    robot = gaitopt.load_robot("anymal_c")
    data, sim = world_of(robot)
    state, _ = sunk(robot, data, sim)
    feet = footholds_of(robot, state)
    level = float(np.mean([feet[leg][0, 2] for leg in LEGS])) - robot.foot_radius
    floor = HeightMap(np.full((41, 41), level), 0.05, (-1.0, -1.0))
    return gaitopt.plan_stand_up(robot, state, feet.with_(ground=floor))


def feet_of(state: State, robot: gaitopt.Quadruped) -> np.ndarray:
    return np.asarray(feet_from_joints(robot, state.q[:3], state.columns[3:6], state.q[7:]))


def test_a_robot_that_was_switched_off_stands_up(lying_a1: Any) -> None:
    """From where it really lies, by position servos that know nothing of the trunk's contact."""
    data, sim, state, ground = lying_a1
    robot = gaitopt.load_robot("a1")
    with pytest.raises(InfeasibleStateError, match=r"beyond its limit.*nearest_state"):
        gaitopt.plan_stand_up(robot, state)
    near = gaitopt.nearest_state(robot, state, ground)
    plan = gaitopt.plan_stand_up(robot, near.state)
    assert gaitopt.verify(plan).outcome == "certified"
    assert played(plan, data, sim).stands
    assert gaitopt.simulate(plan).passed


def test_the_nearest_state_keeps_limits_and_feet(lying_a1: Any) -> None:
    _, _, state, _ = lying_a1
    robot = gaitopt.load_robot("a1")
    near = gaitopt.nearest_state(robot, state)
    low, high = robot.position_limits
    assert ((near.state.q[7:] >= low) & (near.state.q[7:] <= high)).all()
    assert feet_of(near.state, robot) == pytest.approx(feet_of(state, robot), abs=1e-9)
    assert near.state.q[:3] - state.q[:3] == pytest.approx(near.body, abs=1e-12)
    assert near.state.q[7:] - state.q[7:] == pytest.approx(near.joints, abs=1e-9)
    beyond = np.maximum(low - state.q[7:], state.q[7:] - high).max()
    assert beyond < np.abs(near.joints).max() < beyond + 0.02
    assert any("beyond its limit" in words for words in near.changes)
    # Half of the way is not enough, and straight up is farther.
    turned = (near.turn**2 + (np.linalg.norm(near.body) / robot.standing_height) ** 2) ** 0.5
    for rise in np.linspace(0.0, turned * robot.standing_height, 8):
        place = state.q[:3] + np.array([0.0, 0.0, rise])
        joints, reached = gaitopt.joints_from_feet(
            robot, place, state.columns[3:6], feet_of(state, robot), on_unreachable="mask"
        )
        assert not reached.all() or (np.maximum(low - joints, joints - high) > -1e-3).any()


def test_a_feasible_state_stays(a1_route: Plan) -> None:
    """That of a plan in motion, with a foot in the air: to the last digit."""
    state = a1_route.state(0.4 * a1_route.duration)
    near = gaitopt.nearest_state(a1_route.robot, state)
    assert near.changes == () and near.turn == pytest.approx(0.0, abs=1e-7)
    assert (near.state.q == state.q).all() and near.state.support == state.support
    assert near.state.v == pytest.approx(state.v, abs=1e-5)


def test_feet_that_are_estimated_beside_the_ground(a1_walk: Plan) -> None:
    """A little above or below they stand, farther above they fly; those that slide rest."""
    robot, footholds = a1_walk.robot, a1_walk.footholds
    feet = np.array([footholds[leg][0] for leg in LEGS])
    wrong = feet + np.array([[0.0, 0.0, dz] for dz in (0.004, -0.003, 0.0, 0.03)])
    base = State.standing(robot, feet)
    joints = gaitopt.joints_from_feet(robot, base.q[:3], base.columns[3:6], wrong)
    state = State.of(robot, base.q[:3], base.columns[3:6], joints, linear=(0.1, 0.0, 0.0))
    near = gaitopt.nearest_state(robot, state, footholds)
    assert near.state.support == ("LF", "LH", "RH")
    assert feet_of(near.state, robot)[:3] == pytest.approx(feet[:3], abs=1e-9)
    told = " ".join(near.changes)
    for words in ("LF 4.0 mm down", "LH 3.0 mm up", "RF is in the air, 30.0 mm", "slid at 0.100"):
        assert words in told


def test_what_is_not_near_is_refused(a1_walk: Plan) -> None:
    robot = a1_walk.robot
    state = State.standing(robot)
    q = np.array(state.q)
    q[7 + robot.leg_columns["RF"][2]] = robot.position_limits[0][robot.leg_columns["RF"][2]] - 0.9
    far = State(q, state.v, LEGS, robot.joint_names)
    with pytest.raises(InfeasibleStateError) as caught:
        gaitopt.nearest_state(robot, far)
    assert caught.value.limit.startswith("joint position")
    with pytest.raises(InfeasibleStateError, match="stands on 1 feet"):
        gaitopt.nearest_state(robot, State(state.q, state.v, ("LF",), robot.joint_names))


def test_links_that_touch_come_apart() -> None:
    """Thigh and trunk of a body that leans."""
    robot = gaitopt.load_robot("a1")
    stands = State.standing(robot)
    feet = feet_of(stands, robot)
    place, rpy = stands.q[:3] - [0.0, 0.0, 0.05], [0.6, 0.0, 0.0]
    joints = gaitopt.joints_from_feet(robot, place, rpy, feet)
    leans = State.of(robot, place, rpy, joints)
    with pytest.raises(InfeasibleStateError, match="touches") as caught:
        gaitopt.plan_stand_up(robot, leans)
    assert caught.value.limit.startswith("self-collision trunk")
    near = gaitopt.nearest_state(robot, leans)
    assert np.linalg.norm(near.body) < 0.01 and near.turn < 0.05
    assert gaitopt.verify(gaitopt.plan_stand_up(robot, near.state)).outcome == "certified"


def test_bodies_rise_gently() -> None:
    """Feet carry 75 to 125 % of the weight, so that nothing is thrown up."""
    robot = gaitopt.load_robot("a1")
    low = State.standing(robot, height=0.4 * robot.standing_height)
    rise = gaitopt.plan_stand_up(robot, low)
    lifts = largest_sizes(rise.path, 2)[:, 2].max()
    # Between the places of the timing's grid a little more than at them.
    assert 0.2 * GRAVITY < lifts < 0.28 * GRAVITY
    vertical = gaitopt.contact_forces(rise).forces[..., 2].sum(axis=1) / (robot.mass * GRAVITY)
    assert vertical.min() > 0.7 and vertical.max() < 1.3


def test_a_robot_lies_on_the_ground_where_its_plan_begins(lying_plan: Plan) -> None:
    found = gaitopt.verify(lying_plan)
    assert found.outcome == "certified"
    clear = next(c for c in found.checks if c.name == "legs and trunk clear of the ground")
    assert "on the ground at the begin, and never deeper: base" in str(clear)


def test_no_part_of_it_may_sink_deeper(lying_plan: Plan) -> None:
    """Planted: half a millimetre down and up again, in the first tenth of the way."""
    path = lying_plan.path
    coefficients = np.array(path.coefficients)
    # t^2 (h - t)^2 on the first segment, and nothing elsewhere.
    length = float(path.times[1])
    bump = np.array([1.0, -2.0 * length, length**2, 0.0, 0.0]) * -5e-4 * 16.0 / length**4
    coefficients[-5:, 0, 2] += bump
    deeper = replace(lying_plan, path=MotionPath(path.times, coefficients))
    names = {check.name for check in gaitopt.verify(deeper).violations}
    assert "legs and trunk clear of the ground" in names


def test_only_entries_begin_on_the_ground(lying_plan: Plan) -> None:
    """Planted: the same way as one of a walk that enters from nowhere."""
    walk = replace(lying_plan, entry=0)
    names = {check.name for check in gaitopt.verify(walk).violations}
    assert "legs and trunk clear of the ground" in names


def test_feet_that_are_too_near_step_into_the_usual_stance() -> None:
    robot = gaitopt.load_robot("a1")
    usual = feet_of(State.standing(robot, heading=0.4), robot)
    assert gaitopt.square_stance(robot, State.standing(robot, usual, heading=0.4)).order == ()
    moved = usual * [0.5, 0.5, 1.0] + [1.0, 2.0, 0.0]
    moved[2] = usual[2] + moved[:, :].mean(axis=0) - usual.mean(axis=0)
    narrow = State.standing(robot, moved, heading=0.4)
    footholds = gaitopt.square_stance(robot, narrow)
    plan = gaitopt.plan_crawl(robot, footholds, start=narrow)
    assert gaitopt.verify(plan).outcome == "certified"
    ends = plan.at([plan.duration]).feet[0]
    off = (ends - ends.mean(axis=0)) - (usual - usual.mean(axis=0))
    assert np.linalg.norm(off, axis=1).max() < 2.0 * footholds.landing_radius
    stepped = [leg for leg in LEGS if footholds.counts[leg] == 2]
    assert [swing.leg for swing in plan.swings] == [
        x for x in ("RH", "RF", "LH", "LF") if x in stepped
    ]
