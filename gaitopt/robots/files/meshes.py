"""Where the mesh files are that a robot file names, and their corners."""

from __future__ import annotations

import os
import re
from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np

from gaitopt.conventions import FloatArray, frozen

MESH_KINDS = (".stl", ".obj", ".dae")
"""Kinds of mesh files that are read."""
MESH_LIMIT = 30_000_000
"""Most bytes of a mesh that is read to find a foot. Chosen: lower legs at hand have up to 15 MB."""
LFS_POINTER = b"version https://git-lfs"
"""How a file begins that Git LFS has put in the place of a mesh, which was not fetched with it."""
_LEFT_BY_XACRO = re.compile(r"^(?:file://)?\$\(find(?:-pkg-share)?\s+([^)\s]+)\)")
LEVELS = 6
"""So many folders above the robot file are looked into. Chosen: packages of ROS keep a robot file
one or two folders below their own."""


class MeshFinder:
    """Looks for mesh files beside a robot file, above it, and in folders of packages.

    Args:
        folder: the folder of the robot file; ``None`` for a robot that comes as text.
        package_folders: folders that hold packages, or are packages.
        named: the folder of meshes that the file names (:func:`named_folder`), relative to its own.
    """

    def __init__(
        self, folder: Path | None, package_folders: Sequence[Path] = (), named: str = ""
    ) -> None:
        self._folder = None if folder is None else folder.resolve()
        self._packages = with_ros_packages(package_folders)
        self._named = None if folder is None or not named else (folder / named).resolve()

    def find(self, filename: str) -> Path | None:
        """The file that a URDF or MJCF names; ``None`` where it is not there.

        Args:
            filename: ``package://name/path``, ``model://name/path``, ``file:///path``, or a path,
                absolute or relative to the robot file. ``$(find name)``, which xacro would have
                replaced, is a package, too.
        """
        try:
            for path in self._candidates(filename):
                if path.suffix.lower() in MESH_KINDS and _is_mesh(path):
                    return path
        except (OSError, ValueError):  # a name too long, a folder that is closed
            pass
        return None

    def _candidates(self, filename: str) -> list[Path]:
        """Where a file may be, the likeliest place first."""
        filename = _LEFT_BY_XACRO.sub(r"package://\1", filename)
        scheme, mark, rest = filename.partition("://")
        name = rest if mark else filename
        if scheme == "file" and mark:
            return [Path(name)]
        if not mark and Path(name).is_absolute():
            return [Path(name)]
        # A package is often a folder above the robot file, with its own name or another one.
        inner = "/".join(name.split("/")[1:]) if mark else ""
        above = [] if self._folder is None else [self._folder, *self._folder.parents][:LEVELS]
        found = [folder / part for folder in [*self._packages, *above]
                 for part in (name, inner) if part]  # fmt: skip
        # MuJoCo leaves out the folders of a file's name where it reads a URDF.
        return found if self._named is None else [self._named / Path(name).name, *found]


def named_folder(root: ElementTree.Element) -> str:
    """The folder of meshes that a URDF names for MuJoCo; empty where it names none.

    It is ``meshdir`` of ``<mujoco><compiler>``, an element of ``<robot>``.
    """
    compiler = root.find("mujoco/compiler")
    return "" if compiler is None else compiler.get("meshdir", "")


def _is_mesh(path: Path) -> bool:
    """Whether there is a file, and not only what Git LFS leaves where it fetched none."""
    if not path.is_file():
        return False
    with path.open("rb") as stream:
        return stream.read(len(LFS_POINTER)) != LFS_POINTER


def with_ros_packages(package_folders: Sequence[Path]) -> list[Path]:
    """The folders of packages that are given, and those that ``ROS_PACKAGE_PATH`` names."""
    named = [Path(p) for p in os.environ.get("ROS_PACKAGE_PATH", "").split(os.pathsep) if p]
    return [*package_folders, *named]


def found_meshes(
    urdf: str, folder: Path | None, package_folders: Sequence[Path] = ()
) -> dict[str, Path | None]:
    """The mesh files that a URDF names, and where they are; ``None`` for those that are missing.

    Args:
        urdf: the text.
        folder: of the robot file.
        package_folders: folders with packages.
    """
    root = ElementTree.fromstring(urdf)
    finder = MeshFinder(folder, package_folders, named_folder(root))
    names = {mesh.get("filename", "") for mesh in root.iter("mesh")}
    return {name: finder.find(name) for name in sorted(names) if name}


def mesh_corners(path: Path) -> FloatArray | None:
    """The corners ``(N, 3)`` of a mesh file in its own units; ``None`` where it cannot be read."""
    changed = changed_at(path)
    found = None if changed is None else _mesh(path, changed)
    return None if found is None else found[0]


def mesh_triangles(path: Path) -> FloatArray | None:
    """The triangles ``(T, 3, 3)`` of a mesh file in its own units; ``None`` as for its corners."""
    changed = changed_at(path)
    found = None if changed is None else _mesh(path, changed)
    return None if found is None else found[0][found[1]]


@lru_cache(maxsize=64)
def _mesh(path: Path, changed: int) -> tuple[FloatArray, np.ndarray] | None:
    """Corners ``(N, 3)`` of a file as it was ``changed``, and numbers of its triangles' corners."""
    import trimesh

    try:
        mesh: Any = trimesh.load(path, force="mesh", skip_materials=True, process=False)
        corners = np.asarray(mesh.vertices, dtype=np.float64).reshape(-1, 3)
        faces = np.asarray(mesh.faces, dtype=np.intp).reshape(-1, 3)
    except Exception:  # trimesh's readers raise errors of many kinds
        return None
    good = len(corners) and np.isfinite(corners).all()
    return (frozen(corners), faces) if good else None


def mesh_hull(path: Path) -> FloatArray | None:
    """The corners ``(N, 3)`` of a mesh's convex hull in the file's units.

    ``None`` where the file cannot be read, or the mesh is flat.
    """
    changed = changed_at(path)
    return None if changed is None else _hull(path, changed)


def changed_at(path: Path) -> int | None:
    """When a file was changed last [ns]; ``None`` for one that is missing or too large."""
    try:
        stamp = path.stat()
    except OSError:
        return None
    return stamp.st_mtime_ns if stamp.st_size <= MESH_LIMIT else None


@lru_cache(maxsize=256)
def _hull(path: Path, changed: int) -> FloatArray | None:
    """The hull of a file as it was ``changed``."""
    from scipy.spatial import ConvexHull, QhullError

    corners = mesh_corners(path)
    try:
        return None if corners is None else frozen(corners[ConvexHull(corners).vertices])
    except (QhullError, ValueError):
        return None
