"""The obstacles of a plan as a scene: wooden solids with drawn edges."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.terrain.obstacles import Obstacle
from gaitopt.viewing.replay.scene import Appearance, FramePath, Node, Part, Scene, Segments, Surface

OBSTACLES: FramePath = ("obstacles",)
WOOD, GRAIN = "#c79a63", "#6d4a26"
SIDES = 64
"""Flat sides of a full circle of a round section. Chosen here: enough to look round."""


def obstacle_scene(obstacles: Iterable[Obstacle]) -> Scene:
    """All obstacles, each in a frame of its own: ``("obstacles", "0")`` and so on."""
    nodes = [Node((*OBSTACLES, str(i)), _parts(found)) for i, found in enumerate(obstacles)]
    return Scene((Node(OBSTACLES), *nodes) if nodes else ())


def _parts(obstacle: Obstacle) -> tuple[Part, ...]:
    """Sides, ends and edges of an obstacle."""
    vertices, faces = obstacle.mesh(SIDES)
    n = len(vertices) // 2
    # The first 2 n triangles of the mesh are its sides, the others its ends. They are separate
    # surfaces, so that round sides look smooth, and their edges sharp.
    wood = Appearance(WOOD)
    sides = Part(Surface(vertices, faces[: 2 * n], smooth=obstacle.rounding > 0.0), wood)
    ends = Part(Surface(vertices, faces[2 * n :], smooth=False), wood)
    edges = Part(
        Segments(_edges(obstacle, vertices)), Appearance(GRAIN, 0.8, lit=False, casts_shadow=False)
    )
    return sides, ends, edges


def _edges(obstacle: Obstacle, vertices: FloatArray) -> FloatArray:
    """Ends of the edges ``(2 k, 3)`` [m]: around both ends, and along the section's corners."""
    near, far = np.split(vertices, 2)
    pairs = [np.stack([rim, np.roll(rim, -1, axis=0)], axis=1) for rim in (near, far)]
    if obstacle.rounding == 0.0:
        pairs.append(np.stack([near, far], axis=1))
    return np.concatenate(pairs).reshape(-1, 3)
