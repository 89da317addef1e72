"""Gait schedules: the papers' support patterns, and no support that lasts for a rounding error."""

from __future__ import annotations

import copy
import itertools
import json
import pickle

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from gaitopt.conventions import LEGS
from gaitopt.errors import InputError
from gaitopt.gait.schedule import SNAP, GaitSchedule

TROT = {"LF": 0.0, "RH": 0.0, "RF": 0.5, "LH": 0.5}
QUARTERS = {"LF": 0.0, "RH": 0.25, "RF": 0.5, "LH": 0.75}

share = st.floats(0.0, 1.0, exclude_max=True)
offsets = st.tuples(share, share, share, share).map(lambda s: dict(zip(LEGS, s, strict=True)))
duty = st.floats(0.01, 0.99)
cycle_time = st.floats(0.01, 100.0)
schedules = st.builds(GaitSchedule, cycle_time, duty, offsets)

shift = share | st.sampled_from([0.0, SNAP, 1.0 - SNAP, 0.25 + SNAP, 0.5 - SNAP])
"""Where a cycle starts: anywhere, and where the tolerance ends."""

ulps = st.integers(-40, 40)
"""Errors of a few units in the last place, as they come out of sums and quotients."""


def fuzzed(value: float, steps: int) -> float:
    return value + steps * np.spacing(max(abs(value), 0.1))


def moved(shares: dict[str, float], by: float) -> dict[str, float]:
    return {leg: (s + by) % 1.0 for leg, s in shares.items()}


@pytest.mark.parametrize("period", [1.0, 0.6, 0.37])
def test_trot_at_half_a_cycle_of_stance_has_the_pattern_of_eqs_37_and_38(period: float) -> None:
    trot = GaitSchedule(period, 0.5, TROT)
    first = np.linspace(0.0, 0.5, 50, endpoint=False) * period
    second = first + 0.5 * period
    assert LEGS == ("LF", "LH", "RH", "RF")  # the order of eq. (36)
    np.testing.assert_array_equal(trot.support(first), np.tile([True, False, True, False], (50, 1)))
    np.testing.assert_array_equal(
        trot.support(second), np.tile([False, True, False, True], (50, 1))
    )


def test_times_and_lengths_are_eqs_28_to_31() -> None:
    walk = GaitSchedule(2.0, 0.75, QUARTERS)
    assert walk.stride(0.25) == 0.5  # (28)
    assert (walk.steps, walk.step_time) == (4, 0.5)  # (29), four steps of a walk
    assert GaitSchedule(2.0, 0.5, TROT).step_time == 1.0  # two of a trot
    assert (walk.stance_time, walk.swing_time) == (1.5, 0.5)  # (30)
    t = 2.0 * walk.phase_offsets["RH"]  # (31)
    rh = LEGS.index("RH")
    assert walk.support([t - 1e-6, t, t + 1e-6])[:, rh].tolist() == [False, True, True]


def test_a_leg_stands_at_its_touchdown_and_not_at_its_lift_off() -> None:
    walk = GaitSchedule(2.0, 0.75, QUARTERS)
    assert walk.support(2.0 * 0.75)[0] == np.False_  # LF lifts off
    assert walk.support(2.0)[0] == np.True_  # and touches down
    assert walk.liftoffs == {"LF": 0.75, "RH": 0.0, "RF": 0.25, "LH": 0.5}


def test_legs_may_have_other_names() -> None:
    names = {"LF": "FL", "LH": "rear_left", "RH": "RR", "RF": "Front-Right"}
    walk = GaitSchedule(2.0, 0.75, {names[leg]: share for leg, share in QUARTERS.items()})
    assert walk.phase_offsets == GaitSchedule(2.0, 0.75, QUARTERS).phase_offsets
    with pytest.raises(InputError, match="must name each of LF, LH, RH, RF once, got LF, FL"):
        GaitSchedule(2.0, 0.75, {"LF": 0.0, "FL": 0.2, "RH": 0.4, "RF": 0.6})


@given(ulps, ulps, ulps, ulps, ulps, shift, cycle_time, st.integers(1, 5))
def test_exactly_one_leg_flies_in_the_critical_walk_whatever_the_rounding(
    a: int, b: int, c: int, d: int, e: int, shift: float, period: float, cycles: int
) -> None:
    shares = {k: fuzzed(v, n) for (k, v), n in zip(QUARTERS.items(), (a, b, c, d), strict=True)}
    walk = GaitSchedule(period, fuzzed(0.75, e), moved(shares, shift))
    intervals = walk.intervals(cycles * period)
    assert {len(i.support) for i in intervals} == {3}
    # One of the supports is cut in two by the ends, unless the cycle starts with an edge.
    assert len(intervals) in (4 * cycles, 4 * cycles + 1)
    inner = [i.duration for i in intervals[1:-1]]
    np.testing.assert_allclose(inner, period / 4, rtol=0, atol=3e-9 * period)
    t = np.random.default_rng(0).uniform(-cycles * period, cycles * period, 200)
    assert (walk.support(t).sum(axis=1) == 3).all()


