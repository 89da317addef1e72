"""The gait state machine: its graph, the clock's exact times, and feet that come early or late."""

from __future__ import annotations

import itertools
from collections import defaultdict

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gaitopt.conventions import LEGS
from gaitopt.errors import InputError
from gaitopt.gait.gaits import pace, quasi_static, trot, walk, wave
from gaitopt.gait.schedule import GaitSchedule
from gaitopt.gait.state_machine import GaitStateMachine, LegEvent, LegState, swing_events

INITIAL, LIFT_OFF, SWING, TOUCHDOWN, STANCE = LegState
GRAPH = {(INITIAL, LIFT_OFF), (LIFT_OFF, SWING), (SWING, TOUCHDOWN), (TOUCHDOWN, STANCE),
         (STANCE, LIFT_OFF)}  # fmt: skip

share = st.floats(0.0, 1.0, exclude_max=True)
offsets = st.tuples(share, share, share, share).map(lambda s: dict(zip(LEGS, s, strict=True)))
schedules = st.builds(GaitSchedule, st.floats(0.1, 5.0), st.floats(0.05, 0.95), offsets) | (
    st.sampled_from([walk(1.0), trot(0.6), trot(0.6, 0.35), pace(0.8), quasi_static(1.0, 0.6),
                     wave(1.3, 0.85)])
)  # fmt: skip
steps_of_time = st.lists(st.floats(0.0, 3.0), min_size=1, max_size=60)
transition = st.none() | st.floats(0.0, 0.5)


def is_walk_in_the_graph(events: list[LegEvent]) -> bool:
    """Whether each leg goes along edges only, from INITIAL on, with its swings numbered."""
    paths: dict[str, list[LegState]] = defaultdict(lambda: [INITIAL])
    steps: dict[str, int] = defaultdict(lambda: -1)
    for event in events:
        paths[event.leg].append(event.state)
        steps[event.leg] += event.state is LIFT_OFF
        if event.step != steps[event.leg]:
            return False
    pairs = {pair for path in paths.values() for pair in itertools.pairwise(path)}
    return pairs <= GRAPH


def in_order(events: list[LegEvent]) -> bool:
    return all(a.time <= b.time for a, b in itertools.pairwise(events))


def touching(*legs: str) -> dict[str, bool]:
    return {leg: leg in legs for leg in LEGS}


def run(machine: GaitStateMachine, until: float, dt: float) -> list[LegEvent]:
    count = int(np.ceil((until - machine.time) / dt))
    return [e for t in machine.time + dt * np.arange(1, count + 1) for e in machine.advance(t)]


def of(events: list[LegEvent], leg: str) -> list[tuple[LegState, float]]:
    return [(e.state, e.time) for e in events if e.leg == leg]


@given(schedules, steps_of_time, transition, st.none() | st.integers(0, 5))
def test_by_the_clock_every_leg_walks_in_the_graph(
    schedule: GaitSchedule, steps: list[float], last: float | None, cycles: int | None
) -> None:
    machine = GaitStateMachine(schedule, cycles, transition_time=last)
    events: list[LegEvent] = []
    for dt in steps:
        before = machine.time
        fresh = machine.advance(before + dt)
        assert all(before <= e.time <= machine.time for e in fresh)
        events += fresh
    assert is_walk_in_the_graph(events) and in_order(events)
    assert machine.late == machine.overdue == ()


@given(schedules, st.data(), transition, st.none() | st.integers(0, 5))
def test_with_any_contacts_every_leg_walks_in_the_graph(
    schedule: GaitSchedule, data: st.DataObject, last: float | None, cycles: int | None
) -> None:
    machine = GaitStateMachine(schedule, cycles, transition_time=last)
    events: list[LegEvent] = []
    for dt in data.draw(steps_of_time):
        contacts = data.draw(st.none() | st.tuples(*[st.booleans()] * 4))
        if data.draw(st.booleans()):
            machine.set_cycle_time(data.draw(st.floats(0.1, 5.0)))
        phase = machine.cycles_passed
        measured = None if contacts is None else dict(zip(LEGS, contacts, strict=True))
        events += machine.advance(machine.time + dt, measured)
        assert machine.cycles_passed >= phase - 1e-9
        for leg in machine.late:
            assert machine.states[leg] is SWING and measured and not measured[leg]
    assert is_walk_in_the_graph(events) and in_order(events)
    lifts = [sum(e.state is LIFT_OFF for e in events if e.leg == leg) for leg in LEGS]
    assert cycles is None or max(lifts) <= cycles


