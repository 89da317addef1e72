"""Read mesh files that a URDF names, only from a folder that the user has chosen.

A plan, and the file names in its URDF, may come from somebody else. So no file outside of that
folder is opened, and nothing is downloaded.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np

from gaitopt.errors import InputError
from gaitopt.files import StrPath
from gaitopt.robots.files.meshes import LEVELS, with_ros_packages
from gaitopt.viewing.replay.scene import Surface

MESH_KINDS = (".stl", ".obj", ".dae")
MESH_LIMIT = 100_000_000
"""Most bytes of one mesh file. Chosen here: the largest of example-robot-data has 29 MB."""
LONGEST_NAME = 200
"""Most letters of a file name in a message: a URDF may hold anything."""


def read_mesh(filename: str, scale: Any, meshes: bool | StrPath) -> Surface:
    """The triangles of a mesh file.

    Args:
        filename: as the URDF gives it, ``package://...`` or a relative path.
        scale: the URDF's scale, a number or ``(3,)``.
        meshes: ``True`` to look in the package example-robot-data, or the folder to look in.

    Raises:
        InputError: the file is not in the folder, is too large, or cannot be read.
    """
    path = _found(str(filename), _example_root() if meshes is True else Path(str(meshes)))
    factor = np.ones(3) if scale is None else np.asarray(scale, dtype=np.float64) * np.ones(3)
    surface = _loaded(path)
    return Surface(surface.vertices * factor, surface.faces, smooth=False)


def folder_of_meshes(
    urdf: str, folder: Path, package_folders: Sequence[StrPath] = ()
) -> Path | None:
    """The folder that holds most visual meshes of a URDF's text; ``None`` where none holds any.

    Looked into are the folder of the robot's file, those above it, those of packages, and those
    that ``ROS_PACKAGE_PATH`` names. Of two with equally many the first one counts.

    Args:
        urdf: the text.
        folder: of the robot's file.
        package_folders: that hold packages, or are packages.
    """
    shapes = ElementTree.fromstring(urdf).iterfind("link/visual/geometry/mesh")
    names = {mesh.get("filename", "") for mesh in shapes}
    roots = [folder, *folder.resolve().parents][:LEVELS]
    roots += with_ros_packages([Path(str(f)) for f in package_folders])
    counts = [sum(_is_in(name, root) for name in names) for root in roots]
    most = max(counts)
    return roots[counts.index(most)] if most else None


def _is_in(filename: str, root: Path) -> bool:
    """Whether a folder holds a mesh."""
    try:
        _found(filename, root)
    except (InputError, OSError, ValueError):  # a name too long, a folder that is closed
        return False
    return True


def _found(filename: str, root: Path) -> Path:
    """The file inside ``root``; raises InputError where there is none."""
    relative = filename.removeprefix("package://")
    candidates = [relative]
    while relative.startswith("../"):
        # From the folder of the robot file, which lies in the one that holds the meshes.
        relative = relative.removeprefix("../")
        candidates.append(relative)
    if filename.startswith("package://"):
        # Without the name of the package, too.
        candidates.append("/".join(relative.split("/")[1:]))
    base = root.resolve()
    for name in candidates:
        path = (base / name).resolve()
        inside = path.is_relative_to(base) and path.suffix.lower() in MESH_KINDS
        if inside and path.is_file() and path.stat().st_size <= MESH_LIMIT:
            return path
    raise InputError(
        f"mesh {filename[:LONGEST_NAME]!r} is not in {root}; "
        "draw the robot without meshes (meshes=False), "
        "or give the folder that holds them (meshes='folder'); .stl, .obj and .dae are read"
    )


def _example_root() -> Path:
    """The folder of the package example-robot-data."""
    from gaitopt.robots.catalog import example_urdf

    path = example_urdf("a1")
    return next(p.parent for p in path.parents if p.name == "example-robot-data")


@lru_cache(maxsize=64)
def _loaded(path: Path) -> Surface:
    """The triangles of a file; raises InputError where it cannot be read."""
    import trimesh

    try:
        mesh: Any = trimesh.load(path, force="mesh", skip_materials=True)
        vertices, faces = np.asarray(mesh.vertices, dtype=np.float64), np.asarray(mesh.faces)
    except Exception as error:  # trimesh's readers raise errors of many kinds
        raise InputError(f"mesh {path.name} cannot be read: {error}") from error
    if not len(faces) or not np.isfinite(vertices).all():
        raise InputError(f"mesh {path.name} holds no triangles")
    return Surface(vertices, faces)
