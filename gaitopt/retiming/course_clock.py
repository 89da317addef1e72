"""When a course is where, with its rests: what largest normal forces depend on."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gaitopt.conventions import BoolArray, FloatArray
from gaitopt.motion.retiming import interval_times
from gaitopt.plan.load_transfer import Stances, stances
from gaitopt.retiming.course import Grid


class CourseClock(NamedTuple):
    """Times of the intervals of a grid.

    Attributes:
        begin, end: when they begin and end, all rests before them included ``(K,)`` [s].
        spans: when the feet that stand on them have landed, and when they lift off ``(K, 4)`` [s].
    """

    begin: FloatArray
    end: FloatArray
    spans: Stances

    @classmethod
    def of(
        cls, grid: Grid, standing: BoolArray, squares: tuple[FloatArray, FloatArray],
        rests: FloatArray,
    ) -> CourseClock:  # fmt: skip
        """The times of a timing.

        Args:
            grid: the intervals.
            standing: which feet stand on them ``(K, 4)``.
            squares: squared speeds at their begins and ends, each ``(K,)``.
            rests: how long the motion rests before each of them ``(K,)`` [s].
        """
        taken = interval_times(*squares, grid.end - grid.begin)
        ends = np.cumsum(taken + rests)
        return cls(ends - taken, ends, stances(standing, ends - taken, ends))

    def since_and_until(self, times: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Times since feet have landed and until they lift off, each ``(K, 4)`` [s].

        Args:
            times: an instant of each interval ``(K,)`` [s].
        """
        return times[:, None] - self.spans.landed, self.spans.lifted - times[:, None]

    def in_motion(self, begins: FloatArray) -> Stances:
        """The stances in the times of a motion that does not count rests.

        Args:
            begins: when its intervals begin ``(K,)`` [s].
        """
        later = (self.begin - begins)[:, None]
        return Stances(self.spans.landed - later, self.spans.lifted - later)
