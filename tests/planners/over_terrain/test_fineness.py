"""How finely the search looks: usually, at dead ends, and as a check of refusals."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

import gaitopt
from gaitopt.planners.over_terrain.places import grid_shares
from gaitopt.planners.over_terrain.settings import TerrainSettings
from gaitopt.planners.over_terrain.setup import first_layer, search_for
from gaitopt.planners.over_terrain.ways.fineness import AT_DEAD_ENDS, FINE, USUAL
from gaitopt.planners.over_terrain.ways.tries import FURTHER, ways_of
from tests.helpers.terrain_steps import judge_and_pairs

GO2 = gaitopt.load_robot("go2")


def test_a_grid_over_a_triangle_has_its_corners_and_lies_in_it() -> None:
    shares = grid_shares(5)
    assert len(shares) == 15 and np.allclose(shares.sum(axis=1), 1.0)
    assert shares.min() >= 0.0
    assert all((np.abs(shares - corner).max(axis=1) < 1e-12).any() for corner in np.eye(3))


@pytest.mark.parametrize("name", ["go2", "wang2020"])
def test_a_finer_look_finds_all_that_the_usual_one_finds_and_more(name: str) -> None:
    judge, pairs = judge_and_pairs(name, 0.08)
    usual, fine = (judge.judge(pairs, fineness).possible for fineness in (USUAL, FINE))
    assert (fine | ~usual).all() and usual.any()
    assert fine.sum() > usual.sum() or name == "wang2020"


def test_at_dead_ends_more_footholds_are_tried_and_the_usual_ones_are_near_them() -> None:
    ground = gaitopt.make_ground("rubble", robot=GO2, length=0.9, difficulty=0.5)
    search = search_for(GO2, ground, (0.4, 0.0), (0.0, 0.0, 0.0), TerrainSettings.for_robot(GO2))
    place = search.usual(0, 1)
    few, more = (search._thinned(place, 0, 1, how)[0] for how in (USUAL, AT_DEAD_ENDS))
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
    assert set(search._candidates(layer, legs, Counter(), FINE)[2]) == {0, 1, 2, 3}
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
