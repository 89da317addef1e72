"""The longitudinal stability margin of gaits, which shows what order of the legs is most stable.

The body moves forward at constant speed along its middle line, its centre over that line. The
hips are the corners of a rectangle. Each foot stands, in the middle of its stance, below its hip,
so that in the body's frame it moves from half a stroke before the hip to half a stroke behind it;
the stroke is the duty factor times the stride. The longitudinal margin is the distance, along the
middle line, from the centre to the nearer border of the support polygon. It does not depend on the
distance between left and right feet.

Source: [McGhee1968], in which the order LF, RH, RF, LH (``WANG_SEQUENCE``) is best.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from gaitopt.conventions import LEGS, BoolArray, FloatArray
from gaitopt.errors import InputError
from gaitopt.gait.gaits import crawl, wave
from gaitopt.gait.schedule import SNAP, GaitSchedule
from gaitopt.inputs import check_array, check_number

LEFT: Final = np.array([leg[0] == "L" for leg in LEGS])
"""Which legs are on the left side ``(4,)``."""
FRONT: Final = np.array([leg[1] == "F" for leg in LEGS])
"""Which legs are in front ``(4,)``."""


def longitudinal_margin(schedule: GaitSchedule, stride: float, length: float) -> float:
    """The smallest longitudinal stability margin in a cycle, exact.

    Args:
        schedule: the gait.
        stride: distance that the body moves in a cycle, 0 or more [m].
        length: distance from hind to front hips [m].

    Returns:
        [m], positive when the gait is statically stable at every instant. Where only a diagonal
        pair stands it is negative or zero. It is ``-inf`` for a gait with times at which a side
        has no foot on the ground: no support reaches the middle line then.

    Raises:
        InputError: a length is out of range.
    """
    return float(_margins([schedule], stride, length)[0])


def margin_over_duty(
    orders: Iterable[Sequence[str]], duties: ArrayLike, stride: float, length: float
) -> FloatArray:
    """The longitudinal margins of evenly spaced crawls, for leg orders and duty factors.

    For a length of at least the stride they are ``stride * (duty - c) / 2`` with c = 3/4 for the
    order LF, RH, RF, LH, c = 1 for two orders and c = 5/4 for three: only the first is ever
    statically stable.

    Args:
        orders: ``O`` leg orders, such as ``CRAWL_SEQUENCES``.
        duties: duty factors ``(D,)`` in [0.75, 1).
        stride: distance that the body moves in a cycle [m].
        length: distance from hind to front hips [m].

    Returns:
        ``(O, D)`` [m]; see :func:`longitudinal_margin`.

    Raises:
        InputError: an order does not name each leg once, or a number is out of range.
    """
    shares, sequences = _duties(duties), list(orders)
    gaits = [crawl(order, 1.0, duty) for order in sequences for duty in shares]
    return _margins(gaits, stride, length).reshape(len(sequences), len(shares))


def wave_margin_over_duty(duties: ArrayLike, stride: float, length: float) -> FloatArray:
    """The longitudinal margins of the wave, for several duty factors.

    For a length of at least the stride they are ``stride * (duty - 3/4)``: twice those of evenly
    spaced steps in the same order, and the largest of all gaits with these duty factors. For
    shorter bodies they are at most ``(length - stride * (duty - 1/2)) / 2``.

    Args:
        duties: duty factors ``(D,)`` in [0.5, 1).
        stride: distance that the body moves in a cycle [m].
        length: distance from hind to front hips [m].

    Returns:
        ``(D,)`` [m]; see :func:`longitudinal_margin`.

    Raises:
        InputError: a number is out of range.
    """
    return _margins([wave(1.0, duty) for duty in _duties(duties)], stride, length)


def _duties(duties: ArrayLike) -> list[float]:
    shares = check_array("duties", duties)
    if shares.ndim != 1:
        raise InputError(f"duties must have the shape (D,), got {shares.shape}")
    return [float(share) for share in shares]


def _margins(gaits: Sequence[GaitSchedule], stride: float, length: float) -> FloatArray:
    """Smallest margins of ``G`` gaits ``(G,)`` [m].

    Between two changes of support all standing feet move back together, so that both borders of
    the support move linearly. The margin is the smaller of two linear functions, and so it is least
    at an end of the interval: it is evaluated at both ends, with the feet that stand in between.
    """
    stride = check_number("stride", stride, 0.0, 1e6, "m")
    length = check_number("length", length, 1e-6, 1e6, "m")
    touch = np.array([[g.touchdowns[leg] for leg in LEGS] for g in gaits]).reshape(-1, 4)
    lift = np.array([[g.liftoffs[leg] for leg in LEGS] for g in gaits]).reshape(-1, 4)
    duty = np.array([g.duty_factor for g in gaits])
    edges = np.sort(np.concatenate([touch, lift], axis=1), axis=1)
    edges = np.concatenate([edges, edges[:, :1] + 1.0], axis=1)
    ends = np.stack([edges[:, :-1], edges[:, 1:]], axis=2)  # (G, 8, 2)
    middle = ends.mean(axis=2)
    age = (middle[..., None] - touch[:, None]) % 1.0  # since touchdown (G, 8, 4)
    stands = age < ((lift - touch) % 1.0)[:, None]
    ages = age[:, :, None] + (ends - middle[..., None])[..., None]  # (G, 8, 2, 4)
    hips = np.where(FRONT, length / 2.0, -length / 2.0)
    feet = hips + stride * (duty[:, None, None, None] / 2.0 - ages)
    nearest = np.minimum(_border(feet, stands[:, :, None]), _border(-feet, stands[:, :, None])).min(
        axis=2
    )
    lasts = np.diff(edges, axis=1) > SNAP  # events that coincide leave no time between them
    return np.asarray(np.where(lasts, nearest, np.inf).min(axis=1))


def _border(feet: FloatArray, stands: BoolArray) -> FloatArray:
    """Place ``(...)`` [m] of the support polygon's foremost point on the middle line.

    The middle line lies halfway between the sides, so that the point is the middle between the
    foremost feet of both sides; ``-inf`` where a side has none.

    Args:
        feet: places of the feet along the middle line ``(..., 4)`` [m].
        stands: which of them stand ``(..., 4)``.
    """
    foremost = [np.where(stands & side, feet, -np.inf).max(axis=-1) for side in (LEFT, ~LEFT)]
    return np.asarray((foremost[0] + foremost[1]) / 2.0)
