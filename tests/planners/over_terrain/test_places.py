"""Places and heights of the body for steps of the search over terrain."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

import gaitopt
from gaitopt import LEGS, HeightMap
from gaitopt.planners.over_terrain.settings import TerrainSettings
from gaitopt.planners.over_terrain.setup import search_for
from gaitopt.robots.rotations import rpy_to_matrix
from gaitopt.robots.whole_body import configuration
from gaitopt.stability.support import triangle_half_planes
from tests.helpers.terrain_steps import LEG, judge_and_pairs


@pytest.mark.parametrize("name", ["go2", "wang2020"])
def test_the_true_centre_of_mass_keeps_the_margin_where_legs_reach(name: str) -> None:
    """Pinocchio says where it is, with the flying foot where it lifts off and where it lands."""
    judge, pairs = judge_and_pairs(name, 0.02)
    robot, posture = judge.robot, judge.postures(pairs)
    places, there = judge.places.of_pairs(pairs, posture)
    reached = judge._reached(pairs, posture, places) & there[:, None]
    normals, offsets = triangle_half_planes(np.delete(pairs.feet[..., :2], LEG, axis=1))
    data, least = robot.model.createData(), []
    for k, p in np.argwhere(reached):
        pose = np.append(places[k, p], posture[k, 1:])
        for foot in (pairs.feet[k, LEG], pairs.target[k]):
            feet = pairs.feet[k].copy()
            feet[LEG] = foot
            local = judge.limbs.local(feet[None], pose[None])[0]
            joints = np.zeros(len(robot.joint_names))
            for leg, point in zip(LEGS, local, strict=True):
                joints[list(robot.leg_columns[leg])] = robot.legs[leg].inverse(point)
            axes = rpy_to_matrix(pose[3:]) @ robot.body_axes.T
            base = pose[:3] - rpy_to_matrix(pose[3:]) @ robot.centre
            q = pin.neutral(robot.model)
            q[:3], q[3:7] = base, pin.Quaternion(axes).coeffs()
            q[7:] = configuration(robot, np.zeros(3), np.zeros(3), joints)[7:]
            com = pin.centerOfMass(robot.model, data, q)[:2]
            least.append((normals[k] @ com - offsets[k]).min())
    assert len(least) > 200
    assert min(least) > judge.settings.stability_margin


def test_fitted_heights_are_the_nearest_from_which_all_legs_reach() -> None:
    judge, pairs = judge_and_pairs("go2", 0.05)
    posture = judge.postures(pairs, 1.3)
    places, _ = judge.places.of_pairs(pairs, posture)
    assert judge._reached(pairs, posture, places).mean() < 0.1
    fitted = places.copy()
    fitted[..., 2] = judge.heights.fitted(pairs, posture, places)
    reached = judge._reached(pairs, posture, fitted)
    assert reached.mean() > 0.6
    assert (fitted[..., 2] <= places[..., 2]).all()
    higher = fitted + np.array([0.0, 0.0, 0.02 * judge.robot.standing_height])
    assert not judge._reached(pairs, posture, higher)[reached & (fitted < places)[..., 2]].any()


def test_unknown_ground_reaches_farther_in_while_footholds_are_searched_for() -> None:
    z = np.zeros((60, 60))
    z[:20] = np.nan
    robot = gaitopt.load_robot("go2")
    search = search_for(robot, HeightMap(z, 0.02, (-0.8, -0.6)), (0.3, 0.0), (0.05, 0.0, 0.0),
                        TerrainSettings.for_robot(robot, freedom=0.3))  # fmt: skip
    x = np.arange(-0.5, 0.0, 0.002)
    line, size = np.column_stack([x, 0.0 * x]), np.array([0])
    as_it_is, narrowed = (
        x[np.isfinite(surfaces.clear_heights(line, size))].min()
        for surfaces in (search.limbs.surfaces, search.judge.surfaces)
    )
    assert 0.018 < narrowed - as_it_is < 0.032


def test_where_little_ground_is_fit_to_stand_on_a_step_may_go_farther() -> None:
    """Across a hole, in whose middle there is no place to stand within the freedom."""
    x = np.arange(-0.8, 1.6, 0.02)
    hole = 0.0 * x
    hole[(x > 0.5) & (x < 0.74)] = -0.4
    ground = HeightMap(np.tile(hole[:, None], (1, 80)), 0.02, (-0.8, -0.8))
    robot = gaitopt.load_robot("go2")
    search = search_for(robot, ground, (0.9, 0.0), (0.0, 0.0, 0.0),
                        TerrainSettings.for_robot(robot, detours=False))  # fmt: skip
    middle = np.array([0.62, 0.13])
    assert not search.stands.near(ground, middle, search.judge.settings.freedom).size
    assert search.candidates.near(middle).size
    beside = np.array([0.0, 0.13])
    assert len(search.candidates.near(beside)) == len(
        search.stands.near(ground, beside, search.judge.settings.freedom)
    )
