"""grid_map messages in bags: a layout that confuses many of its users."""

from __future__ import annotations

import os
import sqlite3
from pathlib import Path

import numpy as np
import pytest
from grid_map_bags import KIND, grid_map, type_store, write_bag

from gaitopt import GroundError, HeightMap, InputError, MissingPackageError, load_ground
from gaitopt.conventions import FloatArray
from gaitopt.terrain.ground_files.bag_process import MOST_MEMORY, described
from gaitopt.terrain.ground_files.bags import layer_heights

pytest.importorskip("rosbags")

ROWS, COLUMNS, CELL, MIDDLE = 7, 5, 0.1, (2.0, -1.0)


def height(x: FloatArray, y: FloatArray) -> FloatArray:
    """A ground that is the same in no two places."""
    return np.asarray(1.0 + x + 10.0 * y + x * y)


def buffer(start: tuple[int, int] = (0, 0)) -> FloatArray:
    """The matrix of a layer, by grid_map's formula for the place of a cell (getPositionFromIndex).

    position = middle + (length - resolution) / 2 - resolution * (index - start, wrapped).
    """
    matrix = np.zeros((ROWS, COLUMNS))
    for i in range(ROWS):
        for j in range(COLUMNS):
            wrapped = (i - start[0]) % ROWS, (j - start[1]) % COLUMNS
            x = MIDDLE[0] + (ROWS * CELL - CELL) / 2.0 - CELL * wrapped[0]
            y = MIDDLE[1] + (COLUMNS * CELL - CELL) / 2.0 - CELL * wrapped[1]
            matrix[i, j] = height(x, y)
    return matrix


def ground_of(message: object, layer: str | None = None) -> HeightMap:
    return HeightMap(*layer_heights(*described(message), layer))


@pytest.mark.parametrize("start", [(0, 0), (3, 2), (6, 4), (0, 4)])
@pytest.mark.parametrize("labels", [("column_index", "row_index"), ("row_index", "column_index")])
def test_each_cell_is_where_grid_map_puts_it(
    start: tuple[int, int], labels: tuple[str, str]
) -> None:
    message = grid_map(type_store(2), {"elevation": buffer(start)}, resolution=CELL,
                       position=MIDDLE, start=start, labels=labels)  # fmt: skip
    ground = ground_of(message)
    assert ground.shape == (ROWS, COLUMNS) and ground.resolution == CELL
    x, y = np.meshgrid(ground.x, ground.y, indexing="ij")
    assert np.allclose(ground.z, height(x, y), atol=1e-6)
    assert ground.extent[0] == pytest.approx((1.7, 2.3))
    assert ground.extent[1] == pytest.approx((-1.2, -0.8))


@pytest.mark.parametrize("kind", ["mcap", "db3", "bag"])
def test_bags_of_all_kinds_hold_the_same_ground(tmp_path: Path, kind: str) -> None:
    ros, start = 1 if kind == "bag" else 2, (1, 3)
    store = type_store(ros)
    message = grid_map(store, {"elevation": buffer(start)}, resolution=CELL, position=MIDDLE,
                       start=start, ros=ros)  # fmt: skip
    path = write_bag(tmp_path / f"map.{kind}", store, {"/map": [message]}, kind=kind)
    ground = load_ground(path)
    assert ground == ground_of(message)
    if path.is_dir():
        (inner,) = path.glob(f"*.{kind}")
        moved = load_ground(inner, origin=(0.0, 0.0))
        assert moved.z.tolist() == ground.z.tolist() and moved.origin == (0.0, 0.0)


