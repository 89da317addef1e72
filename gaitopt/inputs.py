"""Checks of numbers that a user gives."""

from __future__ import annotations

import math
import sys
from collections.abc import Iterable, Mapping, Set
from numbers import Real
from types import MappingProxyType
from typing import Any, Final, TypeGuard

import numpy as np
from numpy.typing import ArrayLike

from gaitopt.conventions import BoolArray, FloatArray
from gaitopt.errors import InputError

LONGEST_SHOWN: Final = 100
"""Most letters of a value in a message. Chosen: about a line of a terminal."""
MOST_NESTED: Final = 64
"""Most axes of an array of NumPy: lists within more lists are no array."""


def check_number(
    name: str, value: object, low: float, high: float, unit: str = "", hint: str = ""
) -> float:
    """Return ``value`` as float, if it is a number from ``low`` to ``high``.

    Args:
        name: what the number is, for the message.
        value: what was given. An array without dimensions is a number; a bool or a text is none.
        low, high: smallest and largest number that are allowed.
        unit: of the number, for the message.
        hint: end of the message.

    Raises:
        InputError: it is no number, or out of range; the message gives ``name`` and the range.
    """
    number: Any = value
    # A comparison with NaN is false.
    if is_real(value) and low <= number <= high:
        return float(number)
    raise InputError(
        f"{name} must be a number from {low:g} to {high:g} {unit}".rstrip()
        + f", got {as_text(value)}{hint}"
    )


def check_numbers(
    name: str, values: ArrayLike, low: float, high: float, unit: str = ""
) -> FloatArray:
    """Return ``values`` as an array of floats, if all are numbers from ``low`` to ``high``.

    Args:
        name: what the numbers are, for the message.
        values: an array of any shape.
        low, high: smallest and largest number that are allowed.
        unit: of the numbers, for the message.

    Raises:
        InputError: one is no number, or out of range; the message gives its index.
    """
    numbers = check_array(name, values, unit)
    wrong = np.argwhere(~((numbers >= low) & (numbers <= high)))
    if len(wrong):
        index = tuple(wrong[0].tolist())
        where = f" at index {index}" if index else ""
        raise InputError(
            f"{name} must be from {low:g} to {high:g} {unit}".rstrip()
            + f", got {numbers[index]:g}{where}"
        )
    return numbers


def check_count(name: str, value: object, low: int, high: int) -> int:
    """Return ``value`` as int, if it is a whole number from ``low`` to ``high``.

    Args:
        name: what the number is, for the message.
        value: what was given. 2.0 is no whole number, nor is True.
        low, high: smallest and largest number that are allowed.

    Raises:
        InputError: it is no whole number, or out of range.
    """
    number: Any = value
    if is_whole(value) and low <= number <= high:
        return int(number)
    raise InputError(f"{name} must be a whole number from {low} to {high}, got {as_text(value)}")


LARGEST_SEED = 2**63 - 1
"""Largest seed: that of NumPy's integers, which tables of studies hold."""


def check_seed(seed: object) -> int:
    """Return a seed of made terrain as int.

    Args:
        seed: what was given.

    Raises:
        InputError: it is no whole number, negative, or larger than :data:`LARGEST_SEED`.
    """
    return check_count("seed", seed, 0, LARGEST_SEED)


def check_array(name: str, values: ArrayLike | object, unit: str = "") -> FloatArray:
    """``values`` as an array of floats: a plain one, also where a subclass was given.

    Args:
        name: what the numbers are, for the message.
        values: an array of any shape.
        unit: of the numbers, for the message.

    Raises:
        InputError: these are no numbers, some are hidden behind a mask, or lists in it are of
            unequal lengths. NumPy itself would take a text for its number, and ``None`` for NaN.
    """
    if type(values) is np.ndarray and values.dtype == np.float64:
        return values
    raw = as_plain_array(values)
    try:
        if raw is not None and (raw.dtype.kind in "biuf" or not raw.size):
            return np.asarray(raw, np.float64)
        if raw is not None and raw.dtype.kind == "O" and all(is_real(v) for v in raw.flat):
            return raw.astype(np.float64)
    except (TypeError, ValueError, OverflowError):
        pass
    told = f" [{unit}]" if unit else ""
    raise InputError(f"{name} must be numbers{told}, got {as_text(values)}")


def check_flags(name: str, values: ArrayLike) -> BoolArray:
    """``values`` as an array of truth values.

    Raises:
        InputError: they are neither true or false, nor 0 or 1.
    """
    raw = as_plain_array(values)
    if raw is not None and raw.dtype == np.bool_:
        return raw
    if raw is None or raw.dtype.kind not in "iuf" or not np.isin(raw, (0, 1)).all():
        raise InputError(f"{name} must be true or false, got {as_text(values)}")
    return raw.astype(np.bool_)


def as_plain_array(values: object) -> np.ndarray | None:
    """What NumPy makes of a value; ``None`` where it is nothing that can be numbers.

    A set has no order, bytes are letters, and what a mask hides is not known: NumPy takes all of
    these, the last with the numbers behind the mask.
    """
    if isinstance(values, (str, bytes, bytearray, Mapping, Set)):
        return None
    if isinstance(values, memoryview) and values.itemsize == 1:
        return None
    if is_masked(values):
        return None
    try:
        return np.asarray(values)
    except Exception:  # Objects that say how they become arrays may raise anything.
        return None


