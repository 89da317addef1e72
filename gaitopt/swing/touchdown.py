"""Where a swinging foot is to land, from the measured and the commanded velocity of the body.

Both rules use horizontal coordinates with the body's axes and an origin on the body. Places are
relative to the body at the time of the touch-down; velocities are the body's over the ground.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from gaitopt.conventions import FloatArray
from gaitopt.errors import InputError
from gaitopt.inputs import check_array


def velocity_touchdown(
    nominal: ArrayLike,
    velocity: ArrayLike,
    commanded: ArrayLike,
    stance_time: ArrayLike,
    gain: ArrayLike,
) -> FloatArray:
    """Landing points at the neutral point, displaced in proportion to the error of the velocity.

    ``nominal + velocity stance_time / 2 + gain (velocity - commanded)``. The second term is half of
    how far the body moves during the stance: at constant velocity the foot is in front of its
    nominal place as long as behind it. A body that is too fast steps farther, which slows it down.

    Args:
        nominal: place of each foot under a standing body ``(..., 2)`` [m], for instance below its
            hip.
        velocity: measured velocity of the body ``(2,)`` or ``(..., 2)`` [m/s].
        commanded: velocity that is wanted ``(2,)`` or ``(..., 2)`` [m/s].
        stance_time: how long the foot will stand [s]: ``(1 - mu) Ts`` with the paper's share mu
            of the swing in the period Ts. A number, or one for each leg ``(...)``.
        gain: ``(K_bx, K_by)`` [s], or one number for both.

    Returns:
        ``(..., 2)`` [m]. Source: [Wang2024], eqs. (15), (16), corrected: the printed second term
        has the time of the swing ``mu Ts``, which is right only where both last equally long; and
        there is no nominal place.

    Raises:
        InputError: a shape is wrong, a value is not finite, or a stance time is negative.
    """
    place, measured, wanted = (
        _pairs(name, value)
        for name, value in (("nominal", nominal), ("velocity", velocity), ("commanded", commanded))
    )
    time = _numbers("stance_time", stance_time)
    if (time < 0.0).any():
        raise InputError(f"stance_time must be 0 s or more, got {time.min():g}")
    gains = _gains("gain", gain)
    _go_together(place, measured, wanted, time[..., None])
    return np.asarray(place + measured * (time[..., None] / 2.0) + gains * (measured - wanted))


def com_touchdown(
    nominal: ArrayLike,
    com: ArrayLike,
    velocity: ArrayLike,
    position_gain: ArrayLike,
    velocity_gain: ArrayLike,
) -> FloatArray:
    """Landing points displaced towards the centre of mass, and along the velocity.

    The equation of the source has the landing point on both sides,
    ``p = position_gain (com - p) + velocity_gain velocity + nominal``. Its solution is
    ``p = (nominal + velocity_gain velocity + position_gain com) / (1 + position_gain)``.
    So ``position_gain`` weighs the centre of mass against the nominal place: with 0 it does not
    count, with 1 the foot lands half-way. Any gain above 0 also narrows the stance of a robot at
    rest.

    Args:
        nominal: place of each foot relative to the body's centre ``(..., 2)`` [m].
        com: centre of mass relative to the body's centre ``(2,)`` or ``(..., 2)`` [m].
        velocity: velocity of the body ``(2,)`` or ``(..., 2)`` [m/s].
        position_gain: ``k_p``, a number or one for each of x and y ``(2,)``; not -1.
        velocity_gain: ``k_v`` [s], likewise. ``(k_v, 0)`` is the paper's, which lets only the
            forward velocity count.

    Returns:
        ``(..., 2)`` [m]. Source: [XiLing], eqs. (42), (43) of Section 3.3, solved.

    Raises:
        InputError: a shape is wrong, a value is not finite, or ``position_gain`` is -1.
    """
    place, centre, speed = (
        _pairs(name, value)
        for name, value in (("nominal", nominal), ("com", com), ("velocity", velocity))
    )
    k_p, k_v = _gains("position_gain", position_gain), _gains("velocity_gain", velocity_gain)
    if (k_p == -1.0).any():
        raise InputError(
            "position_gain must not be -1: the landing point drops out of its own equation; "
            "take 0 or more"
        )
    _go_together(place, centre, speed)
    return np.asarray((place + k_v * speed + k_p * centre) / (1.0 + k_p))


def _numbers(name: str, value: ArrayLike) -> FloatArray:
    numbers = check_array(name, value)
    if not np.isfinite(numbers).all():
        raise InputError(f"{name} must be finite, got {numbers[~np.isfinite(numbers)][0]}")
    return numbers


def _pairs(name: str, value: ArrayLike) -> FloatArray:
    numbers = _numbers(name, value)
    if numbers.shape[-1:] != (2,):
        raise InputError(f"{name} must have the shape (..., 2), x and y, got {numbers.shape}")
    return numbers


def _gains(name: str, value: ArrayLike) -> FloatArray:
    numbers = _numbers(name, value)
    if numbers.shape not in ((), (2,)):
        raise InputError(f"{name} must be a number or two, for x and y, got {numbers.shape}")
    return numbers


def _go_together(*arrays: FloatArray) -> None:
    shapes = [array.shape[:-1] for array in arrays]
    try:
        np.broadcast_shapes(*shapes)
    except ValueError:
        raise InputError(
            "places, velocities and times must each be given for all legs at once or for as many "
            f"as the others, got {', '.join(map(str, shapes))}"
        ) from None
