"""Checks of footholds and of what is told of them, before :class:`gaitopt.Footholds` takes them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np
from numpy.typing import ArrayLike

from gaitopt.conventions import LEGS, FloatArray, frozen
from gaitopt.errors import FootholdsError, InputError
from gaitopt.inputs import as_text, check_array, check_tuple, is_real
from gaitopt.robots.leg_names import LegMapping, leg_named
from gaitopt.terrain.foothold_csv import FARTHEST

UNIT = 1e-6
"""How far the length of a normal may be from 1: numbers in a text file are rounded."""
ROUNDING = 1e-15
"""How far the length of a unit vector is from 1 by rounding: at most 3.4e-16 of a million."""
LOWEST_NORMAL = 0.05
"""Least vertical part of a normal: ground steeper than 87 degrees is a wall."""
LEAST_FRICTION = 1e-3
"""Smallest coefficient of friction. Chosen: far below that of ice."""
MOST_FRICTION = 10.0
"""Largest coefficient of friction that is believed."""


def checked_points(points: object) -> dict[str, FloatArray]:
    """Footholds by leg, as read-only arrays ``(n, 3)`` [m].

    Raises:
        FootholdsError: they are none.
    """
    if not isinstance(points, Mapping):
        raise FootholdsError(
            f"footholds must map {', '.join(LEGS)} to arrays (n, 3), got {type(points).__name__}"
        )
    named = _by_leg("footholds", points)
    return {leg: _checked(leg, named[leg]) for leg in LEGS}


def checked_normals(
    normals: Mapping[str, ArrayLike] | None, counts: Mapping[str, int]
) -> Mapping[str, FloatArray] | None:
    """Unit normals by leg, made one long. Those that are, within rounding, are kept as they are.

    Raises:
        FootholdsError: one is not a unit vector that points up.
    """
    if normals is None:
        return None
    found = {}
    for leg, array in _of_counts("normals", normals, counts, 3).items():
        lengths = np.linalg.norm(array, axis=1)
        bad = np.flatnonzero((np.abs(lengths - 1.0) > UNIT) | (array[:, 2] < LOWEST_NORMAL))
        if bad.size:
            raise FootholdsError(
                f"normal {bad[0]} of {leg} is {array[bad[0]].tolist()}; it must have the length 1 "
                f"and point up, with a vertical part of at least {LOWEST_NORMAL:g}"
            )
        found[leg] = frozen(np.where(np.abs(lengths - 1.0)[:, None] <= ROUNDING, array,
                                     array / lengths[:, None]))  # fmt: skip
    return LegMapping(found)


def checked_friction(
    friction: object, counts: Mapping[str, int]
) -> Mapping[str, FloatArray] | None:
    """Coefficients of friction by leg ``(n,)``.

    Raises:
        FootholdsError: one is not above 0, or too large to be believed.
    """
    if friction is None:
        return None
    if is_real(friction):
        # Whole numbers may be larger than any float; a comparison with NaN is false.
        if not LEAST_FRICTION <= friction <= MOST_FRICTION:
            raise FootholdsError(
                f"friction must be from {LEAST_FRICTION:g} to {MOST_FRICTION:g}, got "
                f"{as_text(friction)}"
            )
        friction = {leg: np.full(n, float(friction)) for leg, n in counts.items()}
    if not isinstance(friction, Mapping):
        raise FootholdsError(
            f"friction must be one number, or map {', '.join(LEGS)} to arrays, got "
            f"{as_text(friction)}"
        )
    return _within("friction", friction, counts, LEAST_FRICTION, MOST_FRICTION)


def checked_swing_heights(
    heights: Mapping[str, ArrayLike] | None, counts: Mapping[str, int]
) -> Mapping[str, FloatArray] | None:
    """Swing heights by leg ``(n - 1,)`` [m].

    Raises:
        FootholdsError: one is negative or not finite.
    """
    if heights is None:
        return None
    fewer = {leg: n - 1 for leg, n in counts.items()}
    return _within("swing_heights", heights, fewer, 0.0, FARTHEST)


def checked_order(order: Iterable[str] | None, counts: Mapping[str, int]) -> tuple[str, ...] | None:
    """The legs in the order in which they step.

    Raises:
        FootholdsError: a leg is unknown, or steps another number of times than it has footholds;
            or legs have different numbers of footholds, and there is no order.
    """
    if order is None:
        if len(set(counts.values())) > 1:
            raise FootholdsError(
                "every leg needs the same number of footholds, got "
                + ", ".join(f"{leg} {n}" for leg, n in counts.items())
                + "; or give the order of all steps"
            )
        return None
    names = [order] if isinstance(order, str) else list(check_tuple("order", order))
    legs = [leg_named(name) if isinstance(name, str) else None for name in names]
    if None in legs:
        raise FootholdsError(f"order names an unknown leg: {names[legs.index(None)]!r}")
    known = tuple(leg for leg in legs if leg is not None)
    for leg in LEGS:
        if known.count(leg) != counts[leg] - 1:
            raise FootholdsError(
                f"in the order {leg} steps {known.count(leg)} times, and it has {counts[leg]} "
                f"footholds, the first of which is where it stands at the start"
            )
    return known


def checked_of_steps(
    name: str, values: ArrayLike | None, order: tuple[str, ...] | None, width: int
) -> FloatArray | None:
    """Numbers of the body at the start and during each swing ``(steps + 1, width)`` [m, rad].

    Raises:
        FootholdsError: there is no order of steps, or the shape or a number is wrong.
    """
    if values is None:
        return None
    if order is None:
        raise FootholdsError(f"{name} go with the order of the steps, and there is no order")
    array = _numbers(name, values)
    if array.shape != (len(order) + 1, width):
        raise FootholdsError(
            f"{name} must have the shape ({len(order) + 1}, {width}), one row for the start and "
            f"one for each step, got {array.shape}"
        )
    if not (np.abs(array) <= FARTHEST).all():
        raise FootholdsError(f"{name} must be finite lengths [m] and angles [rad]")
    return array


def _within(
    name: str, given: object, counts: Mapping[str, int], low: float, high: float
) -> Mapping[str, FloatArray]:
    """Numbers by leg, from ``low`` to ``high``."""
    found = _of_counts(name, given, counts, 0)
    for leg, array in found.items():
        bad = np.flatnonzero(~((array >= low) & (array <= high)))
        if bad.size:
            raise FootholdsError(
                f"{name} {bad[0]} of {leg} is {array[bad[0]]:g}; it must be from {low:g} to "
                f"{high:g}"
            )
    return LegMapping(found)


def _of_counts(
    name: str, given: object, counts: Mapping[str, int], width: int
) -> dict[str, FloatArray]:
    """Arrays by leg, with as many rows as there are footholds or steps, and ``width`` columns."""
    if not isinstance(given, Mapping):
        raise FootholdsError(f"{name} must map {', '.join(LEGS)} to arrays, got {as_text(given)}")
    named = _by_leg(f"values of {name}", given)
    found = {}
    for leg in LEGS:
        array = _numbers(f"{name} of {leg}", named[leg])
        shape = (counts[leg], width) if width else (counts[leg],)
        if array.shape != shape:
            raise FootholdsError(f"{name} of {leg} must have the shape {shape}, got {array.shape}")
        if not np.isfinite(array).all():
            row = int(np.argwhere(~np.isfinite(array))[0, 0])
            raise FootholdsError(
                f"{name} of {leg} must be finite numbers, and {row} is {array[row].tolist()}"
            )
        found[leg] = array
    return found


def _numbers(name: str, values: ArrayLike) -> FloatArray:
    """Values as a read-only array of floats."""
    try:
        return frozen(check_array(name, values))
    except InputError as error:
        raise FootholdsError(str(error)) from error


def _by_leg(what: str, points: Mapping[str, ArrayLike]) -> dict[str, ArrayLike]:
    """What was given for each of :data:`gaitopt.LEGS`, whose names may be others.

    Raises:
        FootholdsError: a leg is missing, unknown, or there under two names.
    """
    names = {name: leg_named(name) if isinstance(name, str) else None for name in points}
    unknown = [str(name) for name, leg in names.items() if leg is None]
    missing = [leg for leg in LEGS if leg not in names.values()]
    if unknown or missing:
        raise FootholdsError(
            f"{what} are needed for the legs {', '.join(LEGS)}"
            + (f"; missing: {', '.join(missing)}" if missing else "")
            + (f"; unknown: {', '.join(unknown)}" if unknown else "")
        )
    if len(names) > len(LEGS):
        raise FootholdsError(f"two of the names {', '.join(names)} are of one leg")
    return {leg: points[name] for name, leg in names.items() if leg is not None}


def _checked(leg: str, points: ArrayLike) -> FloatArray:
    """The footholds of a leg as a read-only array ``(n, 3)``."""
    array = _numbers(f"footholds of {leg}", points)
    if array.ndim != 2 or array.shape[1] != 3 or len(array) < 1:
        raise FootholdsError(
            f"footholds of {leg} must have the shape (n, 3) with n >= 1, got {array.shape}"
        )
    bad = np.flatnonzero(~np.isfinite(array).all(axis=1) | (np.abs(array) > FARTHEST).any(axis=1))
    if bad.size:
        raise FootholdsError(
            f"foothold {bad[0]} of {leg} is {array[bad[0]].tolist()}; coordinates must be finite "
            f"and below {FARTHEST:g} m"
        )
    return array