@given(ulps, ulps, ulps, ulps, ulps, shift, cycle_time)
def test_exactly_two_legs_stand_in_the_critical_trot_whatever_the_rounding(
    a: int, b: int, c: int, d: int, e: int, shift: float, period: float
) -> None:
    shares = {k: fuzzed(v, n) for (k, v), n in zip(TROT.items(), (a, b, c, d), strict=True)}
    trot = GaitSchedule(period, fuzzed(0.5, e), moved(shares, shift))
    assert {i.support for i in trot.intervals(3 * period)} == {("LF", "RH"), ("LH", "RF")}
    assert trot.least_support == 2 and not trot.has_flight and trot.steps == 2


@given(schedules, st.floats(1e-6, 20.0))
def test_intervals_join_without_gaps_and_change_the_support(
    schedule: GaitSchedule, cycles: float
) -> None:
    duration = cycles * schedule.cycle_time
    intervals = schedule.intervals(duration)
    assert intervals[0].start == 0.0 and intervals[-1].end == duration
    for before, after in itertools.pairwise(intervals):
        assert before.end == after.start and before.support != after.support
    assert min(i.duration for i in intervals) >= 0.99 * SNAP * schedule.cycle_time
    for interval in intervals:
        if interval.duration < 3 * SNAP * schedule.cycle_time:
            continue  # its middle counts as its end
        inside = schedule.support((interval.start + interval.end) / 2.0)
        assert tuple(leg for leg, s in zip(LEGS, inside, strict=True) if s) == interval.support


@given(schedules, st.integers(0, 2**32 - 1))
def test_support_is_that_of_the_definition_away_from_the_boundaries(
    schedule: GaitSchedule, seed: int
) -> None:
    t = np.random.default_rng(seed).uniform(-50, 50, 100) * schedule.cycle_time
    touch = np.array([schedule.phase_offsets[leg] for leg in LEGS])
    since = (t[:, None] / schedule.cycle_time - touch) % 1.0
    clear = np.abs([since, since - schedule.duty_factor, since - 1.0]).min(axis=0) > 1e-8
    expected = since < schedule.duty_factor
    np.testing.assert_array_equal(schedule.support(t)[clear], expected[clear])
    assert np.abs(schedule.leg_phases(t) - since)[clear].max(initial=0.0) < 1e-8


@given(schedules)
def test_legs_stand_for_their_duty_factor_on_average(schedule: GaitSchedule) -> None:
    standing = sum(i.duration * len(i.support) for i in schedule.intervals(schedule.cycle_time))
    expected = 4.0 * schedule.stance_time
    assert standing == pytest.approx(expected, abs=1e-8 * schedule.cycle_time)


@given(schedules, st.integers(-1000, 1000))
def test_support_repeats_every_cycle(schedule: GaitSchedule, cycles: int) -> None:
    """At the middles of the intervals, which no rounding takes across a boundary."""
    middles = [(i.start + i.end) / 2 for i in schedule.intervals(schedule.cycle_time)
               if i.duration > 1e-8 * schedule.cycle_time]  # fmt: skip
    later = np.array(middles) + cycles * schedule.cycle_time
    np.testing.assert_array_equal(schedule.support(middles), schedule.support(later))


@given(schedules, st.sampled_from([-1.0, 1.0]), st.integers(0, 200))
def test_a_time_rounded_at_a_boundary_is_that_boundary(
    schedule: GaitSchedule, side: float, cycle: int
) -> None:
    """A touchdown's leg stands there and a lift-off's does not, by a tenth of the tolerance."""
    for shares, stands in ((schedule.touchdowns, True), (schedule.liftoffs, False)):
        for i, leg in enumerate(LEGS):
            t = (cycle + shares[leg] + side * 0.1 * SNAP) * schedule.cycle_time
            assert schedule.support(t)[i] == stands


@given(schedules, st.floats(0.0, 0.9))
def test_offsets_within_the_tolerance_are_one_instant(
    schedule: GaitSchedule, within: float
) -> None:
    shares = schedule.phase_offsets
    assume(shares["LF"] < 0.99)  # so that a whole cycle is not nearer
    pair = {**shares, "RF": shares["LF"] + within * SNAP}
    together = GaitSchedule(1.0, schedule.duty_factor, pair)
    assert together.touchdowns["RF"] == together.touchdowns["LF"]
    assert together.liftoffs["RF"] == together.liftoffs["LF"]


