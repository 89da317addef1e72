"""Shanks next to their feet: points on them find the ground where coal finds it."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from pinocchio import coal

import gaitopt
from gaitopt import LEGS, HeightMap, Quadruped
from gaitopt.certificate.ground.solids import Solids
from gaitopt.planners.over_terrain.links.limbs import Limbs
from gaitopt.planners.over_terrain.links.link_spheres import link_spheres
from gaitopt.planners.over_terrain.settings import TerrainSettings
from gaitopt.planners.over_terrain.setup import first_layer, search_for
from gaitopt.planners.over_terrain.surfaces import Surfaces

CELL = 0.005


def stance(robot: Quadruped) -> tuple[np.ndarray, np.ndarray]:
    """A standing pose of the body ``(1, 6)``, with feet on the level z = 0, and the joints."""
    joints = robot.standing_joints()
    feet = [robot.legs[leg].forward(joints[list(robot.leg_columns[leg])]) for leg in LEGS]
    pose = np.zeros((1, 6))
    pose[0, 2] = robot.centre[2] - np.mean(feet, axis=0)[2] + robot.foot_radius
    return pose, np.stack([joints[list(robot.leg_columns[leg])] for leg in LEGS])[None]


def clear(robot: Quadruped, edge: float, side: float, height: float) -> bool:
    """Whether the shank of LH is clear of a stone that begins at x = ``edge``."""
    x = CELL * np.arange(-140, 140)
    z = np.where(side * (x - edge) >= -1e-9, height, -0.001)[:, None] * np.ones((1, 200))
    ground = HeightMap(z, CELL, (float(x[0]), -0.5))
    # Tables for balls are not looked at.
    none = np.zeros(0, dtype=int)
    surfaces = Surfaces(ground, CELL, none, np.zeros((0, 1, 1)))
    limbs = Limbs(robot, surfaces, 0.0, link_spheres(robot), none, (none,) * 4)
    return bool(limbs.near_feet_clear(*stance(robot))[0, LEGS.index("LH")])


@pytest.mark.parametrize("name", ["go2", "hyq"])
def test_points_of_a_shank_touch_a_stone_where_coal_says_so(name: str) -> None:
    robot = gaitopt.load_robot(name)
    pose, joints = stance(robot)
    leg = robot.legs["LH"]
    foot = (leg.forward(joints[0, LEGS.index("LH")]) - robot.centre) + pose[0, :3]
    heights = np.arange(0.25, 4.0, 0.1) * robot.foot_radius
    model, data = robot.model, robot.model.createData()
    q = pin.neutral(model)
    q[:3] = pose[0, :3] - robot.body_axes @ robot.centre
    q[7:] = robot.standing_joints()
    pin.forwardKinematics(model, data, q)
    joint = model.frames[model.getFrameId(leg.foot)].parentJoint
    # The shank leans over the stone.
    side = float(np.sign(data.oMi[joint].translation[0] - foot[0]))
    edge = CELL * round((foot[0] + 1.2 * side * robot.foot_radius) / CELL)
    parts = [solid for solid in Solids.of(robot).parts if solid.joint == joint]

    def gap(height: float) -> float:
        stone = coal.Box(1.0, 1.0, 1.0)
        at = coal.Transform3s(np.eye(3), np.array([edge + 0.5 * side, foot[1], height - 0.5]))
        place = data.oMi[joint]
        gaps = []
        for solid in parts:
            there = solid.transform(place.rotation, place.translation)
            gaps.append(coal.distance(solid.shape, there, stone, at, coal.DistanceRequest(),
                                      coal.DistanceResult()))  # fmt: skip
        return float(min(gaps))

    touches = np.array([gap(h) <= 0.0 for h in heights])
    found = np.array([not clear(robot, edge, side, h) for h in heights])
    # A stone of the map has a steep side of one cell, and coal's an upright one.
    assert touches.any() and not touches.all()
    assert abs(int(touches.argmax()) - int(found.argmax())) <= 2


def test_feet_begin_where_their_shanks_are_clear() -> None:
    robot = gaitopt.load_robot("hyq")
    ground = gaitopt.make_ground("rubble", seed=1, difficulty=0.5, length=3.0, robot=robot)
    search = search_for(robot, ground, (1.5, 0.2, 0.0), (1.5, -0.2, 0.0),
                        TerrainSettings.for_robot(robot))  # fmt: skip
    layer = first_layer(search)
    assert search.limbs.stands_clear(layer.feet, layer.body).all()
    usual = np.array([search.usual(leg, 0) for leg in range(4)])
    nearest = [search.stands.near(ground, place, 0.2) for place in usual]
    nearest = [n[np.linalg.norm(search.stands.centres[n, :2] - p, axis=1).argmin()]
               for n, p in zip(nearest, usual, strict=True)]  # fmt: skip
    # The nearest stands do not all do.
    assert list(layer.stands[0]) != [int(n) for n in nearest]
