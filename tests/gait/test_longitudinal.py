"""The longitudinal margin: its closed forms, the best leg order, and the convex hull as judge."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gaitopt.conventions import LEGS
from gaitopt.errors import InputError
from gaitopt.gait.crawl import CRAWL_SEQUENCES, WANG_SEQUENCE
from gaitopt.gait.gaits import bound, crawl, pace, quasi_static, trot, walk, wave
from gaitopt.gait.longitudinal import longitudinal_margin, margin_over_duty, wave_margin_over_duty
from gaitopt.gait.schedule import GaitSchedule

share = st.floats(0.0, 1.0, exclude_max=True)
offsets = st.tuples(share, share, share, share).map(lambda s: dict(zip(LEGS, s, strict=True)))
duty = st.floats(0.75, 0.99)
BEST = CRAWL_SEQUENCES.index(WANG_SEQUENCE)


def ends_of_intervals(schedule: GaitSchedule) -> np.ndarray:
    return np.append(schedule.edges, schedule.edges[0] + 1.0)


def closest(schedule: GaitSchedule) -> float:
    """The shortest support of a cycle, as a share of it."""
    return float(np.diff(ends_of_intervals(schedule)).min())


def sampled_margin(
    schedule: GaitSchedule, stride: float, length: float, times: np.ndarray, width: float = 0.3
) -> float:
    """The least margin at some times, by cutting the feet's polygon with the middle line."""
    least = np.inf
    corners = np.array([[length / 2 if leg[1] == "F" else -length / 2,
                         width / 2 if leg[0] == "L" else -width / 2] for leg in LEGS])  # fmt: skip
    age = schedule.leg_phases(times * schedule.cycle_time)
    for ages, standing in zip(age, schedule.support(times * schedule.cycle_time), strict=True):
        feet = corners + np.outer(stride * (schedule.duty_factor / 2 - ages), [1.0, 0.0])
        feet = feet[standing]
        cuts = [a[0] + (b[0] - a[0]) * a[1] / (a[1] - b[1])
                for a in feet for b in feet if a[1] > 0 > b[1]]  # fmt: skip
        least = min(least, *([max(cuts), -min(cuts)] if cuts else [-np.inf]))
    return float(least)


@given(offsets, st.floats(0.05, 0.97), st.floats(0.0, 2.0), st.floats(0.1, 2.0))
def test_margin_is_never_above_and_comes_close_to_that_at_many_instants(
    shares: dict[str, float], beta: float, stride: float, length: float
) -> None:
    schedule = GaitSchedule(1.0, beta, shares)
    exact = longitudinal_margin(schedule, stride, length)
    edges = ends_of_intervals(schedule)
    inside = edges[:-1, None] + np.diff(edges)[:, None] * np.array([1e-6, 0.3, 0.7, 1 - 1e-6])
    inside = inside[np.diff(edges) > 1e-4]
    sampled = sampled_margin(schedule, stride, length, inside.ravel())
    if closest(schedule) > 1e-4:
        assert sampled == pytest.approx(exact, abs=1e-5)
    else:
        assert exact <= sampled + 1e-9


@given(duty, st.floats(0.01, 2.0), st.floats(1.0, 5.0))
def test_evenly_spaced_crawls_have_their_closed_forms(
    beta: float, stride: float, slenderness: float
) -> None:
    """stride (duty - c) / 2, where only the best order has c = 3/4."""
    found = margin_over_duty(CRAWL_SEQUENCES, [beta], stride, slenderness * stride)[:, 0]
    constants = np.sort(beta - 2.0 * found / stride)
    expected = [3 / 4, 1, 1, 5 / 4, 5 / 4, 5 / 4]
    np.testing.assert_allclose(constants, expected, rtol=0, atol=1e-7)
    assert found.argmax() == BEST


def test_the_order_of_mcghee_and_frank_is_best_at_all_duty_factors() -> None:
    duties = np.linspace(0.75, 0.999, 250)
    for length in (0.3, 0.45, 1.0, 3.0):
        found = margin_over_duty(CRAWL_SEQUENCES, duties, 0.3, length)
        others = np.delete(found, BEST, axis=0)
        assert (found[BEST] > others.max(axis=0) + 0.01 * 0.3).all()
        assert (others < 0).all() and (found[BEST, 1:] > 0).all()


@given(st.floats(0.5, 0.99), st.floats(0.01, 2.0), st.floats(0.2, 5.0))
def test_wave_has_the_margin_of_mcghee_and_frank(
    beta: float, stride: float, slenderness: float
) -> None:
    """stride (duty - 3/4), until the feet of hind and front legs come too near to each other."""
    length = slenderness * stride
    found = longitudinal_margin(wave(1.0, beta), stride, length)
    expected = min(stride * (beta - 0.75), (length - stride * (beta - 0.5)) / 2)
    if slenderness >= 1.0:
        assert expected == stride * (beta - 0.75)
    assert found == pytest.approx(expected, abs=1e-8 * stride)


@given(offsets, duty, st.floats(1.0, 5.0))
def test_no_regular_gait_is_more_stable_than_the_wave(
    shares: dict[str, float], beta: float, length: float
) -> None:
    any_gait = longitudinal_margin(GaitSchedule(1.0, beta, shares), 1.0, length)
    assert any_gait <= longitudinal_margin(wave(1.0, beta), 1.0, length) + 1e-8


