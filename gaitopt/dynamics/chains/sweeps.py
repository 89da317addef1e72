"""The two sweeps of the fastest timing along one chain, by a linear program for every interval.

This is the general way. It knows chains along which the robot cannot rest everywhere, and those on
which fewer than three feet stand. :mod:`gaitopt.dynamics.speed_sweeps` is faster where the robot
can rest.

The speeds from which a path can be followed are an interval. It begins at 0 wherever the robot can
rest at all places that follow; where only its momentum carries it through, it does not.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TypeVar

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.dynamics.chains.interval_programs import IntervalPrograms
from gaitopt.dynamics.chains.program_sequence import ProgramSequence
from gaitopt.dynamics.path_intervals import PathIntervals, TimingLimits
from gaitopt.dynamics.small_programs import NO_BOUND

SLOWER = 1.0 - 1e-9
"""Share of a largest squared speed that is used: the next sweep then never fails by rounding."""
NOTHING = 1e-12
"""Least squared speed, in the chain's unit, from which on a path counts as not able to rest."""
BLOCK = 256
"""Intervals whose programs are judged together. Where not all of them are proven, their block is
gone through anew, and each is judged by itself."""

State = TypeVar("State")
_Question = tuple[int, bool, bool]
"""An interval, and whether the fastest is asked for, and at a given speed."""
_Asked = tuple[tuple[tuple[float, float], tuple[float, float]], tuple[float, float] | None]
"""The limits with which it was asked, and the answer."""


class ProgramSweeps:
    """The two sweeps along one chain; squared speeds are in the chain's unit."""

    def __init__(
        self, rows: IntervalPrograms, intervals: PathIntervals, timing: TimingLimits,
        own: np.ndarray,
    ) -> None:  # fmt: skip
        self._programs, self._sequence = [rows.programs[k] for k in own], ProgramSequence()
        self._unit = float(rows.units[own[0]])
        steps = 2.0 * intervals.lengths[own]
        if intervals.even is not None:
            steps = np.where(intervals.even[own], 0.0, steps)
        self._steps = steps.tolist()
        self._edges = rows.edges[own].tolist()
        self._samples = intervals.begin[own], intervals.end[own]
        self._known: dict[_Question, _Asked] = {}
        self.limit(timing)

    def limit(self, timing: TimingLimits) -> None:
        """Take other limits of squared speeds: what was found is used where nothing changes it."""
        tops = np.minimum(timing.squares / self._unit, NO_BOUND)
        self._top, self._top_end = (tops[samples].tolist() for samples in self._samples)

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

        def before(i: int, there: tuple[float, float]) -> tuple[float, float] | None:
            """Least and largest squared speed where an interval begins, of those at its end."""
            low, limit = there[0], min(there[1], self._top_end[i])
            found = self._solve(i, (0.0, self._top[i]), (low, limit), fastest=True)
            if found is None:
                return None
            u, x = found
            after[i] = max(x + self._steps[i] * u, 0.0)
            high = _up_to(self._top[i], max(x, 0.0))
            most[i] = SLOWER * high
            if not resting:
                found = self._solve(i, (0.0, self._top[i]), (low, limit), fastest=False)
                slowest = 0.0 if found is None else found[1]
                # In flight one speed is possible, so the least one is the largest one.
                least[i] = low = 0.0 if slowest < NOTHING else min(slowest / SLOWER, most[i])
            return low, high

        found = self._each(range(count)[::-1], (0.0, NO_BOUND), before)
        return found if isinstance(found, int) else (least, most, after)

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

        def behind(i: int, x: float) -> float | None:
            """Squared speed where an interval ends, of that where it begins."""
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
                        return None
                    x = min(x / most[i] * after[i], high)
                else:
                    x = _up_to(high, max(x + self._steps[i] * found[0], low))
            end[i] = x
            return x

        # Where the chain begins at rest this is 0.
        found = self._each(range(count), most[0], behind)
        return found if isinstance(found, int) else (begin, end)

    def _each(
        self, order: Sequence[int], state: State, step: Callable[[int, State], State | None]
    ) -> State | int:
        """What follows a state after all intervals, or the one at which nothing follows.

        Args:
            order: the intervals, one after the other.
            state: before the first of them; never a whole number.
            step: what follows a state after an interval, if anything.
        """
        for first in range(0, len(order), BLOCK):
            block = order[first : first + BLOCK]
            for careful in (False, True):
                self._sequence.careful, now = careful, state
                stuck = None
                # An answer of DAQP that is no number is found out when it is judged.
                with np.errstate(invalid="ignore", over="ignore"):
                    for i in block:
                        then = step(i, now)
                        if then is None:
                            stuck = i
                            break
                        now = then
                if self._sequence.all_proven():
                    break
                self._known = {
                    key: found for key, found in self._known.items() if key[0] not in block
                }
            if stuck is not None:
                return stuck
            state = now
        return state

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
        question, limits = (i, fastest, speed), (begin, end)
        known = self._known.get(question)
        if known is not None and known[0] == limits:
            return known[1]
        edge = self._edges[i]
        found = self._sequence.extreme(
            self._programs[i], 0 if speed else 1, fastest,
            (begin[0], end[0] / edge), (begin[1], min(end[1] / edge, NO_BOUND)),
        )  # fmt: skip
        answer = None if found is None else (float(found[0]), float(found[1]))
        self._known[question] = limits, answer
        return answer


def _up_to(limit: float, value: float) -> float:
    """A value up to a limit; the limit itself where rounding alone is in between.

    So timings with other limits elsewhere agree exactly from the next limit on that both reach.
    """
    return limit if value >= SLOWER * limit else value
