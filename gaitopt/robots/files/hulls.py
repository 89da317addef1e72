"""Convex hulls of a robot's collision meshes, so that plans can be checked without the files."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.errors import RobotError
from gaitopt.robots.files.mesh_parts import mesh_parts
from gaitopt.robots.files.meshes import MeshFinder, mesh_hull
from gaitopt.robots.files.notes import Hulls
from gaitopt.robots.files.origins import placement_of
from gaitopt.robots.files.shapes import mesh_scale
from gaitopt.robots.files.tree import UrdfTree

DIGITS = 5
"""Decimal places of a hull's coordinates [m]: a tenth of the distance that counts as touching."""
MOST_CORNERS = 20_000
"""Most corners of all hulls of a robot; the largest robot at hand has 5 000."""


def find_hulls(tree: UrdfTree, finder: MeshFinder) -> Hulls:
    """The hulls of all collision meshes; none, where a file of one is missing or flat.

    A mesh of the trunk, whose hull is much larger than those of its parts, has these
    (:mod:`gaitopt.robots.files.mesh_parts`).
    """
    out, count = [], 0
    for name, link in tree.links.items():
        trunk = not tree.moving_above(name)
        for shape in link.findall("collision"):
            for mesh in shape.findall("geometry/mesh"):
                path = finder.find(mesh.get("filename", ""))
                parts = _parts(path, trunk)
                if not parts:
                    return ()
                where = f"{tree.label}: link {name}"
                pose = placement_of(shape, where)
                scale = mesh_scale(mesh, where)
                for corners in parts:
                    placed = corners * scale @ pose[:3, :3].T + pose[:3, 3]
                    count += len(placed)
                    if count > MOST_CORNERS:
                        return ()
                    out.append((name, tuple(np.round(placed.ravel(), DIGITS).tolist())))
    return tuple(out)


def _parts(path: Path | None, trunk: bool) -> tuple[FloatArray, ...]:
    """Corners of the hulls of a mesh ``(n, 3)`` in the file's units; none for what is not read."""
    if path is None:
        return ()
    if trunk:
        return mesh_parts(path)
    hull = mesh_hull(path)
    return () if hull is None else (hull,)


def convex_hull(numbers: tuple[float, ...]) -> Any:
    """A convex solid of coal's, from the coordinates of a hull's corners.

    The certificate makes its own, so that an error in one of the two is seen by the other
    (:func:`gaitopt.certificate.collisions.self_collision.convex_solid`).

    Raises:
        RobotError: the corners lie in a plane.
    """
    from pinocchio import coal
    from scipy.spatial import ConvexHull, QhullError

    corners = np.array(numbers, dtype=np.float64).reshape(-1, 3)
    try:
        hull = ConvexHull(corners)
    except (QhullError, ValueError) as error:
        raise RobotError(f"a hull of the robot's meshes is flat: {str(error)[:100]}") from error
    points, triangles = coal.StdVec_Vec3s(), coal.StdVec_Triangle()
    points.extend(list(corners[hull.vertices]))
    place = {int(corner): k for k, corner in enumerate(hull.vertices)}
    triangles.extend([coal.Triangle(*(place[int(c)] for c in face)) for face in hull.simplices])
    return coal.Convex(points, triangles)
