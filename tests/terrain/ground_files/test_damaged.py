"""Files that are damaged at random: each is read, or refused by an error that names it."""

from __future__ import annotations

import io
import random
import struct
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from PIL import Image

from gaitopt import GroundError, HeightMap, load_ground

Z = np.random.default_rng(0).uniform(0.0, 1.0, (12, 9))
DAMAGES = 40


def image(pixels: Any, form: str, **more: Any) -> bytes:
    stream = io.BytesIO()
    Image.fromarray(pixels).save(stream, form, **more)
    return stream.getvalue()


def array(save: Callable[..., None], *values: Any, **more: Any) -> bytes:
    stream = io.BytesIO()
    save(stream, *values, **more)
    return stream.getvalue()


BALL = trimesh.creation.icosphere(subdivisions=1)
CLOUD = "\n".join(" ".join(map(str, p)) for p in BALL.vertices.tolist())
FILES: dict[str, tuple[bytes, dict[str, Any]]] = {
    "a.npz": (array(np.savez_compressed, z=Z, resolution=0.1, origin=(0.0, 0.0)), {}),
    "b.npz": (array(np.savez, elevation=Z, other=1.0), {"resolution": 0.1}),
    "c.npy": (array(np.save, Z), {"resolution": 0.1}),
    "d.png": (image((255 * Z).astype(np.uint8), "PNG"), {"resolution": 0.1, "heights": (0, 1)}),
    "e.png": (image((65535 * Z).astype(np.uint16), "PNG"), {"resolution": 0.1, "heights": (0, 1)}),
    "f.tif": (image(Z.astype(np.float32), "TIFF", compression="tiff_lzw"), {"resolution": 0.1}),
    "g.stl": (BALL.export(file_type="stl"), {}),
    "h.stl": (BALL.export(file_type="stl_ascii").encode(), {}),
    "i.obj": (BALL.export(file_type="obj").encode(), {}),
    "j.ply": (BALL.export(file_type="ply"), {}),
    "k.ply": (trimesh.PointCloud(BALL.vertices).export(file_type="ply"), {}),
    "l.xyz": (CLOUD.encode(), {}),
}


def damaged(data: bytes, draw: random.Random) -> bytes:
    """Bits turned, and bytes that are replaced, left out, put in, or cut off."""
    out = bytearray(data)
    for _ in range(draw.choice([1, 1, 2, 8])):
        at = draw.randrange(min(len(out), draw.choice([64, 512, len(out)])) or 1)
        kind = draw.randrange(6)
        if kind == 0 and out:
            out[min(at, len(out) - 1)] ^= 1 << draw.randrange(8)
        elif kind == 1:
            del out[at:]
        elif kind == 2:
            del out[at : at + draw.randrange(1, 20)]
        elif kind == 3:
            out[at:at] = draw.randbytes(draw.randrange(1, 20))
        elif kind == 4:
            number = draw.choice([0, 1, 10**6, 2**31 - 1, 2**32 - 1])
            out[at : at + 4] = struct.pack(draw.choice("<>") + "I", number)
        else:
            other = draw.randrange(len(out) or 1)
            out[at : at + 8] = out[other : other + 8]
    return bytes(out)


def with_right_sums(data: bytes) -> bytes:
    """A PNG whose parts have the right check sums, so that a reader gets to what is in them."""
    out, at = bytearray(data), 8
    while at + 12 <= len(out):
        (length,) = struct.unpack(">I", out[at : at + 4])
        end = at + 8 + length
        if end + 4 > len(out):
            break
        out[end : end + 4] = struct.pack(">I", zlib.crc32(bytes(out[at + 4 : end])))
        at = end + 4
    return bytes(out)


@pytest.mark.parametrize("name", FILES)
def test_damaged_files_are_read_or_refused_by_name(tmp_path: Path, name: str) -> None:
    data, options = FILES[name]
    path = tmp_path / name
    path.write_bytes(data)
    assert isinstance(load_ground(path, **options), HeightMap)
    draw = random.Random(name)
    refused = 0
    for _ in range(DAMAGES):
        bad = damaged(data, draw)
        path.write_bytes(with_right_sums(bad) if name.endswith(".png") else bad)
        try:
            assert isinstance(load_ground(path, **options), HeightMap)
        except GroundError as error:
            assert str(path) in str(error)
            refused += 1
    assert refused > DAMAGES / 4
