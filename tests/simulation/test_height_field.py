"""Walks on a height map in physics: its surface is that of the map, and places judge landings."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import gaitopt
from gaitopt import LEGS, Footholds, HeightMap, InputError, Plan, Quadruped
from gaitopt.errors import GroundError
from gaitopt.simulation.height_field import add_height_field, within_reach
from gaitopt.simulation.model import build_sim_model
from gaitopt.simulation.settings import SimulationSettings

mujoco = pytest.importorskip("mujoco")

BALL = 0.003
DEPTH = 5e-4


def level_map(footholds: Footholds, resolution: float, margin: float = 1.0) -> HeightMap:
    """A map of height 0 around footholds."""
    places = footholds.array[..., :2].reshape(-1, 2)
    low, high = places.min(axis=0) - margin, places.max(axis=0) + margin
    return HeightMap(np.zeros(np.ceil((high - low) / resolution).astype(int)), resolution, low)


def on_level_ground(robot: Quadruped, resolution: float, columns: int = 3) -> Footholds:
    flat = gaitopt.s_columns(0, columns=columns, robot=robot).with_(radius=None)
    return flat.raised(robot.foot_radius).with_(ground=level_map(flat, resolution))


def on_plane(plan: Plan) -> Plan:
    return replace(plan, footholds=plan.footholds.with_(ground=None))


def small_ball_on(robot: Quadruped, ground: HeightMap) -> tuple[Any, Any]:
    """MuJoCo's model of a map with a small ball, and its state."""
    footholds = gaitopt.s_columns(0, columns=1).with_(radius=None, ground=ground)
    spec = mujoco.MjSpec()
    add_height_field(mujoco, spec, "ground", robot, footholds, {"condim": 3})
    ball = spec.worldbody.add_body(name="ball")
    ball.add_freejoint()
    ball.add_geom(type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[BALL, 0, 0], mass=1.0)
    model = spec.compile()
    return model, mujoco.MjData(model)


@pytest.mark.parametrize("resolution", [0.02, 0.05])
def test_the_surface_is_that_of_the_map(wang: Quadruped, resolution: float) -> None:
    """A ball is pressed by half a millimetre into random triangles of a rough, oblong map."""
    rng = np.random.default_rng(0)
    ground = HeightMap(rng.uniform(-0.3, -0.3 + resolution, (60, 70)), resolution, (-0.5, -0.7))
    model, data = small_ball_on(wang, ground)
    tried = 0
    for place in rng.uniform([-0.45, -0.65], [0.6, 0.6], (400, 2)):
        u, v = (place - ground.origin) / ground.resolution % 1.0
        # Near to an edge a ball may touch the next triangle first.
        if min(u, v, 1.0 - u, 1.0 - v, abs(u - v)) < 0.2:
            continue
        inwards = (BALL - DEPTH) * ground.normal(place)
        data.qpos[:3] = np.append(place, ground.height(place)) + inwards
        mujoco.mj_forward(model, data)
        assert data.contact.dist.min() == pytest.approx(-DEPTH, abs=1e-7)
        tried += 1
    assert tried > 50


def test_nothing_stands_where_the_height_is_not_known(wang: Quadruped) -> None:
    """It is a pit, by the length of a leg deeper than the lowest point, which is elsewhere."""
    z = np.zeros((40, 40))
    z[18:23, 18:23] = np.nan
    z[0, 0] = -0.05
    model, data = small_ball_on(wang, HeightMap(z, 0.05, (-1.0, -1.0)))
    leg = max(leg.reach for leg in wang.legs.values())
    for (x, y), lowest in (((0.02, 0.01), -0.05 - leg), ((0.4, 0.38), 0.0)):
        data.qpos[:3] = [x, y, lowest + BALL + DEPTH]
        mujoco.mj_forward(model, data)
        assert data.ncon == 0
        data.qpos[2] -= 2.0 * DEPTH
        mujoco.mj_forward(model, data)
        assert data.contact.dist.min() == pytest.approx(-DEPTH, abs=1e-6)


def test_only_what_the_robot_reaches_is_kept(wang: Quadruped) -> None:
    rng = np.random.default_rng(1)
    ground = HeightMap(rng.uniform(0.0, 0.1, (400, 300)), 0.05, (-10.0, -7.0))
    footholds = gaitopt.s_columns(0, columns=3).with_(radius=None, ground=ground)
    part = within_reach(wang, footholds)
    assert part.z.size < 0.1 * ground.z.size
    (x0, x1), (y0, y1) = part.extent
    places = footholds.array[..., :2].reshape(-1, 2)
    assert x0 < places[:, 0].min() - 1.0 and x1 > places[:, 0].max() + 1.0
    assert y0 < places[:, 1].min() - 1.0 and y1 > places[:, 1].max() + 1.0
    spots = rng.uniform([x0, y0], [x1, y1], (100, 2))
    np.testing.assert_allclose(part.height(spots), ground.height(spots), rtol=0, atol=1e-12)


