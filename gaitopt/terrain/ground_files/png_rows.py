"""Whether a PNG is whole. Pillow makes pixels black that are missing at the end of the file, and
heights of black are believed."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator

from gaitopt.errors import GroundError

SIGNATURE = b"\x89PNG\r\n\x1a\n"
_PASSES = (
    (0, 0, 8, 8), (4, 0, 8, 8), (0, 4, 4, 8), (2, 0, 4, 4), (0, 2, 2, 4), (1, 0, 2, 2),
    (0, 1, 1, 2),
)  # fmt: skip
"""First column and row, and distance of columns and rows, of the seven passes of an interlaced PNG
(PNG specification, section 8.2)."""


def png_header(data: bytes) -> tuple[int, int, int, int, bool]:
    """Width, height, bits, kind, and whether it is interlaced, before anything is unpacked.

    Raises:
        GroundError: it is no PNG file.
    """
    if data[:8] != SIGNATURE or data[12:16] != b"IHDR" or len(data) < 33:
        raise GroundError("it is no PNG file")
    width, height, depth, kind, _, _, interlaced = struct.unpack(">IIBBBBB", data[16:29])
    if depth not in (1, 2, 4, 8, 16) or kind not in (0, 2, 3, 4, 6):
        raise GroundError("it is damaged: there are no such PNG files")
    return width, height, depth, kind, bool(interlaced)


def check_png_rows(data: bytes, width: int, height: int, bits: int, interlaced: bool) -> None:
    """Refuse a PNG whose pixels are incomplete or damaged.

    Args:
        data: the file.
        width, height: in pixels.
        bits: of one pixel.
        interlaced: whether it is.

    Raises:
        GroundError: it is; no more of it is unpacked than belongs to its pixels.
    """
    passes = _PASSES if interlaced else ((0, 0, 1, 1),)
    expected = 0
    for left, top, across, down in passes:
        columns, rows = -(-(width - left) // across), -(-(height - top) // down)
        if columns > 0 and rows > 0:
            expected += rows * (1 + -(-columns * bits // 8))
    unpack = zlib.decompressobj()
    count = 0
    for part in _pixels(data):
        pixels = unpack.decompress(part, expected + 1 - count)
        count += len(pixels)
        if count > expected:
            break
    # At its end zlib has compared the sum of all bytes.
    if count != expected or not unpack.eof:
        raise GroundError("it is incomplete or damaged; ask for the file again")


def _pixels(data: bytes) -> Iterator[bytes]:
    """The parts of a PNG that hold its pixels."""
    at = len(SIGNATURE)
    while at + 12 <= len(data):
        (length,) = struct.unpack(">I", data[at : at + 4])
        if data[at + 4 : at + 8] == b"IDAT":
            yield data[at + 8 : at + 8 + length]
        at += 12 + length
