"""Read mesh files that a URDF names, only from a folder that the user has chosen.

A plan, and the file names in its URDF, may come from somebody else. So no file outside of that
folder is opened, and nothing is downloaded.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np

from gaitopt.errors import InputError
from gaitopt.files import StrPath
from gaitopt.inputs import as_text
from gaitopt.robots.files.meshes import LEVELS, with_ros_packages
from gaitopt.viewing.replay.scene import Surface

MeshFolders = bool | StrPath | Sequence[StrPath]
"""Whether meshes are drawn: those of example-robot-data, or those in a folder, or in several."""

MESH_KINDS = (".stl", ".obj", ".dae")
MESH_LIMIT = 100_000_000
"""Most bytes of one mesh file. Chosen here: the largest of example-robot-data has 29 MB."""
LONGEST_NAME = 200
"""Most letters of a file name in a message: a URDF may hold anything."""


def read_mesh(filename: str, scale: Any, meshes: MeshFolders) -> Surface:
    """The triangles of a mesh file.

    Args:
        filename: as the URDF gives it, ``package://...`` or a relative path.
        scale: the URDF's scale, a number or ``(3,)``.
        meshes: ``True`` to look in the package example-robot-data, or the folder to look in, or
            several: the first that holds the file counts.

    Raises:
        InputError: the file is in none of them, is too large, or cannot be read.
    """
    factor = np.ones(3) if scale is None else np.asarray(scale, dtype=np.float64)
    if factor.shape not in ((), (1,), (3,)):
        raise InputError(
            f"mesh {filename[:LONGEST_NAME]!r} has a scale of {factor.size} numbers; give 3"
        )
    roots = _roots(meshes)
    root = next((root for root in roots if _is_in(str(filename), root)), roots[0])
    path = _found(str(filename), root, roots)
    surface = _loaded(path)
    return Surface(surface.vertices * factor, surface.faces, smooth=False)


def check_meshes(meshes: MeshFolders) -> None:
    """Refuse what is neither true or false, nor a folder, nor some folders.

    Raises:
        InputError: the message shows ``meshes``.
    """
    if isinstance(meshes, (bool, str, os.PathLike)):
        return
    several = isinstance(meshes, Sequence) and not isinstance(meshes, bytes)
    if not (several and all(isinstance(folder, (str, os.PathLike)) for folder in meshes)):
        raise InputError(
            f"meshes must be true or false, a folder, or a list of folders, got {as_text(meshes)}"
        )
    if not meshes:
        raise InputError("meshes names no folder: give one, or meshes=False")


def _roots(meshes: MeshFolders) -> list[Path]:
    """The folders to look into."""
    if isinstance(meshes, bool):
        return [_example_root()]
    several = [meshes] if isinstance(meshes, (str, os.PathLike)) else meshes
    return [Path(str(folder)) for folder in several]


def folders_of_meshes(
    urdf: str, folder: Path, package_folders: Sequence[StrPath] = ()
) -> tuple[Path, ...]:
    """The folders that hold visual meshes of a URDF's text, those with most of them first.

    Looked into are the folder of the robot's file, those above it, those of packages, and those
    that ``ROS_PACKAGE_PATH`` names. Of two with equally many the first one comes first. A folder
    whose meshes are all in one before it is left out.

    Args:
        urdf: the text.
        folder: of the robot's file.
        package_folders: that hold packages, or are packages.
    """
    shapes = ElementTree.fromstring(urdf).iterfind("link/visual/geometry/mesh")
    left = {mesh.get("filename", "") for mesh in shapes}
    roots = [folder, *folder.resolve().parents][:LEVELS]
    roots += with_ros_packages([Path(str(f)) for f in package_folders])
    holds = {root: {name for name in left if _is_in(name, root)} for root in roots}
    out: list[Path] = []
    while holds and (most := max(holds, key=lambda root: len(holds[root] & left))):
        if not holds[most] & left:
            break
        out.append(most)
        left -= holds.pop(most)
    return tuple(out)


def _is_in(filename: str, root: Path) -> bool:
    """Whether a folder holds a mesh."""
    try:
        _found(filename, root)
    except (InputError, OSError, ValueError):  # a name too long, a folder that is closed
        return False
    return True


def _found(filename: str, root: Path, told: Sequence[Path] = ()) -> Path:
    """The file inside ``root``; raises InputError, which names ``told``, where there is none."""
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
        f"mesh {filename[:LONGEST_NAME]!r} is not in {', '.join(map(str, told or (root,)))}; "
        "draw the robot without meshes (meshes=False), or give the folder or folders that hold "
        "them (meshes='folder'); .stl, .obj and .dae are read"
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
