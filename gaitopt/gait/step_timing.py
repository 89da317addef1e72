"""Times of steps: the cycles of a walk, its swings, and step times by the stability margin.

A walk starts and ends on four feet. Its first event is a lift-off. A leg that the schedule has in
the air at that instant stands until its own next lift-off. Cycles are counted from the start.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil, inf
from operator import itemgetter
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from gaitopt.conventions import LEGS, FloatArray
from gaitopt.errors import InputError
from gaitopt.gait.schedule import CYCLE_TIMES, SNAP, GaitSchedule, wrapped
from gaitopt.inputs import check_array, check_choice, check_count, check_number
from gaitopt.robots.leg_names import as_leg

MOST_CYCLES: Final = 100_000
"""Largest number of swings of a leg in a walk. Chosen: it is about a day of walking."""
SHORTEST_SHARE: Final = 0.5
"""Shortest step as a share of the nominal one, by default. Chosen."""
LONGEST_SHARE: Final = 2.0
"""Longest step as a share of the nominal one, by default. Chosen."""


@dataclass(frozen=True)
class SwingEvent:
    """A swing of a walk.

    Attributes:
        leg: the leg that swings.
        step: number of this swing among those of the leg, from 0.
        lift_off: when it leaves the ground [s].
        touch_down: when it comes down [s].
    """

    leg: str
    step: int
    lift_off: float
    touch_down: float


class Moment(NamedTuple):
    """An instant of a walk: the cycle it lies in, from 0, and the share of that cycle."""

    cycle: int
    share: float

    @property
    def cycles(self) -> float:
        """Cycles from the walk's start."""
        return self.cycle + self.share

    def later(self, cycles: int) -> Moment:
        """The same instant some cycles later."""
        return Moment(self.cycle + cycles, self.share)


class GaitClock:
    """A clock that counts the cycles of a walk. Durations of cycles may change, and it may stop.

    Args:
        cycle_times: durations of the first cycles [s]; all further ones last as long as the last.
    """

    def __init__(self, cycle_times: Sequence[float]) -> None:
        self._pieces: list[tuple[int, float, float]] = []
        """First cycle of a piece, its start [s], and the duration of its cycles [s]."""
        self.halted: float | None = None
        """The time since which the clock stands still [s]; ``None`` while it runs."""
        start = 0.0
        for cycle, time in enumerate(cycle_times):
            period = check_number(f"cycle_times[{cycle}]", time, *CYCLE_TIMES, "s")
            self._pieces.append((cycle, start, period))
            start += period

    def time_of(self, moment: Moment) -> float:
        """The time at which the clock reaches a moment, if it does not stop before [s]."""
        after = bisect_right(self._pieces, moment.cycle, key=itemgetter(0))
        first, start, period = self._pieces[max(after - 1, 0)]
        return start + (moment.cycle - first) * period + moment.share * period

    def cycles_at(self, time: float) -> float:
        """The number of cycles that have passed at a time [s]; it is constant while it stops."""
        first, start, period = self._piece_at(time)
        return first + (min(time, inf if self.halted is None else self.halted) - start) / period

    def period_at(self, time: float) -> float:
        """Duration of the cycle at a time [s]."""
        return self._piece_at(time)[2]

    def change(self, time: float, period: float) -> None:
        """Give all cycles that start at ``time`` or later a new duration [s]."""
        cycle = ceil(self.cycles_at(time) - SNAP)
        start = self.time_of(Moment(cycle, 0.0))
        before = [piece for piece in self._pieces if piece[0] < cycle]
        self._pieces = [*before[-1:], (cycle, start, period)]

    def resume(self, time: float) -> None:
        """Let a stopped clock go on from a time [s]."""
        if self.halted is not None:
            lost = time - self.halted
            self._pieces = [(first, start + lost, period) for first, start, period in self._pieces]
            self.halted = None

    def _piece_at(self, time: float) -> tuple[int, float, float]:
        reached = time if self.halted is None else min(time, self.halted)
        after = bisect_right(self._pieces, reached, key=itemgetter(1))
        return self._pieces[max(after - 1, 0)]


def first_swings(
    schedule: GaitSchedule, first: str | None = None
) -> dict[str, tuple[Moment, Moment]]:
    """Lift-off and touchdown of each leg's first swing, counted from the walk's start.

    Args:
        schedule: the gait.
        first: the leg whose lift-off is the start; by default the first of ``schedule.order``.

    Raises:
        InputError: there is no such leg.
    """
    first = schedule.order[0][0] if first is None else as_leg(first)
    check_choice("first", first, LEGS)
    start = schedule.liftoffs[first]
    swings = {}
    for leg in LEGS:
        lift = float(wrapped(schedule.liftoffs[leg] - start))
        touch = float(wrapped(schedule.touchdowns[leg] - start))
        swings[leg] = Moment(0, lift), Moment(0 if touch > lift else 1, touch)
    return swings


