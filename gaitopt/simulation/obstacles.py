"""Obstacles in the way of a stride as shapes of MuJoCo: feet, limbs and trunk touch them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.simulation.settings import SimulationSettings
from gaitopt.simulation.shapes import ground_bits, surface
from gaitopt.terrain.obstacles import Obstacle

OBSTACLE = "gaitopt obstacle "
"""Beginning of the names of these shapes."""

ROUND = 48
"""Corners that stand for a circle: they lie inside of it by 0.2 % of its radius."""


def add_obstacles(
    mujoco: Any, spec: Any, obstacles: Sequence[Obstacle], settings: SimulationSettings, own: bool
) -> None:
    """Add obstacles to the world.

    Args:
        mujoco, spec: the package, and the model that is made.
        obstacles: in the way.
        settings: of the contacts.
        own: whether the shapes of the robot are those of its file.
    """
    for number, obstacle in enumerate(obstacles):
        mesh = spec.add_mesh(name=f"{OBSTACLE}{number}")
        mesh.uservert = corners(obstacle).reshape(-1).tolist()
        spec.worldbody.add_geom(
            name=mesh.name, type=mujoco.mjtGeom.mjGEOM_MESH, meshname=mesh.name,
            **ground_bits(own), **surface(settings),
        )  # fmt: skip


def corners(obstacle: Obstacle) -> FloatArray:
    """Points in the world whose convex hull is the obstacle, or nearly so ``(n, 3)`` [m]."""
    section = np.array(obstacle.core)
    if obstacle.rounding > 0.0:
        turns = 2.0 * np.pi * np.arange(ROUND) / ROUND
        ring = obstacle.rounding * np.column_stack([np.cos(turns), np.sin(turns)])
        section = (section[:, None] + ring).reshape(-1, 2)
    half = np.full(len(section), obstacle.length / 2.0)
    ends = [np.column_stack([section[:, 0], side * half, section[:, 1]]) for side in (-1.0, 1.0)]
    return obstacle.to_world(np.concatenate(ends))
