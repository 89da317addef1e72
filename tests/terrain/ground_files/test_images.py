"""Ground in PNG and GeoTIFF images."""

from __future__ import annotations

import io
import struct
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image, TiffImagePlugin

from gaitopt import GroundError, InputError, load_ground
from gaitopt.conventions import FloatArray

RNG = np.random.default_rng(0)
ASKED = {"resolution": 0.1, "heights": (0.0, 1.0)}


def save(path: Path, pixels: Any, **more: Any) -> Path:
    Image.fromarray(np.asarray(pixels)).save(path, **more)
    return path


def test_x_is_to_the_right_and_y_up_black_is_low_and_white_high(tmp_path: Path) -> None:
    for dtype, white in ((np.uint8, 255), (np.uint16, 65535)):
        pixels = np.zeros((3, 4), dtype)
        pixels[0, 3] = white  # In the upper right corner.
        pixels[2, 1] = white // 5
        path = save(tmp_path / "map.png", pixels)
        ground = load_ground(path, resolution=0.1, heights=(-0.5, 0.5), origin=(1.0, 2.0))
        assert ground.shape == (4, 3) and ground.resolution == 0.1
        assert ground.height([1.3, 2.2]) == pytest.approx(0.5, abs=1e-12)
        assert ground.height([1.1, 2.0]) == pytest.approx(-0.3, abs=1e-12)
        assert ground.height([1.0, 2.0]) == ground.height([1.0, 2.2]) == -0.5
    assert load_ground(path, resolution=0.1, heights=(0.5, -0.5)).z[3, 2] == -0.5


def test_sixteen_bits_are_all_there(tmp_path: Path) -> None:
    pixels = RNG.integers(0, 65536, (30, 20)).astype(np.uint16)
    path = save(tmp_path / "map.png", pixels)
    ground = load_ground(path, resolution=0.1, heights=(0.0, 65.535))
    assert np.allclose(ground.z, pixels[::-1].T / 1000.0, atol=1e-12)


def test_mujoco_reads_the_same_ground(tmp_path: Path) -> None:
    mujoco = pytest.importorskip("mujoco")
    pixels = RNG.integers(0, 256, (9, 13)).astype(np.uint8)
    pixels[0, 0], pixels[4, 4] = 0, 255
    path = save(tmp_path / "map.png", pixels)
    ground = load_ground(path, resolution=0.1, heights=(0.0, 0.7))
    model = mujoco.MjModel.from_xml_string(
        '<mujoco><asset><hfield name="g" file="map.png" size="0.6 0.4 0.7 0.1"/></asset></mujoco>',
        {"map.png": path.read_bytes()},
    )
    heights = model.hfield_data.reshape(model.hfield_nrow[0], model.hfield_ncol[0])
    assert np.allclose(0.7 * heights.T, ground.z, atol=1e-6)


