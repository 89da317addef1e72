"""Ground from grid_map messages of ROS, in bags of ROS 1 and ROS 2 [Fankhauser2016].

The layout of a message confuses many of its users. The matrix of a layer has x along its rows and
y along its columns, and both run *against* the axes: row 0, column 0 is the cell at the highest x
and y. Numbers are stored column by column, which the labels of the layout tell. The matrix is a
circular buffer: the first row and column are those at ``outer_start_index`` and
``inner_start_index``. The pose is that of the middle of the map.
"""

from __future__ import annotations

import json
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.errors import GroundError, MissingPackageError
from gaitopt.terrain.ground_files.bag_process import MOST_SECONDS
from gaitopt.terrain.ground_files.options import Options
from gaitopt.terrain.height_map import HeightMap
from gaitopt.terrain.height_map_checks import check_size

LAYER = "elevation"
"""Name of the layer with heights that mapping packages use."""
_REFUSED = 2
"""Exit code for a bag that is read, and has not what was asked for."""
_LEVEL = 1e-3
"""How far from no rotation the orientation of a map may be by rounding."""


def read_bag(path: Path, options: Options) -> HeightMap:
    """A map from a grid_map message in a bag: a ``.bag``, ``.mcap`` or ``.db3`` file, or a folder.

    Raises:
        MissingPackageError: rosbags is not installed.
    """
    options.only("bags", "origin", "layer", "topic", "message")
    if find_spec("rosbags") is None:
        raise MissingPackageError(
            f"{path} is a bag; reading it needs the package rosbags: pip install 'gaitopt[ground]'"
        )
    message = -1 if options.message is None else options.message
    told, numbers = _message(path, {"topic": options.topic, "message": message})
    return options.placed(*layer_heights(told, numbers, options.layer))


def _message(path: Path, asked: dict[str, Any]) -> tuple[dict[str, Any], bytes]:
    """A message of a bag, as :func:`gaitopt.terrain.ground_files.bag_process.described` does."""
    script = str(Path(__file__).with_name("bag_process.py"))
    job = json.dumps({**asked, "path": str(path.resolve())})
    try:
        done = subprocess.run(
            [sys.executable, script], input=job.encode(), capture_output=True,
            timeout=2.0 * MOST_SECONDS,
        )  # fmt: skip
    except subprocess.TimeoutExpired:
        raise GroundError(f"it is not read within {2.0 * MOST_SECONDS:.0f} s") from None
    told = done.stderr.decode("utf-8", "replace").strip()[:300]
    if done.returncode == _REFUSED:
        raise GroundError(told)
    if done.returncode:
        raise GroundError(f"it is damaged, too large, or no bag: {told or 'reading it failed'}")
    line, _, data = done.stdout.partition(b"\n")
    return json.loads(line), data


def layer_heights(
    told: dict[str, Any], numbers: bytes, name: str | None
) -> tuple[FloatArray, float, FloatArray]:
    """Heights ``(nx, ny)``, resolution and origin of a layer of a grid map [m].

    Args:
        told, numbers: of :func:`gaitopt.terrain.ground_files.bag_process.described`.
        name: of the layer; ``None`` for the only one, or ``"elevation"``.

    Raises:
        GroundError: the message is not as grid_map writes it, or has no such layer.
    """
    layers = told["layers"]
    if name is None:
        name = layers[0] if len(layers) == 1 else LAYER
    if name not in layers or len(layers) != len(told["counts"]):
        raise GroundError(
            f"the grid map has no layer {name!r}; choose one with layer=...: {', '.join(layers)}"
        )
    which = layers.index(name)
    begin = sum(told["counts"][:which])
    values = np.frombuffer(numbers, "<f4")[begin : begin + told["counts"][which]]
    values = values.astype(np.float64)
    matrix = _matrix(values, told["sides"][which], told["offsets"][which])
    matrix = np.roll(matrix, [-n for n in told["start"]], axis=(0, 1))
    turn = np.array(told["orientation"])
    if np.abs(turn[:3]).max() > _LEVEL:
        raise GroundError(
            f"the grid map is turned (orientation {turn.tolist()} as x, y, z, w), and grid_map "
            "itself takes no turned maps; write it without a rotation"
        )
    resolution = told["resolution"]
    if not 1e-6 <= resolution <= 1e3:
        raise GroundError(f"the resolution of the grid map is {resolution:g} m")
    z = np.where(np.isfinite(matrix), matrix, np.nan)[::-1, ::-1]
    return z, resolution, told["position"] - (np.array(z.shape) - 1) / 2.0 * resolution


def _matrix(values: FloatArray, sides: list[list[Any]], offset: int) -> FloatArray:
    """The matrix of a layer ``(rows, columns)``, in the order of the buffer."""
    labels = [label for label, _ in sides]
    if sorted(labels) != ["column_index", "row_index"] or offset:
        raise GroundError(
            f"the layout of the grid map has the labels {labels} and the offset {offset}; "
            "column_index and row_index without an offset are read"
        )
    outer, inner = (size for _, size in sides)
    check_size(outer, inner)
    if outer * inner != len(values):
        raise GroundError(
            f"the grid map tells {outer} by {inner} cells, and holds {len(values)} numbers"
        )
    matrix = values.reshape(outer, inner)
    return matrix.T if labels[0] == "column_index" else matrix
