"""The shapes of a MuJoCo model that can touch something, for physics."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.robots.files.mjcf.links import body_name
from gaitopt.robots.files.own_shapes import (
    MOST_BITS,
    MOST_CORNERS,
    MOST_SHAPES,
    SIZES,
    OwnShape,
    OwnShapes,
)

DIGITS = 6
"""Decimal places of the corners of hulls [m]."""


def touching_shapes(mujoco: Any, model: Any, shifts: Mapping[int, FloatArray]) -> OwnShapes:
    """The shapes of some bodies that can touch something; none where there are too many.

    Args:
        mujoco, model: the package, and the model.
        shifts: of these bodies by their numbers, where their links' frames are ``(3,)`` [m].
    """
    shapes = []
    kinds = {int(getattr(mujoco.mjtGeom, f"mjGEOM_{kind.upper()}")): kind for kind in SIZES}
    for geom in range(model.ngeom):
        body = int(model.geom_bodyid[geom])
        bits = int(model.geom_contype[geom]), int(model.geom_conaffinity[geom])
        kind = kinds.get(int(model.geom_type[geom]))
        if body not in shifts or not any(bits) or kind is None:
            continue
        if not all(0 <= bit <= MOST_BITS for bit in bits):
            return OwnShapes()
        shapes.append(OwnShape(
            link=body_name(model, body), kind=kind,
            size=_plain(model.geom_size[geom][: SIZES[kind]]),
            place=_plain(model.geom_pos[geom] - shifts[body]), turn=_plain(model.geom_quat[geom]),
            bits=bits, corners=_hull(model, int(model.geom_dataid[geom])) if kind == "mesh" else (),
        ))  # fmt: skip
    apart = tuple(
        (body_name(model, pair >> 16), body_name(model, pair & 0xFFFF))
        for pair in (int(signature) for signature in model.exclude_signature)
        if pair >> 16 in shifts and pair & 0xFFFF in shifts
    )
    corners = sum(len(shape.corners) // 3 for shape in shapes)
    if max(len(shapes), len(apart)) > MOST_SHAPES or corners > MOST_CORNERS:
        return OwnShapes()
    return OwnShapes(tuple(shapes), apart)


def _hull(model: Any, mesh: int) -> tuple[float, ...]:
    """Corners of the convex hull of a mesh, in the frame that MuJoCo gives it."""
    start, count = int(model.mesh_vertadr[mesh]), int(model.mesh_vertnum[mesh])
    corners = np.array(model.mesh_vert[start : start + count], dtype=np.float64)
    graph = int(model.mesh_graphadr[mesh])
    if graph >= 0:
        # Counts of corners and faces, an address for each corner, and then its number.
        size = int(model.mesh_graph[graph])
        corners = corners[model.mesh_graph[graph + 2 + size : graph + 2 + 2 * size]]
    return _plain(np.round(corners.ravel(), DIGITS))


def _plain(numbers: Any) -> tuple[float, ...]:
    return tuple(float(number) for number in np.asarray(numbers, dtype=np.float64))
