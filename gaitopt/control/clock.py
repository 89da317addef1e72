"""The clock of a walk: which instant of the plan is followed at which time.

A plan may let a foot lift off at the very instant at which another touches down. On a real robot
the foot that lands needs a moment to find the ground and to take up its load. A static walk can
stop at any instant, so the clock stops there for that moment. The stops are known beforehand, so
the motion with its stops can be smoothed like any other.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from gaitopt.conventions import BoolArray, FloatArray, frozen
from gaitopt.errors import InputError
from gaitopt.motion.path import BASE_COLUMNS
from gaitopt.plan.plan import Plan


@dataclass(frozen=True, eq=False)
class WalkClock:
    """Times of a walk and of its plan, which differ by the pauses so far.

    Attributes:
        stops: instants of the plan at which its clock stands still ``(n,)`` [s], increasing.
        pauses: how long it stands still at each ``(n,)`` [s].

    Raises:
        InputError: instants do not increase, a pause is not positive, or the numbers differ.
    """

    stops: FloatArray
    pauses: FloatArray

    def __post_init__(self) -> None:
        stops, pauses = frozen(self.stops), frozen(self.pauses)
        if not (stops.shape == pauses.shape and (np.diff(stops) > 0).all() and (pauses > 0).all()):
            raise InputError(
                f"a clock needs instants that increase and as many positive pauses, got {stops} "
                f"and {pauses}"
            )
        object.__setattr__(self, "stops", stops)
        object.__setattr__(self, "pauses", pauses)

    @cached_property
    def paused(self) -> float:
        """How long the clock stands still in all [s]."""
        return float(self.pauses.sum())

    def plan_time(self, times: ArrayLike) -> FloatArray:
        """The plan's time ``(...)`` at ``times (...)`` [s] since the walk's start.

        It goes on before the walk's start and after its end.
        """
        t = np.asarray(times, dtype=np.float64)
        return np.asarray(t - np.interp(t, *self._lost)) if len(self.stops) else t

    def paused_before(self, instants: ArrayLike) -> FloatArray:
        """How long the clock has stood still before instants of the plan ``(...)`` [s]."""
        lost = np.append(0.0, np.cumsum(self.pauses))
        return np.asarray(lost[np.searchsorted(self.stops, instants, side="left")])

    def pausing(self, times: ArrayLike) -> BoolArray:
        """Whether the clock stands still at ``times (...)`` [s]: ``(...)``."""
        return np.asarray(np.searchsorted(self._lost[0], times, side="right") % 2 == 1)

    @cached_property
    def _lost(self) -> tuple[FloatArray, FloatArray]:
        """Start and end of every pause, alternating ``(2 n,)`` [s]; and the pauses until then."""
        lost = np.concatenate([[0.0], np.cumsum(self.pauses)])
        edges = np.stack([self.stops + lost[:-1], self.stops + lost[1:]], axis=1)
        return edges.reshape(-1), np.stack([lost[:-1], lost[1:]], axis=1).reshape(-1)


SAME_INSTANT = 1e-9
"""Touch-downs this much later than a lift-off count as the same instant [s]: times of long walks
are known to 1e-12 s."""


AT_REST = 1e-3
"""Largest velocity at which the body counts as at rest [m/s, rad/s]."""


def walk_clock(plan: Plan, handover_time: float) -> WalkClock:
    """The clock on which every foot has stood for a while before another lifts off.

    A plan that promises no static stability cannot stop in the middle of its motion: its clock
    never stands still. A plan that promises contact forces stops only where its body is at rest.

    Args:
        plan: the motion.
        handover_time: how long a foot stands at least before another lifts off [s].
    """
    if not (plan.settings.static and handover_time > 0.0):
        return WalkClock(np.zeros(0), np.zeros(0))
    landings = np.sort([swing.end for swing in plan.swings])
    # Forces were planned for the motion as it is, without stops.
    flowing = plan.settings.promised_forces is not None
    stops, pauses = [], []
    for stop in np.unique([swing.start for swing in plan.swings]):
        before = landings[landings <= stop + SAME_INSTANT]
        missing = handover_time - (stop - before[-1]) if len(before) else 0.0
        if missing > 0.0 and not (flowing and _moves(plan, float(stop))):
            stops.append(stop)
            pauses.append(missing)
    return WalkClock(np.array(stops), np.array(pauses))


def _moves(plan: Plan, time: float) -> bool:
    """Whether the body moves at an instant."""
    return bool(np.abs(plan.path.evaluate([time], 1)[0, :BASE_COLUMNS]).max() > AT_REST)
