"""Estimates of how long steps take, and the cost of a way, which is made of them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import gaitopt
from gaitopt import LEGS, HeightMap
from gaitopt.planners.over_terrain.links.pace import (
    BODY_ACCELERATION,
    FOOT_ACCELERATION,
    Pace,
)
from gaitopt.planners.over_terrain.search import Search
from gaitopt.planners.over_terrain.settings import TerrainSettings
from gaitopt.planners.over_terrain.setup import search_for

LH = LEGS.index("LH")


def searching(name: str) -> Search:
    robot = gaitopt.load_robot(name)
    flat = HeightMap(np.zeros((100, 60)), 0.02, (-0.8, -0.6))
    return search_for(robot, flat, (0.3, 0.0), (0.0, 0.0, 0.0), TerrainSettings.for_robot(robot))


@pytest.fixture(scope="module")
def paces() -> dict[str, Pace]:
    return {name: searching(name).pace for name in ("go2", "wang2020")}


def test_a_body_with_quick_joints_speeds_up_and_slows_down_evenly(paces: dict[str, Pace]) -> None:
    """Half of the way is speeding up: d / 2 = a (t / 2)^2 / 2."""
    time = paces["go2"].of_moves(np.array([0.1, 0.4]), np.zeros((2, 4, 3)))
    assert np.allclose(BODY_ACCELERATION * (time / 2.0) ** 2, [0.1, 0.4])


def test_a_body_with_slow_joints_takes_as_long_as_the_slowest_one(paces: dict[str, Pace]) -> None:
    pace = paces["wang2020"]
    turns = np.zeros((1, 4, 3))
    turns[0, LH, 2] = -0.5
    expected = 0.5 / gaitopt.load_robot("wang2020").legs["LH"].velocity_limits[2]
    assert pace.of_moves(np.array([1e-4]), turns)[0] == pytest.approx(expected)


def test_a_swing_takes_as_long_as_its_joints_or_its_foot_need(paces: dict[str, Pace]) -> None:
    pace = paces["go2"]
    start, end = np.array([[-0.2, 0.14, -0.28]]), np.array([[-0.1, 0.14, -0.28]])
    rise, pose = np.array([0.03]), np.zeros((1, 6))
    quick = replace(pace, velocities=np.full((4, 3), np.inf))
    foot = 2.0 * np.sqrt((0.1 + 2 * 0.03) / FOOT_ACCELERATION)
    assert quick.of_swings(LH, start, end, rise, pose)[0] == pytest.approx(foot)
    # Very slow joints: time is inverse to their velocity, and straight back it is as long.
    slow = [replace(pace, velocities=np.full((4, 3), v)) for v in (1e-3, 2e-3)]
    one, two = (p.of_swings(LH, start, end, rise, pose)[0] for p in slow)
    assert one == pytest.approx(2.0 * two, rel=1e-6)
    assert slow[0].of_swings(LH, end, start, rise, pose)[0] == pytest.approx(one)


@pytest.mark.parametrize("name", ["go2", "wang2020"])
def test_the_estimate_is_near_the_time_that_forces_and_joints_give(name: str) -> None:
    """Quick joints, whose pace forces set, and slow ones: 0.3 to 5 s a step."""
    robot = gaitopt.load_robot(name)
    ground = gaitopt.make_ground("rubble", robot=robot, length=1.2, difficulty=0.4)
    way = robot, ground, (0.15, 0.0)
    search = gaitopt.search_terrain(*way, start=(0.0, 0.0, 0.0))
    plan = gaitopt.plan_terrain(*way, start=(0.0, 0.0, 0.0), search=search)
    walked = plan.swings[-1].end
    # The range of ten longer walks (docs/terrain.md).
    assert 0.91 <= search.estimate / walked <= 1.06
    assert search.estimate < search.cost
