"""When steps take place: the swings of whole walks, the clock, and the pace by the margin."""

from __future__ import annotations

import itertools
from collections import Counter

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gaitopt.conventions import LEGS
from gaitopt.errors import InputError
from gaitopt.gait.crawl import CRAWL_SEQUENCES, swing_order
from gaitopt.gait.gaits import crawl, trot, walk, wave
from gaitopt.gait.schedule import GaitSchedule
from gaitopt.gait.step_timing import (
    GaitClock,
    Moment,
    adapted_step_time,
    cycles_spanned,
    first_swings,
    swing_events,
)

share = st.floats(0.0, 1.0, exclude_max=True)
offsets = st.tuples(share, share, share, share).map(lambda s: dict(zip(LEGS, s, strict=True)))
schedules = st.builds(GaitSchedule, st.floats(0.05, 10.0), st.floats(0.02, 0.98), offsets)


def test_a_walk_of_the_critical_crawl_is_one_swing_after_another() -> None:
    events = swing_events(walk(2.0), 3)
    assert [(e.leg, e.step + 1) for e in events] == swing_order(("RH", "RF", "LH", "LF"), 4)
    assert [e.lift_off for e in events] == [0.5 * i for i in range(12)]
    assert [e.touch_down for e in events] == [0.5 * (i + 1) for i in range(12)]


@pytest.mark.parametrize("sequence", CRAWL_SEQUENCES)
def test_a_crawl_begins_with_the_first_leg_of_its_sequence(sequence: tuple[str, ...]) -> None:
    for duty in (0.75, 0.8):
        events = swing_events(crawl(sequence, 1.0, duty), 2)
        assert tuple(e.leg for e in events) == sequence * 2


def test_a_trot_begins_with_the_pair_that_eq_37_has_in_the_air() -> None:
    events = swing_events(trot(0.6), 2)
    assert [e.leg for e in events] == ["LH", "RF", "LF", "RH"] * 2
    lifts = [e.lift_off for e in events]
    assert lifts == pytest.approx([0.0, 0.0, 0.3, 0.3, 0.6, 0.6, 0.9, 0.9])
    assert lifts[::2] == lifts[1::2]


def test_the_first_leg_can_be_chosen() -> None:
    events = swing_events(trot(0.6), 1, first="RH")
    assert [e.leg for e in events] == ["LF", "RH", "LH", "RF"]
    assert swing_events(walk(1.0), 2, first="LF")[0].leg == "LF"
    with pytest.raises(InputError, match="first must be one of LF, LH, RH, RF, got 'XL'"):
        swing_events(trot(0.6), 1, first="XL")


@given(schedules, st.integers(1, 5), st.sampled_from([None, *LEGS]))
def test_every_leg_swings_as_often_and_as_long(
    schedule: GaitSchedule, cycles: int, first: str | None
) -> None:
    events = swing_events(schedule, cycles, first=first)
    assert Counter(e.leg for e in events) == dict.fromkeys(LEGS, cycles)
    assert events[0].lift_off == 0.0
    assert all(a.lift_off <= b.lift_off for a, b in itertools.pairwise(events))
    period = schedule.cycle_time
    for leg in LEGS:
        mine = [e for e in events if e.leg == leg]
        assert [e.step for e in mine] == list(range(cycles))
        assert mine[0].lift_off < period
        for event in mine:
            lasts = event.touch_down - event.lift_off
            assert lasts == pytest.approx(schedule.swing_time, abs=1e-8 * period)
        for before, after in itertools.pairwise(mine):
            assert after.lift_off - before.lift_off == pytest.approx(period)


@given(schedules, st.integers(2, 5))
def test_in_the_middle_of_a_walk_the_feet_stand_as_scheduled(
    schedule: GaitSchedule, cycles: int
) -> None:
    """From the last first lift-off on, until the first last one's cycle ends."""
    events = swing_events(schedule, cycles)
    start = min(schedule.liftoffs.values()) * schedule.cycle_time
    begin = max(e.lift_off for e in events if e.step == 0)
    end = min(e.lift_off for e in events if e.step == cycles - 1)
    t = np.linspace(begin, max(begin, end), 57)
    planned = schedule.support(t + start)
    flying = np.array([[any(e.lift_off <= x < e.touch_down for e in events if e.leg == leg)
                        for leg in LEGS] for x in t])  # fmt: skip
    instants = np.array([x for e in events for x in (e.lift_off, e.touch_down)])
    clear = np.abs(t[:, None] - instants).min(axis=1) > 1e-7 * schedule.cycle_time
    np.testing.assert_array_equal(flying[clear], ~planned[clear])


