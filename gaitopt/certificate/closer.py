"""Pieces of a motion on which a bound alone is short of what is asked, looked at more closely."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from gaitopt.certificate.trace import Motion, cut_finer
from gaitopt.conventions import BoolArray, FloatArray
from gaitopt.plan.plan import Plan

PARTS = 4
"""How many parts a piece is cut into at a time: the bounds fall by its square."""
MOST_ROUNDS = 6
"""Most times that pieces are cut. Chosen: six times take 65 mm to 4 nm."""
MOST_PIECES = 20_000
"""Most pieces that are looked at in one round. What is left counts as short."""

SETTLED = 1e-7
"""A foot that leaves its chord by less than this one is known well enough [m]."""


class Look(Protocol):
    """One look at pieces, or at parts of pieces."""

    def __call__(self, motion: Motion, owner: np.ndarray, /) -> tuple[FloatArray, BoolArray]:
        """Lower bounds, and whether a closer look could tell more, ``(P,)`` each.

        Args:
            motion: pieces, or parts of pieces.
            owner: the pieces of the whole motion that they belong to ``(P,)``.
        """


def looked_at_closely(plan: Plan, motion: Motion, short: np.ndarray, look: Look) -> FloatArray:
    """Lower bounds on some pieces, which are cut until a closer look tells no more ``(N,)``.

    Args:
        plan: the motion's plan.
        motion: the motion.
        short: numbers of the pieces ``(N,)``, in order.
        look: what is looked at.
    """
    if len(short) > MOST_PIECES:
        return np.full(len(short), -np.inf)
    out = np.full(len(motion.phase), np.inf)
    part, owner = cut_finer(plan, motion, short, 1), short
    for left in range(MOST_ROUNDS, -1, -1):
        bounds, again = look(part, owner)
        if left == 0 or PARTS * np.count_nonzero(again) > MOST_PIECES:
            again = np.zeros_like(again)
        # What is no number stays no number.
        np.minimum.at(out, owner[~again], bounds[~again])
        chosen = np.flatnonzero(again)
        if not len(chosen):
            break
        part, owner = cut_finer(plan, part, chosen, PARTS), np.repeat(owner[chosen], PARTS)
    return np.asarray(out[short])