@given(schedules, st.integers(1, 5), steps_of_time, transition, st.sampled_from([None, *LEGS]))
def test_the_clock_gives_the_planned_swings_to_the_last_bit(
    schedule: GaitSchedule, cycles: int, steps: list[float], last: float | None, first: str | None
) -> None:
    machine = GaitStateMachine(schedule, cycles, first=first, transition_time=last)
    planned = swing_events(schedule, cycles, first=first)
    assert machine.duration == max(e.touch_down for e in planned)
    events: list[LegEvent] = []
    for dt in [*steps, 2 * machine.duration, 1.0]:
        events += machine.advance(machine.time + dt)
    found = {(e.leg, e.step, e.state): e.time for e in events}
    for swing in planned:
        assert found[swing.leg, swing.step, LIFT_OFF] == swing.lift_off
        assert found[swing.leg, swing.step, TOUCHDOWN] == swing.touch_down
    assert len(events) == 4 * len(planned)
    assert machine.finished and set(machine.states.values()) == {STANCE}
    assert all(e.delay == 0.0 for e in events)


def test_robot_stands_on_four_feet_before_and_after_the_walk() -> None:
    machine = GaitStateMachine(trot(0.5, 0.4), 2)
    assert machine.support == LEGS and set(machine.states.values()) == {INITIAL}
    assert not machine.finished
    machine.advance(machine.duration)
    assert machine.finished and machine.support == LEGS
    assert machine.advance(1e6)[-1].state is STANCE
    assert machine.advance(2e6) == ()


def test_no_cycles_are_a_walk_that_is_over() -> None:
    machine = GaitStateMachine(walk(1.0), 0)
    assert machine.finished and machine.duration == 0.0 and machine.advance(5.0) == ()
    assert set(machine.states.values()) == {INITIAL}


@pytest.mark.parametrize("schedule", [walk(1.0, 0.8), trot(1.0), trot(1.0, 0.4), wave(1.0, 0.7)])
def test_in_the_middle_of_a_walk_the_legs_stand_as_scheduled(schedule: GaitSchedule) -> None:
    machine = GaitStateMachine(schedule)
    start = min(schedule.liftoffs.values())
    run(machine, 1.5, 0.01)
    for t in 1.5037 + 0.01 * np.arange(300):
        machine.advance(float(t))
        standing = [leg in machine.support for leg in LEGS]
        assert standing == schedule.support(t + start).tolist()
        assert machine.phase == pytest.approx(float(schedule.phase(t + start)), abs=1e-9)


def test_transitional_states_are_seen_once_by_default() -> None:
    machine = GaitStateMachine(trot(1.0), 1)
    seen = []
    for t in 0.25 * np.arange(8):
        machine.advance(float(t))
        seen.append(machine.states["RF"])
    assert seen == [LIFT_OFF, SWING, TOUCHDOWN, STANCE, STANCE, STANCE, STANCE, STANCE]


def test_transitional_states_last_for_their_time() -> None:
    machine = GaitStateMachine(trot(1.0), 2, transition_time=0.1)
    assert of(list(machine.advance(5.0)), "RF") == [
        (LIFT_OFF, 0.0), (SWING, 0.1), (TOUCHDOWN, 0.5), (STANCE, 0.6),
        (LIFT_OFF, 1.0), (SWING, 1.1), (TOUCHDOWN, 1.5), (STANCE, 1.6),
    ]  # fmt: skip


