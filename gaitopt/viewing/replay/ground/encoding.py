"""Height maps of a scene, and what lies upon them, as data from which the browser makes triangles.

A map of 150 by 75 points takes 30 kB, and its triangles, which meshcat's viewer would be given,
1.2 MB.
"""

from __future__ import annotations

import base64
from typing import Any

import numpy as np

from gaitopt.viewing.replay.scene import Dots, Draped, Heights, Relief, Scene

UNKNOWN = 65535
"""Number in place of a height where nothing is drawn."""
DIGITS = 5
"""Decimals of places [m]: a hundredth of a millimetre cannot be seen."""


def ground_data(scene: Scene) -> dict[str, Any]:
    """The height maps of a scene, their surfaces, and polygons upon them, for the page's script.

    Returns:
        ``heights``: of each map its ``shape``, ``step``, ``origin``, and ``z``: numbers of 16 bits,
        little-endian, in base64; a height is ``low + unit * number``, and :data:`UNKNOWN` none.
        ``reliefs`` and ``draped`` are the parts of the scene that lie on the map with the number
        ``heights``, and ``dots`` single points; each has its ``frame``.
    """
    maps: list[dict[str, Any]] = []
    found: dict[str, list[dict[str, Any]]] = {"reliefs": [], "draped": [], "dots": []}
    for node in scene.nodes:
        for part in node.parts:
            look, shape = part.appearance, part.shape
            of = {"frame": list(node.path), "colour": look.colour, "opacity": look.opacity,
                  "layer": look.layer}  # fmt: skip
            if isinstance(shape, Relief):
                of |= {"heights": _numbered(shape.heights, maps), **_colours(shape)}
                found["reliefs"].append(of)
            elif isinstance(shape, Draped):
                places = [np.round(p, DIGITS).tolist() for p in shape.polygons]
                of |= {"heights": _numbered(shape.heights, maps), "polygons": places}
                found["draped"].append(of)
            elif isinstance(shape, Dots):
                of |= {"size": shape.size, "points": _text(shape.points, "<f4")}
                found["dots"].append(of)
    return {"heights": maps, **found}


def _numbered(heights: Heights, maps: list[dict[str, Any]]) -> int:
    """The number of a map in ``maps``, to which it is added where no equal one is there."""
    data = _packed(heights)
    if data not in maps:
        maps.append(data)
    return maps.index(data)


def _packed(heights: Heights) -> dict[str, Any]:
    """A height map with numbers of 16 bits."""
    known = np.isfinite(heights.z)
    low, high = (float(f(heights.z, where=known, initial=s))
                 for f, s in ((np.min, np.inf), (np.max, -np.inf)))  # fmt: skip
    if not known.any():
        low = high = 0.0
    # At most 2^16 - 2 steps, as the last number stands for unknown heights.
    unit = (high - low) / (UNKNOWN - 1) or 1.0
    z = np.where(known, np.rint((np.nan_to_num(heights.z) - low) / unit), UNKNOWN)
    return {
        "shape": list(heights.z.shape),
        "step": heights.step,
        "origin": list(heights.origin),
        "low": low,
        "unit": unit,
        "z": _text(z, "<u2"),
    }


def _colours(relief: Relief) -> dict[str, Any]:
    """The codes of a relief with their colours; nothing where it is coloured by height."""
    if relief.codes is None:
        return {}
    return {"codes": _text(relief.codes, "u1"), "palette": list(relief.palette)}


def _text(numbers: Any, kind: str) -> str:
    """Numbers of a ``kind`` of NumPy, row by row, in base64."""
    return base64.b64encode(np.asarray(numbers).astype(kind).tobytes()).decode("ascii")
