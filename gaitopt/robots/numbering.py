"""The papers' numbers of the legs, and arrays in their orders.

Inside gaitopt legs have names. Numbers are for comparison with the papers and with code that
follows them.
"""

from __future__ import annotations

import operator
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, Final, SupportsIndex

import numpy as np

from gaitopt.conventions import LEGS, leg_index
from gaitopt.errors import InputError
from gaitopt.robots.leg_names import as_leg

NUMBERINGS: Final[Mapping[str, Mapping[int, str]]] = MappingProxyType(
    {
        "wang2020": MappingProxyType({1: "RH", 2: "RF", 3: "LH", 4: "LF"}),
        "xiling": MappingProxyType({1: "LF", 2: "LH", 3: "RH", 4: "RF"}),
        "wang2024": MappingProxyType({1: "LF", 2: "LH", 3: "RF", 4: "RH"}),
    }
)
"""Leg numbers by the name of the paper.

``"wang2020"``: [Wang2020], Section II. ``"xiling"``: [XiLing],
Module A, Section 2, counter-clockwise from above. ``"wang2024"``: [Wang2024],
Section 2, which gives the order left front, right rear, right front, left rear as 1-4-3-2.
"""


def leg_of(number: SupportsIndex, numbering: str) -> str:
    """Name of the leg that a paper gives this number.

    Raises:
        InputError: unknown numbering or number.
    """
    table = _table(numbering)
    try:
        index = 0 if isinstance(number, (bool, np.bool_)) else operator.index(number)
    except TypeError:
        index = 0
    if index not in table:
        raise InputError(f"{numbering} numbers its legs {_listing(table)}; there is no {number!r}")
    return table[index]


def number_of(leg: str, numbering: str) -> int:
    """Number that a paper gives the leg of this name.

    Raises:
        InputError: unknown numbering or leg.
    """
    table, leg = _table(numbering), as_leg(leg)
    if leg not in LEGS:
        raise InputError(f"there is no leg {leg!r}; legs are {', '.join(LEGS)}")
    return next(number for number, name in table.items() if name == leg)


def renumber(number: SupportsIndex, source: str, target: str) -> int:
    """The number in the paper ``target`` of the leg with this number in the paper ``source``.

    Raises:
        InputError: unknown numbering or number.
    """
    return number_of(leg_of(number, source), target)


def to_paper_order(array: Any, numbering: str, axis: int = 0) -> np.ndarray[Any, np.dtype[Any]]:
    """``array`` with its axis over legs from gaitopt's order into the paper's, from leg 1 on.

    Args:
        array: any array with four entries along ``axis``, in the order of :data:`gaitopt.LEGS`.
        numbering: a key of :data:`NUMBERINGS`.
        axis: the axis that runs over legs.

    Raises:
        InputError: unknown numbering, or not four legs along ``axis``.
    """
    return _reordered(array, _places(numbering), axis)


def from_paper_order(array: Any, numbering: str, axis: int = 0) -> np.ndarray[Any, np.dtype[Any]]:
    """The inverse of :func:`to_paper_order`.

    Args:
        array: any array with four entries along ``axis``, in the paper's order from leg 1 on.
        numbering: a key of :data:`NUMBERINGS`.
        axis: the axis that runs over legs.

    Raises:
        InputError: unknown numbering, or not four legs along ``axis``.
    """
    return _reordered(array, list(np.argsort(_places(numbering))), axis)


def _table(numbering: str) -> Mapping[int, str]:
    if not isinstance(numbering, str) or numbering not in NUMBERINGS:
        raise InputError(f"unknown numbering {numbering!r}; known are {', '.join(NUMBERINGS)}")
    return NUMBERINGS[numbering]


def _listing(table: Mapping[int, str]) -> str:
    return ", ".join(f"{number} {leg}" for number, leg in table.items())


def _places(numbering: str) -> list[int]:
    table = _table(numbering)
    return [leg_index(table[number]) for number in sorted(table)]


def _reordered(array: Any, order: list[int], axis: int) -> np.ndarray[Any, np.dtype[Any]]:
    values = np.asarray(array)
    if not -values.ndim <= axis < values.ndim or values.shape[axis] != len(LEGS):
        raise InputError(
            f"axis {axis} must run over four legs, but the array's shape is {values.shape}"
        )
    return np.take(values, order, axis=axis)
