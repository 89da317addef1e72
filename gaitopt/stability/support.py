"""Support polygons on the horizontal projection, as half-planes whose normals point inward."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from gaitopt.conventions import FloatArray
from gaitopt.errors import InputError
from gaitopt.inputs import check_array

ROUNDING = 1e-12
"""Distance by which a foot, or a corner, may lie outside a side by rounding [m]: distances are
computed from differences of places, so that they are rounded to about 1e-16 of the stance."""
PARALLEL = 1e-9
"""Sine of the angle between two sides below which they count as parallel. The feet of a robot that
are this near to one line support nothing: their polygon is thinner than a micrometre."""
SAME_CORNER = 1e-9
"""Corners this near to one another are the same [m]: what rounding makes of three lines through one
point."""


class HalfPlanes(NamedTuple):
    """The polygon ``{p : normals @ p >= offsets}``.

    Attributes:
        normals: unit inward normals ``(m, 2)``.
        offsets: ``(m,)`` [m].
        edges: for each half-plane the two corners it joins, as indices ``(m, 2)``.
    """

    normals: FloatArray
    offsets: FloatArray
    edges: tuple[tuple[int, int], ...]


def support_half_planes(corners: FloatArray) -> HalfPlanes:
    """Half-planes of the convex polygon over three or more feet.

    The sides follow from the polygon's orientation. Eqs. (4)-(7) of [Wang2020] distinguish cases
    that hold for the usual arrangement of the feet only (``docs/papers.md``, errata).

    Args:
        corners: feet ``(m, 2)`` or ``(m, 3)`` [m], ``m >= 3``, in any order; only x and y count.

    Raises:
        InputError: the feet stand in one line, or fewer than three are given.
    """
    points = check_array("corners", corners)
    if points.ndim != 2 or points.shape[1] < 2:
        raise InputError(f"corners must be (m, 2) or (m, 3), got {points.shape}")
    points = points[:, :2]
    normals, offsets, is_side = pair_lines(points)
    chosen = np.flatnonzero(is_side)
    if len(points) < 3 or len(chosen) < 3 or not _spans_area(normals[chosen]):
        raise InputError(
            f"the feet at {np.round(points, 4).tolist()} stand in one line, and support no area"
        )
    pairs = np.argwhere(~np.eye(len(points), dtype=bool))
    edges = tuple((int(i), int(j)) for i, j in pairs[chosen])
    return HalfPlanes(normals[chosen], offsets[chosen], edges)


def triangle_half_planes(corners: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Half-planes of many triangles at once.

    Args:
        corners: ``(..., 3, 2)`` [m].

    Returns:
        Unit inward normals ``(..., 3, 2)`` and offsets ``(..., 3)`` [m] of the sides 0-1, 1-2, 2-0;
        NaN for a triangle without area.
    """
    along = np.roll(corners, -1, axis=-2) - corners
    area = along[..., 0, 0] * along[..., 1, 1] - along[..., 0, 1] * along[..., 1, 0]
    length = np.hypot(along[..., 0], along[..., 1])
    flat = np.abs(area) <= PARALLEL * length.max(axis=-1) ** 2
    turn = np.where(flat, np.nan, np.sign(area))[..., None]
    with np.errstate(invalid="ignore", divide="ignore"):
        normals = np.stack([-along[..., 1], along[..., 0]], axis=-1) * (turn / length)[..., None]
    return normals, np.einsum("...ij,...ij->...i", normals, corners)


def pair_lines(feet: FloatArray) -> tuple[FloatArray, FloatArray, np.ndarray]:
    """The lines through every ordered pair of feet, and which of them bound the support polygon.

    Args:
        feet: ``(..., m, 2)`` [m].

    Returns:
        Unit left normals ``(..., m (m - 1), 2)``, offsets ``(..., m (m - 1))`` [m], and whether no
        foot lies to the line's right ``(..., m (m - 1))``: such a line is a side of the polygon.
    """
    first, second = np.nonzero(~np.eye(feet.shape[-2], dtype=bool))
    along = feet[..., second, :] - feet[..., first, :]
    length = np.hypot(along[..., 0], along[..., 1])
    with np.errstate(invalid="ignore", divide="ignore"):
        normals = np.stack([-along[..., 1], along[..., 0]], axis=-1) / length[..., None]
    offsets = np.einsum("...ij,...ij->...i", normals, feet[..., first, :])
    # Heights above the lines are computed from differences, so that they keep their digits far from
    # the origin.
    apart = feet[..., None, :, :] - feet[..., first, None, :]
    heights = np.einsum("...ij,...ikj->...ik", normals, apart)
    return normals, offsets, (heights >= -ROUNDING).all(axis=-1)


def _margins(margin: ArrayLike, sides: int) -> FloatArray:
    """One margin, or one for each side."""
    margins = check_array("margin", margin)
    if margins.shape not in ((), (1,), (sides,)):
        raise InputError(f"margin must be a number, or {sides} of them, got {margins.shape}")
    return margins


def shrunken_polygon(corners: FloatArray, margin: ArrayLike) -> FloatArray:
    """Corners of the support polygon with each side moved inward by ``margin``.

    Args:
        corners: feet ``(m, 2)`` or ``(m, 3)`` [m].
        margin: the stability margin ``S0`` [m], or one for each side ``(k,)``, in the order of
            :func:`support_half_planes`.

    Returns:
        ``(k, 2)`` counter-clockwise [m]; empty when the margin leaves nothing. Area A of
        [Wang2020], Section III.A and Fig. 6.
    """
    planes = support_half_planes(corners)
    origin = np.asarray(corners, dtype=np.float64)[0, :2]
    normals, offsets = (
        planes.normals,
        planes.offsets - planes.normals @ origin + _margins(margin, len(planes.offsets)),
    )
    found = []
    for i in range(len(offsets)):
        for j in range(i + 1, len(offsets)):
            pair = normals[[i, j]]
            if abs(np.linalg.det(pair)) > ROUNDING:
                point = np.linalg.solve(pair, offsets[[i, j]])
                if (normals @ point >= offsets - ROUNDING).all():
                    found.append(point)
    if not found:
        return np.empty((0, 2))
    points = _distinct(np.array(found))
    turn = np.arctan2(*(points - points.mean(axis=0)).T[::-1])
    return points[np.argsort(turn)] + origin


def _distinct(points: FloatArray) -> FloatArray:
    """``points (k, 2)`` without repetitions, which occur where three sides meet."""
    apart = np.linalg.norm(points[:, None] - points, axis=-1)
    return np.asarray(points[~np.tril(apart < SAME_CORNER, -1).any(axis=1)])


def _spans_area(normals: FloatArray) -> bool:
    """Whether not all of the sides are parallel."""
    return bool(
        np.abs(normals[:, 0] * normals[0, 1] - normals[:, 1] * normals[0, 0]).max() > PARALLEL
    )
