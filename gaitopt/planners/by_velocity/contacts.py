"""Which feet stand at a time, and where, by the swings of a gait."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gaitopt.conventions import LEGS, BoolArray, FloatArray
from gaitopt.gait.step_timing import SwingEvent
from gaitopt.terrain.footholds import Footholds


def flights_at(events: Sequence[SwingEvent], times: FloatArray) -> np.ndarray:
    """Index of the swing in which each foot is at ``times (N,)``: ``(N, 4)``.

    It is -1 for a foot that stands; feet stand at the very instants of lift-off and touch-down.

    Args:
        events: the swings; those of one leg are in order of time.
        times: [s].
    """
    found = np.full((len(times), len(LEGS)), -1)
    for i, leg in enumerate(LEGS):
        mine = np.array([k for k, e in enumerate(events) if e.leg == leg], dtype=int)
        if not mine.size:
            continue
        lifts = np.array([events[k].lift_off for k in mine])
        lands = np.array([events[k].touch_down for k in mine])
        last = np.searchsorted(lifts, times, side="left") - 1
        flies = (last >= 0) & (times < lands[last])
        found[flies, i] = mine[last[flies]]
    return found


def support_changes(events: Sequence[SwingEvent], duration: float) -> FloatArray:
    """Begin and end of a motion, and all lift-offs and touchdowns, in any order ``(N,)`` [s].

    Args:
        events: the swings.
        duration: of the whole motion [s].
    """
    return np.array([0.0, duration, *(t for e in events for t in (e.lift_off, e.touch_down))])


def contacts_at(events: Sequence[SwingEvent], times: FloatArray) -> BoolArray:
    """Which feet stand at ``times (N,)``: ``(N, 4)``."""
    return flights_at(events, times) < 0


def stances_at(footholds: Footholds, events: Sequence[SwingEvent], times: FloatArray) -> FloatArray:
    """Footholds of all feet at ``times (N,)``: ``(N, 4, 3)`` [m]; flying feet's last ones."""
    places = np.empty((len(times), len(LEGS), 3))
    for i, leg in enumerate(LEGS):
        lands = [e.touch_down for e in events if e.leg == leg]
        places[:, i] = footholds[leg][np.searchsorted(lands, times, side="right")]
    return places
