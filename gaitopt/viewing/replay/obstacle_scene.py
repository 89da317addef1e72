"""Obstacles that a plan strides over: wooden solids with shaded sides and drawn edges."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.terrain.obstacles import Obstacle
from gaitopt.viewing.replay.scene import FramePath, Look, Node, Part, Scene, Segments, Surface

OBSTACLES: FramePath = ("obstacles",)
WOOD, GRAIN = "#c79a63", "#6d4a26"
SIDES = 64
"""Flat sides that stand for a full turn of a round section."""


def obstacle_scene(obstacles: Iterable[Obstacle]) -> Scene:
    """All obstacles, each in a frame of its own: ``obstacles``, ``0``, ``1`` and so on."""
    nodes = [Node((*OBSTACLES, str(i)), _parts(found)) for i, found in enumerate(obstacles)]
    return Scene((Node(OBSTACLES), *nodes) if nodes else ())


def _parts(obstacle: Obstacle) -> tuple[Part, ...]:
    vertices, faces = obstacle.mesh(SIDES)
    n = len(vertices) // 2
    # The mesh's first 2 n triangles are its sides, the others its ends. They share no corners
    # here, so that a round side is shaded as round up to a sharp rim.
    wood = Look(WOOD)
    sides = Part(Surface(vertices, faces[: 2 * n], smooth=obstacle.rounding > 0.0), wood)
    ends = Part(Surface(vertices, faces[2 * n :], smooth=False), wood)
    edges = Part(Segments(_edges(obstacle, vertices)), Look(GRAIN, 0.8, lit=False, casts=False))
    return sides, ends, edges


def _edges(obstacle: Obstacle, vertices: FloatArray) -> FloatArray:
    """The rims of both ends, and the long edges where the section has corners ``(2 k, 3)`` [m]."""
    near, far = np.split(vertices, 2)
    pairs = [np.stack([rim, np.roll(rim, -1, axis=0)], axis=1) for rim in (near, far)]
    if obstacle.rounding == 0.0:
        pairs.append(np.stack([near, far], axis=1))
    return np.concatenate(pairs).reshape(-1, 3)
