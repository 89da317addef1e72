"""Feet that lose the ground: how quickly they move, and the steps of the physics for that."""

from __future__ import annotations

import re

import numpy as np
import pinocchio as pin
import pytest
from robot_loading import quiet
from robot_texts import robot

from gaitopt.conventions import GRAVITY, LEGS
from gaitopt.robots.catalog import load_robot
from gaitopt.robots.quadruped import Quadruped
from gaitopt.simulation.light_feet import FAR, time_to_give_way
from gaitopt.simulation.settings import LEAST_STEPS, TIMESTEPS, SimulationSettings


def thrown(made: Quadruped) -> float:
    """The same time by forward dynamics: the joints' torques for a load, on a body of 1e9 kg."""
    model = made.model.copy()
    model.inertias[1] = pin.Inertia(1e9, np.zeros(3), 1e9 * np.eye(3))
    model.gravity.setZero()
    data, q, times = model.createData(), pin.neutral(model), []
    q[7:] = made.standing_joints()
    pin.computeJointJacobians(model, data, q)
    pin.updateFramePlacements(model, data)
    for leg in LEGS:
        frame = model.getFrameId(made.legs[leg].foot)
        jacobian = pin.getFrameJacobian(model, data, frame, pin.LOCAL_WORLD_ALIGNED)[:3]
        torques = np.zeros(model.nv)
        torques[6:] = jacobian[2, 6:] * made.mass * GRAVITY / 4.0
        upwards = float(jacobian[2] @ pin.aba(model, model.createData(), q, 0.0 * torques, torques))
        times.append(np.sqrt(2.0 * FAR * made.legs[leg].reach / upwards))
    return float(min(times))


@pytest.mark.parametrize("name", ["go2", "solo8", "wang2020"])
def test_it_is_that_of_forward_dynamics(name: str) -> None:
    made = load_robot(name) if name != "solo8" else quiet(name)
    assert time_to_give_way(made) == pytest.approx(thrown(made), rel=1e-5)


def test_the_inertia_of_motors_slows_feet() -> None:
    plain, geared = quiet(robot()), quiet(robot(), motor_inertia=0.1)
    assert time_to_give_way(geared) > 1.5 * time_to_give_way(plain)
    assert time_to_give_way(geared) == pytest.approx(thrown(geared), rel=1e-5)


def test_robots_without_masses_have_no_such_time() -> None:
    text = re.sub("<inertial>.*?</inertial>", "", robot())
    assert time_to_give_way(quiet(text, masses="none")) == np.inf


@pytest.mark.parametrize("steps", [0.3, 1.6, 1.9, 2.4, 8.0, np.inf])
def test_steps_are_short_enough_and_control_is_the_same(steps: float) -> None:
    usual = SimulationSettings()
    found = usual.for_feet(steps * usual.timestep)
    assert found.control_interval == pytest.approx(usual.control_interval)
    assert found.timestep <= max(steps * usual.timestep / LEAST_STEPS, TIMESTEPS[0]) + 1e-12
    assert (found == usual) == (steps > LEAST_STEPS)


@pytest.mark.parametrize("asked", [1e-4, 1.5e-4, 3e-4, 0.001 / 1.8, 7e-4, 0.002])
@pytest.mark.parametrize("time", [1e-9, 2e-4, 2.5e-4])
def test_the_lightest_feet_get_the_shortest_steps_and_no_error(asked: float, time: float) -> None:
    usual = SimulationSettings(timestep=asked)
    found = usual.for_feet(time)
    assert TIMESTEPS[0] <= found.timestep < 2.0 * TIMESTEPS[0]
    assert found.control_interval == pytest.approx(usual.control_interval)


def test_robots_of_the_list_keep_the_usual_steps() -> None:
    usual = SimulationSettings()
    for name in ("wang2020", "a1", "go1", "go2", "b1", "anymal", "anymal_c", "hyq"):
        assert usual.for_feet(time_to_give_way(load_robot(name))) == usual


@pytest.mark.parametrize("reach", [0.1799, 0.12, 0.06, 0.01])
def test_small_robots_have_contacts_to_their_size(reach: float) -> None:
    """What they stand on gives way by the same share of their legs, down to a quarter."""
    usual, edge = SimulationSettings(), SimulationSettings().for_reach(0.1799999)
    found, share = usual.for_reach(reach), max(reach / 0.18, 0.25)
    assert usual.for_reach(0.18) == usual
    assert found.contact_time == pytest.approx(share * edge.contact_time, rel=1e-5)
    assert found.timestep == pytest.approx(share * edge.timestep, rel=1e-5)
    assert found.contact_time > 2.0 * found.timestep  # what MuJoCo asks for
    assert found.control_interval == pytest.approx(0.003, rel=0.2)
