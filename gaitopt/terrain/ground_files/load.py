"""Ground from a file of any kind that is read."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from types import MappingProxyType
from typing import Final

from gaitopt.errors import GaitoptError, GroundError, InputError
from gaitopt.files import StrPath, what_no_file_is
from gaitopt.inputs import as_text
from gaitopt.terrain.ground_files.arrays import read_npy, read_npz
from gaitopt.terrain.ground_files.bags import read_bag
from gaitopt.terrain.ground_files.images import read_geotiff, read_png
from gaitopt.terrain.ground_files.meshes import read_mesh, read_ply, read_table
from gaitopt.terrain.ground_files.options import Options
from gaitopt.terrain.height_map import HeightMap

Reader = Callable[[Path, Options], HeightMap]

READERS: Final = MappingProxyType({
    ".npz": read_npz, ".npy": read_npy, ".png": read_png, ".tif": read_geotiff,
    ".tiff": read_geotiff, ".stl": read_mesh, ".obj": read_mesh, ".ply": read_ply,
    ".csv": read_table, ".txt": read_table, ".xyz": read_table, ".pts": read_table,
    ".bag": read_bag, ".mcap": read_bag, ".db3": read_bag,
})  # fmt: skip
"""Readers by the ending of a file's name."""
PICTURES: Final = (".jpg", ".jpeg", ".webp", ".bmp", ".gif")
"""Endings of pictures that are not read: most of them lose what is fine."""


def load_ground(
    path: StrPath,
    *,
    resolution: float | None = None,
    heights: tuple[float, float] | None = None,
    origin: tuple[float, float] | None = None,
    unit: float | None = None,
    method: str | None = None,
    layer: str | None = None,
    topic: str | None = None,
    message: int | None = None,
) -> HeightMap:
    """The ground that a file holds; the ending of its name tells the kind.

    ============================ ====================================================
    file                         needs, and takes
    ============================ ====================================================
    ``.npz`` of ``save``         ``origin``
    other ``.npz``, ``.npy``     needs ``resolution``; ``origin``, ``layer``
    ``.png``                     needs ``resolution`` and ``heights``; ``origin``
    ``.tif``, ``.tiff``          ``resolution``, ``origin``, ``unit``
    ``.stl``, ``.obj``, ``.ply`` ``resolution``, ``origin``, ``unit``
    ``.ply`` with points alone,  ``resolution``, ``origin``, ``unit``, ``method``
    ``.csv .txt .xyz .pts``
    ``.bag .mcap .db3``, folder  ``origin``, ``layer``, ``topic``, ``message``
    ============================ ====================================================

    Args:
        path: the file; for a bag of ROS 2 also its folder.
        resolution: distance between neighbouring points [m]: of the array's or image's, or of the
            grid that a mesh or a cloud is put on, 0.02 by default. That of a GeoTIFF is used if
            none is given.
        heights: of black and of white in a PNG [m].
        origin: x and y of the map's lowest corner [m], instead of the file's; by default (0, 0) for
            files that tell none, and for GeoTIFF, whose coordinates are far from 0.
        unit: of the coordinates of a mesh or a cloud, or of the heights of a GeoTIFF [m]; 0.001 for
            millimetres.
        method: ``"highest"`` or ``"median"``, as of :meth:`gaitopt.HeightMap.from_points`.
        layer: name of the array in an ``.npz``, or of the grid map's layer, ``"elevation"`` by
            default.
        topic: of the grid maps in a bag; needed where there are several.
        message: number of the message on that topic, from 0; negative numbers count from the last,
            which is the default.

    Raises:
        GroundError: the file cannot be read, or more must be told of it; the message tells which.
        InputError: an option is out of range, or the kind of file does not take it.
        MissingPackageError: a bag needs rosbags: ``pip install 'gaitopt[ground]'``.
    """
    options = Options(resolution, heights, origin, unit, method, layer, topic, message).checked()
    try:
        source = Path(path)
    except TypeError:
        raise InputError(
            f"the path of a file must be a text or a path, got {as_text(path)}"
        ) from None
    reader = read_bag if source.is_dir() else READERS.get(source.suffix.lower())
    if reader is None and source.suffix.lower() in PICTURES:
        raise GroundError(
            f"{source}: pictures with the ending {source.suffix!r} are not read; save it as a PNG"
        )
    if reader is None:
        raise GroundError(
            f"{source}: files with the ending {source.suffix!r} are not read; those with "
            f"{', '.join(READERS)} are"
        )
    if not source.exists():
        raise GroundError(f"there is no file {source}")
    special = what_no_file_is(source)
    if special:
        raise GroundError(
            f"cannot read {source}: it is {special}, and no file; save it as a file first"
        )
    try:
        return reader(source, options)
    except GroundError as error:
        told = str(error)
        named = told.startswith((str(source), f"cannot read {source}"))
        raise GroundError(told if named else f"{source}: {told}") from error
    except InputError as error:
        raise InputError(f"{source}: {error}") from error
    except GaitoptError:
        raise
    except Exception as error:  # readers of libraries raise errors of many kinds
        raise GroundError(
            f"{source} is damaged, or no {source.suffix} file: {error or type(error).__name__}"
        ) from error
