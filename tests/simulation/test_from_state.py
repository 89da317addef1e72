"""Plans that begin in motion, in physics: MuJoCo begins with the same velocities."""

from __future__ import annotations

import mujoco
import numpy as np
import pytest

from gaitopt import Plan, SimulationStatus, contact_forces, plan_crawl, s_columns, simulate
from gaitopt.conventions import GRAVITY
from gaitopt.robots.quadruped import Quadruped
from gaitopt.simulation.model import build_sim_model, to_mujoco, velocity_to_mujoco
from gaitopt.simulation.settings import SimulationSettings


@pytest.mark.parametrize("share", [0.3, 0.5])
def test_a_walk_from_the_middle_of_another_ends_on_its_feet(a1_walk: Plan, share: float) -> None:
    time = share * a1_walk.duration
    state = a1_walk.state(time)
    plan = plan_crawl(a1_walk.robot, a1_walk.footholds_ahead(time), start=state)
    assert plan.begins_moving
    result = simulate(plan)
    assert result.status is SimulationStatus.FINISHED
    assert not result.missed
    # The simulation begins in the state, and not at rest.
    assert np.allclose(result.motion.v[0], state.v, atol=1e-9)


def test_velocities_of_mujoco_are_those_of_pinocchio(a1_walk: Plan) -> None:
    """MuJoCo's own Jacobians give the feet the velocities that Pinocchio's kinematics do."""
    robot = a1_walk.robot
    sim = build_sim_model(robot, a1_walk.footholds, SimulationSettings())
    rng = np.random.default_rng(0)
    q = np.array(a1_walk.at([0.4 * a1_walk.duration]).q[0])
    q[3:7] = [0.1, -0.2, 0.3, np.sqrt(1.0 - 0.14)]
    v, step = rng.normal(size=robot.model.nv), 1e-6
    import pinocchio as pin

    data, ours = mujoco.MjData(sim.model), robot.model.createData()
    data.qpos[:], data.qvel[:] = to_mujoco(sim, q), velocity_to_mujoco(sim, q[3:7], v)
    mujoco.mj_forward(sim.model, data)
    for site, leg in zip(sim.sites, robot.legs.values(), strict=True):
        jacobian = np.zeros((3, sim.model.nv))
        mujoco.mj_jacSite(sim.model, data, jacobian, None, site)
        places = []
        for moved in (q, pin.integrate(robot.model, q, step * v)):
            pin.framesForwardKinematics(robot.model, ours, moved)
            places.append(ours.oMf[robot.model.getFrameId(leg.foot)].translation.copy())
        assert np.allclose(jacobian @ data.qvel, (places[1] - places[0]) / step, atol=1e-4)


def test_slow_joints_follow_from_the_first_instant(wang: Quadruped) -> None:
    """Feet that begin on the ground, and not in it, would let the body fall by up to a
    millimetre: a knee of wang2020 then turned at five times its limit."""
    walk = plan_crawl(wang, s_columns(0, columns=2))
    time = 0.3 * walk.duration
    state = walk.state(time)
    plan = plan_crawl(wang, walk.footholds_ahead(time), start=state)
    result = simulate(plan)
    assert result.passed, str(result)
    assert result.rate_use < 1.1
    # The ground carries the planned forces at once, and it gives way by less than a millimetre.
    planned = contact_forces(plan, times=[float(result.motion.t[1])]).forces[0]
    assert np.allclose(result.forces[1, :, 2], planned[:, 2], atol=0.05 * wang.mass * GRAVITY)
    assert 0.0 < state.q[2] - result.motion.q[0, 2] < 1e-3
