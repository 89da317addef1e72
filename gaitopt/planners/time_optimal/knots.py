"""The knots of a walk: where feet stand at each of them, and which foot flies."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from gaitopt.conventions import LEGS, BoolArray, FloatArray
from gaitopt.planners.phase_by_phase.steps import CrawlSteps


class Flying(NamedTuple):
    """Which foot flies, for many intervals, spans or instants.

    Attributes:
        flies: whether a foot flies ``(N,)``.
        leg: its leg, as a position in :data:`gaitopt.LEGS` ``(N,)``; where no foot flies, any leg.
    """

    flies: BoolArray
    leg: np.ndarray

    def at(self, which: np.ndarray) -> Flying:
        """Which foot flies on the intervals (or spans) with these numbers."""
        return Flying(self.flies[which], self.leg[which])

    @property
    def stands(self) -> BoolArray:
        """Whether each foot stands ``(N, 4)``."""
        is_leg = np.arange(len(LEGS)) == self.leg[:, None]
        return np.asarray(~(self.flies[:, None] & is_leg))


@dataclass(frozen=True, eq=False)
class RouteKnots:
    """Knots of a walk: for every step, those of its stance phase and then those of its swing.

    Interval ``k`` lies between the knots ``k`` and ``k + 1``. A foot stands at the knots at which
    it lifts off and touches down, and is in the air at those between.

    Attributes:
        step: the step that each interval belongs to ``(K - 1,)``.
        is_swing: whether a foot flies during each interval ``(K - 1,)``.
        leg: the leg of each interval's step, as a position in :data:`gaitopt.LEGS` ``(K - 1,)``.
        feet: places of the standing feet at each knot ``(K, 4, 3)`` [m].
        in_air: 1 where a foot is in the air at a knot, else 0 ``(K, 4)``.
        phase_ends: the first knot, then the last knot of every phase ``(2 S + 1,)``.
    """

    step: np.ndarray
    is_swing: BoolArray
    leg: np.ndarray
    feet: FloatArray
    in_air: FloatArray
    phase_ends: np.ndarray

    @property
    def flights(self) -> np.ndarray:
        """The knots at which the foot of every step lifts off and touches down ``(S, 2)``."""
        return self.phase_ends[1:].reshape(-1, 2)

    @property
    def flying_on_intervals(self) -> Flying:
        """Which foot flies during each interval ``(K - 1,)``."""
        return Flying(self.is_swing, self.leg)

    @cached_property
    def flying_on_spans(self) -> Flying:
        """Which foot flies on the span of each knot ``(K,)``, for smooth walks.

        A foot flies from the beginning of the span of the knot at which it lifts off until the end
        of the span of the knot at which it touches down.
        """
        flies, leg = np.zeros(len(self.feet), dtype=bool), np.zeros(len(self.feet), dtype=int)
        for lift_off, touchdown in self.flights.tolist():
            flies[lift_off : touchdown + 1] = True
            leg[lift_off : touchdown + 1] = self.leg[lift_off]
        return Flying(flies, leg)

    @cached_property
    def ground_on_spans(self) -> FloatArray:
        """Mean height of the feet that stand on the span of each knot ``(K,)`` [m]."""
        stands = self.flying_on_spans.stands
        return np.asarray((self.feet[..., 2] * stands).sum(axis=1) / stands.sum(axis=1))

    def feet_at_knots(self, flying_feet: FloatArray) -> FloatArray:
        """All four feet at every knot ``(K, 4, 3)`` [m].

        Args:
            flying_feet: place of the foot that is in the air at each knot ``(K, 3)`` [m]; it is
                not looked at where none is.
        """
        return np.where(self.in_air[..., None] > 0, flying_feet[:, None], self.feet)

    def between(self, first: int, last: int) -> RouteKnots:
        """The knots from ``first`` to ``last``, both included.

        Of a flight that begins before or ends after them, the part within them counts as a flight.
        """
        flights = self.flights
        flights = flights[(flights[:, 1] >= first) & (flights[:, 0] <= last)]
        within = np.clip(flights, first, last) - first
        intervals, knots = slice(first, last), slice(first, last + 1)
        leg = self.leg[intervals].copy()
        # A foot that touches down at the first knot flies on that knot's span, although the
        # interval after it belongs to the next step.
        leg[within[:, 0]] = self.leg[flights[:, 0]]
        return RouteKnots(
            self.step[intervals], self.is_swing[intervals], leg, self.feet[knots],
            self.in_air[knots], np.concatenate([[0], within.ravel()]),
        )  # fmt: skip


def route_knots(steps: CrawlSteps, stance_intervals: int, swing_intervals: int) -> RouteKnots:
    """The knots of a walk, with so many intervals for the two phases of every step."""
    count, each = len(steps.legs), stance_intervals + swing_intervals
    step = np.repeat(np.arange(count), each)
    number = np.tile(np.arange(each), count)
    leg = steps.indices[step]
    last_feet = steps.feet[-1].copy()
    if count:
        last_feet[steps.indices[-1]] = steps.targets[-1]
    feet = np.concatenate([steps.feet[step], last_feet[None]])
    # Interval and knot k have the same number within the step. The knot of lift-off has the number
    # stance_intervals: there the foot still stands.
    in_air = np.zeros((len(step) + 1, len(LEGS)))
    air = np.flatnonzero(number > stance_intervals)
    in_air[air, leg[air]] = 1.0
    ends_of_step = np.arange(count)[:, None] * each + np.array([stance_intervals, each])
    phase_ends = np.concatenate([[0], ends_of_step.ravel()])
    return RouteKnots(step, number >= stance_intervals, leg, feet, in_air, phase_ends)
