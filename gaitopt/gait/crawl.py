"""The crawl: one leg swings at a time, and before each swing the body moves over four feet."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from itertools import permutations
from typing import Any, Final, cast

from gaitopt.conventions import LEGS
from gaitopt.errors import InputError
from gaitopt.inputs import as_text, check_count
from gaitopt.robots.leg_names import as_leg, by_leg

WANG_SEQUENCE: Final[tuple[str, str, str, str]] = ("RH", "RF", "LH", "LF")
"""Leg order of [Wang2020], Section II.D, best for static stability."""

SHAO_SEQUENCE: Final[tuple[str, str, str, str]] = ("RF", "LH", "LF", "RH")
"""Leg order of [Shao2011], Section IV."""

MOST_FOOTHOLDS = 1_000_000
"""Most footholds of a leg. Chosen: far more than any walk has, and few enough to list."""
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
        single = not isinstance(sequence, Iterable) or getattr(sequence, "ndim", 1) == 0
        names = (sequence,) if single else tuple(cast("Iterable[Any]", sequence))
    return tuple(as_leg(name) for name in names)


def check_sequence(sequence: Iterable[str]) -> tuple[str, ...]:
    """``sequence`` as a tuple, if it names each leg once; see :func:`legs_in`.

    Raises:
        InputError: a leg is missing, unknown or named twice.
    """
    order = legs_in(sequence)
    if sorted(map(_shown, order)) != sorted(LEGS):
        raise InputError(
            f"sequence must name each of {', '.join(LEGS)} once, got "
            f"{', '.join(map(_shown, order)) or 'nothing'}; an order is "
            f"{', '.join(WANG_SEQUENCE)}, for instance, and where footholds are given "
            f"{FREE_ORDER!r} searches for one"
        )
    return order


def check_order(sequence: Iterable[str]) -> tuple[str, ...]:
    """``sequence`` as a tuple, if it names legs only: a cycle of four legs, or all steps of a walk.

    Names are read as by :func:`legs_in`. Whether it fits a walk, :func:`swing_order` tells.

    Raises:
        InputError: it names no leg, or one that is unknown.
    """
    order = legs_in(sequence)
    known = order and all(isinstance(leg, str) and leg in LEGS for leg in order)
    return order if known else check_sequence(order)


def swing_order(
    sequence: Iterable[str], footholds: int | Mapping[str, int]
) -> list[tuple[str, int]]:
    """The steps of a whole walk: ``(leg, index of the foothold it steps onto)``.

    Args:
        sequence: order of the legs in a cycle, or of all steps of the walk, in which legs may step
            unequally often.
        footholds: footholds of each leg, under any of its names, or one number for all; the first
            is where its foot stands at the start.

    Raises:
        InputError: the sequence is that of a walk with other numbers of steps; or these are no
            numbers of footholds.
    """
    order = check_order(sequence)
    given = (
        by_leg("footholds", footholds) if isinstance(footholds, Mapping)
        else dict.fromkeys(LEGS, footholds)
    )  # fmt: skip
    counts = {
        leg: check_count(f"footholds of {leg}", given.get(leg), 1, MOST_FOOTHOLDS) for leg in LEGS
    }
    asked = {leg: n - 1 for leg, n in counts.items()}
    if len(order) <= len(LEGS) and len(set(asked.values())) == 1 and _steps_of(order) != asked:
        cycle = check_sequence(order)
        return [(leg, k) for k in range(1, counts[LEGS[0]]) for leg in cycle]
    if _steps_of(order) != asked:
        raise InputError(_misfit(order, asked))
    taken = dict.fromkeys(LEGS, 0)
    steps = []
    for leg in order:
        taken[leg] += 1
        steps.append((leg, taken[leg]))
    return steps


def _shown(leg: object) -> str:
    return leg if isinstance(leg, str) else as_text(leg)


def _steps_of(order: tuple[str, ...]) -> dict[str, int]:
    """How often each leg steps."""
    return {leg: order.count(leg) for leg in LEGS}


def _misfit(order: tuple[str, ...], asked: Mapping[str, int]) -> str:
    """What to say of an order in which legs step other numbers of times than ``asked``."""

    def in_words(steps: Mapping[str, int]) -> str:
        return ", ".join(f"{leg} {steps[leg]}" for leg in LEGS)

    cycle = sorted(order) == sorted(LEGS)
    have = "is a cycle in which every leg steps equally often" if cycle else (
        f"has {len(order)} steps ({in_words(_steps_of(order))})"
    )  # fmt: skip
    if len(set(asked.values())) == 1:
        way = "give a cycle of four legs, or as many steps"
    else:
        way = "give an order with as many steps of each leg, or leave sequence out for that of the "
        way += "footholds"
    return (
        f"the sequence {have}, and the footholds ask for {sum(asked.values())} steps "
        f"({in_words(asked)}); {way}"
    )
