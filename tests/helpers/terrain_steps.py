"""Steps for the search over terrain to judge."""

from __future__ import annotations

import numpy as np

import gaitopt
from gaitopt import HeightMap
from gaitopt.planners.over_terrain.judge import Judge
from gaitopt.planners.over_terrain.pairs import Pairs
from gaitopt.planners.over_terrain.settings import TerrainSettings
from gaitopt.planners.over_terrain.setup import first_layer, search_for

LEG = 2
"""The leg that steps: RH."""


def judge_and_pairs(name: str, rough: float) -> tuple[Judge, Pairs]:
    """Steps of RH from feet that stand up to ``rough`` above and below their usual heights [m]."""
    robot, rng = gaitopt.load_robot(name), np.random.default_rng(7)
    flat = HeightMap(np.zeros((100, 100)), 0.02, (-1.0, -1.0))
    search = search_for(robot, flat, (0.5, 0.0), (0.0, 0.0, 0.0), TerrainSettings.for_robot(robot))
    layer, count = first_layer(search), 40
    feet = np.tile(layer.feet, (count, 1, 1))
    feet += rng.uniform(-rough, rough, feet.shape)
    target = feet[:, LEG] + rng.uniform([0.0, -0.05, -rough], [0.15, 0.05, rough], (count, 3))
    return search.judge, Pairs(feet, np.tile(layer.body, (count, 1)), target, np.zeros(count), LEG)