@given(schedules, st.integers(1, 4))
def test_instants_that_coincide_in_the_schedule_are_equal_in_the_walk(
    schedule: GaitSchedule, cycles: int
) -> None:
    """No two of them lie within rounding errors of each other without being the same."""
    events = swing_events(schedule, cycles)
    instants = np.unique([x for e in events for x in (e.lift_off, e.touch_down)])
    assert np.diff(instants).min() > 0.9e-9 * schedule.cycle_time


@given(st.floats(0.5, 0.99), st.floats(0.05, 10.0), st.integers(2, 20))
def test_handover_of_the_wave_is_one_instant(duty: float, period: float, cycles: int) -> None:
    events = swing_events(wave(period, duty), cycles)
    touches = {(e.leg, e.step): e.touch_down for e in events}
    lifts = {(e.leg, e.step): e.lift_off for e in events}
    for side in "LR":
        hind = [touches[side + "H", k] for k in range(cycles)]
        front = [lifts[side + "F", k] for k in range(cycles)]
        # The first lift-off and the last touchdown may be alone.
        assert len(set(hind) & set(front)) >= cycles - 1


@given(schedules, st.integers(1, 6), st.floats(0.05, 10.0))
def test_equal_cycle_times_are_another_cycle_time(
    schedule: GaitSchedule, cycles: int, period: float
) -> None:
    times = [period] * cycles_spanned(schedule, cycles)
    given_times = swing_events(schedule, cycles, times)
    scaled = swing_events(schedule.with_cycle_time(period), cycles)
    for a, b in zip(given_times, scaled, strict=True):
        assert (a.leg, a.step) == (b.leg, b.step)
        np.testing.assert_allclose(
            [a.lift_off, a.touch_down], [b.lift_off, b.touch_down], rtol=0, atol=1e-12 * 60
        )


@given(schedules, st.integers(1, 5), st.data())
def test_within_a_cycle_time_is_proportional_to_phase(
    schedule: GaitSchedule, cycles: int, data: st.DataObject
) -> None:
    needed = cycles_spanned(schedule, cycles)
    times = data.draw(st.lists(st.floats(0.05, 5.0), min_size=needed, max_size=needed))
    starts = np.append(0.0, np.cumsum(times))
    unit = schedule.with_cycle_time(1.0)
    for event, phases in zip(
        swing_events(schedule, cycles, times), swing_events(unit, cycles), strict=True
    ):
        found = [event.lift_off, event.touch_down]
        expected = np.interp([phases.lift_off, phases.touch_down], np.arange(needed + 1), starts)
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-9)


def test_a_swing_across_two_cycles_takes_its_share_of_both() -> None:
    """RH lifts off after 0.75 cycles, and touches down after 1.05."""
    schedule = GaitSchedule(1.0, 0.7, walk(1.0).phase_offsets)
    events = swing_events(schedule, 1, [1.0, 10.0], first="RF")
    (rh,) = (e for e in events if e.leg == "RH")
    assert rh.lift_off == pytest.approx(0.75)
    assert rh.touch_down == pytest.approx(1.0 + 0.05 * 10.0)


@pytest.mark.parametrize(
    ("schedule", "cycles", "spanned"),
    [
        (walk(1.0), 3, 3), (trot(1.0), 3, 3),  # the last touchdown ends the last cycle
        (trot(1.0, 0.4), 3, 4), (trot(1.0, 0.6), 3, 3), (walk(1.0), 0, 0),
    ],
)  # fmt: skip
def test_cycles_that_a_walk_spans(schedule: GaitSchedule, cycles: int, spanned: int) -> None:
    assert cycles_spanned(schedule, cycles) == spanned
    end = max((e.touch_down for e in swing_events(schedule, cycles)), default=0.0)
    assert np.ceil(end - 1e-12) == spanned


def test_too_few_cycle_times_are_refused_with_the_number_that_is_needed() -> None:
    schedule = trot(1.0, 0.4)
    with pytest.raises(InputError, match="3 swings of each leg span 4 cycles, got 3 cycle_times"):
        swing_events(schedule, 3, [1.0, 1.0, 1.0])
    with pytest.raises(InputError, match=r"cycle_times\[1\] must be a number .* s, got -1.0"):
        swing_events(schedule, 1, [1.0, -1.0])
    assert len(swing_events(schedule, 3, np.ones(9))) == 12  # type: ignore[arg-type]


