"""Heights in NumPy's files. Reading one executes nothing: arrays of objects are refused."""

from __future__ import annotations

import io
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gaitopt.errors import GroundError
from gaitopt.files import read_bounded
from gaitopt.terrain.ground_files.options import Options
from gaitopt.terrain.height_map import HeightMap
from gaitopt.terrain.height_map_checks import MOST_POINTS

LIMIT = 8 * MOST_POINTS + 1_000_000
"""Most bytes of such a file, and of what it unpacks to: the largest map, and its frame."""
_KNOWN = ("z", "resolution", "origin")
"""What :meth:`gaitopt.HeightMap.save` writes."""


def read_npy(path: Path, options: Options) -> HeightMap:
    """A map from an ``.npy`` file with an array ``(nx, ny)``."""
    options.only(".npy files", "resolution", "origin")
    resolution = options.needed_resolution(".npy files")
    return options.placed(_array(read_bounded(path, LIMIT, GroundError)), resolution)


def read_npz(path: Path, options: Options) -> HeightMap:
    """A map from an ``.npz`` file: one that was saved, or one with an array ``(nx, ny)``."""
    options.only(".npz files", "resolution", "origin", "layer")
    parts = _members(read_bounded(path, LIMIT, GroundError))
    if options.layer is None and set(_KNOWN) <= set(parts):
        z, resolution, origin = (_array(parts[name]) for name in _KNOWN)
        if resolution.shape != () or resolution.dtype.kind not in "iuf":
            raise GroundError(f"its resolution is no number, but of the shape {resolution.shape}")
        told = float(resolution) if options.resolution is None else options.resolution
        return options.placed(z, told, origin)
    name = options.layer or _only_map(parts)
    if name not in parts:
        raise GroundError(f"it has no array {name!r}; it has {', '.join(sorted(parts)) or 'none'}")
    return options.placed(_array(parts[name]), options.needed_resolution("such .npz files"))


def tells_place(path: Path, layer: str | None = None) -> bool:
    """Whether an ``.npz`` file says where its map lies, as one does that was saved."""
    if layer is not None:
        return False
    return set(_KNOWN) <= set(_members(read_bounded(path, LIMIT, GroundError)))


def _only_map(parts: dict[str, bytes]) -> str:
    """The name of the one array that can hold heights."""
    names = [name for name, data in parts.items() if len(_header(data)[1]) == 2]
    if len(names) != 1:
        raise GroundError(
            f"it has {len(names)} arrays with two axes, of {', '.join(sorted(parts)) or 'none'}; "
            "tell which holds the heights, for instance layer='elevation'"
        )
    return names[0]


def _members(data: bytes) -> dict[str, bytes]:
    """The arrays of an ``.npz`` file, not yet read, by name.

    Raises:
        GroundError: they would unpack to too much.
    """
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        content = sum(entry.file_size for entry in archive.infolist())
        if content > LIMIT:
            raise GroundError(
                f"it would unpack to {content / 1e6:.0f} MB; at most {LIMIT / 1e6:.0f} MB are read"
            )
        # zipfile reads no more of a part than its directory tells, and checks its sum.
        return {
            entry.filename.removesuffix(".npy"): archive.read(entry)
            for entry in archive.infolist()
            if entry.filename.endswith(".npy")
        }


def _header(data: bytes) -> tuple[np.dtype[Any], tuple[int, ...], bool, int]:
    """Type, shape, order (whether Fortran's) and start of the numbers of an ``.npy`` file."""
    stream = io.BytesIO(data)
    version = np.lib.format.read_magic(stream)
    if version not in ((1, 0), (2, 0)):
        raise GroundError(f"it is an .npy file of version {version}; 1.0 and 2.0 are read")
    read = (
        np.lib.format.read_array_header_1_0
        if version == (1, 0)
        else np.lib.format.read_array_header_2_0
    )
    shape, fortran, dtype = read(stream)
    return dtype, shape, fortran, stream.tell()


def _array(data: bytes) -> NDArray[Any]:
    """The array of an ``.npy`` file.

    Raises:
        GroundError: it holds no plain numbers, or others than its header tells.
    """
    dtype, shape, fortran, start = _header(data)
    if dtype.kind not in "iuf":
        raise GroundError(f"it holds no numbers, but {dtype}; save an array of floats")
    count = int(np.prod([int(n) for n in shape], dtype=object)) if shape else 1
    if min(shape, default=1) < 0 or count * dtype.itemsize != len(data) - start:
        raise GroundError("it is incomplete or damaged: its size does not fit its shape")
    return np.frombuffer(data, dtype, offset=start).reshape(shape, order="F" if fortran else "C")