@given(schedules)
def test_distinct_instants_are_further_apart_than_the_tolerance(schedule: GaitSchedule) -> None:
    edges = np.append(schedule.edges, schedule.edges[0] + 1.0)
    assert np.diff(edges).min() > 0.99 * SNAP
    assert schedule.edges[0] >= 0.0 and schedule.edges[-1] < 1.0


def test_offsets_further_apart_than_the_tolerance_stay_apart() -> None:
    apart = GaitSchedule(1.0, 0.5, {**TROT, "RH": 3 * SNAP})
    alone, *_ = apart.intervals(1.0)
    assert alone.support == ("LF",) and alone.duration == pytest.approx(3 * SNAP)
    assert len(apart.intervals(1.0)) == 4 and apart.steps == 3


def test_an_offset_just_below_a_whole_cycle_is_its_start() -> None:
    near = GaitSchedule(1.0, 0.5, {**TROT, "LF": 1.0 - 1e-12})
    assert near.touchdowns == TROT
    assert near.phase_offsets["LF"] == 1.0 - 1e-12
    assert near.intervals(2.0) == GaitSchedule(1.0, 0.5, TROT).intervals(2.0)


@pytest.mark.parametrize(
    ("duty_factor", "order"),
    [
        (0.75, (("RH",), ("RF",), ("LH",), ("LF",))),  # RH at the very start of the cycle
        (0.80, (("RH",), ("RF",), ("LH",), ("LF",))),
        (0.70, (("RF",), ("LH",), ("LF",), ("RH",))),  # RH at the end of it
    ],
)
def test_order_is_that_of_the_lift_offs_in_a_cycle(
    duty_factor: float, order: tuple[tuple[str, ...], ...]
) -> None:
    assert GaitSchedule(1.0, duty_factor, QUARTERS).order == order


def test_legs_that_lift_off_together_are_named_together() -> None:
    assert GaitSchedule(1.0, 0.5, TROT).order == (("LH", "RF"), ("LF", "RH"))
    assert GaitSchedule(1.0, 0.4, TROT).order == (("LF", "RH"), ("LH", "RF"))
    assert GaitSchedule(1.0, 0.4, dict.fromkeys(LEGS, 0.0)).order == (LEGS,)


@pytest.mark.parametrize(
    ("shares", "duty_factor", "least"),
    [
        (TROT, 0.5, 2), (TROT, 0.49, 0), (TROT, 0.51, 2), (QUARTERS, 0.75, 3), (QUARTERS, 0.76, 3),
        (QUARTERS, 0.74, 2), (QUARTERS, 0.25, 1), (QUARTERS, 0.24, 0), (QUARTERS, 0.5, 2),
        (dict.fromkeys(LEGS, 0.3), 0.9, 0),
    ],
)  # fmt: skip
def test_fewest_feet_that_stand(shares: dict[str, float], duty_factor: float, least: int) -> None:
    schedule = GaitSchedule(1.0, duty_factor, shares)
    assert schedule.least_support == least
    assert schedule.has_flight == (least == 0)


def test_phase_counts_the_cycle_from_its_start() -> None:
    walk = GaitSchedule(2.0, 0.75, QUARTERS)
    np.testing.assert_allclose(walk.phase([0.0, 0.5, 2.0, 3.0, -0.5]), [0, 0.25, 0, 0.5, 0.75])
    assert walk.phase(0.1 * 60) == 0.0  # 6.000000000000001
    assert walk.phase(np.zeros((3, 2))).shape == (3, 2)
    assert walk.support(np.zeros((3, 2))).shape == walk.leg_phases(np.zeros((3, 2))).shape
    assert walk.leg_phases(0.5).tolist() == [0.25, 0.5, 0.0, 0.75]


@given(schedules, cycle_time)
def test_another_cycle_time_is_the_same_gait(schedule: GaitSchedule, period: float) -> None:
    other = schedule.with_cycle_time(period)
    assert other.phase_offsets == schedule.phase_offsets and other.name == schedule.name
    t = np.linspace(0, 3, 17) + 1e-3
    a = schedule.leg_phases(t * schedule.cycle_time)
    b = other.leg_phases(t * period)
    apart = np.abs(a - b)
    assert np.minimum(apart, 1.0 - apart).max() < 1e-8


