"""The clock of a walk: it stands still where one foot hands its load over to another.

A plan may have a foot leave at the very instant at which another lands. On a robot the one that
lands needs a moment to find its ground and to take up its load. A static walk can stop at any
instant, so the plan's clock stops there for that moment; this is known beforehand, and the motion
that follows it can be smoothed like any other.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from gaitopt.conventions import BoolArray, FloatArray, frozen
from gaitopt.errors import InputError
from gaitopt.plan.plan import Plan


@dataclass(frozen=True, eq=False)
class WalkClock:
    """Which instant of a plan a controller follows when.

    Attributes:
        stops: instants of the plan at which its clock stands still ``(n,)`` [s], increasing.
        pauses: for how long it does ``(n,)`` [s].
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
        """For how long the clock stands still in all [s]."""
        return float(self.pauses.sum())

    def plan_time(self, times: ArrayLike) -> FloatArray:
        """The plan's time at ``times`` [s] since its start, before and after it as well."""
        t = np.asarray(times, dtype=np.float64)
        return np.asarray(t - np.interp(t, *self._lost)) if len(self.stops) else t

    def pausing(self, times: ArrayLike) -> BoolArray:
        """Whether the clock stands still at ``times`` [s]."""
        return np.asarray(np.searchsorted(self._lost[0], times, side="right") % 2 == 1)

    @cached_property
    def _lost(self) -> tuple[FloatArray, FloatArray]:
        """Beginnings and ends of the pauses in turn, and the time lost until each [s]."""
        lost = np.concatenate([[0.0], np.cumsum(self.pauses)])
        turns = np.stack([self.stops + lost[:-1], self.stops + lost[1:]], axis=1)
        return turns.reshape(-1), np.stack([lost[:-1], lost[1:]], axis=1).reshape(-1)


def walk_clock(plan: Plan, handover: float) -> WalkClock:
    """The clock on which every foot stands for at least ``handover`` [s] before another leaves.

    Plans that promise no static stability cannot stop in their middle; their clock never does.
    """
    if not (plan.settings.static and handover > 0.0):
        return WalkClock(np.zeros(0), np.zeros(0))
    landings = np.sort([swing.end for swing in plan.swings])
    stops, pauses = [], []
    for stop in np.unique([swing.start for swing in plan.swings]):
        before = landings[landings <= stop + 1e-9]
        missing = handover - (stop - before[-1]) if len(before) else 0.0
        if missing > 0.0:
            stops.append(stop)
            pauses.append(missing)
    return WalkClock(np.array(stops), np.array(pauses))
