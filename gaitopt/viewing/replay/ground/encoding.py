"""Parts of a scene whose triangles the browser makes, as data for the page's scripts.

A map of 150 by 75 points takes 30 kB, and its triangles, which meshcat's viewer would be given,
1.2 MB. Tubes and polygons take a tenth of their triangles.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.viewing.replay.numbers import as_text, packed
from gaitopt.viewing.replay.scene import (
    Dots,
    Draped,
    FramePath,
    Heights,
    Part,
    Polygon,
    Relief,
    Scene,
    Tubes,
)

UNKNOWN = 65535
"""Number in place of a height where nothing is drawn."""
DIGITS = 5
"""Decimals of places [m]: a hundredth of a millimetre cannot be seen."""
KINDS = {"relief": "reliefs", "draped": "draped", "dots": "dots", "tubes": "solids",
         "polygon": "solids"}  # fmt: skip
"""Lists of the page's data, by the kinds of their parts."""


class GroundData:
    """What the parts of a page have in common: height maps, each of them once, and points.

    Attributes:
        data: of each map; parts name it by its number.
    """

    def __init__(self) -> None:
        self.data: list[dict[str, Any]] = []
        self._numbers: dict[int, tuple[Heights, int]] = {}
        self._points: list[FloatArray] = []
        self._count = 0

    def first(self, points: FloatArray) -> int:
        """Add points ``(n, 3)`` [m]; the index of the first one."""
        self._points.append(points)
        self._count += len(points)
        return self._count - len(points)

    @property
    def points(self) -> dict[str, Any]:
        """All points."""
        return packed(np.concatenate([np.zeros((0, 3)), *self._points]), 10.0**-DIGITS)

    def number(self, heights: Heights) -> int:
        """The number of a map, which is added where no equal one is there."""
        if id(heights) not in self._numbers:
            data = _packed(heights)
            if data not in self.data:
                self.data.append(data)
            # The map is kept as well, so that no other one gets its id.
            self._numbers[id(heights)] = heights, self.data.index(data)
        return self._numbers[id(heights)][1]


def ground_data(
    scene: Scene, maps: GroundData, passing: Iterable[FramePath] = ()
) -> dict[str, Any]:
    """The parts of a scene whose triangles the browser makes.

    Args:
        scene: the scene.
        maps: takes height maps and points.
        passing: frames that are left out, since they are shown for some time only.

    Returns:
        ``heights``: of each map its ``shape``, ``step``, ``origin``, and ``z``: numbers of 16 bits,
        little-endian, in base64; a height is ``low + unit * number``, and :data:`UNKNOWN` none.
        ``reliefs`` and ``draped`` are the parts of the scene that lie on the map with the number
        ``heights``, ``dots`` single points, ``solids`` tubes and polygons; each has its ``frame``.
        ``points`` are those of all tubes and polygons, also of passing frames that were added to
        ``maps`` before: a part has ``counts`` of them, from number ``first`` on.
    """
    found: dict[str, list[dict[str, Any]]] = {name: [] for name in KINDS.values()}
    hidden = set(passing)
    for node in scene.nodes:
        if node.path in hidden:
            continue
        for part in node.parts:
            data = part_data(part, maps)
            if data is not None:
                found[KINDS[data["kind"]]].append({"frame": list(node.path), **data})
    return {"heights": maps.data, "points": maps.points, **found}


def part_data(part: Part, maps: GroundData) -> dict[str, Any] | None:
    """A part as data; ``None`` where meshcat's viewer is given its triangles."""
    look, shape = part.appearance, part.shape
    of: dict[str, Any] = {"colour": look.colour, "opacity": look.opacity, "layer": look.layer}
    if isinstance(shape, Relief):
        of |= {"kind": "relief", "heights": maps.number(shape.heights), **_colours(shape)}
    elif isinstance(shape, Draped):
        places = [np.round(p, DIGITS).tolist() for p in shape.polygons]
        of |= {"kind": "draped", "heights": maps.number(shape.heights), "polygons": places}
    elif isinstance(shape, Dots):
        of |= {"kind": "dots", "size": shape.size, "points": as_text(shape.points, "<f4")}
    elif isinstance(shape, Tubes):
        of |= {"kind": "tubes", "lit": look.lit, "radius": shape.radius,
               "counts": [len(line) for line in shape.lines],
               "first": maps.first(np.concatenate(shape.lines))}  # fmt: skip
    elif isinstance(shape, Polygon):
        of |= {"kind": "polygon", "lit": look.lit, "width": shape.border,
               "counts": [len(shape.vertices)], "first": maps.first(shape.vertices)}  # fmt: skip
    else:
        return None
    return of


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
        "z": as_text(z, "<u2"),
    }


def _colours(relief: Relief) -> dict[str, Any]:
    """The codes of a relief with their colours; nothing where it is coloured by height."""
    if relief.codes is None:
        return {}
    return {"codes": as_text(relief.codes, "u1"), "palette": list(relief.palette)}
