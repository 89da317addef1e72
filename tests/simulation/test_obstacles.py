"""Obstacles of a stride in physics: they are where the plan has them, and limbs touch them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import gaitopt
from gaitopt import Obstacle, Plan, rectangular_obstacle, round_obstacle, triangular_obstacle
from gaitopt.simulation.obstacles import corners

pytest.importorskip("mujoco")


@pytest.mark.parametrize(
    "obstacle",
    [
        rectangular_obstacle(0.11, 0.04, position=(0.3, -0.2, 0.1), yaw=0.4),
        round_obstacle(0.03, position=(1.0, 0.5, 0.0), yaw=-2.0),
        triangular_obstacle(0.08, 0.06),
        rectangular_obstacle(0.05, 0.1).inflated(0.02),
    ],
    ids=["board", "log", "ridge", "board with a margin"],
)
def test_corners_lie_on_the_surface_and_the_hull_is_the_obstacle(obstacle: Obstacle) -> None:
    points = corners(obstacle)
    assert np.abs(obstacle.distance(points)).max() < 1e-12
    local = obstacle.to_local(points)
    assert (local.min(axis=0)[0], local.max(axis=0)[0]) == pytest.approx(obstacle.extent)
    assert np.ptp(local[:, 1]) == pytest.approx(obstacle.length)
    assert local[:, 2].max() == pytest.approx(obstacle.height)


@pytest.fixture(scope="module")
def stride() -> Plan:
    """anymal_c steps over a board, without steps before and after it."""
    robot = gaitopt.load_robot("anymal_c")
    return gaitopt.plan_stride(robot, rectangular_obstacle(0.05, 0.03), approach=0, leave=0)


def test_a_stride_touches_nothing_but_the_ground(stride: Plan) -> None:
    result = gaitopt.simulate(stride)
    assert result.passed, result
    assert result.bumps == ()


def test_a_board_that_is_higher_than_planned_is_hit(stride: Plan) -> None:
    """Feet and shanks that would have gone through it are stopped by it, or miss."""
    asked = stride.settings
    higher = replace(asked, obstacles=(rectangular_obstacle(0.3, 0.03),))  # type: ignore[call-arg]
    result = gaitopt.simulate(replace(stride, settings=higher))
    assert result.bumps or result.missed
    assert not result.passed
