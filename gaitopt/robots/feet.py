"""The balls that are a robot's feet, as its URDF has them."""

from __future__ import annotations

import io
import math
from typing import Any


def ball_radius(urdf: str, links: list[str]) -> float:
    """Radius of the smallest ball among the collision shapes of the foot ``links`` [m].

    It is 0 where a link has no ball, because its foot is a mesh or has no shape.
    """
    import yourdfpy

    robot = yourdfpy.URDF.load(
        io.BytesIO(urdf.encode()),
        build_scene_graph=False,
        load_meshes=False,
        load_collision_meshes=False,
        mesh_dir="",
    )
    radii = [_smallest_ball(robot.link_map.get(name)) for name in links]
    radius = min(radii)
    return 0.0 if math.isinf(radius) else radius


def _smallest_ball(link: Any) -> float:
    """Radius of the smallest ball of a link [m]; infinite where it has none."""
    shapes = [] if link is None else link.collisions
    spheres = [c.geometry.sphere for c in shapes if c.geometry and c.geometry.sphere]
    return min((float(s.radius) for s in spheres), default=math.inf)
