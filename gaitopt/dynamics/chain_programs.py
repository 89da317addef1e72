"""The two sweeps of the fastest timing along one chain, by a linear program for every interval.

This is the general way. It knows chains along which the robot cannot rest everywhere, and those on
which fewer than three feet stand. :mod:`gaitopt.dynamics.speed_sweeps` is faster where the robot
can rest.

The speeds from which a path can be followed are an interval. It begins at 0 wherever the robot can
rest at all places that follow; where only its momentum carries it through, it does not.
"""

from __future__ import annotations

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.dynamics.path_intervals import PathIntervals, TimingLimits
from gaitopt.dynamics.path_programs import IntervalPrograms
from gaitopt.dynamics.small_programs import NO_BOUND

SLOWER = 1.0 - 1e-9
"""Share of a largest squared speed that is used: the next sweep then never fails by rounding."""
NOTHING = 1e-12
"""Least squared speed, in the chain's unit, from which on a path counts as not able to rest."""


class ProgramSweeps:
    """The two sweeps along one chain; squared speeds are in the chain's unit."""

    def __init__(
        self, rows: IntervalPrograms, intervals: PathIntervals, timing: TimingLimits,
        own: np.ndarray,
    ) -> None:  # fmt: skip
        self._programs = [rows.programs[k] for k in own]
        self._unit = float(rows.units[own[0]])
        steps = 2.0 * intervals.lengths[own]
        if intervals.even is not None:
            steps = np.where(intervals.even[own], 0.0, steps)
        self._steps = steps.tolist()
        self._edges = rows.edges[own].tolist()
        tops = np.minimum(timing.squares / self._unit, NO_BOUND)
        self._top = tops[intervals.begin[own]].tolist()
        self._top_end = tops[intervals.end[own]].tolist()

    def fastest(self) -> tuple[FloatArray, FloatArray] | int:
        """Squared speeds at both ends of every interval [1/s^2]; or the interval that stops it."""
        for resting in (True, False):
            found = self._controllable(resting)
            out = found if isinstance(found, int) else self._forward(*found, rounding=not resting)
            if not isinstance(out, int):
                return self._unit * out[0], self._unit * out[1]
        return out

    def _controllable(self, resting: bool) -> tuple[list[float], list[float], list[float]] | int:
        """Of every interval the least and the largest speed from which the chain can be followed.

        Args:
            resting: take for granted that the robot can rest at every place of the chain.

        Returns:
            Least and largest squared speeds, and what follows the largest at the interval's end;
            or the interval without any.
        """
        count = len(self._steps)
        least, most, after = [0.0] * count, [0.0] * count, [0.0] * count
        low, high = 0.0, NO_BOUND
        for i in reversed(range(count)):
            limit = min(high, self._top_end[i])
            found = self._solve(i, (0.0, self._top[i]), (low, limit), fastest=True)
            if found is None:
                return i
            u, x = found
            after[i] = max(x + self._steps[i] * u, 0.0)
            high = max(x, 0.0)
            most[i] = SLOWER * high
            if not resting:
                found = self._solve(i, (0.0, self._top[i]), (low, limit), fastest=False)
                slowest = 0.0 if found is None else found[1]
                # In flight one speed is possible, so the least one is the largest one.
                least[i] = low = 0.0 if slowest < NOTHING else min(slowest / SLOWER, most[i])
        return least, most, after

    def _forward(
        self, least: list[float], most: list[float], after: list[float], rounding: bool
    ) -> tuple[FloatArray, FloatArray] | int:
        """Squared speeds that gain as much as the controllable ones allow.

        Args:
            least, most, after: what :meth:`_controllable` found.
            rounding: least speeds are known, so where they are 0 only rounding makes a program
                fail.
        """
        count = len(self._steps)
        begin, end = np.zeros(count), np.zeros(count)
        # Where the chain begins at rest this is 0.
        x = most[0]
        for i in range(count):
            last = i + 1 == count
            low = 0.0 if last else least[i + 1]
            high = self._top_end[i] if last else min(most[i + 1], self._top_end[i])
            begin[i] = x
            if x >= SLOWER * most[i] and after[i] >= SLOWER**2 * high:
                # The largest speed, which is followed by the largest one.
                x = min(after[i], high)
            else:
                found = self._solve(i, (x, x), (low, high), fastest=True, speed=True)
                if found is None:
                    # Follow the largest speeds, slowed by one factor. Limits are convex, and hold
                    # at rest, so they hold there.
                    if not rounding or low > 0.0 or not most[i] > 0.0:
                        return i
                    x = min(x / most[i] * after[i], high)
                else:
                    x = min(max(x + self._steps[i] * found[0], low), high)
            end[i] = x
        return begin, end

    def _solve(
        self, i: int, begin: tuple[float, float], end: tuple[float, float], fastest: bool,
        speed: bool = False,
    ) -> tuple[float, float] | None:  # fmt: skip
        """Path acceleration and squared speed where interval ``i`` begins.

        Args:
            i: the interval.
            begin, end: least and largest squared speed at its ends.
            fastest: largest speed or acceleration, or least.
            speed: the speed is given, and the acceleration is looked for.
        """
        program, edge = self._programs[i], self._edges[i]
        costs = np.zeros(program.rows.shape[1])
        costs[0 if speed else 1] = -1.0 if fastest else 1.0
        found = program.solve(
            costs, (begin[0], end[0] / edge), (begin[1], min(end[1] / edge, NO_BOUND))
        )
        return None if found is None else (float(found[0]), float(found[1]))