@pytest.mark.parametrize("wrong", [-1, 1.0, True, "2", 10**6])
def test_a_number_of_cycles_that_is_none_is_refused(wrong: object) -> None:
    with pytest.raises(InputError, match="cycles must be a whole number from 0 to 100000, got"):
        swing_events(walk(1.0), wrong)  # type: ignore[arg-type]


def test_no_cycles_are_no_swings() -> None:
    assert swing_events(walk(1.0), 0) == swing_events(walk(1.0), 0, []) == ()


def test_clock_that_stood_still_is_late_by_as_much() -> None:
    clock = GaitClock([1.0, 2.0])
    third = Moment(2, 0.25)
    assert clock.time_of(third) == 1.0 + 2.0 + 0.5
    clock.halted = 1.5
    assert clock.cycles_at(1.9) == clock.cycles_at(1.5) == 1.25
    clock.resume(1.9)
    assert clock.time_of(third) == pytest.approx(3.5 + 0.4)
    assert clock.cycles_at(1.9) == pytest.approx(1.25)


def test_first_swings_of_the_critical_walk() -> None:
    swings = first_swings(walk(1.0))
    assert swings["RH"] == (Moment(0, 0.0), Moment(0, 0.25))
    assert swings["LF"] == (Moment(0, 0.75), Moment(1, 0.0))


def test_at_the_nominal_margin_the_step_time_is_nominal() -> None:
    assert adapted_step_time(0.4, 0.03, 0.03, 0.5) == 0.4


def test_step_time_by_hand() -> None:
    """0.4 s (1 + 5 / m (0.03 m - 0.01 m)) = 0.44 s, and 0.36 s on the other side."""
    found = adapted_step_time(0.4, [0.01, 0.05], 0.03, 5.0)
    np.testing.assert_allclose(found, [0.44, 0.36])


@given(st.floats(0.1, 2.0), st.floats(0.0, 0.2), st.floats(0.01, 20.0),
       st.lists(st.floats(-0.5, 0.5), min_size=2, max_size=20))  # fmt: skip
def test_smaller_margins_never_make_steps_shorter(
    nominal: float, wanted: float, gain: float, margins: list[float]
) -> None:
    found = adapted_step_time(nominal, np.sort(margins), wanted, gain)
    assert (np.diff(found) <= 0).all()
    assert (found >= 0.5 * nominal).all() and (found <= 2.0 * nominal).all()


def test_bounds_hold_where_the_papers_formula_would_not() -> None:
    """As printed, a margin of 0.25 m over the wanted one at a gain of 5 / m takes time back."""
    printed = 0.4 * (1.0 + 5.0 * (0.03 - 0.28))
    assert printed < 0
    assert adapted_step_time(0.4, 0.28, 0.03, 5.0) == 0.2
    assert adapted_step_time(0.4, 0.28, 0.03, 5.0, least=0.3) == 0.3
    assert adapted_step_time(0.4, -np.inf, 0.03, 5.0, most=0.5) == 0.5
    assert adapted_step_time(0.4, [np.inf, -np.inf], 0.03, 0.0).tolist() == [0.4, 0.4]


def test_gain_is_by_the_metre() -> None:
    """The same robot in millimetres needs a thousandth of the gain."""
    in_metres = adapted_step_time(0.4, 0.02, 0.03, 2.0)
    in_millimetres = adapted_step_time(0.4, 20.0, 30.0, 2.0e-3)
    assert in_metres == pytest.approx(in_millimetres)
    assert adapted_step_time(0.4, np.zeros((2, 3)), 0.03, 0.5).shape == (2, 3)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"gain": -0.1}, "gain must be a number from 0 to .* 1/m, got -0.1"),
        ({"nominal": 0.0}, "nominal must be a number .* s, got 0.0"),
        ({"margin": [0.1, np.nan]}, "margin must not be NaN; give -inf"),
        ({"least": 0.5}, "between least and most, got 0.5 s <= 0.4 s <= 0.8 s"),
        ({"most": 0.3}, "between least and most, got 0.2 s <= 0.4 s <= 0.3 s"),
    ],
)
def test_step_times_that_make_no_sense_are_refused(
    changes: dict[str, object], message: str
) -> None:
    right: dict[str, object] = {"nominal": 0.4, "margin": 0.02, "nominal_margin": 0.03, "gain": 0.5}
    with pytest.raises(InputError, match=message):
        adapted_step_time(**{**right, **changes})  # type: ignore[arg-type]
