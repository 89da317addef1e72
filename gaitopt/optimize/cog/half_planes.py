"""The half-planes of the COG problem: sides of support triangles, and others that are given."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Final

import numpy as np

from gaitopt.conventions import LEGS, FloatArray
from gaitopt.errors import InputError
from gaitopt.stability.support import triangle_half_planes

SIDES: Final = 3
"""Sides of a support triangle."""
GROUP: Final = 8
"""Half-planes beside those of the triangle are filled up to multiples of this number, so that few
symbolic problems are needed. Regions of three feet have 3 to 12 sides."""
EVERYWHERE: Final = (0.0, 0.0, -1.0)
"""A half-plane that holds everywhere, with a slack of 1 m."""


def padded(planes: FloatArray, origin: FloatArray) -> FloatArray:
    """Half-planes relative to ``origin``, filled up to a multiple of :data:`GROUP` ``(n, 3)``.

    Args:
        planes: x and y of the inward normals, and offsets [m] ``(k, 3)``.
        origin: ``(2,)`` [m].
    """
    out = np.tile(EVERYWHERE, (-(-len(planes) // GROUP) * GROUP, 1))
    out[: len(planes), :2] = planes[:, :2]
    out[: len(planes), 2] = planes[:, 2] - planes[:, :2] @ origin
    return out


def triangle_planes(
    feet: FloatArray, swings: Sequence[str | None], origins: FloatArray
) -> FloatArray:
    """Normals and offsets of the support triangles' sides ``(S, 9)``, relative to ``origins``.

    Args:
        feet: horizontal places of the four feet ``(S, 4, 2)`` [m], relative to ``origins``.
        swings: the leg that swings at each step.
        origins: ``(S, 2)`` [m].

    Raises:
        InputError: the feet of a triangle stand in one line.
    """
    standing = np.array([[i for i, leg in enumerate(LEGS) if leg != s] for s in swings])
    corners = np.take_along_axis(feet, standing[..., None], axis=1)
    normals, offsets = triangle_half_planes(corners)
    flat = np.flatnonzero(np.isnan(offsets).any(axis=1))
    if flat.size:
        raise InputError(
            f"step {flat[0]} ({swings[flat[0]]}): the three feet that stand, at "
            f"{np.round(corners[flat[0]] + origins[flat[0]], 4).tolist()}, are in one line and "
            "support no area; move one of them"
        )
    return np.concatenate([normals, offsets[..., None]], axis=2).reshape(len(feet), 3 * SIDES)


@lru_cache(maxsize=64)
def constraint_names(swing: str | None, further: int = 0) -> tuple[str, ...]:
    """Names of the constraints before this leg swings, in their order.

    Args:
        swing: the leg; ``None`` for standing on four feet.
        further: number of half-planes beside those of the triangle.
    """
    reach = tuple(f"reach {leg}" for leg in LEGS)
    if swing is None:
        return reach
    a, b, c = (leg for leg in LEGS if leg != swing)
    others = tuple(f"forces side {i + 1}" for i in range(further))
    return (f"margin {a}-{b}", f"margin {b}-{c}", f"margin {c}-{a}", *others, *reach,
            f"reach {swing} foothold")  # fmt: skip
