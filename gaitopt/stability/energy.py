"""The energy stability margin: how much energy tips the robot over a side of its support.

Each side of the support polygon is an axis through two feet. Tipping over it turns the COG about
that axis, up to its highest place and down on the other side. The height by which the COG must
rise times the weight is the energy that a push must supply ([Messuri1985]; the height alone is the
normalised margin, [Hirose1998]). Unlike the static margin it takes account of the height of the
COG, and of feet at different heights.

With ``d`` the COG's horizontal distance from the side's vertical plane, ``b`` its distance from
the axis within that plane and ``psi`` the axis's slope::

    rise = cos(psi) (sqrt(d**2 + b**2) - b)

which is ``|R| (1 - cos(theta)) cos(psi)`` of [Messuri1985].
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from gaitopt.conventions import GRAVITY, FloatArray
from gaitopt.errors import InputError
from gaitopt.stability.contacts import standing_feet
from gaitopt.stability.support import pair_lines


def energy_stability_margin(
    feet: ArrayLike,
    cog: ArrayLike,
    mass: ArrayLike,
    contacts: ArrayLike | None = None,
    *,
    gravity: float = GRAVITY,
) -> FloatArray:
    """The least energy that tips the robot over a side of its support (ESM).

    Args:
        feet: ``(..., m, 3)`` [m], ``m >= 1``, in any order.
        cog: COG positions ``(..., 3)`` [m]; leading axes are broadcast.
        mass: the robot's mass ``(...)`` [kg].
        contacts: which of the feet stand ``(..., m)``, of truth values; all, when ``None``.
        gravity: [m/s^2].

    Returns:
        ``(...)`` [J]: mass times gravity times
        :func:`normalised_energy_stability_margin`, which states the conventions.

    Raises:
        InputError: shapes that do not fit, or contacts that are not truth values.
    """
    height = normalised_energy_stability_margin(feet, cog, contacts)
    return np.asarray(np.asarray(mass, np.float64) * gravity * height)


def normalised_energy_stability_margin(
    feet: ArrayLike, cog: ArrayLike, contacts: ArrayLike | None = None
) -> FloatArray:
    """The least height by which the COG must rise to tip over a side of the support (NESM).

    The sides are those of the convex hull of the feet's horizontal projection, each turned about
    in space, from foot to foot. Outside a side the robot tips without any push: the height counts
    negative there, as what is missing to bring the COG back over the side. Supports without an
    inside follow the same rule: over two feet, or a row of feet, the margin is minus the height
    to which the COG must be lifted to balance above their line, and over one foot above the foot.

    Args:
        feet: ``(..., m, 3)`` [m], ``m >= 1``, in any order and at any heights.
        cog: COG positions ``(..., 3)`` [m]; leading axes are broadcast.
        contacts: which of the feet stand ``(..., m)``, of truth values; all, when ``None``.

    Returns:
        ``(...)`` [m]: positive inside, zero above a side, negative outside; NaN where no foot
        stands. Source: [Messuri1985], [Hirose1998].

    Raises:
        InputError: shapes that do not fit, or contacts that are not truth values.
    """
    corners, centre = standing_feet(feet, contacts), np.asarray(cog, np.float64)
    if corners.shape[-1] != 3 or centre.ndim == 0 or centre.shape[-1] != 3:
        raise InputError(
            f"tipping needs heights: feet (..., m, 3) and cog (..., 3), got {corners.shape} and "
            f"{centre.shape}"
        )
    if corners.shape[-2] == 1:  # no pair: a second foot in the same place changes nothing
        corners = np.repeat(corners, 2, axis=-2)
    away = centre[..., None, :] - corners
    rises, is_side = _rises(corners, away)
    least = np.where(is_side, rises, np.inf).min(axis=-1)
    reach = np.linalg.norm(away, axis=-1)
    alone = -_drop(reach, away[..., 2], np.hypot(away[..., 0], away[..., 1])).max(axis=-1)
    return np.asarray(np.where(is_side.any(axis=-1), least, alone))


def _rises(corners: FloatArray, away: FloatArray) -> tuple[FloatArray, np.ndarray]:
    """Signed rise over the line of every ordered pair of feet, and which of them are sides."""
    flat = corners[..., :2] - corners[..., :1, :2]
    normals, _, is_side = pair_lines(flat)
    first, second = np.nonzero(~np.eye(corners.shape[-2], dtype=bool))
    along = corners[..., second, :] - corners[..., first, :]
    run, length = np.hypot(along[..., 0], along[..., 1]), np.linalg.norm(along, axis=-1)
    start = away[..., first, :]
    distance = (normals * start[..., :2]).sum(axis=-1)
    with np.errstate(invalid="ignore", divide="ignore"):
        cosine = run / length
        travelled = (start * along).sum(axis=-1) / length**2
        above = (start[..., 2] - travelled * along[..., 2]) / cosine
        rise = cosine * _drop(np.hypot(distance, above), above, distance)
    return np.sign(distance) * rise, is_side


def _drop(radius: FloatArray, height: FloatArray, distance: FloatArray) -> FloatArray:
    """``radius - height`` of a right triangle, exact also where the two are nearly the same."""
    upper = radius + np.abs(height)
    small = distance**2 / np.where(upper > 0, upper, 1.0)
    return np.where(height > 0, small, upper)