def cycles_spanned(schedule: GaitSchedule, cycles: int, *, first: str | None = None) -> int:
    """The number of cycles in which each leg swings ``cycles`` times; the last may be incomplete.

    Raises:
        InputError: ``cycles`` is no whole number from 0 to :data:`MOST_CYCLES`, or there is no such
            leg.
    """
    swings, count = first_swings(schedule, first), check_cycles(cycles)
    last = max(touch for _, touch in swings.values()).later(count - 1)
    return last.cycle + (last.share > 0.0) if count else 0


def swing_events(
    schedule: GaitSchedule,
    cycles: int,
    cycle_times: Sequence[float] | None = None,
    *,
    first: str | None = None,
) -> tuple[SwingEvent, ...]:
    """The swings of a walk in which each leg swings ``cycles`` times, in the order of lift-offs.

    The walk starts at time 0 with the first lift-off, and ends with the last touchdown. Instants
    that coincide in the schedule are equal to the last bit.

    Args:
        schedule: the gait.
        cycles: swings of each leg.
        cycle_times: duration of each cycle from the start on [s], at least
            :func:`cycles_spanned` of them; by default the schedule's. Within a cycle, phase and
            time are proportional.
        first: the leg that lifts off first, with those that lift off together with it; by default
            the first of ``schedule.order``.

    Raises:
        InputError: a number is out of range, there are too few cycle times, or there is no such
            leg.
    """
    count, needed = check_cycles(cycles), cycles_spanned(schedule, cycles, first=first)
    times = [schedule.cycle_time] if cycle_times is None else [*cycle_times]
    if cycle_times is not None and len(times) < needed:
        raise InputError(
            f"{count} swings of each leg span {needed} cycles, got {len(times)} cycle_times; "
            f"give {needed}"
        )
    clock = GaitClock(times)
    swings = [
        SwingEvent(leg, step, *(clock.time_of(m.later(step)) for m in moments))
        for leg, moments in first_swings(schedule, first).items()
        for step in range(count)
    ]
    return tuple(sorted(swings, key=lambda swing: (swing.lift_off, LEGS.index(swing.leg))))


def adapted_step_time(
    nominal: float,
    margin: ArrayLike,
    nominal_margin: float,
    gain: float,
    *,
    least: float | None = None,
    most: float | None = None,
) -> FloatArray:
    """Duration of a step, adapted to the static stability margin.

    It is ``nominal * (1 + gain * (nominal_margin - margin))``, kept between ``least`` and ``most``:
    a margin below the nominal one makes the step longer, a larger one makes it shorter. Without
    these bounds a large margin would make the time zero or negative. The cycle time of a gait is
    the step time multiplied by the steps in a cycle (``GaitSchedule.steps``), eq. (29) of [XiLing].

    [XiLing] gives the gain as 0.1 to 0.5 without a unit. It multiplies a length, so that its unit
    is 1/m; with 0.5/m a centimetre of margin changes the time by 0.5 per cent.

    Source: [XiLing], "Stability and Gait Control", Section 4.

    Args:
        nominal: duration of a step at the nominal margin [s].
        margin: static stability margins ``(...)`` [m]; infinite ones are bounded too.
        nominal_margin: the margin that is wanted [m].
        gain: relative change of the time for a metre of margin, 0 or more [1/m].
        least: shortest time [s]; half the nominal one by default.
        most: longest time [s]; twice the nominal one by default.

    Returns:
        Durations ``(...)`` [s].

    Raises:
        InputError: a number is out of range, a margin is NaN, or ``least <= nominal <= most`` does
            not hold.
    """
    nominal = check_number("nominal", nominal, 1e-6, 1e6, "s")
    wanted = check_number("nominal_margin", nominal_margin, -1e6, 1e6, "m")
    gain = check_number("gain", gain, 0.0, 1e6, "1/m")
    low = (
        SHORTEST_SHARE * nominal if least is None else check_number("least", least, 1e-9, 1e6, "s")
    )
    high = LONGEST_SHARE * nominal if most is None else check_number("most", most, 1e-9, 1e6, "s")
    if not low <= nominal <= high:
        raise InputError(
            f"the nominal step time must lie between least and most, got {low:g} s <= "
            f"{nominal:g} s <= {high:g} s"
        )
    margins = check_array("margin", margin)
    if np.isnan(margins).any():
        raise InputError("margin must not be NaN; give -inf where no feet support the robot")
    # A gain of zero changes nothing; times an infinite margin it would be NaN.
    change = gain * (wanted - margins) if gain > 0.0 else np.zeros_like(margins)
    return np.asarray(np.clip(nominal * (1.0 + change), low, high))


def check_cycles(cycles: object) -> int:
    """``cycles`` as int, if it is a whole number from 0 to :data:`MOST_CYCLES`.

    Raises:
        InputError: it is no such number.
    """
    return check_count("cycles", cycles, 0, MOST_CYCLES)
