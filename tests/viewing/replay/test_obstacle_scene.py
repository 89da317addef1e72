"""The obstacles in a replay are those of the plan, in shape and place, solid and lit."""

from __future__ import annotations

import numpy as np
import pytest

from gaitopt.terrain.obstacles import (
    Obstacle,
    rectangular_obstacle,
    round_obstacle,
    triangular_obstacle,
)
from gaitopt.viewing.replay.encoding import commands
from gaitopt.viewing.replay.obstacle_scene import SIDES, obstacle_scene
from gaitopt.viewing.replay.scene import Segments, Surface

BOARD = rectangular_obstacle(0.11, 0.04, position=(0.8, 0.1, -0.02), yaw=0.3)
RIDGE = triangular_obstacle(0.2, 0.3, apex=0.05)
LOG = round_obstacle(0.2, length=1.0, position=(2.0, 0.0, 0.0))
ALL = [BOARD, RIDGE, LOG, BOARD.inflated(0.03)]


def surfaces(obstacle: Obstacle) -> list[Surface]:
    parts = obstacle_scene([obstacle]).nodes[1].parts
    for part in parts:
        assert np.array_equal(part.pose, np.eye(4))
    return [part.shape for part in parts if isinstance(part.shape, Surface)]


def volume(obstacle: Obstacle) -> float:
    """Volume within the triangles, by the divergence theorem: positive when they face outward."""
    found = surfaces(obstacle)
    corners = np.concatenate([s.vertices[s.faces] for s in found])
    return float(np.linalg.det(corners).sum() / 6.0)


def test_no_obstacle_no_frame() -> None:
    assert obstacle_scene(()).nodes == ()


def test_each_obstacle_has_its_frame_below_one() -> None:
    nodes = obstacle_scene([BOARD, LOG]).nodes
    assert [node.path for node in nodes] == [
        ("obstacles",), ("obstacles", "0"), ("obstacles", "1"),
    ]  # fmt: skip


def test_the_board_has_its_volume_and_faces_outward() -> None:
    assert volume(BOARD) == pytest.approx(0.11 * 0.04 * 1.5)
    assert volume(RIDGE) == pytest.approx(0.5 * 0.2 * 0.3 * 1.5)
    assert np.pi * 0.01 < volume(LOG) < np.pi * 0.01 * (1.0 + 2.0 / SIDES)


@pytest.mark.parametrize("obstacle", ALL)
def test_corners_lie_on_the_obstacle(obstacle: Obstacle) -> None:
    corners = np.concatenate([s.vertices for s in surfaces(obstacle)])
    off = obstacle.distance(corners)
    assert np.abs(off).max() <= obstacle.rounding * 2.0 / SIDES + 1e-12
    assert corners[:, 2].max() == pytest.approx(obstacle.position[2] + obstacle.height)


@pytest.mark.parametrize("obstacle", ALL)
def test_it_is_lit_opaque_and_casts_a_shadow(obstacle: Obstacle) -> None:
    for part in obstacle_scene([obstacle]).nodes[1].parts:
        solid = isinstance(part.shape, Surface)
        assert part.appearance.lit == part.appearance.casts_shadow == solid
        assert part.appearance.opacity == 1.0 or not solid


def test_edges_of_the_board_are_those_of_a_box() -> None:
    edges = next(
        p.shape for p in obstacle_scene([BOARD]).nodes[1].parts if isinstance(p.shape, Segments)
    )
    lengths = np.linalg.norm(np.diff(edges.points.reshape(-1, 2, 3), axis=1)[:, 0], axis=1)
    assert sorted(np.round(lengths, 9)) == [0.04] * 4 + [0.11] * 4 + [1.5] * 4


def test_only_round_sides_are_shaded_as_round() -> None:
    assert [s.smooth for s in surfaces(BOARD)] == [False, False]
    assert [s.smooth for s in surfaces(LOG)] == [True, False]


def test_the_viewer_gets_it() -> None:
    assert len(commands(obstacle_scene(ALL))) > len(commands(obstacle_scene([BOARD])))
