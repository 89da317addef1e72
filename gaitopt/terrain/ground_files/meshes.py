"""Ground from meshes and clouds of points."""

from __future__ import annotations

import io
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.errors import GroundError
from gaitopt.files import read_bounded
from gaitopt.terrain.ground_files.options import RESOLUTION, Options
from gaitopt.terrain.height_map import HeightMap

LIMIT = 200_000_000
"""Most bytes of a mesh or a cloud that are read: some four million triangles, or eight million
points as text."""


def read_mesh(path: Path, options: Options) -> HeightMap:
    """A map of the top of an STL or OBJ mesh, z up."""
    options.only("mesh files", "resolution", "origin", "unit")
    shape = _loaded(path)
    if not len(getattr(shape, "faces", ())):
        raise GroundError("it has no triangles")
    return _of_mesh(shape, options)


def read_ply(path: Path, options: Options) -> HeightMap:
    """A map of a PLY file: of a mesh, or of a cloud of points where it has no triangles."""
    shape = _loaded(path)
    if len(getattr(shape, "faces", ())):
        options.only("PLY files with triangles", "resolution", "origin", "unit")
        return _of_mesh(shape, options)
    return _of_points(np.asarray(shape.vertices, dtype=np.float64), options)


def read_table(path: Path, options: Options) -> HeightMap:
    """A map of a cloud of points in a text file: x, y and z in each line."""
    return _of_points(_numbers(read_bounded(path, LIMIT, GroundError)), options)


def _loaded(path: Path) -> Any:
    """The mesh or cloud of a file. Nothing else that the file names is opened."""
    import trimesh

    data = read_bounded(path, LIMIT, GroundError)
    kind = path.suffix.lower().lstrip(".")
    force = None if kind == "ply" else "mesh"
    shape: Any = trimesh.load(
        io.BytesIO(data), file_type=kind, force=force, process=False, skip_materials=True
    )
    if isinstance(shape, trimesh.Scene):
        shape = shape.to_mesh()
    if not len(shape.vertices):
        raise GroundError("it is empty")
    return shape


def _of_mesh(shape: Any, options: Options) -> HeightMap:
    triangles = np.asarray(shape.triangles, dtype=np.float64) * _unit(options)
    return options.moved(HeightMap.from_triangles(triangles, _resolution(options)))


def _of_points(points: FloatArray, options: Options) -> HeightMap:
    options.only("clouds of points", "resolution", "origin", "unit", "method")
    method = "highest" if options.method is None else options.method
    ground = HeightMap.from_points(points * _unit(options), _resolution(options), method=method)
    return options.moved(ground)


def _resolution(options: Options) -> float:
    return RESOLUTION if options.resolution is None else options.resolution


def _unit(options: Options) -> float:
    return 1.0 if options.unit is None else options.unit


def _numbers(data: bytes) -> FloatArray:
    """The points of a text file ``(n, 3)``.

    Numbers stand between commas, semicolons or spaces. Lines that begin with ``#`` are left out,
    and so are the first lines that are no points, such as names of columns or the number of points.

    Raises:
        GroundError: no line has three numbers.
    """
    lines = io.TextIOWrapper(io.BytesIO(data), encoding="utf-8-sig")
    before, footholds = "", False
    for line in lines:
        if _is_point(line):
            break
        before = line if _split(line) else before
        footholds = footholds or "leg" in _split(line.lower())
    else:
        if footholds:
            raise GroundError(
                "it holds footholds and no ground: gaitopt walk --footholds walks over them, and "
                "HeightMap.from_columns makes ground of their columns"
            )
        raise GroundError("no line of it has three numbers x, y and z")
    # Names may stand in a comment, as CloudCompare and NumPy write them.
    names = _split(before.lower().lstrip("#/ "))
    columns = [names.index(name) for name in "xyz"] if {"x", "y", "z"} <= set(names) else [0, 1, 2]
    separator = next((mark for mark in ",;" if mark in line), None)
    # One line after the other, so that a large file is not in memory several times.
    rest = chain([line], lines)
    return np.loadtxt(rest, np.float64, delimiter=separator, usecols=columns, ndmin=2)


def _split(line: str) -> list[str]:
    return [word.strip(' "') for word in line.replace(";", ",").replace(",", " ").split()]


def _is_point(line: str) -> bool:
    words = _split(line)
    try:
        return len([float(word) for word in words[:3]]) == 3
    except ValueError:
        return False
