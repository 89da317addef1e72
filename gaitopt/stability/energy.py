"""The energy stability margin: how much energy tips the robot over a side of its support.

Each side of the support polygon is an axis through two feet. Tipping over a side turns the COG
about its axis, up to the highest place and down on the other side. The height by which the COG must
rise, times the weight, is the energy that a push must supply ([Messuri1985]; the height alone is
the normalised margin, [Hirose1998]). Unlike the static margin it takes account of the height of the
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
from gaitopt.inputs import check_array
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
        contacts: which of the feet stand ``(..., m)``, as truth values; all by default.
        gravity: [m/s^2].

    Returns:
        ``(...)`` [J]: mass times gravity times
        :func:`normalised_energy_stability_margin`, which states the conventions.

    Raises:
        InputError: shapes that do not fit, or contacts that are not truth values.
    """
    height = normalised_energy_stability_margin(feet, cog, contacts)
    return np.asarray(check_array("mass", mass) * gravity * height)


def normalised_energy_stability_margin(
    feet: ArrayLike, cog: ArrayLike, contacts: ArrayLike | None = None
) -> FloatArray:
    """The least height by which the COG must rise to tip over a side of the support (NESM).

    The sides are those of the convex hull of the feet's horizontal projection; the axis of each
    leads from foot to foot in space. Where the COG is outside a side, the robot tips without any
    push: the margin is then minus the height by which the COG must be raised to bring it back over
    the side. The same holds for supports without an inside: over two feet, or feet in one line, the
    margin is minus the height by which the COG must be raised to balance above the line; over one
    foot it is the same above the foot.

    Args:
        feet: ``(..., m, 3)`` [m], ``m >= 1``, in any order and at any heights.
        cog: COG positions ``(..., 3)`` [m]; leading axes are broadcast.
        contacts: which of the feet stand ``(..., m)``, as truth values; all by default.

    Returns:
        ``(...)`` [m]: positive inside, zero above a side, negative outside; NaN where no foot
        stands. Source: [Messuri1985], [Hirose1998].

    Raises:
        InputError: shapes that do not fit, or contacts that are not truth values.
    """
    corners, centre = standing_feet(feet, contacts), check_array("cog", cog)
    if corners.shape[-1] != 3 or centre.ndim == 0 or centre.shape[-1] != 3:
        raise InputError(
            f"tipping needs heights: feet (..., m, 3) and cog (..., 3), got {corners.shape} and "
            f"{centre.shape}"
        )
    if corners.shape[-2] == 1:  # a second foot in the same place makes a pair
        corners = np.repeat(corners, 2, axis=-2)
    away = centre[..., None, :] - corners
    rises, is_side = _rises(corners, away)
    least = np.where(is_side, rises, np.inf).min(axis=-1)
    reach = np.linalg.norm(away, axis=-1)
    alone = -_drop(reach, away[..., 2], np.hypot(away[..., 0], away[..., 1])).max(axis=-1)
    return np.asarray(np.where(is_side.any(axis=-1), least, alone))


def _rises(corners: FloatArray, away: FloatArray) -> tuple[FloatArray, np.ndarray]:
    """Signed rise of the COG over the line of every ordered pair of feet, and which are sides.

    Args:
        corners: feet ``(..., m, 3)`` [m].
        away: the COG as seen from each foot ``(..., m, 3)`` [m].

    Returns:
        ``(..., m (m - 1))`` [m], and truth values of the same shape.
    """
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
    """``radius - height`` [m] of a right triangle whose third side is ``distance``.

    It keeps its digits also where radius and height are nearly the same.
    """
    upper = radius + np.abs(height)
    small = distance**2 / np.where(upper > 0, upper, 1.0)
    return np.where(height > 0, small, upper)
