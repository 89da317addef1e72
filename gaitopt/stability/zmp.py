"""The zero moment point.

The zero moment point (ZMP) is the point of the ground about which the ground's forces have no
horizontal moment. Feet can only push, so this point cannot lie outside the convex hull of their
places; a motion whose ZMP would lie outside tips the robot. Source: [XiLing], "Stability and Gait
Control", Section 3; [Vukobratovic2004].
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike

from gaitopt.conventions import GRAVITY, FloatArray
from gaitopt.inputs import check_kind, check_leads, check_numbers
from gaitopt.stability.contacts import of_width

FARTHEST: Final = 1e6
"""Heights beyond this are taken for a mistake [m]."""

LEAST_LOAD: Final = 1e-9
"""Share of the weight below which the ground counts as carrying nothing: a billionth is rounding,
and puts the ZMP at a billion times the usual distance."""


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
        ``(..., 2)`` [m]. Source: [XiLing], "Stability and Gait Control",
        Section 3; the cart-table model of [Kajita2003]. With the COM in vertical motion use
        :func:`point_mass_zmp`.

    Raises:
        InputError: an array has another shape, or the ground's height is no number.
    """
    place = of_width("com", com, 3)
    return _zmp(place, of_width("acceleration", acceleration, 2, 3), ground_height,
                np.asarray(gravity))  # fmt: skip


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
        ``(..., 2)`` [m]; NaN where the mass falls freely or faster, because the ground cannot pull
        it down.

    Raises:
        InputError: an array has another shape, or the ground's height is no number.
    """
    place, change = of_width("com", com, 3), of_width("acceleration", acceleration, 3)
    load = gravity + change[..., 2]
    load = np.where(load > LEAST_LOAD * gravity, load, np.nan)
    return _zmp(place, change, ground_height, load)


def _zmp(
    place: FloatArray, acceleration: FloatArray, ground_height: ArrayLike, load: FloatArray
) -> FloatArray:
    """ZMP of a point mass ``(..., 2)`` [m].

    Args:
        place: of the mass ``(..., 3)`` [m].
        acceleration: of the mass ``(..., 2)`` or ``(..., 3)`` [m/s^2].
        ground_height: height of the ground ``(...)`` [m].
        load: vertical force on the ground per mass ``(...)`` [m/s^2].
    """
    height = place[..., 2] - check_numbers("ground_height", ground_height, -FARTHEST, FARTHEST, "m")
    return np.asarray(place[..., :2] - (height / load)[..., None] * acceleration[..., :2])


def ground_wrench(model: Any, q: ArrayLike, v: ArrayLike, a: ArrayLike) -> FloatArray:
    """Force and moment that the ground must exert for a motion, by Pinocchio's inverse dynamics.

    Args:
        model: a Pinocchio model with a free-flying base.
        q: configurations ``(..., nq)``, Pinocchio's.
        v: velocities ``(..., nv)``, Pinocchio's.
        a: accelerations ``(..., nv)``, Pinocchio's: the time derivative of ``v``.

    Returns:
        ``(..., 6)``: force [N], and moment [N m] about the base's origin, both along the world's
        axes, for the weight and inertia of all bodies. Pinocchio is called once for each sample.

    Raises:
        InputError: an array does not fit the model.
    """
    import pinocchio as pin

    check_kind("model", model, pin.Model)
    motion = [
        of_width("q", q, model.nq), of_width("v", v, model.nv), of_width("a", a, model.nv)
    ]  # fmt: skip
    lead = check_leads(**{n: x.shape[:-1] for n, x in zip("qva", motion, strict=True)})
    rows = [np.broadcast_to(x, (*lead, x.shape[-1])).reshape(-1, x.shape[-1]) for x in motion]
    data = model.createData()
    found = np.empty((len(rows[0]), 2, 3))
    for i, sample in enumerate(zip(*rows, strict=True)):
        # No joint exerts the force on the free-flying base, so the ground must.
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
    weight = sum(inertia.mass for inertia in model.inertias) * np.linalg.norm(model.gravity.linear)
    return zmp_of_wrench(wrench, np.asarray(q, np.float64)[..., :3], weight, ground_height)


def zmp_of_wrench(
    wrench: FloatArray, base: FloatArray, weight: float, ground_height: ArrayLike
) -> FloatArray:
    """ZMP of what the ground exerts ``(..., 2)`` [m]; NaN where that is no upward force.

    Args:
        wrench: force [N], and moment about ``base`` [N m], along the world's axes ``(..., 6)``.
        base: a place ``(..., 3)`` [m].
        weight: of the robot [N].
        ground_height: of the level plane in which the point is taken ``(...)`` [m].
    """
    force, moment = wrench[..., :3], wrench[..., 3:]
    load = np.where(force[..., 2] > LEAST_LOAD * weight, force[..., 2], np.nan)
    depth = check_numbers("ground_height", ground_height, -FARTHEST, FARTHEST, "m") - base[..., 2]
    x = (depth * force[..., 0] - moment[..., 1]) / load
    y = (depth * force[..., 1] + moment[..., 0]) / load
    return np.asarray(base[..., :2] + np.stack([x, y], axis=-1))