@pytest.mark.parametrize("mode", ["LA", "RGB", "RGBA", "P", "1", "grey key", "4 bits"])
def test_other_greyscale_images_and_transparency(tmp_path: Path, mode: str) -> None:
    grey = (RNG.integers(0, 16, (5, 6)) * 17).astype(np.uint8)
    path, hidden = tmp_path / "map.png", grey == grey[1, 2]
    image = Image.fromarray(grey)
    if mode == "grey key":
        image.save(path, transparency=int(grey[1, 2]))
    elif mode == "4 bits":
        path.write_bytes(png(6, 5, 4, 0, [bytes([a // 17 << 4 | b // 17 for a, b in
                                                 zip(row[::2], row[1::2], strict=True)])
                                          for row in grey.astype(int)],
                             (b"tRNS", struct.pack(">H", grey[1, 2] // 17))))  # fmt: skip
    elif mode in ("LA", "RGBA"):
        image = image.convert(mode)
        image.putalpha(Image.fromarray(np.where(hidden, 0, 255).astype(np.uint8)))
        image.save(path)
    else:
        image, hidden = image.convert(mode), hidden & False
        image.save(path)
        grey = np.asarray(image.convert("L"))
    ground = load_ground(path, resolution=0.1, heights=(0.0, 2.55))
    told = np.where(hidden, np.nan, grey / 100.0)
    assert np.allclose(ground.z, told[::-1].T, atol=1e-12, equal_nan=True)


@pytest.mark.parametrize("size", [(8, 8), (3, 2), (13, 9), (2, 17), (5, 1)])
@pytest.mark.parametrize("bits", [8, 16])
def test_interlaced_images_are_whole_or_refused(
    tmp_path: Path, size: tuple[int, int], bits: int
) -> None:
    width, height = size
    pixels = RNG.integers(0, 2**bits, (height, width))
    rows = []
    for left, top, across, down in (
        (0, 0, 8, 8), (4, 0, 8, 8), (0, 4, 4, 8), (2, 0, 4, 4), (0, 2, 2, 4), (1, 0, 2, 2),
        (0, 1, 1, 2),
    ):  # fmt: skip
        some = pixels[top::down, left::across]
        if some.size:
            rows += [row.astype(">u2" if bits == 16 else np.uint8).tobytes() for row in some]
    data = png(width, height, bits, 0, rows, interlaced=1)
    path = tmp_path / "map.png"
    path.write_bytes(data)
    if height == 1:
        with pytest.raises(GroundError, match="at least 2 by 2"):
            load_ground(path, **ASKED)  # type: ignore[arg-type]
        return
    ground = load_ground(path, resolution=0.1, heights=(0.0, 2.0**bits - 1.0))
    assert np.allclose(ground.z, pixels[::-1].T)
    path.write_bytes(png(width, height, bits, 0, rows[:-1], interlaced=1))
    with pytest.raises(GroundError, match="incomplete"):
        load_ground(path, **ASKED)  # type: ignore[arg-type]


def png(width: int, height: int, depth: int, kind: int, rows: list[bytes], *more: Any,
        interlaced: int = 0) -> bytes:  # fmt: skip
    def chunk(name: bytes, data: bytes) -> bytes:
        return (
            struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))
        )

    head = chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, depth, kind, 0, 0, interlaced))
    body = b"".join(chunk(*part) for part in more)
    pixels = zlib.compress(b"".join(b"\0" + row for row in rows))
    return b"\x89PNG\r\n\x1a\n" + head + body + chunk(b"IDAT", pixels) + chunk(b"IEND", b"")


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (b"", "no PNG file"),
        (b"GIF89a" + bytes(100), "no PNG file"),
        (png(3, 3, 16, 2, [bytes(18)] * 3), "16-bit greyscale"),
        (png(3, 3, 8, 2, [bytes(range(9))] * 3), "save it as greyscale"),
        # Pillow makes rows black that are missing, and they would be the lowest ground.
        (png(3, 3, 8, 0, [bytes(3)]), "incomplete or damaged"),
        (png(2, 3, 8, 0, [bytes(2)] * 3)[:-20], "incomplete or damaged"),
        (png(3, 3, 8, 0, [bytes(3)] * 4), "incomplete or damaged"),
        (png(3, 3, 7, 0, [bytes(3)] * 4), "no such PNG"),
        # A bomb: 10 GB of black in 10 kB, and one whose header tells four billion points a side.
        (png(100_000, 100_000, 8, 0, [bytes(10_000_000)]), "100,000 by 100,000; take a coarser"),
        (png(2**32 - 1, 2**32 - 1, 8, 0, []), "coarser"),
        (png(1, 1, 8, 0, [bytes(1)]), "at least 2 by 2"),
        (png(3, 3, 8, 6, [bytes(12)] * 3), "no height of the map is known"),
    ],
)
def test_pngs_that_hold_no_ground_are_refused(tmp_path: Path, data: bytes, words: str) -> None:
    path = tmp_path / "map.png"
    path.write_bytes(data)
    with pytest.raises(GroundError, match=words) as caught:
        load_ground(path, **ASKED)  # type: ignore[arg-type]
    assert str(path) in str(caught.value)


def test_a_text_that_unpacks_to_too_much_is_refused(tmp_path: Path) -> None:
    packed = zlib.compress(bytes(100_000_000))
    text = (b"zTXt", b"Comment\0\0" + packed), (b"iCCP", b"icc\0\0" + packed)
    path = tmp_path / "map.png"
    path.write_bytes(png(2, 2, 8, 0, [b"\0\1"] * 2, *text))
    try:
        assert load_ground(path, **ASKED).shape == (2, 2)  # type: ignore[arg-type]
    except GroundError as error:
        assert "damaged" in str(error)


def test_what_must_be_told_of_a_png(tmp_path: Path) -> None:
    path = save(tmp_path / "map.png", np.zeros((3, 3), np.uint8))
    with pytest.raises(GroundError, match=r"map.png: PNG files tell no scale.*resolution=0.02"):
        load_ground(path, heights=(0.0, 1.0))
    with pytest.raises(GroundError, match=r"map.png: .*heights=\(0.0, 0.15\)"):
        load_ground(path, resolution=0.1)
    with pytest.raises(InputError, match="PNG files take no option topic"):
        load_ground(path, topic="/map", **ASKED)  # type: ignore[arg-type]
    for options in ({"heights": (0.0,)}, {"heights": (0.0, np.nan)}, {"resolution": -1.0},
                    {"origin": "here"}, {"layer": 3}, {"unit": 0.0}, {"message": 0.5}):  # fmt: skip
        with pytest.raises(InputError, match=next(iter(options))):
            load_ground(path, **options)  # type: ignore[arg-type]


