"""Ground from meshes and clouds of points."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

from gaitopt import GroundError, HeightMap, InputError, load_ground

RNG = np.random.default_rng(0)
CLOUD = RNG.uniform([0.0, 1.0, 0.0], [0.4, 1.3, 0.1], (300, 3))


def wedge() -> Any:
    """A block whose top falls from 0.3 m at x = 0 to 0.1 m at x = 1 m."""
    corners = [[x, y, z] for x in (0.0, 1.0) for y in (0.0, 0.5) for z in (0.0, 0.3 - 0.2 * x)]
    return trimesh.convex.convex_hull(corners)


@pytest.mark.parametrize("kind", ["stl", "stl_ascii", "obj", "ply"])
def test_the_top_of_a_mesh(tmp_path: Path, kind: str) -> None:
    path = tmp_path / f"wedge.{kind[:3]}"
    wedge().export(path, file_type=kind)
    ground = load_ground(path)
    assert ground.resolution == 0.02 and ground.shape == (51, 26) and ground.known.all()
    assert np.allclose(ground.z, (0.3 - 0.2 * ground.x)[:, None], atol=1e-7)
    small = load_ground(path, unit=0.1, resolution=0.01, origin=(5.0, 6.0))
    assert small.shape == (11, 6) and small.origin == (5.0, 6.0)
    assert small.z[0, 0] == pytest.approx(0.03)
    with pytest.raises(InputError, match="take no option method"):
        load_ground(path, method="median")


@pytest.mark.parametrize("kind", ["stl", "obj", "ply"])
def test_a_map_as_a_mesh_comes_back_whole_with_its_border(tmp_path: Path, kind: str) -> None:
    """Coordinates of 32 bits: the border at 1.4 m is at 1.39999998 m in the file."""
    z = RNG.uniform(0.0, 0.1, (36, 39))
    map_ = HeightMap(z, 0.02, (0.7, -0.76))
    x, y = np.meshgrid(map_.x, map_.y, indexing="ij")
    number = np.arange(z.size).reshape(z.shape)
    low, right, high, left = number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]
    faces = np.concatenate([np.stack(t, -1).reshape(-1, 3)
                            for t in ((low, right, high), (low, high, left))])  # fmt: skip
    path = tmp_path / f"map.{kind}"
    trimesh.Trimesh(np.stack([x, y, z], -1).reshape(-1, 3), faces, process=False).export(path)
    ground = load_ground(path)
    assert ground.shape == map_.shape and ground.known.all()
    assert np.allclose(ground.origin, map_.origin) and np.allclose(ground.z, z, atol=1e-6)


@pytest.mark.parametrize("name", ["c.csv", "c.xyz", "c.txt", "c.pts", "c.ply"])
@pytest.mark.parametrize("method", ["highest", "median"])
def test_a_cloud_of_points(tmp_path: Path, name: str, method: str) -> None:
    path = tmp_path / name
    head = {"c.csv": "x, y, z, intensity", "c.txt": "# a scan", "c.pts": "300"}.get(name, "")
    mark = ", " if name == "c.csv" else " "
    if name == "c.ply":
        path.write_bytes(trimesh.PointCloud(CLOUD).export(file_type="ply"))
    else:
        more = [[7.0]] * 300 if name in ("c.csv", "c.pts") else [[]] * 300
        lines = [
            mark.join(map(repr, [*map(float, p), *m])) for p, m in zip(CLOUD, more, strict=True)
        ]
        path.write_text("\n".join([head, *lines] if head else lines) + "\n\n")
    ground = load_ground(path, resolution=0.1, method=method)
    told = HeightMap.from_points(CLOUD, 0.1, method=method)
    assert ground.origin == told.origin
    assert np.allclose(ground.z, told.z, atol=1e-6, equal_nan=True)
    assert load_ground(path, resolution=100.0, unit=1000.0, method=method).shape == told.shape


@pytest.mark.parametrize("head", ['"id";"Z";"Y";"X"', "# id;z;y;x", "//ID;Z;Y;X;Class"])
def test_columns_are_found_by_their_names(tmp_path: Path, head: str) -> None:
    path = tmp_path / "c.csv"
    rows = "\n".join(f"{k};{z};{y};{x};1" for k, (x, y, z) in enumerate(CLOUD.tolist()))
    path.write_text(f"{head}\n{rows}\n")
    told = HeightMap.from_points(CLOUD, 0.1)
    assert np.allclose(load_ground(path, resolution=0.1).z, told.z, equal_nan=True)


@pytest.mark.parametrize(
    ("name", "data", "words"),
    [
        ("m.stl", b"", "m.stl"),
        ("m.stl", b"solid nothing\nendsolid\n", "m.stl"),
        ("m.stl", bytes(80) + b"\xff\xff\xff\x7f" + bytes(100), "m.stl"),
        ("m.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n", "m.obj"),
        ("m.obj", b"v 0 0 0\nv 1 0 nan\nv 0 1 0\nf 1 2 3\n", "m.obj"),
        ("m.obj", b"v 0 0 0\nv 1 0 0\n", "m.obj"),
        ("m.obj", b"v 0 0 0\nv 1e9 0 0\nv 0 1e9 0\nf 1 2 3\n", "must be below"),
        ("m.obj", b"v 0 0 0\nv 900 0 0\nv 0 900 0\nf 1 2 3\n", "coarser"),
        ("m.ply", b"ply\nformat ascii 1.0\nelement vertex 999999999999\nend_header\n", "m.ply"),
        ("m.ply", b"ply\n", "m.ply"),
        ("c.csv", b"x,y,z\n", "no line of it has three numbers"),
        ("c.csv", b"leg,step,x,y,z\nLF,0,0.1,0.2,0.0\n", "walk --footholds walks over them"),
        ("c.csv", b"1,2,3\n4,5\n", "damaged"),
        ("c.csv", b"1,2,3\n4,5,six\n", "damaged"),
        ("c.xyz", b"\xff\xfe\x00", "damaged"),
        ("c.xyz", b"nan nan nan\n", "no points with finite"),
        ("c.xyz", b"0 0 0\n1e300 0 0\n", "must be below"),
    ],
)
def test_files_that_hold_no_ground_are_refused(
    tmp_path: Path, name: str, data: bytes, words: str
) -> None:
    path = tmp_path / name
    path.write_bytes(data)
    with pytest.raises(GroundError, match=words) as caught:
        load_ground(path)
    assert str(path) in str(caught.value)


def test_nothing_that_a_mesh_names_is_opened(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    secret = tmp_path / "secret.mtl"
    secret.write_text("newmtl m\nmap_Kd secret.png\n")
    path = tmp_path / "m.obj"
    text = "mtllib secret.mtl\nusemtl m\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"
    path.write_text(text)
    opened: list[str] = []
    true_open = Path.open

    def note(self: Path, *args: Any, **more: Any) -> Any:
        opened.append(self.name)
        return true_open(self, *args, **more)

    monkeypatch.setattr(Path, "open", note)
    monkeypatch.setattr("builtins.open", lambda name, *a, **k: opened.append(str(name)))
    load_ground(path, resolution=0.1)
    assert opened == ["m.obj"]


def test_kinds_of_files(tmp_path: Path) -> None:
    with pytest.raises(
        GroundError, match=r"ending '.dwg' are not read; those with .npz, .npy, .png"
    ):
        load_ground(tmp_path / "map.dwg")
    with pytest.raises(GroundError, match=r"pictures .* '.JPG' are not read; save it as a PNG"):
        load_ground(tmp_path / "map.JPG")
    with pytest.raises(GroundError, match="there is no file"):
        load_ground(tmp_path / "map.png")
    upper = tmp_path / "WEDGE.STL"
    wedge().export(upper, file_type="stl")
    assert load_ground(upper).shape == (51, 26)
