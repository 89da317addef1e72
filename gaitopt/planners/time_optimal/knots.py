"""The knots of a walk: which feet stand, and which one flies."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.planners.phase_by_phase.steps import CrawlSteps


@dataclass(frozen=True, eq=False)
class RouteKnots:
    """Knots of a walk: for every step, those of its stance phase and then of its swing.

    Attributes:
        step: the step of each interval ``(K - 1,)``.
        swings: whether a foot flies during it ``(K - 1,)``.
        leg: the step's leg, as a position in :data:`gaitopt.LEGS` ``(K - 1,)``.
        feet: places of standing feet at each knot ``(K, 4, 3)`` [m].
        flying: 1 where a foot is in the air at a knot ``(K, 4)``.
        ends: the last knot of each phase, after the first knot's ``(2 S + 1,)``.
    """

    step: np.ndarray
    swings: np.ndarray
    leg: np.ndarray
    feet: FloatArray
    flying: FloatArray
    ends: np.ndarray


def lay_knots(steps: CrawlSteps, stance: int, swing: int) -> RouteKnots:
    """``stance`` and ``swing`` intervals for every step's two phases."""
    count, each = len(steps.legs), stance + swing
    step = np.repeat(np.arange(count), each)
    place = np.tile(np.arange(each), count)
    swings = place >= stance
    leg = steps.indices[step]
    last = steps.feet[-1].copy()
    if count:
        last[steps.indices[-1]] = steps.targets[-1]
    # At its lift-off knot a foot still stands where it was.
    feet = np.concatenate([steps.feet[step], last[None]])
    flying = np.zeros((len(step) + 1, 4))
    inside = np.flatnonzero(place > stance)
    flying[inside, leg[inside]] = 1.0
    ends = np.concatenate(
        [[0], (np.arange(count)[:, None] * each + np.array([stance, each])).ravel()]
    )
    return RouteKnots(step, swings, leg, feet, flying, ends)


def part_of(knots: RouteKnots, first: int, last: int) -> RouteKnots:
    """The knots from one to another; swings that are cut count as far as they reach."""
    pairs = knots.ends[1:].reshape(-1, 2)
    pairs = pairs[(pairs[:, 1] >= first) & (pairs[:, 0] <= last)]
    cut = np.clip(pairs, first, last) - first
    flight = slice(first, last)
    leg = knots.leg[flight].copy()
    # The span on which a foot lands is its own, though the next interval is another step's.
    leg[cut[:, 0]] = knots.leg[pairs[:, 0]]
    return RouteKnots(
        knots.step[flight], knots.swings[flight], leg, knots.feet[first : last + 1],
        knots.flying[first : last + 1], np.concatenate([[0], cut.ravel()]),
    )  # fmt: skip
