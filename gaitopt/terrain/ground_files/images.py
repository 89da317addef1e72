"""Heights in images: PNG with shades of grey, and GeoTIFF."""

from __future__ import annotations

import io
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.errors import GroundError
from gaitopt.files import read_bounded
from gaitopt.terrain.ground_files.options import Options
from gaitopt.terrain.ground_files.png_rows import check_png_rows, png_header
from gaitopt.terrain.height_map import HeightMap
from gaitopt.terrain.height_map_checks import check_size

LIMIT = 300_000_000
"""Most bytes of an image that are read: the largest map, not packed, with two numbers a point."""
_GREY, _COLOUR, _PALETTE, _GREY_ALPHA, _COLOUR_ALPHA = 0, 2, 3, 4, 6
"""Kinds of PNG (PNG specification, section 11.2.1)."""
_CHANNELS = {_GREY: 1, _COLOUR: 3, _PALETTE: 1, _GREY_ALPHA: 2, _COLOUR_ALPHA: 4}
"""Numbers of a pixel, for each kind."""


def read_png(path: Path, options: Options) -> HeightMap:
    """A map from a PNG: x to the right and y up as one looks at it, black low and white high.

    Transparent pixels are unknown.
    """
    options.only("PNG files", "resolution", "heights", "origin")
    data = read_bounded(path, LIMIT, GroundError)
    width, height, depth, kind, interlaced = png_header(data)
    check_size(width, height)
    if depth == 16 and kind != _GREY:
        raise GroundError(
            "it has 16 bits a colour; save it as 16-bit greyscale without transparency, for "
            "instance with: magick map.png -alpha off -colorspace gray -depth 16 grey.png"
        )
    resolution = options.needed_resolution("PNG files")
    if options.heights is None:
        raise GroundError(
            "a PNG file tells no heights: give those of black and of white in metres, for instance "
            "heights=(0.0, 0.15)"
        )
    check_png_rows(data, width, height, depth * _CHANNELS[kind], interlaced)
    low, high = options.heights
    with _opened(data, "PNG") as image:
        shades, seen = _shades(image, kind, depth)
    z = low + (high - low) * shades / (65535.0 if depth == 16 else 255.0)
    z[~seen] = np.nan
    return options.placed(_from_above(z), resolution)


def read_geotiff(path: Path, options: Options) -> HeightMap:
    """A map from a GeoTIFF, with x to the east and y to the north from its south-western pixel."""
    options.only("TIFF files", "resolution", "origin", "unit")
    data = read_bounded(path, LIMIT, GroundError)
    with _opened(data, "TIFF") as image:
        check_size(*image.size)
        if image.mode not in ("F", "L") and not image.mode.startswith("I"):
            raise GroundError(
                f"it is an image of the mode {image.mode} and holds no heights; save one band of "
                "numbers"
            )
        tags = dict(image.tag_v2)
        z = np.asarray(image).astype(np.float64)
    missing = _missing_value(tags)
    z[~np.isfinite(z) | (z == missing)] = np.nan
    resolution = options.resolution if options.resolution is not None else _pixel_size(tags)
    unit = options.unit if options.unit is not None else _height_unit(tags)
    return options.placed(_from_above(z) * unit, resolution)


def _from_above(picture: FloatArray) -> FloatArray:
    """Heights ``(nx, ny)`` of a picture ``(rows, columns)`` that is seen from above, y up."""
    return np.ascontiguousarray(picture[::-1].T)


@contextmanager
def _opened(data: bytes, form: str) -> Iterator[Any]:
    """An image of one format in memory. What Pillow warns of, such as tags cut off, is an error."""
    from PIL import Image, UnidentifiedImageError

    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            image = Image.open(io.BytesIO(data), formats=[form])
        except UnidentifiedImageError:
            raise GroundError(
                f"it is damaged, or no {form} file that can be read; integers and 32-bit floats "
                "can be, which gdal_translate -ot Float32 in.tif out.tif writes"
                if form == "TIFF"
                else f"it is damaged, or no {form} file"
            ) from None
        with image:
            yield image


def _shades(image: Any, kind: int, depth: int) -> tuple[FloatArray, Any]:
    """Shades of grey ``(rows, columns)``, and where the image is not transparent."""
    if kind == _GREY:
        hidden = image.info.get("transparency")
        grey = np.asarray(image.convert("L") if image.mode == "1" else image).astype(np.float64)
        if hidden is None:
            return grey, np.ones(grey.shape, np.bool_)
        # Pillow stretches shades of fewer than eight bits, but not the one that is transparent.
        return grey, grey != (hidden * 255 // (2**depth - 1) if depth < 8 else hidden)
    if kind == _GREY_ALPHA:
        pair = np.asarray(image.convert("LA"))
        return pair[..., 0].astype(np.float64), pair[..., 1] > 0
    colours = np.asarray(image.convert("RGBA"))
    seen = colours[..., 3] > 0
    if (np.ptp(colours[..., :3], axis=-1)[seen] > 0).any():
        raise GroundError(
            "it is a picture in colours, and heights are shades of grey; save it as greyscale, "
            "for instance with: magick map.png -colorspace gray grey.png"
        )
    return colours[..., 0].astype(np.float64), seen


# Tags of TIFF and keys of GeoTIFF (OGC GeoTIFF 1.1, annex; GDAL_NODATA).
_PIXEL_SCALE, _KEYS, _NO_DATA = 33550, 34735, 42113
_MODEL_TYPE, _LENGTH_UNIT, _VERTICAL_UNIT = 1024, 3076, 4099
_GEOGRAPHIC = 2
_METRE = 9001


def _geo_keys(tags: dict[int, Any]) -> dict[int, int]:
    """The keys of a GeoTIFF whose values are numbers in the directory itself."""
    directory = tags.get(_KEYS, ())
    rows = [directory[k : k + 4] for k in range(4, len(directory) - 3, 4)]
    return {row[0]: row[3] for row in rows if row[1] == 0}


def _pixel_size(tags: dict[int, Any]) -> float:
    """Size of the pixels of a GeoTIFF [m]."""
    keys, scale = _geo_keys(tags), tags.get(_PIXEL_SCALE)
    cure = "; give the distance between pixels in metres, for instance resolution=0.5"
    if scale is None or len(scale) < 2:
        raise GroundError("it does not tell the size of its pixels" + cure)
    if keys.get(_MODEL_TYPE) == _GEOGRAPHIC:
        raise GroundError("its coordinates are degrees" + cure + ", or reproject it to metres")
    if keys.get(_LENGTH_UNIT, _METRE) != _METRE:
        raise GroundError(f"its coordinates are no metres (unit {keys[_LENGTH_UNIT]})" + cure)
    along, across = float(scale[0]), float(scale[1])
    if not abs(along - across) <= 1e-6 * abs(along):
        raise GroundError(
            f"its pixels are {along:g} m by {across:g} m, and must be square; resample it first"
        )
    return along


def _height_unit(tags: dict[int, Any]) -> float:
    """Unit of the heights of a GeoTIFF [m]: metres, unless it tells another."""
    code = _geo_keys(tags).get(_VERTICAL_UNIT, _METRE)
    if code != _METRE:
        raise GroundError(
            f"its heights are no metres (unit {code}); give their unit, for instance unit=0.3048"
        )
    return 1.0


def _missing_value(tags: dict[int, Any]) -> float:
    """The number that stands for unknown heights in a GeoTIFF; NaN where there is none."""
    try:
        return float(str(tags.get(_NO_DATA, "nan")).strip("\x00 "))
    except ValueError:
        return float("nan")
