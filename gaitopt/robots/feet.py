"""What a URDF says of the shape of its feet."""

from __future__ import annotations

import io
import math
from typing import Any


def ball_radius(urdf: str, links: list[str]) -> float:
    """Radius [m] of the smallest ball that the URDF fixes to each of the foot ``links``.

    0.0 when the links have no spherical collision shape (a mesh foot, or none).
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
    shapes = [] if link is None else link.collisions
    spheres = [c.geometry.sphere for c in shapes if c.geometry and c.geometry.sphere]
    return min((float(s.radius) for s in spheres), default=math.inf)
