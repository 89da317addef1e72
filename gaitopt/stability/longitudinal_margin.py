"""The longitudinal stability margin: how far ahead and behind the support reaches.

It looks along the direction of motion only, where a walking body is pushed most: a robot may have
a large longitudinal margin and yet stand on the side of its support polygon.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from gaitopt.conventions import FloatArray
from gaitopt.errors import InputError
from gaitopt.stability.contacts import standing_feet

ON_LINE = 1e-12
"""A foot that is this near the COG's line of motion lies on it [m]."""


def longitudinal_stability_margin(
    feet: ArrayLike,
    cog: ArrayLike,
    heading: ArrayLike = 0.0,
    contacts: ArrayLike | None = None,
) -> FloatArray:
    """The smaller of the distances to the support's front and rear edge along the heading.

    Conventions are those of :func:`longitudinal_margins`, which also explains the arguments.

    Returns:
        ``(...)`` [m]: positive between the edges; negative ahead of the front or behind the rear
        edge, by the distance that the COG must go back or forward to reach the support; ``-inf``
        where no such way reaches it; NaN where no foot stands. Source: [McGhee1968].
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

    The line through the COG along the heading cuts the convex hull of the standing feet in an
    interval. Two feet span a segment: the line mostly meets it in one point, and one of the two
    distances is minus the other; a segment that lies along the line has both its ends as edges,
    as the thinnest of polygons would. A foot alone is a point.

    Args:
        feet: ``(..., m, 2)`` or ``(..., m, 3)`` [m], ``m >= 1``, in any order.
        cog: COG positions ``(..., 2)`` or ``(..., 3)`` [m]; leading axes are broadcast.
        heading: direction of motion as an angle about z from world x ``(...)`` [rad].
        contacts: which of the feet stand ``(..., m)``, of truth values; all, when ``None``.

    Returns:
        Two arrays ``(...)`` [m], judged on the horizontal projection: front, positive when the
        front edge lies ahead of the COG, and rear, positive when the rear edge lies behind it.
        Their sum is the interval's length. Both are ``-inf`` where the line misses the support,
        and NaN where no foot stands.

    Raises:
        InputError: shapes that do not fit, or contacts that are not truth values.
    """
    corners = standing_feet(feet, contacts)[..., :2]
    centre = np.asarray(cog, np.float64)
    if centre.ndim == 0 or centre.shape[-1] not in (2, 3):
        raise InputError(f"cog must be (..., 2) or (..., 3), got {centre.shape}")
    away = corners - centre[..., None, :2]
    angle = np.asarray(heading, np.float64)[..., None]
    ahead = np.cos(angle) * away[..., 0] + np.sin(angle) * away[..., 1]
    left = np.cos(angle) * away[..., 1] - np.sin(angle) * away[..., 0]
    first, second = np.nonzero(~np.eye(corners.shape[-2], dtype=bool))
    # The hull's ends on the line are feet on it, or joins of a foot left with a foot right of it.
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
