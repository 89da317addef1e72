"""The MuJoCo model is the robot of the plan."""

from __future__ import annotations

import numpy as np
import pytest

import gaitopt
from gaitopt import LEGS, Footholds, InputError, Quadruped
from gaitopt.simulation.model import SimModel, build_sim_model, to_mujoco
from gaitopt.simulation.settings import Push, SimulationSettings
from gaitopt.terrain.columns import s_columns

mujoco = pytest.importorskip("mujoco")
pin = pytest.importorskip("pinocchio")

ROBOTS = ("wang2020", "a1", "go1", "go2", "b1", "laikago", "anymal", "anymal_c", "hyq", "solo12")


def model_of(robot: Quadruped, footholds: Footholds | None = None, **changes: object) -> SimModel:
    ground = s_columns(0, columns=2, robot=robot) if footholds is None else footholds
    return build_sim_model(robot, ground, SimulationSettings(**changes))


@pytest.mark.parametrize("name", ROBOTS)
def test_masses_and_kinematics_are_pinocchios(name: str) -> None:
    robot = gaitopt.load_robot(name)
    sim = model_of(robot)
    assert float(sim.model.body_mass.sum()) == pytest.approx(robot.mass, rel=1e-12)
    data, ours = mujoco.MjData(sim.model), robot.model.createData()
    rng = np.random.default_rng(1)
    for _ in range(3):
        q = pin.randomConfiguration(robot.model, -np.ones(robot.model.nq), np.ones(robot.model.nq))
        q[7:] = rng.uniform(-1, 1, len(q) - 7)
        data.qpos[:] = to_mujoco(sim, q)
        mujoco.mj_forward(sim.model, data)
        pin.framesForwardKinematics(robot.model, ours, q)
        for leg, geom in zip(LEGS, sim.feet, strict=True):
            place = ours.oMf[robot.model.getFrameId(robot.legs[leg].foot)].translation
            assert data.geom_xpos[geom] == pytest.approx(place, abs=1e-9)
        com = pin.centerOfMass(robot.model, ours, q)
        assert data.subtree_com[0] == pytest.approx(com, abs=1e-9)


def test_inertias_are_pinocchios(wang: Quadruped) -> None:
    """The joint-space mass matrices agree, row by row, once both are in one order."""
    sim = model_of(wang)
    q = np.concatenate([[0.1, 0.2, 0.4, 0, 0, 0, 1], np.linspace(-0.5, 0.5, 12)])
    data = mujoco.MjData(sim.model)
    data.qpos[:] = to_mujoco(sim, q)
    mujoco.mj_forward(sim.model, data)
    full = np.zeros((18, 18))
    for i in range(18):
        mujoco.mj_mulM(sim.model, data, full[i], np.eye(18)[i])
    order = np.concatenate([np.arange(6), sim.qvel])
    ours = pin.crba(wang.model, wang.model.createData(), q)
    ours = np.triu(ours) + np.triu(ours, 1).T
    assert full[np.ix_(order, order)] == pytest.approx(ours, abs=1e-9)


def test_columns_stand_under_the_footholds(wang: Quadruped) -> None:
    footholds = gaitopt.s_columns(0, columns=3)
    sim = model_of(wang, footholds)
    assert footholds.radius is not None
    for leg, ids in zip(LEGS, sim.columns, strict=True):
        for point, geom in zip(footholds[leg], ids, strict=True):
            radius, half = sim.model.geom_size[geom][:2]
            top = sim.model.geom_pos[geom] + [0, 0, half]
            assert radius == footholds.radius
            assert top == pytest.approx(point - [0, 0, wang.foot_radius], abs=1e-12)


def test_a_sunken_column_is_lower(wang: Quadruped) -> None:
    footholds = gaitopt.s_columns(0, columns=3)
    sunk = model_of(wang, footholds, column_errors=(("rear_right", 1, -0.005),))
    right = model_of(wang, footholds)
    geom = right.columns[LEGS.index("RH"), 1]
    tops = [m.model.geom_pos[geom, 2] + m.model.geom_size[geom, 1] for m in (sunk, right)]
    assert tops[0] - tops[1] == pytest.approx(-0.005)


def test_masses_can_be_wrong(wang: Quadruped) -> None:
    sim = model_of(wang, body_mass_factor=1.1, leg_mass_factor=0.9)
    assert float(sim.model.body_mass.sum()) == pytest.approx(13 * 1.1 + 12 * 0.9)


@pytest.mark.parametrize(
    "settings",
    [
        {"timestep": 1.0},
        {"friction": 0.0},
        {"body_mass_factor": -1.0},
        {"control_every": 0},
        {"control_every": 1.5},
        {"sensing_delay": np.nan},
    ],
)
def test_bad_settings_are_refused(settings: dict[str, float]) -> None:
    with pytest.raises(InputError, match=next(iter(settings))):
        SimulationSettings(**settings)  # type: ignore[arg-type]


def test_bad_pushes_and_unknown_columns_are_refused(wang: Quadruped) -> None:
    with pytest.raises(InputError, match="push"):
        Push(-1.0, 0.5, (1.0, 0.0, 0.0))
    with pytest.raises(InputError, match="no foothold 99"):
        model_of(wang, column_errors=(("RH", 99, 0.0),))