def geotiff(path: Path, z: FloatArray, tags: dict[int, Any], **more: Any) -> Path:
    found = TiffImagePlugin.ImageFileDirectory_v2()
    for tag, value in tags.items():
        found[tag] = value
        if tag in (33550, 33922):
            found.tagtype[tag] = 12
        elif tag == 34735:
            found.tagtype[tag] = 3
    return save(path, z, tiffinfo=found, **more)


PROJECTED = {
    33550: (0.5, 0.5, 0.0), 33922: (0.0, 0.0, 0.0, 5e5, 5e6, 0.0), 42113: "-9999",
    34735: (1, 1, 0, 3, 1024, 0, 1, 1, 1025, 0, 1, 1, 3076, 0, 1, 9001),
}  # fmt: skip


@pytest.mark.parametrize("dtype", [np.float32, np.int16, np.uint8, np.int32])
@pytest.mark.parametrize("compression", ["raw", "tiff_lzw", "tiff_adobe_deflate"])
def test_a_geotiff_has_its_pixels_and_unknown_heights(
    tmp_path: Path, dtype: Any, compression: str
) -> None:
    z = RNG.integers(0, 200, (7, 9)).astype(dtype)
    path = geotiff(tmp_path / "dem.tif", z, PROJECTED, compression=compression)
    ground = load_ground(path)
    assert ground.shape == (9, 7) and ground.resolution == 0.5 and ground.origin == (0.0, 0.0)
    assert np.allclose(ground.z, z[::-1].T, atol=0)
    if np.issubdtype(dtype, np.signedinteger) or dtype == np.float32:
        z[2, 3] = -9999
        ground = load_ground(geotiff(path, z, PROJECTED), origin=(3.0, 4.0))
        assert np.argwhere(~ground.known).tolist() == [[3, 4]] and ground.origin == (3.0, 4.0)
    feet = load_ground(geotiff(path, z, PROJECTED), unit=0.3048)
    assert np.allclose(feet.z[feet.known], 0.3048 * z[::-1].T[feet.known])


@pytest.mark.parametrize(
    ("changes", "words", "cure"),
    [
        ({33550: None}, "size of its pixels", {"resolution": 0.5}),
        ({34735: (1, 1, 0, 1, 1024, 0, 1, 2)}, "are degrees", {"resolution": 0.5}),
        ({34735: (1, 1, 0, 1, 3076, 0, 1, 9003)}, "no metres", {"resolution": 0.5}),
        ({34735: (1, 1, 0, 1, 4099, 0, 1, 9003)}, "unit=0.3048", {"unit": 0.3048}),
        ({33550: (0.5, 0.6, 0.0)}, "must be square", None),
        ({33550: (0.0, 0.0, 0.0)}, "resolution", None),
        ({33550: (np.nan, 0.5, 0.0)}, "square", None),
    ],
)
def test_what_a_geotiff_does_not_tell_is_asked_for(
    tmp_path: Path, changes: dict[int, Any], words: str, cure: dict[str, Any] | None
) -> None:
    tags = {k: v for k, v in {**PROJECTED, **changes}.items() if v is not None}
    path = geotiff(tmp_path / "dem.tif", np.ones((4, 4), np.float32), tags)
    with pytest.raises((GroundError, InputError), match=rf"dem.tif: .*{words}"):
        load_ground(path)
    if cure is not None:
        assert load_ground(path, **cure).shape == (4, 4)


def test_other_tiffs_are_refused(tmp_path: Path) -> None:
    path = save(tmp_path / "photo.tif", np.zeros((4, 4, 3), np.uint8))
    with pytest.raises(GroundError, match="mode RGB and holds no heights"):
        load_ground(path)
    path.write_bytes(b"II*\0" + bytes(50))
    with pytest.raises(GroundError, match=r"photo.tif: it is damaged.*gdal_translate -ot Float32"):
        load_ground(path)
    data = io.BytesIO()
    Image.fromarray(np.zeros((4, 4), np.float32)).save(data, "TIFF")
    # Width and height become 100,000: entries of the directory with the tags 256 and 257.
    huge = bytearray(data.getvalue())
    for tag in (256, 257):
        at = huge.find(struct.pack("<HHI", tag, 4, 1))
        at = at if at >= 0 else huge.find(struct.pack("<HHI", tag, 3, 1))
        huge[at : at + 12] = struct.pack("<HHII", tag, 4, 1, 100_000)
    path.write_bytes(huge)
    with pytest.raises(GroundError, match=r"coarser|damaged"):
        load_ground(path)