def test_layers_topics_and_messages_are_chosen(tmp_path: Path) -> None:
    store = type_store(2)
    level = np.zeros((3, 4))
    level[1, 2] = np.nan

    def maps(values: list[float]) -> list[object]:
        return [grid_map(store, {"elevation": level + v, "variance": level - v}) for v in values]

    path = next(write_bag(tmp_path / "bag", store, {"/a": maps([1, 2, 3]), "/b": maps([4])})
                .glob("*.mcap"))  # fmt: skip
    with pytest.raises(GroundError, match=r"it has 2 topics with grid maps; choose one.*: /a, /b"):
        load_ground(path)
    last = load_ground(path, topic="/a")
    assert last.height_range == (3.0, 3.0) and np.count_nonzero(~last.known) == 1
    for number, value in ((0, 1.0), (-2, 2.0)):
        ground = load_ground(path, topic="/a", message=number, layer="variance")
        assert ground.height_range == (-value, -value)
    with pytest.raises(GroundError, match="has 3 messages, and none with number -4"):
        load_ground(path, topic="/a", message=-4)
    with pytest.raises(GroundError, match=r"no layer 'slope'.*: elevation, variance"):
        ground_of(maps([4])[0], "slope")
    with pytest.raises(InputError, match="bags take no option resolution"):
        load_ground(path, resolution=0.1)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"turn": (0.0, 0.0, 0.3, 0.95)}, "is turned"),
        ({"labels": ("x", "y")}, "has the labels"),
        ({"offset": 3}, "offset 3"),
        ({"resolution": -0.1}, "resolution of the grid map is -0.1"),
        ({"position": (np.nan, 0.0)}, "origin"),
        ({"heights": {"a": np.zeros((3, 3)), "b": np.zeros((3, 3))}}, "no layer 'elevation'"),
        ({"heights": {"elevation": np.full((3, 3), np.nan)}}, "no height of the map is known"),
        ({"heights": {"elevation": np.zeros((1, 3))}}, "at least 2 by 2"),
    ],
)
def test_grid_maps_that_make_no_ground_are_refused(changes: dict[str, object], words: str) -> None:
    values = {"heights": {"elevation": np.zeros((3, 3))}, **changes}
    with pytest.raises(GroundError, match=words):
        ground_of(grid_map(type_store(2), **values))  # type: ignore[arg-type]


def test_a_layer_that_holds_fewer_numbers_than_it_tells() -> None:
    message = grid_map(type_store(2), {"elevation": np.zeros((3, 3))})
    message.data[0].layout.dim[0].size = 2**32 - 1
    with pytest.raises(GroundError, match="4,294,967,295"):
        ground_of(message)
    message.data[0].layout.dim[0].size = 4
    with pytest.raises(GroundError, match="4 by 3 cells, and holds 9 numbers"):
        ground_of(message)


def test_without_rosbags_the_error_says_how_to_install_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("gaitopt.terrain.ground_files.bags.find_spec", lambda name: None)
    (tmp_path / "map.mcap").write_bytes(b"")
    with pytest.raises(MissingPackageError, match=r"pip install 'gaitopt\[ground\]'"):
        load_ground(tmp_path / "map.mcap")


def test_files_that_are_no_bags_are_refused(tmp_path: Path) -> None:
    for kind in ("mcap", "db3", "bag"):
        bad = tmp_path / f"bad.{kind}"
        bad.write_bytes(b"\x89MCAP0\r\n" + bytes(range(200)))
        with pytest.raises(GroundError, match=r"bad\.\w+: it is damaged, too large, or no bag"):
            load_ground(bad)
    with pytest.raises(GroundError, match="no bag"):
        load_ground(tmp_path)


@pytest.mark.slow
@pytest.mark.skipif(os.name != "posix", reason="limits of memory are those of POSIX")
def test_a_bag_that_unpacks_to_too_much_is_refused(tmp_path: Path) -> None:
    from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer

    zstd = pytest.importorskip("backports.zstd")
    store, path = type_store(2), tmp_path / "bomb"
    writer = Writer(path, version=9, storage_plugin=StoragePlugin.SQLITE3)
    writer.set_compression(CompressionMode.MESSAGE, CompressionFormat.ZSTD)
    with writer:
        connection = writer.add_connection("/map", KIND, typestore=store)
        writer.write(connection, 0, bytes(50_000_000))
    (database,) = path.glob("*.db3")
    bomb = zstd.compress(bytes(1_000_000))
    assert len(bomb) < 1000
    # A frame of zstandard may be followed by others, which belong to the same content.
    with sqlite3.connect(database) as opened:
        opened.execute("UPDATE messages SET data = ?", [bomb * (MOST_MEMORY // 1_000_000)])
    with pytest.raises(GroundError, match="damaged, too large, or no bag"):
        load_ground(path)
