"""Footholds in plan files: a header of JSON, and arrays in which legs are rows of one length.

An array holds as many columns as the leg with the most footholds; ``counts`` in the header says how
many of them belong to each leg.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from gaitopt.conventions import LEGS, FloatArray
from gaitopt.terrain.footholds import Footholds
from gaitopt.terrain.height_map import HeightMap

_BY_LEG = {"normals": 0, "friction": 0, "swing_heights": 1}
"""Arrays that hold a row for each leg, and by how much they are shorter than the footholds."""
_OF_STEPS = ("postures", "body_places")
"""Arrays that hold a row for the start and one for each step."""


def packed_footholds(footholds: Footholds) -> tuple[dict[str, Any], dict[str, FloatArray]]:
    """The part of the header, and the arrays, that hold footholds beside their places.

    Both are empty where there is nothing beside places and radius.
    """
    header: dict[str, Any] = {}
    arrays: dict[str, FloatArray] = {}
    if len(set(footholds.counts.values())) > 1:
        header["counts"] = [footholds.counts[leg] for leg in LEGS]
    if footholds.order is not None:
        header["order"] = list(footholds.order)
    for name, fewer in _BY_LEG.items():
        value: Mapping[str, FloatArray] | None = getattr(footholds, name)
        if value is not None:
            arrays[name] = _rows(value, len(footholds) - fewer)
    for name in _OF_STEPS:
        if getattr(footholds, name) is not None:
            arrays[name] = getattr(footholds, name)
    if footholds.ground is not None:
        arrays["ground"] = footholds.ground.z
        header["ground"] = {
            "resolution": footholds.ground.resolution, "origin": list(footholds.ground.origin),
        }  # fmt: skip
    return header, arrays


def unpacked_footholds(
    radius: float | None, header: Mapping[str, Any], arrays: Mapping[str, FloatArray]
) -> Footholds:
    """The footholds of a plan file.

    Args:
        radius: of the columns [m].
        header: what :func:`packed_footholds` put into the header.
        arrays: of the file.
    """
    points = arrays["footholds"]
    counts = header.get("counts", [points.shape[1]] * len(LEGS))
    further: dict[str, Any] = {
        name: {
            leg: row[: n - fewer] for leg, row, n in zip(LEGS, arrays[name], counts, strict=True)
        }
        for name, fewer in _BY_LEG.items()
        if name in arrays
    }
    further |= {name: arrays[name] for name in _OF_STEPS if name in arrays}
    if "ground" in arrays:
        further["ground"] = HeightMap(arrays["ground"], **header["ground"])
    return Footholds(
        {leg: row[:n] for leg, row, n in zip(LEGS, points, counts, strict=True)}, radius,
        order=header.get("order"), **further,
    )  # fmt: skip


def _rows(by_leg: Mapping[str, FloatArray], most: int) -> FloatArray:
    """The arrays of all legs, filled up with zeros to ``most`` rows."""
    return np.stack([
        np.concatenate([a, np.zeros((most - len(a), *a.shape[1:]))])
        for a in (by_leg[leg] for leg in LEGS)
    ])  # fmt: skip