@pytest.mark.parametrize("beta", [0.76, 0.85, 0.95])
def test_no_regular_gait_near_the_wave_is_more_stable(beta: float) -> None:
    """The neighbourhood, which random offsets hardly ever meet."""
    rng = np.random.default_rng(7)
    best = wave(1.0, beta)
    top = longitudinal_margin(best, 1.0, 1.5)
    for size in (1e-3, 1e-2, 1e-1):
        for moves in rng.uniform(-size, size, (200, 4)):
            shares = {leg: (best.phase_offsets[leg] + m) % 1.0
                      for leg, m in zip(LEGS, moves, strict=True)}  # fmt: skip
            near = longitudinal_margin(GaitSchedule(1.0, beta, shares), 1.0, 1.5)
            # A shift in common is no other gait.
            apart = np.ptp(moves)
            assert near < top if apart > 1e-6 else near <= top + 1e-12


def test_wave_is_twice_as_stable_as_the_same_order_evenly_spaced() -> None:
    duties = np.linspace(0.75, 0.99, 9)
    even = margin_over_duty([WANG_SEQUENCE], duties, 0.4, 0.5)[0]
    np.testing.assert_allclose(wave_margin_over_duty(duties, 0.4, 0.5), 2 * even, atol=1e-8)


def test_critical_walk_is_just_stable_and_the_trot_tips_by_a_quarter_stride() -> None:
    assert longitudinal_margin(walk(1.0), 0.3, 0.5) == pytest.approx(0.0, abs=1e-12)
    assert longitudinal_margin(trot(1.0), 0.4, 0.5) == pytest.approx(-0.1, abs=1e-12)


@given(st.floats(0.5, 0.75))
def test_quasi_static_gaits_go_from_the_trots_margin_to_the_walks(beta: float) -> None:
    found = longitudinal_margin(quasi_static(1.0, beta), 1.0, 2.0)
    assert found == pytest.approx(beta - 0.75, abs=1e-8)


def test_without_support_on_both_sides_there_is_no_margin() -> None:
    assert longitudinal_margin(pace(1.0), 0.3, 0.5) == -np.inf
    assert longitudinal_margin(trot(1.0, 0.45), 0.3, 0.5) == -np.inf


def test_standing_on_the_front_feet_the_robot_tips_by_half_its_length_and_more() -> None:
    found = longitudinal_margin(bound(1.0), 0.2, 0.5)
    assert found == pytest.approx(-(0.25 + 0.05), abs=1e-12)


@given(offsets, duty, share, st.floats(0.1, 10.0))
def test_margin_scales_and_does_not_depend_on_the_start_of_the_cycle_or_its_time(
    shares: dict[str, float], beta: float, shift: float, scale: float
) -> None:
    one = longitudinal_margin(GaitSchedule(1.0, beta, shares), 0.3, 0.5)
    turned = {leg: (s + shift) % 1.0 for leg, s in shares.items()}
    other = longitudinal_margin(GaitSchedule(3.0, beta, turned), 0.3 * scale, 0.5 * scale)
    # Snapping may take or leave an instant in which another set of feet stands.
    if closest(GaitSchedule(1.0, beta, shares)) > 1e-8:
        assert other == pytest.approx(scale * one, abs=1e-7 * scale)


@given(offsets, duty)
def test_walking_backwards_is_as_stable(shares: dict[str, float], beta: float) -> None:
    """Time reversed, with front and hind exchanged, is the same support under the same body."""
    swap = {"LF": "LH", "LH": "LF", "RF": "RH", "RH": "RF"}
    back = {swap[leg]: -(s + beta) % 1.0 for leg, s in shares.items()}
    if closest(GaitSchedule(1.0, beta, shares)) > 1e-8:
        there, here = (longitudinal_margin(GaitSchedule(1.0, beta, s), 0.3, 0.5)
                       for s in (back, shares))  # fmt: skip
        assert there == pytest.approx(here, abs=1e-7)


def test_many_at_once_are_those_one_by_one() -> None:
    duties = [0.75, 0.8, 0.93]
    found = margin_over_duty(CRAWL_SEQUENCES, duties, 0.25, 0.6)
    assert found.shape == (6, 3)
    for i, order in enumerate(CRAWL_SEQUENCES):
        for j, beta in enumerate(duties):
            assert found[i, j] == longitudinal_margin(crawl(order, 2.0, beta), 0.25, 0.6)
    assert margin_over_duty([], duties, 0.25, 0.6).shape == (0, 3)
    assert margin_over_duty(CRAWL_SEQUENCES, [], 0.25, 0.6).shape == (6, 0)


def test_bad_numbers_are_refused() -> None:
    with pytest.raises(InputError, match=r"stride must be a number from 0 to .* m, got -1"):
        longitudinal_margin(walk(1.0), -1, 0.5)
    with pytest.raises(InputError, match=r"length must be a number .* m, got 0"):
        longitudinal_margin(walk(1.0), 0.1, 0)
    with pytest.raises(InputError, match=r"crawl needs a duty_factor of 0.75 or more"):
        margin_over_duty(CRAWL_SEQUENCES, [0.8, 0.7], 0.1, 0.5)
    with pytest.raises(InputError, match=r"duties must have the shape \(D,\), got \(1, 1\)"):
        margin_over_duty(CRAWL_SEQUENCES, [[0.8]], 0.1, 0.5)