def test_a_map_that_is_elsewhere_is_refused(wang: Quadruped) -> None:
    elsewhere = HeightMap(np.zeros((10, 10)), 0.1, (50.0, 0.0))
    footholds = gaitopt.s_columns(0, columns=2).with_(radius=None, ground=elsewhere)
    with pytest.raises(GroundError, match=r"no known point of the map is within \d\.\d m"):
        within_reach(wang, footholds)


def test_a_map_has_no_columns_that_could_be_wrong(wang: Quadruped) -> None:
    settings = SimulationSettings(column_errors=(("LF", 0, 0.01),))
    with pytest.raises(InputError, match="a height map have no columns"):
        build_sim_model(wang, on_level_ground(wang, 0.05, 2), settings)


def test_legs_may_have_different_numbers_of_columns(wang: Quadruped) -> None:
    points = dict(gaitopt.s_columns(0, columns=3).points)
    points["LH"] = points["LH"][:2]
    order = ("LF", "RF", "RH", "LH", "LF", "RF", "RH")
    footholds = Footholds(points, 0.02, order=order)
    sim = build_sim_model(wang, footholds, SimulationSettings())
    assert sim.columns.shape == (4, 3)
    row = sim.columns[LEGS.index("LH")]
    assert row[1] == row[2] and len(np.unique(sim.columns)) == 11


@pytest.mark.parametrize(
    ("timestep", "every", "expected"),
    [(0.002, 3, (0.001, 6)), (0.0025, 2, (0.0025 / 3, 6)), (0.001, 6, (0.001, 6)),
     (0.0004, 4, (0.0004, 4)), (0.003, 1, (0.001, 3))],
)  # fmt: skip
def test_steps_are_short_on_a_map(timestep: float, every: int, expected: tuple[float, int]) -> None:
    """The controller is called as often."""
    settings = SimulationSettings(timestep=timestep, control_every=every)
    found = settings.on_height_map()
    assert (found.timestep, found.control_every) == (pytest.approx(expected[0]), expected[1])
    assert found.control_interval == pytest.approx(settings.control_interval)


@pytest.fixture(scope="module")
def walk() -> Plan:
    """Eight steps of go2 on a level map."""
    robot = gaitopt.load_robot("go2")
    return gaitopt.plan_crawl(robot, on_level_ground(robot, 0.01))


def test_a_level_map_is_walked_as_a_plane_is(walk: Plan) -> None:
    result, plain = gaitopt.simulate(walk), gaitopt.simulate(on_plane(walk))
    assert result.passed and plain.passed, str(result)
    assert result.landing_error == pytest.approx(plain.landing_error, abs=1e-3)
    ours, theirs = result.motion, plain.motion
    samples = min(len(ours.t), len(theirs.t))
    assert np.abs(ours.feet[:samples] - theirs.feet[:samples]).max() < 5e-3
    assert np.abs(ours.q[:samples, :3] - theirs.q[:samples, :3]).max() < 3e-3


@pytest.mark.parametrize("resolution", [0.02, 0.01])
def test_heavy_feet_do_not_creep_on_small_cells(resolution: float) -> None:
    """The feet of anymal_c press on up to 30 triangles at once."""
    robot = gaitopt.load_robot("anymal_c")
    plan = gaitopt.plan_crawl(robot, on_level_ground(robot, resolution))
    result = gaitopt.simulate(plan)
    assert result.passed, str(result)
    # On a plane they roll by 8.2 mm.
    assert result.slip < 0.010 and result.body_error < 3e-3


@pytest.mark.parametrize(("depth", "reason"), [(0.025, "beside"), (0.3, "no contact")])
def test_a_foothold_over_a_hole_is_missed(walk: Plan, depth: float, reason: str) -> None:
    """The controller reaches 30 mm down: to the bottom of one hole, and not of the other."""
    ground, step = walk.footholds.ground, walk.swings[0]
    assert ground is not None
    hole = walk.footholds[step.leg][1, :2]
    near = np.hypot(ground.x[:, None] - hole[0], ground.y[None, :] - hole[1]) < 0.06
    dug = ground.with_heights(np.where(near, -depth, ground.z))
    result = gaitopt.simulate(replace(walk, footholds=walk.footholds.with_(ground=dug)))
    first = result.missed[0]
    assert first.leg == step.leg and first.step == step.step
    assert first.reason == reason and first.distance > 0.02
