"""Random poses, and small problems of time-optimal walks."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import gaitopt
from gaitopt import Quadruped
from gaitopt.optimize.route.legs import FOOT
from gaitopt.optimize.route.problem import RouteProblem
from gaitopt.plan.settings.freedoms import VARIANTS
from gaitopt.plan.settings.time_optimal import RouteSettings
from gaitopt.planners.time_optimal.build import build_route
from gaitopt.planners.time_optimal.walk import prepare_route

Array = NDArray[np.float64]


def poses_near_standing(
    robot: Quadruped, count: int, seed: int, spread: float
) -> tuple[Array, Array, Array]:
    """Poses near standing ``(K, 9)``, the places of the feet ``(K, 4, 3)``, and who swings.

    Feet are up to ``spread`` of the standing height off the places below their hips.
    """
    rng = np.random.default_rng(seed)
    size = robot.standing_height
    below = [leg.hip + leg.axes[:, 1] * leg.lateral for leg in robot.legs.values()]
    feet = np.array(below) * [1, 1, 0] + spread * size * rng.uniform(-1, 1, (count, 4, 3))
    swing = np.eye(4)[rng.integers(0, 4, count)]
    poses = np.zeros((count, 9))
    poses[:, :3] = robot.centre * [1, 1, 0] + [0, 0, size]
    poses[:, :6] += rng.uniform(-1, 1, (count, 6)) * [0.02, 0.02, 0.02, 0.2, 0.2, 0.2]
    poses[:, FOOT] = (feet * swing[..., None]).sum(axis=1)
    poses[:, 8] += 0.1 * size
    return poses, feet, swing


@pytest.fixture(scope="session")
def random_poses() -> Callable[..., tuple[Array, Array, Array]]:
    """:func:`poses_near_standing`."""
    return poses_near_standing


def small_walk(robot: Quadruped, variant: str, steps: int = 4, **settings: Any) -> RouteProblem:
    """The problem of the first ``steps`` of a random terrain, with all joint position limits."""
    chosen = RouteSettings(free=VARIANTS[variant], **settings, timing="velocity")
    route = prepare_route(robot, gaitopt.s_columns(2, columns=3), chosen)
    _, problem = build_route(route.window(0, steps))
    return replace(problem, used_limits=np.ones((2, 12), dtype=np.bool_))


@pytest.fixture(scope="session")
def small_problem() -> Callable[..., RouteProblem]:
    """:func:`small_walk`."""
    return small_walk
