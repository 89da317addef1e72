"""Motors and gears that turn with the joints: what they add to torques, by MuJoCo."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np
import pytest

import gaitopt
from gaitopt import Quadruped
from gaitopt.dynamics.whole_body import equations_of_motion, motion_of_path, path_dynamics
from gaitopt.robots.rotations import quaternion_to_matrix
from gaitopt.simulation.model import build_sim_model, to_mujoco
from gaitopt.simulation.settings import SimulationSettings

INERTIA = np.linspace(0.01, 0.3, 12)


@pytest.fixture(scope="module", params=["a1", "anymal_c"])
def robot(request: pytest.FixtureRequest) -> Quadruped:
    plain = gaitopt.load_robot(request.param)
    named = dict(zip(plain.joint_names, INERTIA.tolist(), strict=True))
    return gaitopt.load_robot(request.param, motor_inertia=named)


def random_rows(count: int = 6) -> list[Any]:
    rng = np.random.default_rng(3)
    return [rng.uniform(-0.8, 0.8, (count, 18)), *rng.normal(size=(2, count, 18))]


def test_torques_are_those_of_mujoco_s_inverse_dynamics(robot: Quadruped) -> None:
    """High above the ground: MuJoCo's armature is the motors' inertia."""
    sim = build_sim_model(
        robot, gaitopt.s_columns(0, columns=1, robot=robot),
        SimulationSettings(),
    )  # fmt: skip
    model, data = sim.model, mujoco.MjData(sim.model)
    model.dof_damping[:] = model.dof_frictionloss[:] = 0.0
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
    motion = motion_of_path(robot, *random_rows())
    found = equations_of_motion(robot, motion).forces
    for q, v, a, forces in zip(*motion, found, strict=True):
        turn = quaternion_to_matrix(q[3:7])
        data.qpos[:] = to_mujoco(sim, q)
        # MuJoCo's velocity of the base is in the world's axes, its rate of turn in the base's.
        data.qvel[:3], data.qvel[3:6], data.qvel[sim.qvel] = turn @ v[:3], v[3:6], v[6:]
        data.qacc[:3] = turn @ (a[:3] + np.cross(v[3:6], v[:3]))
        data.qacc[3:6], data.qacc[sim.qvel] = a[3:6], a[6:]
        mujoco.mj_inverse(model, data)
        # The same joints, in two orders; fixed links make MuJoCo round a little.
        np.testing.assert_allclose(data.qfrc_inverse[sim.qvel], forces[6:], rtol=0, atol=1e-7)
        np.testing.assert_allclose(turn.T @ data.qfrc_inverse[:3], forces[:3], rtol=0, atol=1e-6)


def test_motors_add_their_torque_and_no_force_on_the_base(robot: Quadruped) -> None:
    plain, rows = gaitopt.load_robot(robot.name), random_rows()
    more = equations_of_motion(robot, motion_of_path(robot, *rows)).forces
    more = more - equations_of_motion(plain, motion_of_path(plain, *rows)).forces
    assert not more[:, :6].any()
    np.testing.assert_allclose(more[:, 6:], INERTIA * rows[2][:, 6:], rtol=0, atol=1e-11)


def test_along_a_path_they_count_with_its_acceleration_and_curvature(robot: Quadruped) -> None:
    rows = random_rows()
    u, x = np.linspace(-2.0, 2.0, 6), np.linspace(0.0, 3.0, 6)
    along = path_dynamics(robot, *rows).at(u, x).forces
    first = np.sqrt(x)[:, None] * rows[1]
    second = u[:, None] * rows[1] + x[:, None] * rows[2]
    whole = equations_of_motion(robot, motion_of_path(robot, rows[0], first, second)).forces
    np.testing.assert_allclose(along, whole, rtol=0, atol=1e-9)


def test_heavy_motors_slow_a_walk_and_forces_of_the_plan_know_it() -> None:
    columns = gaitopt.s_columns(0, columns=2, robot=gaitopt.load_robot("a1"))
    durations = []
    for inertia in (0.0, 0.3):
        made = gaitopt.load_robot("a1", motor_inertia=inertia)
        plan = gaitopt.plan_crawl(made, columns)
        assert gaitopt.verify(plan, collisions=False)["contact forces"].status == "ok"
        assert gaitopt.contact_forces(plan).feasible_share == 1.0
        durations.append(plan.duration)
    assert durations[1] > 1.05 * durations[0]