def test_transitional_states_end_with_the_swing_and_the_stance() -> None:
    machine = GaitStateMachine(trot(1.0), 2, transition_time=3.0)
    assert of(list(machine.advance(5.0)), "RF") == [
        (LIFT_OFF, 0.0), (SWING, 0.5), (TOUCHDOWN, 0.5), (STANCE, 1.0),
        (LIFT_OFF, 1.0), (SWING, 1.5), (TOUCHDOWN, 1.5), (STANCE, 4.5),
    ]  # fmt: skip


def test_feet_come_down_before_others_rise() -> None:
    """At the handover of the trot a machine never says that no foot stands."""
    machine = GaitStateMachine(trot(1.0), 4)
    standing, fewest = set(LEGS), 4
    for event in machine.advance(10.0):
        (standing.add if event.state.stands else standing.discard)(event.leg)
        fewest = min(fewest, len(standing))
    assert fewest == 2


def test_contact_before_the_planned_time_ends_the_swing() -> None:
    machine = GaitStateMachine(trot(1.0), 2)
    machine.advance(0.1, touching("LF", "RH"))
    machine.advance(0.2, touching("LF", "RH"))
    assert machine.states["RF"] is SWING
    (early,) = machine.advance(0.4, touching("LF", "RH", "RF"))
    assert early.leg == "RF" and early.state is TOUCHDOWN and early.time == 0.4
    assert early.delay == pytest.approx(-0.1)
    events = list(machine.advance(5.0))
    assert (LIFT_OFF, 1.0) in of(events, "RF")  # its next swing is as planned
    assert [e.time for e in events if e.leg == "LH" and e.state is TOUCHDOWN] == [0.5, 1.5]


def test_contact_does_not_count_while_the_foot_is_leaving_the_ground() -> None:
    machine = GaitStateMachine(trot(1.0), 2, earliest_contact=0.5)
    for t in (0.0, 0.01, 0.1, 0.24):
        machine.advance(t, dict.fromkeys(LEGS, True))
        assert machine.states["RF"] in (LIFT_OFF, SWING)
    machine.advance(0.26, dict.fromkeys(LEGS, True))
    assert machine.states["RF"] is TOUCHDOWN


def test_contact_at_every_instant_from_half_of_the_swing_on_is_planned_walking() -> None:
    """With advances that are much shorter than a swing every touchdown is seen at its half."""
    machine = GaitStateMachine(walk(1.0), 2)
    events: list[LegEvent] = []
    for t in 0.005 * np.arange(600):
        events += machine.advance(float(t), dict.fromkeys(LEGS, True))
    delays = [e.delay for e in events if e.state is TOUCHDOWN]
    np.testing.assert_allclose(delays, -0.125, rtol=0, atol=0.0051)
    assert len(delays) == 8 and machine.finished


def test_planned_contact_is_at_the_planned_time() -> None:
    """A foot that touches the ground at the first advance after it is not late."""
    machine = GaitStateMachine(trot(1.0), 1)
    machine.advance(0.4, touching("LF", "RH"))
    events = list(machine.advance(0.51, dict.fromkeys(LEGS, True)))
    assert (TOUCHDOWN, 0.5) in of(events, "RF") and (LIFT_OFF, 0.5) in of(events, "LF")
    assert machine.cycles_passed == pytest.approx(0.51)


def test_late_foot_keeps_the_others_on_the_ground_and_puts_off_the_rest() -> None:
    machine = GaitStateMachine(trot(1.0), 2, longest_wait=0.25)
    for t in (0.4, 0.49):
        machine.advance(t, touching("LF", "RH"))
    events = list(machine.advance(0.51, touching("LF", "RH", "LH")))
    assert of(events, "LH") == [(TOUCHDOWN, 0.5)]
    assert machine.late == ("RF",) and machine.states["RF"] is SWING
    assert machine.support == ("LF", "LH", "RH")
    assert machine.cycles_passed == 0.5
    for t in (0.6, 0.7, 0.75):
        assert all(e.leg == "LH" for e in machine.advance(t, touching("LF", "RH", "LH")))
        assert machine.overdue == () and machine.cycles_passed == 0.5
    found = list(machine.advance(0.8, dict.fromkeys(LEGS, True)))
    assert of(found, "RF") == [(TOUCHDOWN, 0.8)]
    assert found[0].delay == pytest.approx(0.3)
    assert of(found, "LF") == [(LIFT_OFF, pytest.approx(0.8))]
    assert machine.late == ()
    assert machine.duration == pytest.approx(2.0 + 0.3)


