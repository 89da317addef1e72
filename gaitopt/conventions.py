"""Names and frames that every room of the house shares.

World and body frames: x forward, y left, z up. SI units and radians everywhere.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import fields, is_dataclass
from enum import Enum
from typing import Any, Final, TypeVar

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

LEGS: Final[tuple[str, str, str, str]] = ("LF", "LH", "RH", "RF")
"""The four legs, in the order of every array axis that runs over legs."""

GRAVITY: Final = 9.81
"""Acceleration of gravity [m/s^2]: that of the papers, of Pinocchio and of MuJoCo."""


OTHER_LEGS: Final = np.array([[i for i in range(4) if i != k] for k in range(4)])
"""Indices of the three other legs, for the index of each leg ``(4, 3)``."""
OTHER_LEGS.setflags(write=False)

Progress = Callable[[int, int], None]
"""What planners and studies tell of their progress: (done, in all)."""


class TextEnum(str, Enum):
    """An enumeration whose members compare, print and are stored as their texts."""

    def __str__(self) -> str:
        return str(self.value)

    def __format__(self, spec: str) -> str:
        return format(self.value, spec)


class ByValue:
    """A dataclass, declared with ``eq=False``, whose fields may be arrays: equal where all are."""

    def __eq__(self, other: object) -> bool:
        """Whether all fields are the same, save for how long computing took.

        Arrays are compared number by number, and NaN is the same as NaN.
        """
        if type(self) is not type(other):
            return NotImplemented
        return self is other or same_values(self, other)

    def __hash__(self) -> int:
        # Equal values print the same.
        return hash(repr(self))


def same_values(one: Any, other: Any) -> bool:
    """Whether two values are the same: arrays number by number, NaN as NaN, fields one by one."""
    if isinstance(one, np.ndarray) and isinstance(other, np.ndarray):
        return bool(np.array_equal(one, other, equal_nan=one.dtype.kind == "f"))
    if isinstance(one, Mapping) and isinstance(other, Mapping):
        return one.keys() == other.keys() and all(same_values(one[k], other[k]) for k in one)
    if type(one) is not type(other):
        return False
    if isinstance(one, tuple | list):
        return len(one) == len(other) and all(map(same_values, one, other))
    kind: Any = type(one)
    if is_dataclass(one) and (isinstance(one, ByValue) or kind.__dataclass_params__.eq):
        names = [field.name for field in fields(one) if field.compare]
        return all(same_values(getattr(one, name), getattr(other, name)) for name in names)
    return bool(one == other) or bool(one != one and other != other)


def leg_index(leg: str) -> int:
    """Position of ``leg`` in :data:`LEGS`."""
    return LEGS.index(leg)


def frozen(array: object) -> FloatArray:
    """``array`` as float64 that nobody can write to: a copy, unless it is already that."""
    if isinstance(array, np.ndarray) and array.dtype == np.float64 and is_frozen(array):
        return array
    copy = np.array(array, dtype=np.float64, copy=True)
    copy.setflags(write=False)
    return copy


def is_frozen(array: np.ndarray) -> bool:
    """Whether nobody can write to an array: it has its own numbers, or is a part of such a one."""
    if array.flags.writeable:
        return False
    owner = array.base
    if owner is None:
        return bool(array.flags.owndata)
    return type(owner) is np.ndarray and not owner.flags.writeable and bool(owner.flags.owndata)


Kind = TypeVar("Kind")


def made(kind: type[Kind], /, **values: Any) -> Kind:
    """An object of a frozen dataclass whose maker vouches for all fields: nothing is checked.

    A walk has hundreds of phases and limits, and checks take longer than all else of them. What
    users and files give goes through the checks of the class.
    """
    one = object.__new__(kind)
    # The object takes these values as they are, without another dictionary.
    object.__setattr__(one, "__dict__", values)
    return one


def rotation_z(angle: float) -> FloatArray:
    """Rotation matrix ``(3, 3)`` by ``angle`` [rad] about z."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
