"""The named gaits: the papers' orders and offsets, and the way from the trot to the walk."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gaitopt.conventions import LEGS
from gaitopt.errors import InputError
from gaitopt.gait.crawl import CRAWL_SEQUENCES
from gaitopt.gait.gaits import GAITS, bound, crawl, gait, pace, quasi_static, trot, walk, wave
from gaitopt.gait.schedule import GaitSchedule

cycle_time = st.floats(0.05, 20.0)
DIAGONALS = {frozenset(("LF", "RH")), frozenset(("RF", "LH"))}


def cyclic(order: tuple[tuple[str, ...], ...], first: str) -> tuple[str, ...]:
    """The legs of an order without ties, begun at ``first``."""
    legs = tuple(leg for (leg,) in order)
    start = legs.index(first)
    return legs[start:] + legs[:start]


def share_of_feet(schedule: GaitSchedule) -> dict[int, float]:
    """For each number of feet, the share of the cycle for which so many stand."""
    shares: dict[int, float] = {}
    for interval in schedule.intervals(schedule.cycle_time):
        feet = len(interval.support)
        shares[feet] = shares.get(feet, 0.0) + interval.duration / schedule.cycle_time
    return shares


@pytest.mark.parametrize("duty", [0.75, 0.8, 0.95])
def test_walk_swings_lf_rh_rf_lh(duty: float) -> None:
    """The order of [Wang2024], Section 2."""
    schedule = walk(1.0, duty)
    assert cyclic(schedule.order, "LF") == ("LF", "RH", "RF", "LH")
    assert schedule.order[0] == ("RH",)
    assert schedule.phase_offsets["LF"] == 0.0  # the reference phase of Fig. 2
    assert schedule.name == "walk"


def test_critical_walk_never_stands_on_four_feet() -> None:
    """[Wang2024], Fig. 3: at 0.75 and 0.25 there is no support by four feet."""
    critical = walk(1.0)
    assert critical.duty_factor == 0.75
    assert share_of_feet(critical) == pytest.approx({3: 1.0})
    lifts = critical.liftoffs
    for leg, following in zip(["RH", "RF", "LH", "LF"], ["RF", "LH", "LF", "RH"], strict=True):
        assert lifts[following] == critical.touchdowns[leg]


@given(st.floats(0.7501, 0.99), cycle_time)
def test_walk_above_the_critical_form_stands_on_four_feet_four_times_a_cycle(
    duty: float, period: float
) -> None:
    schedule = walk(period, duty)
    found = share_of_feet(schedule)
    assert found == pytest.approx({3: 4.0 * (1.0 - duty), 4: 4.0 * duty - 3.0}, abs=1e-8)
    intervals = schedule.intervals(period)
    assert [len(i.support) for i in intervals] == [4, 3] * 4


@given(st.floats(0.01, 0.7499))
def test_no_gait_of_a_lower_duty_factor_keeps_three_feet_down(duty: float) -> None:
    """The reason why walk refuses it: four legs stand for 4 duty < 3 feet on average."""
    with pytest.raises(InputError, match=r"walk needs a duty_factor of 0.75 or more.*quasi_static"):
        walk(1.0, duty)
    quarters = walk(1.0).phase_offsets
    assert GaitSchedule(1.0, duty, quarters).least_support < 3


def test_trot_has_the_offsets_of_eqs_32_to_35() -> None:
    schedule = trot(0.6)
    assert schedule.duty_factor == 0.5
    assert schedule.phase_offsets == {"LF": 0.0, "RH": 0.0, "RF": 0.5, "LH": 0.5}
    first = schedule.support(np.linspace(0, 0.3, 20, endpoint=False))  # eq. (37)
    second = schedule.support(np.linspace(0.3, 0.6, 20, endpoint=False))  # eq. (38)
    assert (first == [1, 0, 1, 0]).all() and (second == [0, 1, 0, 1]).all()


@given(st.floats(0.3, 0.499))
def test_trot_below_one_half_has_flight_for_the_rest_of_the_cycle(duty: float) -> None:
    """Erratum to [XiLing]: most of the duty factors that it recommends leave the ground."""
    schedule = trot(1.0, duty)
    assert schedule.has_flight and schedule.least_support == 0
    assert share_of_feet(schedule) == pytest.approx({2: 2.0 * duty, 0: 1.0 - 2.0 * duty}, abs=1e-8)
    assert not trot(1.0).has_flight


@given(st.floats(0.501, 0.99))
def test_trot_above_one_half_stands_on_four_feet_in_between(duty: float) -> None:
    expected = {2: 2.0 - 2.0 * duty, 4: 2.0 * duty - 1.0}
    assert share_of_feet(trot(1.0, duty)) == pytest.approx(expected, abs=1e-8)


@pytest.mark.parametrize(
    ("make", "pair"), [(trot, ("LF", "RH")), (pace, ("LF", "LH")), (bound, ("LF", "RF"))]
)
def test_gaits_of_two_pairs(make: Callable[[float], GaitSchedule], pair: tuple[str, str]) -> None:
    schedule = make(1.0)
    other = tuple(leg for leg in LEGS if leg not in pair)
    assert [set(i.support) for i in schedule.intervals(1.0)] == [set(pair), set(other)]


def test_all_legs_of_a_pronk_step_together() -> None:
    schedule = gait("pronk", 0.5)
    assert [(len(i.support), i.duration) for i in schedule.intervals(0.5)] == [
        (4, pytest.approx(0.35)), (0, pytest.approx(0.15))
    ]  # fmt: skip
    assert schedule.order == (LEGS,)


def test_quasi_static_begins_at_the_trot_and_ends_at_the_walk() -> None:
    assert quasi_static(1.0, 0.5) == GaitSchedule(1.0, 0.5, trot(1.0).phase_offsets, "quasi_static")
    assert quasi_static(1.0, 0.75).phase_offsets == walk(1.0).phase_offsets
    assert quasi_static(1.0, 0.75).order == walk(1.0).order


def test_offsets_of_quasi_static_do_not_jump() -> None:
    """Between close duty factors the offsets differ no more than these."""
    duties = np.linspace(0.5, 0.75, 501)
    offsets = np.array([[quasi_static(1.0, d).phase_offsets[leg] for leg in LEGS] for d in duties])
    assert np.abs(np.diff(offsets, axis=0)).max() <= np.diff(duties).max() + 2e-9


@given(st.floats(0.501, 0.749), cycle_time)
def test_quasi_static_stands_on_three_feet_or_on_a_diagonal(duty: float, period: float) -> None:
    schedule = quasi_static(period, duty)
    expected = {2: 3.0 - 4.0 * duty, 3: 4.0 * duty - 2.0}
    assert share_of_feet(schedule) == pytest.approx(expected, abs=1e-8)
    pairs = {frozenset(i.support) for i in schedule.intervals(period) if len(i.support) == 2}
    assert pairs == DIAGONALS
    assert cyclic(schedule.order, "LF") == ("LF", "RH", "RF", "LH")


@pytest.mark.parametrize(
    ("duty", "message"),
    [
        (0.45, "quasi_static needs a duty_factor from 0.5 to 0.75, got 0.45; use trot, which has"),
        (0.8, "quasi_static needs a duty_factor from 0.5 to 0.75, got 0.8; use walk or wave inst"),
    ],
)
def test_quasi_static_names_the_gait_beyond_its_range(duty: float, message: str) -> None:
    with pytest.raises(InputError, match=message):
        quasi_static(1.0, duty)


@given(st.floats(0.5, 0.99), cycle_time)
def test_wave_lifts_a_front_foot_when_the_hind_foot_of_its_side_comes_down(
    duty: float, period: float
) -> None:
    schedule = wave(period, duty)
    for side in "LR":
        lift, touch = schedule.liftoffs[side + "F"], schedule.touchdowns[side + "H"]
        assert min(abs(lift - touch), 1 - abs(lift - touch)) < 3e-9
    for end in "FH":
        apart = abs(schedule.touchdowns["L" + end] - schedule.touchdowns["R" + end])
        assert apart == pytest.approx(0.5, abs=3e-9)


def test_wave_meets_the_trot_the_walk_and_the_quasi_static_gaits() -> None:
    for duty, other in ((0.5, trot(1.0)), (0.75, walk(1.0)), (0.6, quasi_static(1.0, 0.6))):
        assert wave(1.0, duty).phase_offsets == other.phase_offsets
    with pytest.raises(InputError, match=r"wave needs a duty_factor of 0.5 or more, got 0.4"):
        wave(1.0, 0.4)


@pytest.mark.parametrize("sequence", CRAWL_SEQUENCES)
@pytest.mark.parametrize("duty", [0.75, 0.76, 0.9, 0.999])
def test_crawl_swings_in_its_sequence_from_its_first_leg(
    sequence: tuple[str, ...], duty: float
) -> None:
    schedule = crawl(sequence, 2.0, duty)
    assert schedule.order == tuple((leg,) for leg in sequence)
    assert schedule.least_support == 3
    assert schedule.name == "crawl " + " ".join(sequence)
    touch = np.array([schedule.touchdowns[leg] for leg in sequence])
    np.testing.assert_allclose(np.diff(touch) % 1.0, 0.25, atol=1e-12)


def test_walk_is_the_crawl_of_its_order() -> None:
    for duty in (0.75, 0.83):
        order = ("RH", "RF", "LH", "LF")
        assert walk(1.0, duty).phase_offsets == crawl(order, 1.0, duty).phase_offsets


def test_crawl_refuses_what_is_no_crawl() -> None:
    with pytest.raises(InputError, match="must name each of LF, LH, RH, RF once, got LF, LF"):
        crawl(("LF", "LF"), 1.0)
    with pytest.raises(InputError, match=r"crawl needs a duty_factor of 0.75 or more.* got 0.7;"):
        crawl(CRAWL_SEQUENCES[0], 1.0, 0.7)


@pytest.mark.parametrize("name", list(GAITS))
def test_gaits_are_found_by_their_names(name: str) -> None:
    assert gait(name, 0.8) == GAITS[name](0.8)
    assert gait(name, 0.8).name == name
    duty = 0.75 if name != "pace" else 0.4
    assert gait(name, 0.8, duty) == GAITS[name](0.8, duty)


def test_gaits_are_found_in_any_case_and_crawls_by_their_order() -> None:
    assert gait("Pronk", 0.5) == GAITS["pronk"](0.5)
    assert gait("Quasi-Static", 0.5) == GAITS["quasi_static"](0.5)
    order = ("RH", "RF", "LF", "LH")
    assert gait("RH,RF, LF,LH", 1.0) == crawl(order, 1.0)
    assert gait("RR,FR,FL,RL", 1.0, 0.8) == crawl(order, 1.0, 0.8)


def test_an_unknown_gait_is_refused_with_the_names_that_there_are() -> None:
    with pytest.raises(
        InputError,
        match=r"gait must be one of walk, quasi-static, .* order of legs such as RH,RF,LF,LH; got",
    ):
        gait("canter", 1.0)
    with pytest.raises(InputError, match=r"got \['trot'\]"):
        gait(["trot"], 1.0)  # type: ignore[arg-type]
    with pytest.raises(InputError, match="duty_factor must be a number"):
        gait("walk", 1.0, "fast")  # type: ignore[arg-type]
