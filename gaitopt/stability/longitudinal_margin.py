"""The longitudinal stability margin: how far the support reaches ahead of the COG and behind it.

Only the direction of motion counts, in which a walking body accelerates most. A robot may have a
large longitudinal margin and still have its COG near a side of the support polygon.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from gaitopt.conventions import FloatArray
from gaitopt.errors import InputError
from gaitopt.inputs import check_array
from gaitopt.stability.contacts import standing_feet

ON_LINE = 1e-12
"""A foot that is this near to the COG's line of motion lies on it [m]: rounding of places some
metres away from the origin, with a margin."""


def longitudinal_stability_margin(
    feet: ArrayLike,
    cog: ArrayLike,
    heading: ArrayLike = 0.0,
    contacts: ArrayLike | None = None,
) -> FloatArray:
    """The smaller of the distances to the support's front and rear edge along the heading.

    Conventions are those of :func:`longitudinal_margins`, which also explains the arguments.

    Returns:
        ``(...)`` [m]: positive between the edges; ahead of the front edge or behind the rear edge
        it is minus the distance that the COG must go to reach the support; ``-inf`` where the
        support is nowhere on its line; NaN where no foot stands. Source: [McGhee1968].
    """
    front, rear = longitudinal_margins(feet, cog, heading, contacts)
    return np.minimum(front, rear)


def longitudinal_margins(
    feet: ArrayLike,
    cog: ArrayLike,
    heading: ArrayLike = 0.0,
    contacts: ArrayLike | None = None,
) -> tuple[FloatArray, FloatArray]:
    """Distances from the COG's projection to the support's front and rear edge.

    The line through the COG along the heading meets the convex hull of the standing feet in an
    interval, whose ends are the edges. The hull of two feet is a segment: in general the line meets
    it in one point, and one of the two distances is minus the other; where the segment lies on the
    line, its ends are the edges. The hull of one foot is a point.

    Args:
        feet: ``(..., m, 2)`` or ``(..., m, 3)`` [m], ``m >= 1``, in any order.
        cog: COG positions ``(..., 2)`` or ``(..., 3)`` [m]; leading axes are broadcast.
        heading: direction of motion as an angle about z from world x ``(...)`` [rad].
        contacts: which of the feet stand ``(..., m)``, as truth values; all by default.

    Returns:
        Two arrays ``(...)`` [m], judged on the horizontal projection: front, positive when the
        front edge lies ahead of the COG, and rear, positive when the rear edge lies behind it.
        Their sum is the interval's length. Both are ``-inf`` where the line misses the support,
        and NaN where no foot stands.

    Raises:
        InputError: shapes that do not fit, or contacts that are not truth values.
    """
    corners = standing_feet(feet, contacts)[..., :2]
    centre = check_array("cog", cog)
    if centre.ndim == 0 or centre.shape[-1] not in (2, 3):
        raise InputError(f"cog must be (..., 2) or (..., 3), got {centre.shape}")
    away = corners - centre[..., None, :2]
    angle = check_array("heading", heading)[..., None]
    ahead = np.cos(angle) * away[..., 0] + np.sin(angle) * away[..., 1]
    left = np.cos(angle) * away[..., 1] - np.sin(angle) * away[..., 0]
    first, second = np.nonzero(~np.eye(corners.shape[-2], dtype=bool))
    # The hull's ends on the line are feet on it, or points on segments that lead from a foot on its
    # left to a foot on its right.
    across = (left[..., first] > ON_LINE) & (left[..., second] < -ON_LINE)
    width = np.where(across, left[..., first] - left[..., second], 1.0)
    share = left[..., first] / width
    crossing = ahead[..., first] + share * (ahead[..., second] - ahead[..., first])
    met = np.concatenate([np.abs(left) <= ON_LINE, across], axis=-1)
    at = np.concatenate([ahead, crossing], axis=-1)
    unknown = np.isnan(ahead).any(axis=-1)
    front = np.where(met, at, -np.inf).max(axis=-1)
    rear = np.where(met, -at, -np.inf).max(axis=-1)
    return np.where(unknown, np.nan, front), np.where(unknown, np.nan, rear)
