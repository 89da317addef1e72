"""The crawl: one leg swings at a time, and before each swing the body moves on four feet."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import permutations
from typing import Final

from gaitopt.conventions import LEGS
from gaitopt.errors import InputError

WANG_SEQUENCE: Final[tuple[str, str, str, str]] = ("RH", "RF", "LH", "LF")
"""Leg order of 000_6dacb41600db6a3c.txt, Section II.D, best for static stability."""

CRAWL_SEQUENCES: Final[tuple[tuple[str, ...], ...]] = tuple(
    ("RH", *rest) for rest in permutations(("RF", "LH", "LF"))
)
"""The six different cyclic orders of four legs."""


def check_sequence(sequence: Iterable[str]) -> tuple[str, ...]:
    """``sequence`` as a tuple, when it names each leg once.

    Raises:
        InputError: a leg is missing, unknown or named twice.
    """
    order = tuple(sequence) if isinstance(sequence, Iterable) else (sequence,)
    if sorted(map(str, order)) != sorted(LEGS):
        raise InputError(
            f"sequence must name each of {', '.join(LEGS)} once, got {', '.join(map(str, order))}"
        )
    return order


def swing_order(sequence: Iterable[str], footholds: int) -> list[tuple[str, int]]:
    """The steps of a whole walk: ``(leg, index of the foothold it steps onto)``.

    Args:
        sequence: order of the legs in a cycle.
        footholds: footholds a leg, the first being the start.
    """
    order = check_sequence(sequence)
    return [(leg, k) for k in range(1, footholds) for leg in order]
