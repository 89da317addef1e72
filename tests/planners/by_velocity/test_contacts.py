"""Which foot flies, stands, and where: against a search through all swings."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gaitopt import LEGS, Footholds, trot, walk
from gaitopt.gait.step_timing import SwingEvent, swing_events
from gaitopt.planners.by_velocity.contacts import contacts_at, flights_at, stances_at

events_of = st.builds(
    lambda schedule, cycles: swing_events(schedule, cycles),
    st.sampled_from([trot(0.5), trot(0.5, 0.3), walk(1.6), walk(0.7, 0.9)]),
    st.integers(0, 4),
)


@given(events_of, st.lists(st.floats(-1.0, 8.0), max_size=20))
def test_a_foot_flies_between_its_lift_off_and_its_touch_down(
    events: tuple[SwingEvent, ...], times: list[float]
) -> None:
    edges = [t for e in events for t in (e.lift_off, e.touch_down)]
    instants = np.array([*times, *edges])
    flights = flights_at(events, instants)
    assert flights.shape == (len(instants), 4)
    for time, row in zip(instants, flights, strict=True):
        for leg, found in zip(LEGS, row, strict=True):
            on = [k for k, e in enumerate(events)
                  if e.leg == leg and e.lift_off < time < e.touch_down]  # fmt: skip
            assert on == ([found] if found >= 0 else [])
    assert (contacts_at(events, instants) == (flights < 0)).all()


@given(events_of, st.lists(st.floats(-1.0, 8.0), min_size=1, max_size=20))
def test_a_foot_stands_where_it_touched_down_last(
    events: tuple[SwingEvent, ...], times: list[float]
) -> None:
    rows = 1 + max((e.step + 1 for e in events), default=0)
    places = {leg: np.arange(3.0 * rows).reshape(rows, 3) + 100 * i for i, leg in enumerate(LEGS)}
    found = stances_at(Footholds(places), events, np.array(times))
    for time, feet in zip(times, found, strict=True):
        for leg, foot in zip(LEGS, feet, strict=True):
            landed = sum(e.leg == leg and e.touch_down <= time for e in events)
            assert foot == pytest.approx(places[leg][landed])


def test_nobody_flies_without_swings() -> None:
    assert contacts_at((), np.array([0.0, 1.0])).all()
    assert contacts_at((), np.zeros(0)).shape == (0, 4)
