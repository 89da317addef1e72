"""The papers' leg numbers, and arrays in their orders."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gaitopt.conventions import LEGS
from gaitopt.errors import InputError
from gaitopt.robots.numbering import (
    NUMBERINGS,
    from_paper_order,
    leg_of,
    number_of,
    renumber,
    to_paper_order,
)

each_numbering = pytest.mark.parametrize("numbering", NUMBERINGS)
papers = st.sampled_from(sorted(NUMBERINGS))


@each_numbering
def test_each_paper_numbers_each_leg_once(numbering: str) -> None:
    assert sorted(NUMBERINGS[numbering]) == [1, 2, 3, 4]
    assert sorted(NUMBERINGS[numbering].values()) == sorted(LEGS)


def test_wang_2020_numbers_agree_with_the_signs_of_eq_9() -> None:
    """alpha = 1 (ahead) for legs 2 and 4; beta = 1 (left) for legs 3 and 4."""
    table = NUMBERINGS["wang2020"]
    assert {i for i, leg in table.items() if leg[1] == "F"} == {2, 4}
    assert {i for i, leg in table.items() if leg[0] == "L"} == {3, 4}


def test_wang_2024_walks_left_front_right_rear_right_front_left_rear_as_1_4_3_2() -> None:
    assert [leg_of(i, "wang2024") for i in (1, 4, 3, 2)] == ["LF", "RH", "RF", "LH"]


def test_xiling_numbers_run_counter_clockwise_from_above() -> None:
    places = {"LF": (1, 1), "LH": (-1, 1), "RH": (-1, -1), "RF": (1, -1)}  # x forward, y left
    angles = [np.arctan2(*places[leg_of(i, "xiling")][::-1]) for i in (1, 2, 3, 4)]
    turns = np.diff(np.unwrap(angles))
    np.testing.assert_allclose(turns, np.pi / 2, rtol=0, atol=1e-15)


@each_numbering
@pytest.mark.parametrize("leg", LEGS)
def test_names_and_numbers_lead_back_to_each_other(numbering: str, leg: str) -> None:
    assert leg_of(number_of(leg, numbering), numbering) == leg


@pytest.mark.parametrize(
    ("number", "source", "target", "expected"),
    [(1, "xiling", "wang2020", 4), (2, "wang2020", "wang2024", 3), (4, "wang2024", "xiling", 3)],
)
def test_known_renumberings(number: int, source: str, target: str, expected: int) -> None:
    assert renumber(number, source, target) == expected


@given(st.integers(1, 4), papers, papers, papers)
def test_renumbering_does_not_depend_on_the_way(number: int, a: str, b: str, c: str) -> None:
    assert renumber(renumber(number, a, b), b, c) == renumber(number, a, c)
    assert renumber(renumber(number, a, b), b, a) == number


@each_numbering
def test_arrays_in_a_papers_order_begin_with_its_leg_1(numbering: str) -> None:
    names = [leg_of(i, numbering) for i in range(1, 5)]
    assert to_paper_order(LEGS, numbering).tolist() == names
    assert from_paper_order(names, numbering).tolist() == list(LEGS)


@each_numbering
@pytest.mark.parametrize("axis", [0, 1, 2, -1])
def test_orders_lead_back_to_each_other_along_any_axis(numbering: str, axis: int) -> None:
    array = np.random.default_rng(0).normal(size=(4, 4, 4))
    there = to_paper_order(array, numbering, axis)
    np.testing.assert_array_equal(from_paper_order(there, numbering, axis), array)
    for number in range(1, 5):
        leg = LEGS.index(leg_of(number, numbering))
        np.testing.assert_array_equal(np.take(there, number - 1, axis), np.take(array, leg, axis))


@each_numbering
def test_numbers_of_numpy_are_numbers(numbering: str) -> None:
    assert leg_of(np.int64(2), numbering) == leg_of(2, numbering)


@pytest.mark.parametrize("number", [0, 5, -1, True, 1.0, "1", None, np.bool_(True)])
def test_unknown_numbers_are_refused(number: Any) -> None:
    with pytest.raises(InputError) as caught:
        leg_of(number, "wang2024")
    assert str(caught.value) == (
        f"wang2024 numbers its legs 1 LF, 2 LH, 3 RF, 4 RH; there is no {number!r}"
    )


def test_unknown_legs_papers_and_axes_are_refused() -> None:
    with pytest.raises(InputError, match="there is no leg 'XL'; legs are LF, LH, RH, RF"):
        number_of("XL", "xiling")
    with pytest.raises(InputError, match="numbering 'wang'; known are wang2020, xiling, wang2024"):
        renumber(1, "wang", "xiling")
    with pytest.raises(InputError, match=r"axis 1 must run over four legs, .* shape is \(4, 3\)"):
        to_paper_order(np.zeros((4, 3)), "xiling", 1)
    with pytest.raises(InputError, match=r"axis 2 must run over four legs"):
        from_paper_order(np.zeros((4, 3)), "xiling", 2)
