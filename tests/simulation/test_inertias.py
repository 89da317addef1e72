"""Inertias that no body can have: MuJoCo moves the robot that the plan was made for."""

from __future__ import annotations

import re

import mujoco
import numpy as np
import pinocchio as pin
import pytest
from robot_loading import quiet
from robot_texts import robot

from gaitopt.robots.quadruped import Quadruped
from gaitopt.simulation.inertias import keep_inertias
from gaitopt.simulation.model import SimModel, build_sim_model, to_mujoco
from gaitopt.simulation.settings import SimulationSettings
from gaitopt.terrain.columns import s_columns


def model_of(made: Quadruped) -> SimModel:
    columns = s_columns(0, columns=1, robot=made)
    return build_sim_model(made, columns, SimulationSettings())


def odd_robot() -> Quadruped:
    """All moments about z are those of a link that is far larger, as in files of a Pupper."""
    text, count = re.subn(r'izz="([^"]+)"', lambda m: f'izz="{40.0 * float(m[1]):.9g}"', robot())
    assert count > 8
    return quiet(text)


@pytest.mark.parametrize("odd", [True, False])
def test_mass_matrices_are_those_of_pinocchio(odd: bool) -> None:
    made = odd_robot() if odd else quiet(robot())
    sim = model_of(made)
    rng, data = np.random.default_rng(0), mujoco.MjData(sim.model)
    q = pin.neutral(made.model)
    q[7:] = rng.uniform(-1.0, 1.0, len(q) - 7)
    data.qpos[:] = to_mujoco(sim, q)
    mujoco.mj_forward(sim.model, data)
    ours = np.triu(pin.crba(made.model, made.model.createData(), q))
    ours += np.triu(ours, 1).T
    theirs = np.empty((len(sim.qvel), sim.model.nv))
    for row, column in zip(theirs, sim.qvel, strict=True):
        mujoco.mj_mulM(sim.model, data, row, np.eye(sim.model.nv)[column])
    np.testing.assert_allclose(theirs[:, sim.qvel], ours[6:, 6:], atol=1e-12)


def test_usual_inertias_are_left_as_they_are() -> None:
    for name, some in (("odd", True), ("usual", False), ("wang2020", False)):
        made = odd_robot() if some else quiet(robot() if name == "usual" else name)
        sim = model_of(made)
        joints = np.array([sim.model.joint(joint).id for joint in made.joint_names])
        # What was set once is right.
        assert keep_inertias(mujoco, sim.model, made, sim.base, joints) == ()
        sim.model.body_inertia[1:] *= 2.0
        assert len(keep_inertias(mujoco, sim.model, made, sim.base, joints)) > 8
