"""How fast a path may be followed so that contact forces and joint torques can make the motion.

Along a path ``q(s)`` the equations of motion are linear in the path acceleration ``u = s''``, in
the squared path speed ``x = s'^2`` and in the contact forces, and so are all limits on forces and
torques [Hauser2014] [Pham2015]. The fastest timing then takes two sweeps of small linear programs,
as with limits on joints alone [Pham2018]: backward for the speeds from which the path can still be
followed to its end, and forward with the largest acceleration that these allow. With limits on
joint velocities alone it is the question of [Wang2020], Section IV.

The speeds from which a path can be followed are an interval. It begins at 0 wherever the robot can
rest at all places that follow; where only its momentum carries it through, it does not.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gaitopt.conventions import BoolArray, FloatArray
from gaitopt.dynamics.contacts import ForceLimits
from gaitopt.dynamics.path_programs import (
    IntervalPrograms,
    PathIntervals,
    TimingLimits,
    interval_programs,
)
from gaitopt.dynamics.small_programs import NO_BOUND
from gaitopt.dynamics.whole_body import PathDynamics
from gaitopt.robots.quadruped import Quadruped

MOST_INTERVALS = 2000
"""Intervals whose rows are computed at once: about 20 kB each."""
SLOWER = 1.0 - 1e-9
"""Share of a largest squared speed that is used: the next sweep then never fails by rounding."""
NOTHING = 1e-12
"""Least squared speed, in the chain's unit, from which on a path counts as not able to rest."""


@dataclass(frozen=True, eq=False)
class ForceTiming:
    """The fastest timing of ``C`` chains of ``K`` intervals in all.

    Attributes:
        begin, end: squared path speeds at both ends of every interval ``(K,)`` [1/s^2].
        stuck: chains that cannot be followed at any speed ``(C,)``.
        places: of each such chain an interval on which no motion was found ``(C,)``; -1 for others.
    """

    begin: FloatArray
    end: FloatArray
    stuck: BoolArray
    places: np.ndarray


def fastest_with_forces(
    robot: Quadruped,
    dynamics: PathDynamics,
    intervals: PathIntervals,
    limits: ForceLimits,
    timing: TimingLimits,
) -> ForceTiming:
    """The fastest timing, with forces, of many chains.

    On every interval the path acceleration is constant. Limits hold at both of its ends with that
    same acceleration.

    Args:
        robot: the robot.
        dynamics: at all samples.
        intervals: between samples.
        limits: on forces and torques.
        timing: on joint velocities and accelerations, and where to stop.
    """
    count = len(intervals)
    chains = len(intervals.first) - 1
    begin, end = np.zeros(count), np.zeros(count)
    stuck, places = np.zeros(chains, dtype=np.bool_), np.full(chains, -1)
    for group in _groups(intervals.first):
        part = _part(intervals, group)
        rows = interval_programs(robot, dynamics, part, limits, timing)
        for chain in group:
            first, last = int(intervals.first[chain]), int(intervals.first[chain + 1])
            own = np.arange(first, last) - int(intervals.first[group[0]])
            found = _Chain(rows, part, timing, own).fastest()
            if isinstance(found, int):
                stuck[chain], places[chain] = True, first + found
            else:
                begin[first:last], end[first:last] = found
    return ForceTiming(begin, end, stuck, places)


def _groups(first: np.ndarray) -> list[range]:
    """Neighbouring chains that have about :data:`MOST_INTERVALS` intervals together."""
    groups, begin = [], 0
    for chain in range(1, len(first)):
        if chain == len(first) - 1 or first[chain + 1] - first[begin] > MOST_INTERVALS:
            groups.append(range(begin, chain))
            begin = chain
    return groups


def _part(intervals: PathIntervals, group: range) -> PathIntervals:
    """The intervals of a group of chains."""
    first, last = int(intervals.first[group[0]]), int(intervals.first[group[-1] + 1])
    own = slice(first, last)
    return PathIntervals(
        intervals.begin[own], intervals.end[own], intervals.lengths[own], intervals.standing[own],
        intervals.first[group[0] : group[-1] + 2] - first,
        None if intervals.even is None else intervals.even[own],
    )  # fmt: skip


class _Chain:
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
