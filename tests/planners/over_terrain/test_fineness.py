"""How finely the search looks: usually, at dead ends, and as a check of refusals."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

import gaitopt
from gaitopt.planners.over_terrain.places import grid_shares
from gaitopt.planners.over_terrain.settings import TerrainSettings
from gaitopt.planners.over_terrain.setup import first_layer, search_for
from gaitopt.planners.over_terrain.ways.fineness import AT_DEAD_ENDS, FINE, USUAL
from gaitopt.planners.over_terrain.ways.kinds import FURTHER, ways_of
from gaitopt.robots.rotations import rpy_to_matrix
from gaitopt.robots.whole_body import base_of_body, configuration
from tests.helpers.terrain_steps import judge_and_pairs

GO2 = gaitopt.load_robot("go2")


def test_a_grid_over_a_triangle_has_its_corners_and_lies_in_it() -> None:
    shares = grid_shares(5)
    assert len(shares) == 15 and np.allclose(shares.sum(axis=1), 1.0)
    assert shares.min() >= 0.0
    assert all((np.abs(shares - corner).max(axis=1) < 1e-12).any() for corner in np.eye(3))


@pytest.mark.parametrize(("name", "rough"), [("go2", 0.12), ("wang2020", 0.08)])
def test_a_finer_look_finds_what_the_usual_one_finds_and_more_which_stands(
    name: str, rough: float
) -> None:
    judge, pairs = judge_and_pairs(name, rough)
    usual, fine = (judge.judge(pairs, fineness) for fineness in (USUAL, FINE))
    assert (fine.possible | ~usual.possible).all() and usual.possible.any()
    more = np.flatnonzero(fine.possible & ~usual.possible)
    assert more.size
    # What it finds beyond the usual look is right, by Pinocchio: feet and the centre of mass.
    for k in more:
        com, feet = with_pinocchio(judge.robot, pairs.feet[k], fine.body[k])
        assert np.allclose(feet, pairs.feet[k], atol=1e-9)
        standing = np.delete(pairs.feet[k, :, :2], pairs.leg, axis=0)
        assert room_in(standing, com[:2]) >= judge.settings.stability_margin
    # A look without the finer places misses some of them.
    coarse = judge.judge(pairs, replace(FINE, grid=0)).possible
    assert (fine.possible | ~coarse).all() and (fine.possible & ~coarse).any()


def with_pinocchio(
    robot: gaitopt.Quadruped, feet: np.ndarray, pose: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Centre of mass ``(3,)`` and feet ``(4, 3)`` of the posture that a pose and feet ask for."""
    turn = rpy_to_matrix(pose[3:])
    local = (feet - pose[:3]) @ turn + robot.centre
    columns = robot.standing_joints()[None].copy()
    angles = [robot.legs[leg].inverse(at) for leg, at in zip(gaitopt.LEGS, local, strict=True)]
    columns[:, robot.leg_joint_columns] = np.concatenate(angles)
    base = base_of_body(robot, pose[:3], turn)
    q, data = configuration(robot, base[:3], base[3:], columns[0]), robot.model.createData()
    com = pin.centerOfMass(robot.model, data, q)
    pin.framesForwardKinematics(robot.model, data, q)
    frames = [robot.model.getFrameId(robot.legs[leg].foot) for leg in gaitopt.LEGS]
    return com.copy(), np.array([data.oMf[frame].translation for frame in frames])


def room_in(triangle: np.ndarray, place: np.ndarray) -> float:
    """Distance of a place from the nearest side of a triangle ``(3, 2)``; negative outside."""
    sides = np.roll(triangle, -1, axis=0) - triangle
    across = np.column_stack([-sides[:, 1], sides[:, 0]]) / np.linalg.norm(sides, axis=1)[:, None]
    turned = np.sign(sides[0, 0] * sides[1, 1] - sides[0, 1] * sides[1, 0])
    return float((turned * ((place - triangle) * across).sum(axis=1)).min())


def test_at_dead_ends_more_footholds_are_tried_and_the_usual_ones_are_near_them() -> None:
    ground = gaitopt.make_ground("rubble", robot=GO2, length=0.9, difficulty=0.5)
    search = search_for(GO2, ground, (0.4, 0.0), (0.0, 0.0, 0.0), TerrainSettings.for_robot(GO2))
    place = search.usual(0, 1)
    few, more = (search.candidates.thinned(place, 0, 1, how)[0] for how in (USUAL, AT_DEAD_ENDS))
    assert len(more) > 1.5 * len(few)
    away = search.stands.centres[few, None, :2] - search.stands.centres[None, more, :2]
    side = AT_DEAD_ENDS.block * search.judge.settings.freedom
    assert np.linalg.norm(away, axis=2).min(axis=1).max() <= 3.0 * side


def test_an_exhaustive_search_tries_all_orders_and_further_ways() -> None:
    flat = gaitopt.make_ground("flat", robot=GO2, length=0.9)
    settings = TerrainSettings.for_robot(GO2, exhaustive=True)
    search = search_for(GO2, flat, (0.2, 0.0), (0.0, 0.0, 0.0), settings)
    layer, usual = first_layer(search), TerrainSettings.for_robot(GO2)
    legs = [search.legs(made) for made in layer.made]
    assert set(search.candidates.of(layer, legs, Counter(), FINE)[2]) == {0, 1, 2, 3}
    assert len(ways_of(settings, {})) == len(ways_of(usual, {})) + len(FURTHER)
    assert settings.longest(3.0) > usual.longest(3.0)
    assert replace(search, fine=True).run([layer]).complete


@pytest.mark.slow
def test_stones_that_are_crossed_only_with_more_footholds_at_dead_ends() -> None:
    robot = gaitopt.load_robot("wang2020")
    stones = gaitopt.make_ground(
        "stepping_stones", seed=20, difficulty=1.0, length=3.0, robot=robot
    )
    assert gaitopt.search_terrain(robot, stones, (3.0, 0.0), start=(0.0, 0.0, 0.0)).complete
