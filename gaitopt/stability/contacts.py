"""Support polygons of any set of standing feet, and the margin of a point in them."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from gaitopt.conventions import BoolArray, FloatArray
from gaitopt.errors import InputError
from gaitopt.inputs import check_array, check_leads
from gaitopt.stability.margins import static_stability_margin


def support_margin(feet: ArrayLike, contacts: ArrayLike, point: ArrayLike) -> FloatArray:
    """Signed distance of ``point`` from the border of the standing feet's convex hull.

    Inside the hull it is the distance from the nearest side, which is the static stability margin;
    outside it is minus the distance from the hull. It is defined for any number of feet: the hull
    of two feet is a segment and that of one foot a point, which have no inside, so that the margin
    is never positive.

    Args:
        feet: all feet ``(..., m, 2)`` or ``(..., m, 3)`` [m]; those in the air may be anywhere.
        contacts: which of them stand ``(..., m)``, as truth values.
        point: the ZMP, or the COM ``(..., 2)`` or ``(..., 3)`` [m]; leading axes are broadcast.

    Returns:
        ``(...)`` [m], judged on the horizontal projection; NaN in flight (see :func:`in_flight`)
        and where the point is NaN. Source: [XiLing], "Stability and Gait
        Control", Sections 1-3.

    Raises:
        InputError: shapes that do not fit, or contacts that are not truth values.
    """
    corners = standing_feet(feet, contacts)[..., :2]
    if np.isinf(corners).any():
        raise InputError("feet: those that stand must be at finite places")
    place = of_width("point", point, 2, 3)[..., :2]
    inside = static_stability_margin(corners[..., _at_least_three(corners.shape[-2]), :], place)
    away = place[..., None, :] - corners
    first, second = np.triu_indices(corners.shape[-2])
    along = corners[..., second, :] - corners[..., first, :]
    square = (along**2).sum(axis=-1)
    # Segments between two feet lie in the hull, and the hull's sides are among them. So a point
    # outside is as far from the nearest segment as from the hull.
    share = (away[..., first, :] * along).sum(axis=-1) / np.where(square > 0, square, 1.0)
    gap = away[..., first, :] - np.clip(share, 0.0, 1.0)[..., None] * along
    outside = np.hypot(gap[..., 0], gap[..., 1]).min(axis=-1)
    margins = np.where(inside > 0, inside, 0.0 - outside)
    return np.asarray(np.where(np.isinf(place).any(axis=-1), -np.inf, margins))


def in_flight(contacts: ArrayLike) -> BoolArray:
    """Whether no foot stands ``(...)``: then ZMP and margin are not defined.

    Trots with a duty factor below 0.5 have such phases ([XiLing], Module D,
    Section 2.3).

    Args:
        contacts: which feet stand ``(..., m)``, as truth values.
    """
    return np.asarray(~_truth_values(contacts).any(axis=-1))


def standing_feet(feet: ArrayLike, contacts: ArrayLike | None) -> FloatArray:
    """``feet`` with those in the air moved to the place of one that stands.

    The convex hull of all is then that of the standing feet, so samples with different sets of
    standing feet fit into one array.

    Args:
        feet: ``(..., m, 2)`` or ``(..., m, 3)`` [m].
        contacts: which of them stand ``(..., m)``, as truth values; all by default.

    Returns:
        ``(..., m, 2)`` or ``(..., m, 3)`` [m]; NaN where no foot stands.

    Raises:
        InputError: shapes that do not fit, or contacts that are not truth values.
    """
    places = check_array("feet", feet)
    if places.ndim < 2 or places.shape[-2] < 1 or places.shape[-1] not in (2, 3):
        raise InputError(f"feet must be (..., m, 2) or (..., m, 3), got {places.shape}")
    if contacts is None:
        return places
    standing = _truth_values(contacts)
    if standing.ndim < 1 or standing.shape[-1] != places.shape[-2]:
        raise InputError(
            f"contacts must have one value a foot: {standing.shape} for feet of {places.shape}"
        )
    lead = check_leads(contacts=standing.shape, feet=places.shape[:-1])
    places = np.broadcast_to(places, (*lead, places.shape[-1]))
    standing = np.broadcast_to(standing, lead)[..., None]
    stand_in = np.take_along_axis(places, standing.argmax(axis=-2)[..., None], axis=-2)
    stand_in = np.where(standing.any(axis=-2, keepdims=True), stand_in, np.nan)
    return np.asarray(np.where(standing, places, stand_in))


def of_width(name: str, values: ArrayLike, *widths: int) -> FloatArray:
    """``values`` as an array whose last axis has one of these ``widths``.

    Raises:
        InputError: the last axis has another width, or there is none.
    """
    array = check_array(name, values)
    if array.ndim == 0 or array.shape[-1] not in widths:
        wanted = " or ".join(f"(..., {width})" for width in widths)
        raise InputError(f"{name} must be {wanted}, got {array.shape}")
    return array


def _truth_values(contacts: ArrayLike) -> BoolArray:
    values = np.asarray(contacts)
    if values.dtype != np.bool_:
        raise InputError(f"contacts must be truth values (bool), got {values.dtype}")
    return values


def _at_least_three(count: int) -> list[int]:
    """Indices of all feet, the last one repeated until there are three."""
    return [min(i, count - 1) for i in range(max(count, 3))]
