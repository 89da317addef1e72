"""The static stability margin."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from gaitopt.conventions import FloatArray
from gaitopt.errors import InputError
from gaitopt.inputs import check_array, check_leads
from gaitopt.stability.support import pair_lines


def static_stability_margin(feet: ArrayLike, cog: ArrayLike) -> FloatArray:
    """Signed distance of the COG's projection from the nearest side of the support polygon.

    Args:
        feet: the feet that stand ``(..., m, 2)`` or ``(..., m, 3)`` [m], ``m >= 3``, in any order.
        cog: COG positions ``(..., 2)`` or ``(..., 3)`` [m]; leading axes are broadcast.

    Returns:
        ``(...)`` [m], positive inside, never positive for feet in one line; judged on the
        horizontal projection. Source: [Wang2020], eqs. (1)-(3).

    Raises:
        InputError: fewer than three feet.
    """
    corners, places = check_array("feet", feet), check_array("cog", cog)
    if corners.ndim < 2 or corners.shape[-2] < 3:
        raise InputError(f"a support polygon needs three feet or more, got {corners.shape}")
    corners = corners[..., :2]
    if places.ndim < 1 or places.shape[-1] < 2:
        raise InputError(f"cog must be (..., 2) or (..., 3), got {places.shape}")
    if np.isinf(places).any():
        raise InputError("cog must be finite")
    check_leads(feet=corners.shape[:-2], cog=places.shape[:-1])
    places = places[..., None, :2]
    origin = corners[..., :1, :]
    normals, offsets, is_side = pair_lines(corners - origin)
    distances = (normals * (places - origin)).sum(axis=-1) - offsets
    nearest = np.where(is_side, distances, np.inf).min(axis=-1)
    has_side = is_side.any(axis=-1)
    if has_side.all():
        return np.asarray(nearest)
    # Feet that are all in one point have no side: the margin is minus the COG's distance from it.
    apart = np.linalg.norm(places - corners, axis=-1).max(axis=-1)
    return np.asarray(np.where(has_side, nearest, -apart))
