"""The tracking controller, without any simulator."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest

import gaitopt
from gaitopt import LEGS, Plan
from gaitopt.control.tracking import LARGEST_PROBE, RobotState, TrackingController


def perfect(plan: Plan, time: float) -> RobotState:
    """The robot exactly where the plan has it, at rest."""
    motion = plan.at([time])
    return RobotState(motion.q[0], 0.0 * motion.v[0], motion.contacts[0])


@pytest.fixture
def controller(short_plan: Plan) -> TrackingController:
    return TrackingController(short_plan)


def test_standing_still_the_feet_carry_the_weight(
    short_plan: Plan, controller: TrackingController
) -> None:
    command = controller.command(-1.0, perfect(short_plan, 0.0))
    forces = command.share.forces
    assert forces[:, 2].sum() == pytest.approx(9.81 * short_plan.robot.mass, rel=1e-3)
    assert np.abs(forces[:, :2].sum(axis=0)).max() < 0.1
    assert (forces[:, 2] > 0).all()


def test_standing_still_forces_and_torques_are_in_balance(
    short_plan: Plan, controller: TrackingController
) -> None:
    """Every row of the equation of motion: weight = joint torques + contact forces.

    Independent of the controller: potential energy and contact points by finite differences.
    """
    import pinocchio as pin

    robot = short_plan.robot
    model, data = robot.model, robot.model.createData()
    state = perfect(short_plan, 0.0)
    command = controller.command(-1.0, state)

    def energy(q: np.ndarray) -> float:
        contact = 0.0
        pin.framesForwardKinematics(model, data, q)
        for leg, force in zip(LEGS, command.share.forces, strict=True):
            frame = data.oMf[model.getFrameId(robot.legs[leg].foot)]
            # The material point of the foot that was lowest at the start.
            contact += force @ frame.act(lowest[leg])
        return float(pin.computePotentialEnergy(model, data, q)) - contact

    pin.framesForwardKinematics(model, data, state.q)
    lowest = {}
    for leg in LEGS:
        frame = data.oMf[model.getFrameId(robot.legs[leg].foot)]
        lowest[leg] = frame.actInv(frame.translation - [0, 0, robot.foot_radius])
    for i in range(model.nv):
        step = 1e-6 * np.eye(model.nv)[i]
        slope = (
            energy(pin.integrate(model, state.q, step))
            - energy(pin.integrate(model, state.q, -step))
        ) / 2e-6
        given = 0.0 if i < 6 else command.torque[i - 6]
        assert slope == pytest.approx(given, abs=0.05), model.names[1] if i < 6 else i


def test_a_robot_in_its_place_is_told_the_plans_angles(
    short_plan: Plan, controller: TrackingController
) -> None:
    command = controller.command(-1.0, perfect(short_plan, 0.0))
    assert command.angles == pytest.approx(short_plan.at([0.0]).q[0, 7:], abs=1e-6)
    assert np.abs(command.rates).max() < 1e-9


def test_a_body_out_of_place_is_pushed_back(
    short_plan: Plan, controller: TrackingController
) -> None:
    state = perfect(short_plan, 0.0)
    q = state.q.copy()
    q[1] += 0.01
    # The feet stay: their joints give way.
    for leg in LEGS:
        columns = 7 + np.array(short_plan.robot.leg_columns[leg])
        foot = short_plan.at([0.0]).feet[0, LEGS.index(leg)]
        q[columns] = short_plan.robot.legs[leg].inverse(foot - q[:3])
    command = controller.command(-1.0, RobotState(q, state.v, state.contacts))
    push = command.share.forces.sum(axis=0)[1]
    assert push == pytest.approx(-0.01 * controller.gains.body_stiffness, rel=0.02)
    # One Newton step is within 0.1 mm or so of the plan's own angles.
    assert command.angles == pytest.approx(short_plan.at([0.0]).q[0, 7:], abs=1e-3)


def test_feet_without_contact_bear_nothing_and_reach_down(
    short_plan: Plan, controller: TrackingController
) -> None:
    state = perfect(short_plan, 0.0)
    lifted = RobotState(state.q, state.v, np.array([True, True, True, False]))
    first = controller.command(-1.0, lifted)
    assert first.share.forces[3, 2] > 0  # a moment without contact is no loss
    for _ in range(100):
        last = controller.command(-1.0, lifted)
    assert np.abs(last.share.forces[3]).max() == 0.0
    leg = short_plan.robot.legs[LEGS[3]]
    columns = list(short_plan.robot.leg_columns[LEGS[3]])
    lower = leg.forward(last.angles[columns]) - leg.forward(state.q[7:][columns])
    assert -0.035 < lower[2] < -0.005


def test_the_controller_starts_anew_after_reset(short_plan: Plan) -> None:
    controller = TrackingController(short_plan)
    times = np.arange(0.0, 1.0, controller.dt)
    runs = []
    for _ in range(2):
        controller.reset()
        runs.append([controller.command(t, perfect(short_plan, t)).torque for t in times])
    assert np.array_equal(runs[0], runs[1])


def test_legs_of_two_joints_bear_the_weight_and_lift_feet_in_their_planes() -> None:
    robot = gaitopt.load_robot("solo8")
    plan = gaitopt.plan_crawl(robot, gaitopt.s_columns(0, columns=2, robot=robot))
    standing = TrackingController(plan).command(-1.0, perfect(plan, 0.0))
    assert standing.share.forces[:, 2].sum() == pytest.approx(9.81 * robot.mass, rel=1e-3)
    # A foot that is wanted elsewhere goes there as far as its leg's plane allows.
    controller = TrackingController(plan)
    tick = controller.reference.tick(plan.swings[0].start + 0.5 * plan.swings[0].duration)
    leg = LEGS.index(plan.swings[0].leg)
    step = controller.reference.inverse[tick, leg] @ np.array([0.0, 0.01, 0.0])
    assert step.shape == (2,) and np.abs(step).max() < 1e-9


def test_the_controller_needs_no_mujoco() -> None:
    code = (
        "import sys; sys.modules['mujoco'] = None\n"
        "import gaitopt\n"
        "from gaitopt.control.tracking import RobotState, TrackingController\n"
        "plan = gaitopt.plan_crawl(gaitopt.load_robot('wang2020'), gaitopt.s_columns(0, columns=2))"
        "\nm = plan.at([0.0])\n"
        "c = TrackingController(plan).command(0.0, RobotState(m.q[0], m.v[0], m.contacts[0]))\n"
        "assert c.torque.shape == (12,) and sys.modules['mujoco'] is None\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True, timeout=600)


def test_a_foot_without_ground_reaches_down_by_a_bounded_turn_of_its_leg(
    short_plan: Plan, controller: TrackingController
) -> None:
    state = perfect(short_plan, 0.0)
    touching = controller.command(-1.0, state)
    leg = list(short_plan.robot.leg_columns["LF"])
    turns = []
    for depth in (0.0, 0.002, 1.0):
        controller.reset()
        controller._footing.probe = np.array([depth, 0.0, 0.0, 0.0])
        asked = controller.command(-1.0, state).angles - touching.angles
        np.testing.assert_allclose(np.delete(asked, leg), 0.0, atol=1e-9)
        turns.append(float(np.linalg.norm(asked[leg])))
    assert turns[0] == pytest.approx(0.0, abs=1e-9)
    assert 0.0 < turns[1] < turns[2] == pytest.approx(LARGEST_PROBE, rel=1e-6)