def is_masked(value: object) -> bool:
    """Whether numbers of an array, or of one in lists or tuples, are hidden behind a mask."""
    # Who has such an array has loaded this module; nobody else has to wait for it.
    return "numpy.ma" in sys.modules and _is_masked(value, MOST_NESTED)


def _is_masked(value: object, levels: int) -> bool:
    """The same, for lists within so many lists; one may hold itself."""
    if isinstance(value, (list, tuple)):
        inner = (each for each in value if isinstance(each, (list, tuple, np.ndarray)))
        return levels > 0 and any(_is_masked(each, levels - 1) for each in inner)
    return isinstance(value, np.ma.MaskedArray) and bool(np.ma.is_masked(value))


def is_real(value: object) -> TypeGuard[float]:
    """Whether a value is a real number, also NaN; an array without dimensions may be one."""
    # Plans hold thousands of these, and a look at abstract classes takes ten times as long.
    if type(value) is float or type(value) is int:
        return True
    if isinstance(value, np.ndarray):
        return value.ndim == 0 and value.dtype.kind in "iuf" and not is_masked(value)
    # NumPy calls its spans of time whole numbers.
    return isinstance(value, Real) and not isinstance(value, (bool, np.timedelta64))


def is_whole(value: object) -> bool:
    """Whether a value is a whole number: 2.0 and True are none, nor is a span of time."""
    return isinstance(value, (int, np.integer)) and not isinstance(value, (bool, np.timedelta64))


def as_text(value: object, longest: int = LONGEST_SHOWN) -> str:
    """A value for a message, cut where it is long; there are objects that cannot be shown."""
    try:
        text = repr(value)
    except Exception:
        return f"a {type(value).__name__}"
    return text if len(text) <= longest else f"{text[:longest]}..."


def check_known(name: str, values: ArrayLike) -> FloatArray:
    """``values`` as an array of floats, none of which is NaN.

    Raises:
        InputError: these are no numbers, or one is NaN.
    """
    array = check_array(name, values)
    # The sum is quicker than a look at each, and this is called for single instants.
    if math.isnan(array.sum()) and np.isnan(array).any():
        raise InputError(f"{name} must be numbers, and one is NaN")
    return array


def check_shape(name: str, values: ArrayLike, *tail: int) -> FloatArray:
    """``values`` as an array, when its shape ends with ``tail``.

    Raises:
        InputError: it does not, or these are no numbers.
    """
    array = check_array(name, values)
    if array.shape[-len(tail) :] != tail:
        wanted = ", ".join(map(str, tail))
        raise InputError(f"{name} must be (..., {wanted}), got {array.shape}")
    return array


def check_leads(**leads: tuple[int, ...]) -> tuple[int, ...]:
    """The shape that leading axes of several arrays are broadcast to.

    Args:
        leads: the leading shapes, by the arrays' names.

    Raises:
        InputError: they do not fit one another.
    """
    try:
        return np.broadcast_shapes(*leads.values())
    except ValueError:
        told = ", ".join(f"{name} {lead}" for name, lead in leads.items())
        raise InputError(f"leading axes do not fit one another: {told}") from None


def check_choice(name: str, value: object, known: Iterable[str]) -> None:
    """Refuse what is none of some texts.

    Raises:
        InputError: the message gives ``name`` and the texts.
    """
    # An array compares with each of the texts as many times as it has items.
    texts = tuple(known)
    if not isinstance(value, str) or value not in texts:
        raise InputError(f"{name} must be one of {', '.join(texts)}, got {as_text(value)}")


def check_tuple(name: str, values: object) -> tuple[Any, ...]:
    """``values`` as a tuple.

    Raises:
        InputError: they cannot be gone through, or are a text or a mapping.
    """
    if type(values) is tuple:
        return values
    if not isinstance(values, Iterable) or isinstance(values, (str, bytes, Mapping)):
        raise InputError(f"{name} must be a sequence, got {as_text(values)}")
    try:
        return tuple(values)
    except TypeError:  # an array without dimensions
        raise InputError(f"{name} must be a sequence, got {as_text(values)}") from None


SOURCES: Final[Mapping[str, str]] = MappingProxyType({
    "Quadruped": "gaitopt.load_robot(name or file) loads one",
    "Plan": "planners return one, and gaitopt.load_plan(file) reads one",
    "Footholds": "gaitopt.Footholds.from_csv(file) or gaitopt.s_columns() makes them",
    "HeightMap": "gaitopt.load_ground(file) reads one, and gaitopt.make_ground(name) makes one",
    "GaitSchedule": "gaitopt.trot(0.5) makes one, for instance",
})  # fmt: skip
"""Where objects of a class come from, in words: the way out of the error of :func:`check_kind`."""


def check_kind(name: str, value: object, kind: type) -> None:
    """Refuse what is no object of a class.

    Raises:
        InputError: the message gives ``name``, the class, and that of ``value``; and for classes in
            :data:`SOURCES` where an object comes from.
    """
    if not isinstance(value, kind):
        source = SOURCES.get(kind.__name__)
        raise InputError(
            f"{name} must be a {kind.__name__}, got a {type(value).__name__}"
            + (f"; {source}" if source else "")
        )
