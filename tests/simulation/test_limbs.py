"""Limbs and trunk of robots whose feet are balls touch the ground, and nothing else."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from robot_loading import quiet
from robot_texts import CORNERS, collision, robot

import gaitopt
from gaitopt import LEGS, Footholds, HeightMap, Plan, Quadruped
from gaitopt.simulation.limbs import LIMB, limb_shapes
from gaitopt.simulation.model import SimModel, build_sim_model, to_mujoco
from gaitopt.simulation.settings import SimulationSettings

mujoco = pytest.importorskip("mujoco")

ROBOTS = ("wang2020", "a1", "go2", "anymal_c", "hyq", "solo12")


def model_of(made: Quadruped) -> SimModel:
    ground = gaitopt.s_columns(0, columns=1, robot=made)
    return build_sim_model(made, ground, SimulationSettings())


@pytest.mark.parametrize("name", ROBOTS)
def test_a_robot_stands_on_its_balls_alone(name: str) -> None:
    """At least 3 mm below its shanks there is nothing, and limbs do not touch one another."""
    made = quiet(name)
    sim = model_of(made)
    data = mujoco.MjData(sim.model)
    standing = np.concatenate([[0, 0, made.standing_height, 0, 0, 0, 1], made.standing_joints()])
    data.qpos[:] = to_mujoco(sim, standing)
    mujoco.mj_forward(sim.model, data)
    lowest = float(data.geom_xpos[list(sim.feet), 2].min()) - made.foot_radius
    ground = int(sim.model.geom("gaitopt ground").id)
    away = np.add(data.qpos[:3], [50.0, 0.0, float(sim.model.geom_pos[ground, 2]) - lowest])
    for depth, touching in ((-0.001, set()), (0.003, {*sim.feet, ground})):
        data.qpos[:3] = away - [0.0, 0.0, depth]
        mujoco.mj_forward(sim.model, data)
        assert {int(g) for g in data.contact.geom.ravel()} == touching


@pytest.mark.parametrize("name", ["anymal_c", "go2"])
def test_limbs_are_where_pinocchio_has_them(name: str) -> None:
    """Middles of primitives, and corners of hulls, in a random posture."""
    made = quiet(name)
    sim = model_of(made)
    data, ours = mujoco.MjData(sim.model), made.model.createData()
    q = np.concatenate([[0.1, 0.2, 0.6, 0.1, 0.2, 0.3, 0.9], np.linspace(-1.0, 1.0, 12)])
    q[3:7] /= np.linalg.norm(q[3:7])
    data.qpos[:] = to_mujoco(sim, q)
    mujoco.mj_kinematics(sim.model, data)
    pin.forwardKinematics(made.model, ours, q)
    shapes = limb_shapes(made)
    assert len(shapes) > 8
    for number, (joint, solid, place) in enumerate(shapes):
        geom = int(sim.model.geom(f"{LIMB}{number}").id)
        turn, middle = data.geom_xmat[geom].reshape(3, 3), data.geom_xpos[geom]
        if not isinstance(solid, np.ndarray):
            assert middle == pytest.approx(ours.oMi[joint].act(place.translation), abs=1e-9)
            axis = ours.oMi[joint].rotation @ place.rotation
            assert turn == pytest.approx(axis, abs=1e-9)
            continue
        mesh = int(sim.model.geom_dataid[geom])
        start, count = int(sim.model.mesh_vertadr[mesh]), int(sim.model.mesh_vertnum[mesh])
        theirs = sim.model.mesh_vert[start : start + count] @ turn.T + middle
        world = solid @ ours.oMi[joint].rotation.T + ours.oMi[joint].translation
        np.testing.assert_allclose(theirs.min(axis=0), world.min(axis=0), rtol=0, atol=1e-5)
        np.testing.assert_allclose(theirs.max(axis=0), world.max(axis=0), rtol=0, atol=1e-5)


@pytest.mark.parametrize(
    "shank",
    ['<box size="0.04 0.04 0.30"/>', '<cylinder radius="0.02" length="0.30"/>'],
)
def test_a_shank_that_contains_its_foot_is_cut_there(shank: str) -> None:
    """It reaches 30 mm below the middle of the foot, whose ball has a radius of 30 mm."""
    text = robot(shank=collision(shank, "0 0 -0.10"))
    made = quiet(text)
    last = {int(made.model.getJointId(made.legs[leg].joints[-1])) for leg in LEGS}
    shanks = [s.solid for s in limb_shapes(made) if s.joint in last]
    assert len(shanks) == len(CORNERS)
    for corners in shanks:
        assert corners[:, 2].min() == pytest.approx(-0.22, abs=1e-9)
        assert corners[:, 2].max() == pytest.approx(0.05, abs=1e-9)
        assert np.abs(corners[:, :2]).max() == pytest.approx(0.02, abs=1e-9)


@pytest.fixture(scope="module")
def standing() -> Plan:
    """go2 on its first four footholds of level ground."""
    made = gaitopt.load_robot("go2")
    flat = gaitopt.s_columns(0, columns=1, robot=made).raised(made.foot_radius)
    return gaitopt.plan_crawl(made, flat.with_(radius=None))


def below_the_shank(plan: Plan, height: float) -> np.ndarray:
    """A place on the line from the knee to the foot of LF, at a height above the ground."""
    made, q = plan.robot, plan.at([0.0]).q[0]
    data = made.model.createData()
    pin.framesForwardKinematics(made.model, data, q)
    foot = data.oMf[made.model.getFrameId(made.legs["LF"].foot)].translation
    knee = data.oMi[made.model.getJointId(made.legs["LF"].joints[-1])].translation
    share = (height - foot[2]) / (knee[2] - foot[2])
    return np.array(foot + share * (knee - foot))


def raised_map(place: np.ndarray, height: float) -> HeightMap:
    """A level map that is higher within 15 mm of a place."""
    z = np.zeros((301, 301))
    grid = HeightMap(z, 0.01, (-1.5, -1.5))
    near = np.hypot(grid.x[:, None] - place[0], grid.y[None, :] - place[1]) < 0.015
    return grid.with_heights(np.where(near, height, 0.0))


@pytest.mark.parametrize("limbs", [True, False])
def test_ground_that_is_raised_below_a_shank_is_bumped_into(standing: Plan, limbs: bool) -> None:
    """Certificate and physics agree; they share no shapes."""
    settings: dict[str, Any] = {"limbs": limbs, "watch_time": 0.1}
    place = below_the_shank(standing, 0.09)
    for height, expected in ((0.05, ()), (0.09, ("FL_calf",) * limbs)):
        ground = raised_map(place, height)
        there = replace(standing, footholds=standing.footholds.with_(ground=ground))
        result = gaitopt.simulate(there, SimulationSettings(**settings))
        assert result.bumps == expected, str(result)
        checks = {c.name: c.status for c in gaitopt.verify(there, collisions=False).checks}
        clear = checks["legs and trunk clear of the ground"] == "ok"
        assert clear == (height == 0.05)
        assert ("touched beside the feet" in str(result)) == limbs


@pytest.mark.parametrize(("radius", "bumps"), [(0.01, ("FL_calf",)), (None, ())])
def test_a_pillar_below_a_shank_is_bumped_into(
    standing: Plan, radius: float | None, bumps: tuple[str, ...]
) -> None:
    """On open ground it is but a plate below a foothold: nothing is known beside it."""
    place = below_the_shank(standing, 0.09)
    points = {leg: standing.footholds[leg] for leg in LEGS}
    top = np.add(place, [0.0, 0.0, standing.robot.foot_radius])
    points["RH"] = np.stack([points["RH"][0], top])
    there = replace(standing, footholds=Footholds(points, radius, order=("RH",)))
    result = gaitopt.simulate(there, SimulationSettings(watch_time=0.1))
    assert result.bumps == bumps, str(result)


def test_limbs_of_a_robot_with_point_feet_touch_nothing() -> None:
    """Its lower legs, as lines with a thickness, would stand in the ground."""
    made = quiet(robot(foot=""))
    plan = gaitopt.plan_crawl(made, gaitopt.s_columns(0, columns=2, robot=made))
    result = gaitopt.simulate(plan)
    assert result.passed and not result.settings.limbs
