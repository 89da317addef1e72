"""The crawl: one leg swings at a time, and before each swing the body moves over four feet."""

from __future__ import annotations

import re
from collections.abc import Iterable
from itertools import permutations
from typing import Any, Final

from gaitopt.conventions import LEGS
from gaitopt.errors import InputError
from gaitopt.robots.leg_names import leg_named

WANG_SEQUENCE: Final[tuple[str, str, str, str]] = ("RH", "RF", "LH", "LF")
"""Leg order of [Wang2020], Section II.D, best for static stability."""

SHAO_SEQUENCE: Final[tuple[str, str, str, str]] = ("RF", "LH", "LF", "RH")
"""Leg order of [Shao2011], Section IV."""

FREE_ORDER: Final = "free"
"""In place of an order of legs: search for the fastest one."""

CRAWL_SEQUENCES: Final[tuple[tuple[str, ...], ...]] = tuple(
    ("RH", *rest) for rest in permutations(("RF", "LH", "LF"))
)
"""The six different cyclic orders of four legs."""


def legs_in(sequence: object) -> tuple[Any, ...]:
    """The legs that ``sequence`` names, as names of :data:`gaitopt.LEGS`; others are kept.

    Args:
        sequence: names of legs; or one text, in which commas or spaces are between them.
    """
    names: tuple[Any, ...]
    if isinstance(sequence, str):
        names = tuple(name for name in re.split(r"[,\s]+", sequence) if name)
    else:
        names = tuple(sequence) if isinstance(sequence, Iterable) else (sequence,)
    return tuple((leg_named(n) or n) if isinstance(n, str) else n for n in names)


def check_sequence(sequence: Iterable[str]) -> tuple[str, ...]:
    """``sequence`` as a tuple, if it names each leg once; see :func:`legs_in`.

    Raises:
        InputError: a leg is missing, unknown or named twice.
    """
    order = legs_in(sequence)
    if sorted(map(str, order)) != sorted(LEGS):
        raise InputError(
            f"sequence must name each of {', '.join(LEGS)} once, got "
            f"{', '.join(map(str, order)) or 'nothing'}; an order is {', '.join(WANG_SEQUENCE)}, "
            f"for instance, and where footholds are given {FREE_ORDER!r} searches for one"
        )
    return order


def check_order(sequence: Iterable[str]) -> tuple[str, ...]:
    """``sequence`` as a tuple, if it is a cycle of four legs or the order of a whole walk.

    Names are read as by :func:`legs_in`.

    Raises:
        InputError: a leg is missing or unknown, or steps more often than another.
    """
    order = legs_in(sequence)
    counts = {leg: order.count(leg) for leg in LEGS}
    if len(order) <= len(LEGS) or sum(counts.values()) != len(order):
        return check_sequence(order)
    if len(set(counts.values())) > 1:
        raise InputError(
            "a sequence of more than four steps is the order of a whole walk, in which every leg "
            "steps equally often; got " + ", ".join(f"{leg} {n}" for leg, n in counts.items())
        )
    return order


def swing_order(sequence: Iterable[str], footholds: int) -> list[tuple[str, int]]:
    """The steps of a whole walk: ``(leg, index of the foothold it steps onto)``.

    Args:
        sequence: order of the legs in a cycle, or of all steps of the walk.
        footholds: footholds of each leg, the first of which is where its foot stands at the start.

    Raises:
        InputError: the sequence is that of a walk with another number of steps.
    """
    order = check_order(sequence)
    if len(order) == len(LEGS):
        return [(leg, k) for k in range(1, footholds) for leg in order]
    if len(order) != len(LEGS) * (footholds - 1):
        raise InputError(
            f"the sequence has {len(order)} steps, and {footholds} footholds a leg ask for "
            f"{len(LEGS) * (footholds - 1)}; give a cycle of four legs, or as many steps"
        )
    taken = dict.fromkeys(LEGS, 0)
    steps = []
    for leg in order:
        taken[leg] += 1
        steps.append((leg, taken[leg]))
    return steps