def test_foot_that_is_late_for_longer_than_the_patience_is_overdue() -> None:
    machine = GaitStateMachine(trot(1.0), 2, longest_wait=0.25)
    machine.advance(0.4, touching("LF", "RH"))
    machine.advance(0.74, touching("LF", "RH", "LH"))
    assert machine.late == ("RF",) and machine.overdue == ()
    machine.advance(0.76, touching("LF", "RH", "LH"))
    assert machine.overdue == ("RF",)
    for t in (1.0, 10.0, 1000.0):  # and nothing else happens, however long it takes
        machine.advance(t, touching("LF", "RH", "LH"))
        assert machine.support == ("LF", "LH", "RH") and machine.overdue == ("RF",)
    machine.advance(1000.1, dict.fromkeys(LEGS, True))
    assert machine.overdue == machine.late == () and machine.states["LF"] is LIFT_OFF


def test_both_feet_of_a_pair_are_waited_for() -> None:
    machine = GaitStateMachine(trot(1.0), 1)
    machine.advance(0.4, touching("LF", "RH"))
    machine.advance(0.6, touching("LF", "RH"))
    assert machine.late == ("LH", "RF")
    machine.advance(0.7, touching("LF", "RH", "RF"))
    assert machine.late == ("LH",) and machine.states["RF"] is TOUCHDOWN
    assert machine.support == ("LF", "RH", "RF")
    machine.advance(0.9, dict.fromkeys(LEGS, True))
    assert machine.late == () and machine.states["LF"] is machine.states["RH"] is LIFT_OFF


def test_foot_of_another_leg_that_flies_meanwhile_lands_later_by_as_much() -> None:
    """In a gait where swings overlap, and one of two feet is late."""
    shares = {"LF": 0.0, "RH": 0.5, "LH": 0.1, "RF": 0.6}
    machine = GaitStateMachine(GaitSchedule(1.0, 0.7, shares), 1)
    planned = {e.leg: e for e in swing_events(machine.schedule, 1)}
    late, later = sorted(planned.values(), key=lambda e: e.touch_down)[:2]
    assert late.lift_off < later.lift_off < late.touch_down < later.touch_down
    machine.advance(late.touch_down - 0.01, touching("LF"))
    machine.advance(late.touch_down + 0.2, touching("LF"))
    assert machine.late == (late.leg,) and machine.states[later.leg] is SWING
    machine.advance(late.touch_down + 0.3, touching(late.leg))
    events = list(machine.advance(5.0, dict.fromkeys(LEGS, True)))
    landed = dict(of(events, later.leg))[TOUCHDOWN]
    assert landed == pytest.approx(later.touch_down + 0.3)


def test_without_contacts_a_late_foot_lands_now() -> None:
    machine = GaitStateMachine(trot(1.0), 1)
    machine.advance(0.6, touching("LF", "RH", "LH"))
    events = list(machine.advance(0.8))
    assert (TOUCHDOWN, 0.8) in of(events, "RF") and machine.late == ()
    machine.advance(2.0)
    assert machine.finished and machine.duration == pytest.approx(1.3)


def test_cycle_time_changes_with_the_next_cycle_and_the_phase_does_not_jump() -> None:
    machine = GaitStateMachine(walk(1.0), 3)
    machine.advance(0.4)
    machine.set_cycle_time(2.0)
    assert machine.cycle_time == 1.0 and machine.cycles_passed == 0.4
    machine.advance(1.0)
    assert machine.cycles_passed == pytest.approx(1.0) and machine.cycle_time == 2.0
    machine.advance(1.5)
    assert machine.cycles_passed == pytest.approx(1.25)
    assert machine.duration == pytest.approx(1.0 + 2.0 + 2.0)


