"""Ground in NumPy's files."""

from __future__ import annotations

import io
import pickle
import struct
import zipfile
from pathlib import Path

import numpy as np
import pytest

from gaitopt import GroundError, HeightMap, InputError, load_ground, make_ground
from gaitopt.terrain.ground_files.arrays import LIMIT


class Planted:
    """An object that leaves a trace when it is unpickled."""

    def __reduce__(self) -> tuple[object, ...]:
        return (Path("unpickled").write_text, ("it ran",))


def test_a_saved_map_comes_back_bit_by_bit(tmp_path: Path) -> None:
    z = np.random.default_rng(0).normal(size=(40, 30))
    z[3, 4] = np.nan
    for ground in (HeightMap(z, 0.017, (-1.2345678901234, 1e5)), make_ground("rubble")):
        ground.save(tmp_path / "map.npz")
        assert load_ground(tmp_path / "map.npz") == ground
    moved = load_ground(tmp_path / "map.npz", origin=(1.0, 2.0))
    assert moved.origin == (1.0, 2.0) and np.array_equal(moved.z, ground.z)


def test_a_map_that_cannot_be_written_leaves_no_file(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot write"):
        make_ground("flat").save(tmp_path / "no" / "map.npz")


@pytest.mark.parametrize("dtype", ["<f8", ">f4", "<i2", "|u1", "<f2"])
@pytest.mark.parametrize("order", ["C", "F"])
def test_arrays_of_all_kinds_of_numbers(tmp_path: Path, dtype: str, order: str) -> None:
    z = np.arange(12).reshape(3, 4).astype(dtype, order=order)  # type: ignore[call-overload]
    np.save(tmp_path / "z.npy", z)
    ground = load_ground(tmp_path / "z.npy", resolution=0.1, origin=(1.0, 2.0))
    assert ground == HeightMap(np.arange(12.0).reshape(3, 4), 0.1, (1.0, 2.0))
    np.savez(tmp_path / "z.npz", a=z, b=np.arange(3), c=np.float64(2.0))
    assert load_ground(tmp_path / "z.npz", resolution=0.1).z.tolist() == ground.z.tolist()
    with pytest.raises(GroundError, match=r"z.npy: .npy files tell no scale: .* resolution=0.02"):
        load_ground(tmp_path / "z.npy")


def test_a_real_digital_elevation_model(tmp_path: Path) -> None:
    import matplotlib

    path = Path(matplotlib.get_data_path()) / "sample_data" / "jacksboro_fault_dem.npz"
    ground = load_ground(path, layer="elevation", resolution=0.02)
    assert ground.shape == (344, 403) and ground.height_range == (236.0, 1076.0)
    with pytest.raises(GroundError, match=r"it has no array 'height'; it has .*elevation"):
        load_ground(path, layer="height", resolution=0.02)


def test_which_array_must_be_told_where_there_are_several(tmp_path: Path) -> None:
    np.savez(tmp_path / "two.npz", a=np.zeros((2, 2)), b=np.zeros((2, 2)))
    with pytest.raises(GroundError, match=r"it has 2 arrays with two axes, of a, b; tell which"):
        load_ground(tmp_path / "two.npz", resolution=0.1)
    np.savez(tmp_path / "none.npz", a=np.zeros(2))
    with pytest.raises(GroundError, match="it has 0 arrays"):
        load_ground(tmp_path / "none.npz", resolution=0.1)


def test_nothing_in_a_file_is_executed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    np.save("z.npy", np.array([[Planted(), 1], [2, 3]], dtype=object))
    np.savez(
        "z.npz", z=np.array([[Planted()] * 2] * 2, dtype=object), resolution=0.1, origin=[0, 0]
    )
    Path("bare.npy").write_bytes(pickle.dumps(Planted()))
    for name in ("z.npy", "z.npz", "bare.npy"):
        with pytest.raises(GroundError):
            load_ground(name, **({} if name == "z.npz" else {"resolution": 0.1}))
    assert not Path("unpickled").exists()


def npy(shape: str, data: bytes = b"", descr: str = "'<f8'") -> bytes:
    header = f"{{'descr': {descr}, 'fortran_order': False, 'shape': {shape}}}".ljust(117) + "\n"
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(header)) + header.encode() + data


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (b"", "damaged, or no .npy file"),
        (npy("(1000000000, 1000000000)"), "its size does not fit its shape"),
        (npy("(-1, -1)", bytes(8)), "does not fit"),
        (npy("(2, 3)", bytes(40)), "does not fit"),
        (npy("(2, 2)", bytes(32), "'|S8'"), "holds no numbers"),
        (npy("(2, 2)", bytes(64), "'<c16'"), "holds no numbers"),
        (npy("(4,)", bytes(32)), "must have the shape"),
        (npy("(2, 2)", bytes(32), "__import__('os')"), "damaged"),
        (npy("(" * 90 + ")" * 90), "damaged"),
        (npy("(2, 2)", struct.pack("<4d", 1, 2, 3, 1e300)), "must be below"),
    ],
)
def test_damaged_arrays_are_refused(tmp_path: Path, data: bytes, words: str) -> None:
    path = tmp_path / "z.npy"
    path.write_bytes(data)
    with pytest.raises(GroundError, match=words) as caught:
        load_ground(path, resolution=0.1)
    assert str(path) in str(caught.value)


def test_archives_that_unpack_to_too_much_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "bomb.npz"
    with (
        zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive,
        archive.open("z.npy", "w") as part,
    ):
        for _ in range(LIMIT // 10_000_000 + 1):
            part.write(bytes(10_000_000))
    assert path.stat().st_size < 1_000_000
    with pytest.raises(GroundError, match=r"would unpack to 130 MB; at most 129 MB"):
        load_ground(path)
    # Its directory tells less than there is.
    lied = path.read_bytes().replace(struct.pack("<I", 130_000_000), struct.pack("<I", 1000))
    path.write_bytes(lied)
    with pytest.raises(GroundError, match="damaged"):
        load_ground(path)


def test_a_saved_map_with_wrong_parts_is_refused(tmp_path: Path) -> None:
    for parts, words in (
        ({"resolution": [0.1, 0.2], "origin": [0, 0]}, "resolution is no number"),
        ({"resolution": "fine", "origin": [0, 0]}, "holds no numbers"),
        ({"resolution": -1.0, "origin": [0, 0]}, "resolution"),
        ({"resolution": 0.1, "origin": [0, 0, 0]}, "origin"),
    ):
        np.savez(tmp_path / "map.npz", z=np.zeros((2, 2)), **parts)  # type: ignore[arg-type]
        with pytest.raises((GroundError, InputError), match=rf"map.npz: .*{words}"):
            load_ground(tmp_path / "map.npz")
    data = io.BytesIO()
    np.savez(data, z=np.zeros((2, 2)), resolution=0.1, origin=[0, 0])
    (tmp_path / "map.npz").write_bytes(data.getvalue()[:-30])
    with pytest.raises(GroundError, match="is damaged"):
        load_ground(tmp_path / "map.npz")
