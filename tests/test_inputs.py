"""Numbers are taken as they are, or refused with their name and what they may be."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gaitopt.errors import InputError
from gaitopt.inputs import (
    check_array,
    check_count,
    check_known,
    check_leads,
    check_number,
    check_numbers,
)

anything = st.floats(allow_nan=True, allow_infinity=True)


@given(anything, anything, anything)
def test_a_number_is_taken_when_it_is_between_both_ends(
    value: float, low: float, high: float
) -> None:
    if low <= value <= high:
        assert check_number("height", value, low, high) == value
        assert check_numbers("heights", [value, value], low, high).tolist() == [value, value]
    else:
        with pytest.raises(InputError, match="height must be a number from"):
            check_number("height", value, low, high)
        with pytest.raises(InputError, match="heights must be from"):
            check_numbers("heights", [value, value], low, high)


@pytest.mark.parametrize(
    "value", [1, 1.0, np.int8(1), np.float32(1.0), np.array(1.0), np.array(1), Fraction(1)]
)
def test_numbers_of_all_kinds_are_floats_afterwards(value: Any) -> None:
    number = check_number("height", value, 0.0, 2.0)
    assert type(number) is float and number == 1.0


@pytest.mark.parametrize(
    "value", [True, np.True_, np.array(True), "1", None, [1.0], np.array([1.0]), 1j, 10**400]
)
def test_what_is_no_number_in_range_is_none(value: Any) -> None:
    with pytest.raises(InputError, match="height must be a number from 0 to 2 m, got"):
        check_number("height", value, 0.0, 2.0, "m")


def test_messages_hold_the_name_the_range_the_unit_and_the_way_out() -> None:
    with pytest.raises(InputError) as caught:
        check_number("speed", "fast", 0.001, 1e3, "m/s", " (or 'max')")
    assert (
        str(caught.value) == "speed must be a number from 0.001 to 1000 m/s, got 'fast' (or 'max')"
    )
    with pytest.raises(InputError) as caught:
        check_number("share", 2, 0.0, 1.0)
    assert str(caught.value) == "share must be a number from 0 to 1, got 2"


def test_of_many_numbers_the_first_bad_one_is_named() -> None:
    with pytest.raises(InputError) as caught:
        check_numbers("times", [[1.0, 2.0], [np.nan, 9.0]], 0.0, 3.0, "s")
    assert str(caught.value) == "times must be from 0 to 3 s, got nan at index (1, 0)"
    with pytest.raises(InputError) as caught:
        check_numbers("times", "now", 0.0, 3.0, "s")
    assert str(caught.value) == "times must be numbers [s], got 'now'"


def test_numbers_within_a_range_keep_their_shape() -> None:
    given_ = np.arange(6).reshape(2, 3)
    taken = check_numbers("places", given_, 0.0, 5.0)
    assert taken.dtype == np.float64 and (taken == given_).all()


@pytest.mark.parametrize("value", [3, np.int64(3), 0, 7])
def test_whole_numbers_are_counts(value: Any) -> None:
    count = check_count("cycles", value, 0, 7)
    assert type(count) is int and count == value


@pytest.mark.parametrize("value", [-1, 8, 3.0, np.float64(3.0), True, "3", None])
def test_all_else_is_no_count(value: Any) -> None:
    with pytest.raises(InputError, match="cycles must be a whole number from 0 to 7, got"):
        check_count("cycles", value, 0, 7)


@pytest.mark.parametrize(
    "values", ["1", ["1", "2"], None, [None], [1j], [[1.0], [1.0, 2.0]], {"a": 1}, object()]
)
def test_what_numpy_would_take_for_numbers_and_is_none(values: Any) -> None:
    with pytest.raises(InputError, match="x must be numbers, got "):
        check_array("x", values)


def test_what_a_mask_hides_is_refused_within_lists_too() -> None:
    hidden = np.ma.masked_array([1.0, 2.0], [False, True])
    for values in (hidden, [hidden, hidden], ([hidden],), [np.ma.masked, 1.0]):
        with pytest.raises(InputError, match="x must be numbers, got "):
            check_array("x", values)
    seen = np.ma.masked_array([1.0, 2.0], [False, False])
    np.testing.assert_array_equal(check_array("x", [seen, seen]), [[1.0, 2.0]] * 2)
    own: list[Any] = []
    own.append(own)
    with pytest.raises(InputError, match="x must be numbers, got "):
        check_array("x", own)


def test_numbers_that_nobody_knows_are_refused_where_they_mean_nothing() -> None:
    with pytest.raises(InputError, match="x must be numbers, and one is NaN"):
        check_known("x", [0.0, float("nan")])
    np.testing.assert_array_equal(check_known("x", [np.inf, -np.inf]), [np.inf, -np.inf])


def test_leading_axes_that_do_not_fit_are_named() -> None:
    assert check_leads(feet=(3, 1), cog=(4,)) == (3, 4)
    with pytest.raises(InputError, match=r"feet \(3,\), cog \(2,\)"):
        check_leads(feet=(3,), cog=(2,))