@given(schedules, st.integers(1, 4), st.data())
def test_cycle_times_set_on_the_way_give_the_swings_planned_with_them(
    schedule: GaitSchedule, cycles: int, data: st.DataObject
) -> None:
    times = data.draw(st.lists(st.floats(0.1, 3.0), min_size=cycles + 1, max_size=cycles + 1))
    machine = GaitStateMachine(schedule.with_cycle_time(times[0]), cycles)
    events: list[LegEvent] = []
    starts = np.append(0.0, np.cumsum(times))
    for start, following in zip(starts, times[1:], strict=False):
        events += machine.advance(float(start + 0.05))  # within the cycle
        machine.set_cycle_time(9.0)
        machine.set_cycle_time(following)  # the last word counts
    events += machine.advance(100.0)
    found = {(e.leg, e.step, e.state): e.time for e in events}
    for swing in swing_events(schedule, cycles, times):
        expected = [swing.lift_off, swing.touch_down]
        times_found = [found[swing.leg, swing.step, state] for state in (LIFT_OFF, TOUCHDOWN)]
        np.testing.assert_allclose(times_found, expected, rtol=0, atol=1e-9)


@given(st.lists(st.tuples(st.floats(0.001, 0.3), st.floats(0.2, 2.0)), min_size=1, max_size=80))
def test_phase_is_the_integral_of_dt_over_the_cycle_time(
    moves: list[tuple[float, float]],
) -> None:
    machine = GaitStateMachine(walk(1.0))
    total, period, pending = 0.0, 1.0, 1.0
    for dt, following in moves:
        machine.advance(machine.time + dt)
        left = (np.floor(total + 1e-9) + 1.0 - total) * period  # of the present cycle
        if dt < left:
            total += dt / period
        else:
            total, period = round(total + left / period) + (dt - left) / pending, pending
        assert machine.cycles_passed == pytest.approx(total, abs=1e-7)
        machine.set_cycle_time(following)
        pending = following
        if abs(total - round(total)) < 2e-9:
            period = following


def test_a_choice_of_the_first_leg() -> None:
    machine = GaitStateMachine(walk(1.0), 1, first="LF")
    assert machine.phase == 0.75
    assert [e.leg for e in machine.advance(0.0)] == ["LF"]


def test_time_does_not_go_back_and_takes_no_leaps_without_end() -> None:
    machine = GaitStateMachine(walk(1.0))
    machine.advance(1.0)
    with pytest.raises(InputError, match=r"time must be a number from 1 to 1001 s, got 0.5"):
        machine.advance(0.5)
    with pytest.raises(InputError, match=r"time must be a number .* got nan"):
        machine.advance(float("nan"))
    with pytest.raises(InputError, match="from 1 to 1001 s, got 1002"):
        machine.advance(1002)
    assert machine.time == 1.0 and machine.duration == np.inf and not machine.finished


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"cycles": -1}, "cycles must be a whole number from 0 to 100000, got -1"),
        ({"first": "XL"}, "first must be one of LF, LH, RH, RF, got 'XL'"),
        ({"transition_time": -0.1}, "transition_time must be a number .* s, got -0.1"),
        ({"longest_wait": float("nan")}, "longest_wait must be a number .* s, got nan"),
        ({"earliest_contact": 1.5}, "earliest_contact must be a number from 0 to 1, got 1.5"),
    ],
)
def test_bad_settings_are_refused(changes: dict[str, object], message: str) -> None:
    with pytest.raises(InputError, match=message):
        GaitStateMachine(walk(1.0), **changes)  # type: ignore[arg-type]


def test_contacts_must_name_each_leg() -> None:
    machine = GaitStateMachine(walk(1.0))
    with pytest.raises(InputError, match="contacts must name each of LF, LH, RH, RF once, got LF"):
        machine.advance(0.1, {"LF": True})
    with pytest.raises(InputError, match="cycle_time must be a number"):
        machine.set_cycle_time(0.0)
    assert machine.time == 0.0


def test_states_are_a_copy() -> None:
    machine = GaitStateMachine(walk(1.0))
    before = machine.states
    machine.advance(0.1)
    assert before["RH"] is INITIAL and machine.states["RH"] is LIFT_OFF
    with pytest.raises(TypeError):
        before["RH"] = STANCE  # type: ignore[index]
