"""Robots that lie on their trunk, with their feet in the air."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

import gaitopt
from benchmarks.physics.lying import measured, played, put_down, sunk, with_feet_up, world_of
from gaitopt import LEGS, FeetDown, InputError, State, feet_down
from gaitopt.errors import InfeasibleStateError
from gaitopt.robots.at_many_poses.outlines import lowest_points, outlines
from gaitopt.simulation.model import to_mujoco


@pytest.fixture(scope="module")
def lying() -> State:
    """a1 on its belly, its legs folded beside it."""
    robot = gaitopt.load_robot("a1")
    joints = robot.joint_names
    return State(with_feet_up(robot), np.zeros(6 + len(joints)), (), joints)


@pytest.fixture(scope="module")
def way(lying: State) -> FeetDown:
    return feet_down(gaitopt.load_robot("a1"), lying)


def foot_heights(robot: gaitopt.Quadruped, q: np.ndarray) -> np.ndarray:
    data = robot.model.createData()
    pin.framesForwardKinematics(robot.model, data, q)
    frames = [robot.model.getFrameId(robot.legs[leg].foot) for leg in LEGS]
    return np.array([data.oMf[frame].translation[2] for frame in frames])


def test_all_feet_are_on_the_ground_in_the_end_and_the_trunk_stays(
    lying: State, way: FeetDown
) -> None:
    robot = gaitopt.load_robot("a1")
    assert foot_heights(robot, lying.q).min() > way.ground + robot.foot_radius + 0.01
    assert foot_heights(robot, way.state.q) == pytest.approx(4 * [way.ground + robot.foot_radius])
    assert way.state.support == LEGS and not way.state.v.any()
    assert way.state.q[:7] == pytest.approx(lying.q[:7], abs=1e-12)
    assert gaitopt.verify(gaitopt.plan_stand_up(robot, way.state)).outcome == "certified"


def test_on_the_way_links_are_above_the_ground_and_joints_keep_their_limits(
    lying: State, way: FeetDown
) -> None:
    robot = gaitopt.load_robot("a1")
    times = np.linspace(0.0, way.times[-1], 101)
    joints = way.joints(times)
    assert joints[0] == pytest.approx(lying.q[7:]) and joints[-1] == pytest.approx(way.state.q[7:])
    low, high = robot.position_limits
    assert (joints >= low).all() and (joints <= high).all()
    rates = np.abs(np.diff(joints, axis=0)) / np.diff(times)[:, None]
    assert (rates <= 0.25 * robot.velocity_limits).all()
    shapes = outlines(robot)
    assert shapes is not None
    for angles in joints[::5]:
        points = lowest_points(robot, shapes, np.append(lying.q[:7], angles))
        assert min(float(each[:, 2].min()) for each in points) > way.ground - 3.1e-3


def test_the_centre_of_mass_is_inside_what_the_trunk_lies_on(lying: State, way: FeetDown) -> None:
    """a1's trunk is a box of 267 by 194 mm: its polygon is that, whatever the joints do."""
    assert np.ptp(way.polygon, axis=0) == pytest.approx([0.267, 0.194], abs=1e-3)
    robot = gaitopt.load_robot("a1")
    centre = pin.centerOfMass(robot.model, robot.model.createData(), way.state.q)[:2]
    inside = min(np.abs(way.polygon - lying.q[:2]).max(axis=0) - np.abs(centre - lying.q[:2]))
    assert 0.0 < way.margin <= inside + 1e-9


def test_what_is_no_lying_robot_is_refused(lying: State) -> None:
    robot = gaitopt.load_robot("a1")
    moves = np.zeros(len(lying.v))
    moves[0] = 0.1
    with pytest.raises(InfeasibleStateError, match="a robot that lies does not move"):
        feet_down(robot, State(lying.q, moves, (), lying.joint_names))
    rolled = State.of(robot, lying.q[:3], [0.3, 0.0, 0.0], lying.q[7:], support=())
    with pytest.raises(
        InfeasibleStateError, match=r"does not lie on its trunk: .* m outside of|not"
    ):
        feet_down(robot, rolled)
    with pytest.raises(InputError, match="another robot"):
        feet_down(gaitopt.load_robot("hyq"), lying)
    bare = gaitopt.load_robot(_without_shapes(robot.urdf), foot_radius=0.02)
    with pytest.raises(InputError, match="the shape of the trunk is not known"):
        feet_down(bare, replace(lying, joint_names=bare.joint_names))


def _without_shapes(urdf: str) -> str:
    import re

    return re.sub(r"<collision.*?</collision>", "", urdf, flags=re.DOTALL)


def test_a_plan_from_there_is_refused_and_says_what_to_do(lying: State) -> None:
    robot = gaitopt.load_robot("a1")
    for support in ((), ("LF", "RH"), ("LF", "LH", "RH")):
        state = State(lying.q, lying.v, support, lying.joint_names)
        with pytest.raises(InfeasibleStateError, match=r"gaitopt\.feet_down"):
            gaitopt.plan_stand_up(robot, state)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["a1", "go2", "anymal_c"])
def test_in_physics_it_puts_its_feet_down_and_stands_up(name: str) -> None:
    """Servos that know nothing of the ground move the legs; then the robot is measured again."""
    pytest.importorskip("mujoco")
    robot = gaitopt.load_robot(name)
    data, sim = world_of(robot)
    data.qpos[:] = to_mujoco(sim, with_feet_up(robot))
    state, _ = sunk(robot, data, sim, LEGS)
    way = feet_down(robot, state)
    put_down(robot, data, sim, way)
    now, ground = measured(robot, data, sim)
    assert now.support == LEGS
    plan = gaitopt.plan_stand_up(robot, gaitopt.nearest_state(robot, now, ground).state)
    assert gaitopt.verify(plan).outcome == "certified"
    assert played(plan, data, sim).stands and gaitopt.simulate(plan).passed
