"""The zero moment point, and how far inside the support it lies.

The zero moment point (ZMP) is where the resultant of the ground's forces meets the ground: there
it has no horizontal moment. Feet that only push can make no resultant outside the convex hull of
their places, so a motion that asks for one tips the robot. Source: 003_8f161808651a8f3d.txt,
"Stability and Gait Control", Section 3.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike

from gaitopt.conventions import BoolArray, FloatArray
from gaitopt.errors import InputError
from gaitopt.stability.margins import static_stability_margin

GRAVITY: Final = 9.81
"""Acceleration of gravity [m/s^2], that of the paper and of Pinocchio."""

LEAST_LOAD: Final = 1e-9
"""Share of the weight below which the ground counts as carrying nothing."""


def cart_table_zmp(
    com: ArrayLike,
    acceleration: ArrayLike,
    ground_height: ArrayLike = 0.0,
    *,
    gravity: float = GRAVITY,
) -> FloatArray:
    """ZMP of a point mass that stays at one height: ``c_xy - (h / g) a_xy``.

    Args:
        com: centre of mass ``(..., 3)`` [m].
        acceleration: its acceleration ``(..., 2)`` or ``(..., 3)`` [m/s^2]; only x and y count.
        ground_height: height of the ground ``(...)`` [m].
        gravity: [m/s^2].

    Returns:
        ``(..., 2)`` [m]. Source: 003_8f161808651a8f3d.txt, "Stability and Gait Control",
        Section 3. With the COM in vertical motion use :func:`point_mass_zmp`.

    Raises:
        InputError: an array has another shape.
    """
    place, pull = _of_width("com", com, 3), _of_width("acceleration", acceleration, 2, 3)
    height = place[..., 2] - np.asarray(ground_height, np.float64)
    return np.asarray(place[..., :2] - (height / gravity)[..., None] * pull[..., :2])


def point_mass_zmp(
    com: ArrayLike,
    acceleration: ArrayLike,
    ground_height: ArrayLike = 0.0,
    *,
    gravity: float = GRAVITY,
) -> FloatArray:
    """ZMP of a point mass that moves in all directions: ``c_xy - h / (g + a_z) a_xy``.

    Args:
        com: centre of mass ``(..., 3)`` [m].
        acceleration: its acceleration ``(..., 3)`` [m/s^2].
        ground_height: height of the ground ``(...)`` [m].
        gravity: [m/s^2].

    Returns:
        ``(..., 2)`` [m]; NaN where the mass falls freely or faster, for the ground cannot pull.

    Raises:
        InputError: an array has another shape.
    """
    place, pull = _of_width("com", com, 3), _of_width("acceleration", acceleration, 3)
    load = gravity + pull[..., 2]
    load = np.where(load > LEAST_LOAD * gravity, load, np.nan)
    height = place[..., 2] - np.asarray(ground_height, np.float64)
    return np.asarray(place[..., :2] - (height / load)[..., None] * pull[..., :2])


def ground_wrench(model: Any, q: ArrayLike, v: ArrayLike, a: ArrayLike) -> FloatArray:
    """Force and moment that the ground must exert for a motion, by Pinocchio's inverse dynamics.

    Args:
        model: a Pinocchio model with a free-flying base.
        q: configurations ``(..., nq)``, Pinocchio's.
        v: velocities ``(..., nv)``, Pinocchio's.
        a: accelerations ``(..., nv)``, Pinocchio's: the time derivative of ``v``.

    Returns:
        ``(..., 6)``: force [N], and moment [Nm] about the base's origin, both along the world's
        axes. All bodies' weight and inertia count. Pinocchio is called sample by sample.

    Raises:
        InputError: an array does not fit the model.
    """
    import pinocchio as pin

    motion = [
        _of_width("q", q, model.nq), _of_width("v", v, model.nv), _of_width("a", a, model.nv)
    ]  # fmt: skip
    lead = np.broadcast_shapes(*(x.shape[:-1] for x in motion))
    rows = [np.broadcast_to(x, (*lead, x.shape[-1])).reshape(-1, x.shape[-1]) for x in motion]
    data = model.createData()
    found = np.empty((len(rows[0]), 2, 3))
    for i, sample in enumerate(zip(*rows, strict=True)):
        # What no joint carries, the ground must: the free-flying base's own force.
        wrench = pin.rnea(model, data, *sample)[:6]
        found[i] = wrench.reshape(2, 3) @ data.liMi[1].rotation.T
    return found.reshape(*lead, 6)


def whole_body_zmp(
    model: Any, q: ArrayLike, v: ArrayLike, a: ArrayLike, ground_height: ArrayLike = 0.0
) -> FloatArray:
    """ZMP of the whole robot, with the angular momentum of all its bodies.

    Args:
        model: a Pinocchio model with a free-flying base.
        q: configurations ``(..., nq)``, Pinocchio's.
        v: velocities ``(..., nv)``, Pinocchio's.
        a: accelerations ``(..., nv)``, Pinocchio's: the time derivative of ``v``.
        ground_height: height ``(...)`` of the level plane in which the point is taken [m].

    Returns:
        ``(..., 2)`` [m]; NaN where the motion asks for no upward force. With feet at different
        heights the point moves with ``ground_height``, unless the resultant is vertical.

    Raises:
        InputError: an array does not fit the model.
    """
    wrench = ground_wrench(model, q, v, a)
    force, moment = wrench[..., :3], wrench[..., 3:]
    base = np.asarray(q, np.float64)[..., :3]
    weight = sum(inertia.mass for inertia in model.inertias) * np.linalg.norm(model.gravity.linear)
    load = np.where(force[..., 2] > LEAST_LOAD * weight, force[..., 2], np.nan)
    depth = np.asarray(ground_height, np.float64) - base[..., 2]
    x = (depth * force[..., 0] - moment[..., 1]) / load
    y = (depth * force[..., 1] + moment[..., 0]) / load
    return np.asarray(base[..., :2] + np.stack([x, y], axis=-1))


def support_margin(feet: ArrayLike, contacts: ArrayLike, point: ArrayLike) -> FloatArray:
    """Signed distance of ``point`` from the border of the standing feet's convex hull.

    One definition for any number of feet. Inside it is the distance from the nearest side, the
    static stability margin; outside it is minus the distance from the hull. Two feet span a
    segment and one foot a point: both have no inside, so the margin is never positive.

    Args:
        feet: all feet ``(..., m, 2)`` or ``(..., m, 3)`` [m]; those that fly may be anything.
        contacts: which of them stand ``(..., m)``, of truth values.
        point: the ZMP, or the COM ``(..., 2)`` or ``(..., 3)`` [m]; leading axes are broadcast.

    Returns:
        ``(...)`` [m], judged on the horizontal projection; NaN in flight (see :func:`in_flight`)
        and where the point is NaN. Source: 003_8f161808651a8f3d.txt, "Stability and Gait
        Control", Sections 1-3.

    Raises:
        InputError: shapes that do not fit, or contacts that are not truth values.
    """
    corners = standing_feet(feet, contacts)[..., :2]
    place = _of_width("point", point, 2, 3)[..., :2]
    inside = static_stability_margin(corners[..., _at_least_three(corners.shape[-2]), :], place)
    away = place[..., None, :] - corners
    first, second = np.triu_indices(corners.shape[-2])
    along = corners[..., second, :] - corners[..., first, :]
    square = (along**2).sum(axis=-1)
    # Every join of two feet lies in the hull and its sides are among them: from outside the
    # nearest of them is as far as the hull.
    share = (away[..., first, :] * along).sum(axis=-1) / np.where(square > 0, square, 1.0)
    gap = away[..., first, :] - np.clip(share, 0.0, 1.0)[..., None] * along
    outside = np.hypot(gap[..., 0], gap[..., 1]).min(axis=-1)
    return np.asarray(np.where(inside > 0, inside, 0.0 - outside))


def in_flight(contacts: ArrayLike) -> BoolArray:
    """Where no foot stands ``(...)``: there a ZMP and a margin are not defined.

    Trots with a duty factor below 0.5 have such phases (003_8f161808651a8f3d.txt, Module D,
    Section 2.3).

    Args:
        contacts: which feet stand ``(..., m)``, of truth values.
    """
    return np.asarray(~_truth_values(contacts).any(axis=-1))


def standing_feet(feet: ArrayLike, contacts: ArrayLike | None) -> FloatArray:
    """``feet`` with those that fly moved onto one that stands, which leaves the hull as it is.

    So one array holds samples with different sets of standing feet, and no loop runs over them.

    Args:
        feet: ``(..., m, 2)`` or ``(..., m, 3)`` [m].
        contacts: which of them stand ``(..., m)``, of truth values; all, when ``None``.

    Returns:
        ``(..., m, 2)`` or ``(..., m, 3)`` [m]; NaN in flight.

    Raises:
        InputError: shapes that do not fit, or contacts that are not truth values.
    """
    places = np.asarray(feet, np.float64)
    if places.ndim < 2 or places.shape[-2] < 1 or places.shape[-1] not in (2, 3):
        raise InputError(f"feet must be (..., m, 2) or (..., m, 3), got {places.shape}")
    if contacts is None:
        return places
    standing = _truth_values(contacts)
    if standing.ndim < 1 or standing.shape[-1] != places.shape[-2]:
        raise InputError(
            f"contacts must have one value a foot: {standing.shape} for feet of {places.shape}"
        )
    lead = np.broadcast_shapes(standing.shape, places.shape[:-1])
    places = np.broadcast_to(places, (*lead, places.shape[-1]))
    standing = np.broadcast_to(standing, lead)[..., None]
    stand_in = np.take_along_axis(places, standing.argmax(axis=-2)[..., None], axis=-2)
    stand_in = np.where(standing.any(axis=-2, keepdims=True), stand_in, np.nan)
    return np.asarray(np.where(standing, places, stand_in))


def _of_width(name: str, values: ArrayLike, *widths: int) -> FloatArray:
    array = np.asarray(values, np.float64)
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
