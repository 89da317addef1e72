"""The clock of a walk: it stands still where feet hand over their load."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import gaitopt
from gaitopt import InputError, Plan
from gaitopt.control.clock import WalkClock, walk_clock


def test_a_clock_by_hand() -> None:
    """It stands still at 1 s for 0.5 s, and at 2 s for 0.25 s."""
    clock = WalkClock(np.array([1.0, 2.0]), np.array([0.5, 0.25]))
    times = [-1.0, 0.5, 1.0, 1.2, 1.5, 1.75, 2.5, 2.6, 2.75, 3.75]
    then = [-1.0, 0.5, 1.0, 1.0, 1.0, 1.25, 2.0, 2.0, 2.0, 3.0]
    assert clock.plan_time(times) == pytest.approx(then)
    assert clock.pausing(times).tolist() == [
        False, False, True, True, False, False, True, True, False, False,
    ]  # fmt: skip
    assert clock.paused == 0.75


def test_without_stops_it_is_time_itself() -> None:
    clock = WalkClock(np.zeros(0), np.zeros(0))
    times = np.array([-1.0, 0.0, 7.5])
    assert np.array_equal(clock.plan_time(times), times)
    assert not clock.pausing(times).any()


@given(
    st.lists(st.floats(0.0, 100.0), min_size=1, max_size=8, unique=True).map(sorted),
    st.lists(st.floats(0.001, 2.0), min_size=8, max_size=8),
)
def test_it_never_runs_backwards_or_faster_than_time(
    stops: list[float], pauses: list[float]
) -> None:
    clock = WalkClock(np.array(stops), np.array(pauses[: len(stops)]))
    times = np.linspace(-1.0, stops[-1] + sum(pauses) + 1.0, 500)
    steps = np.diff(clock.plan_time(times))
    assert (steps >= -1e-9).all()
    assert (steps <= np.diff(times) + 1e-9).all()
    assert times[-1] - clock.plan_time(times[-1]) == pytest.approx(clock.paused)


def test_a_crawl_pauses_where_a_foot_leaves_as_another_lands(short_plan: Plan) -> None:
    clock = walk_clock(short_plan, 0.1)
    landings = np.array([s.end for s in short_plan.swings])
    leavings = np.array([s.start for s in short_plan.swings])
    for stop, pause in zip(clock.stops, clock.pauses, strict=True):
        since = stop - landings[landings <= stop + 1e-9].max()
        assert since + pause == pytest.approx(0.1)
        assert stop in leavings
    # Before the first swing nobody has landed; where the plan itself waits, nothing is added.
    assert leavings[0] not in clock.stops
    assert walk_clock(short_plan, 0.0).paused == 0.0


def test_a_gait_that_cannot_stop_does_not() -> None:
    robot = gaitopt.load_robot("wang2020-fast")
    plan = gaitopt.plan_gait(
        robot, gaitopt.trot(0.5), velocity=0.3, distance=1.0, timing="velocity"
    )
    assert walk_clock(plan, 0.1).paused == 0.0


@pytest.mark.parametrize(
    ("stops", "pauses"), [([1.0, 0.5], [0.1, 0.1]), ([1.0], [0.0]), ([1.0], [0.1, 0.1])]
)
def test_bad_clocks_are_refused(stops: list[float], pauses: list[float]) -> None:
    with pytest.raises(InputError, match="a clock needs"):
        WalkClock(np.array(stops), np.array(pauses))