@given(schedules, duty)
def test_another_duty_factor_keeps_the_touchdowns_and_the_cycle_of_lift_offs(
    schedule: GaitSchedule, duty_factor: float
) -> None:
    other = schedule.with_duty_factor(duty_factor)
    assert other.touchdowns == schedule.touchdowns
    apart = np.array([[s.liftoffs[leg] - s.duty_factor for leg in LEGS] for s in (schedule, other)])
    turned = np.abs(apart[0] - apart[1]) % 1.0
    assert np.minimum(turned, 1.0 - turned).max() < 1e-8


def test_another_duty_factor_makes_no_claim_about_the_name() -> None:
    walk = GaitSchedule(1.0, 0.75, QUARTERS, "walk")
    assert walk.with_duty_factor(0.6).name == "own"
    assert walk.with_duty_factor(0.8, "walk").name == "walk"


@given(schedules)
def test_a_schedule_comes_back_from_json_and_pickle(schedule: GaitSchedule) -> None:
    there = GaitSchedule.from_dict(json.loads(json.dumps(schedule.to_dict())))
    assert there == schedule and hash(there) == hash(schedule)
    assert pickle.loads(pickle.dumps(schedule)) == schedule == copy.deepcopy(schedule)


def test_a_schedule_cannot_be_changed() -> None:
    shares = dict(TROT)
    trot = GaitSchedule(1.0, 0.5, shares)
    shares["LF"] = 0.3
    assert trot.phase_offsets["LF"] == 0.0
    with pytest.raises(TypeError):
        trot.phase_offsets["LF"] = 0.3  # type: ignore[index]
    with pytest.raises(AttributeError):
        trot.cycle_time = 2.0  # type: ignore[misc]
    with pytest.raises(ValueError, match="read-only"):
        trot.edges[0] = 0.3


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"duty_factor": 0.0}, "duty_factor must be a number from 1e-06 to 0.999999, got 0.0"),
        ({"duty_factor": 1.0}, "duty_factor must be a number from 1e-06 to 0.999999, got 1.0"),
        ({"duty_factor": float("nan")}, "duty_factor must be a number .*, got nan"),
        ({"duty_factor": "half"}, "duty_factor must be a number .*, got 'half'"),
        ({"cycle_time": 0.0}, r"cycle_time must be a number from 0.001 to 100000 s, got 0.0"),
        ({"cycle_time": True}, "cycle_time must be a number .*, got True"),
        ({"phase_offsets": {"LF": 0.0}}, "must name each of LF, LH, RH, RF once, got LF"),
        ({"phase_offsets": {**TROT, "XX": 0.0}}, "once, got LF, RH, RF, LH, XX"),
        ({"phase_offsets": [0, 0, 0.5, 0.5]}, "once, got "),
        ({"phase_offsets": {**TROT, "RH": 1.2}}, r"'RH'\] must be in \[0, 1\), got 1.2; .* is 0.2"),
        ({"phase_offsets": {**TROT, "RH": -0.25}}, "got -0.25; without whole cycles that is 0.75"),
        ({"phase_offsets": {**TROT, "RH": float("nan")}}, r"'RH'\] must be a number .* got nan"),
        ({"name": ""}, "name must be a text, got ''"),
    ],
)
def test_bad_input_is_refused_with_the_field_and_the_number(
    changes: dict[str, object], message: str
) -> None:
    right: dict[str, object] = {"cycle_time": 1.0, "duty_factor": 0.5, "phase_offsets": TROT}
    with pytest.raises(InputError, match=message):
        GaitSchedule(**{**right, **changes})  # type: ignore[arg-type]


def test_remainder_of_a_rounding_error_is_the_start_of_the_cycle() -> None:
    assert -1e-17 % 1.0 == 1.0
    assert GaitSchedule(1.0, 0.5, {**TROT, "LF": -1e-17 % 1.0}) == GaitSchedule(1.0, 0.5, TROT)
    assert GaitSchedule(1.0, 0.5, {**TROT, "LF": -1e-17}) == GaitSchedule(1.0, 0.5, TROT)


def test_times_that_are_no_times_are_refused() -> None:
    trot = GaitSchedule(1.0, 0.5, TROT)
    with pytest.raises(InputError, match="times must be finite"):
        trot.support([0.0, np.nan])
    for wrong in (0.0, -1.0, np.inf, 1e6):
        with pytest.raises(InputError, match="duration must be a number from 1e-09 to 100000 s"):
            trot.intervals(wrong)


def test_a_file_with_other_entries_is_refused() -> None:
    values = GaitSchedule(1.0, 0.5, TROT).to_dict()
    with pytest.raises(InputError, match="has the entries cycle_time, duty_factor, name, phase_of"):
        GaitSchedule.from_dict({**values, "stride": 1.0})
    with pytest.raises(InputError, match="got \\[\\]"):
        GaitSchedule.from_dict([])  # type: ignore[arg-type]
