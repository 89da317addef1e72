"""The box swing of Fig. 5: straight up, straight across, straight down."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from gaitopt.swing.box import box_corners

metre = st.floats(-10.0, 10.0)
place = st.tuples(metre, metre, metre).map(np.array)
height = st.floats(0.0, 1.0)


def test_level_box_is_7_cm_high_and_as_long_as_the_step() -> None:
    corners = box_corners(np.array([0.0, 0.0, 0.0]), np.array([0.1, 0.02, 0.0]), 0.07)
    assert corners.tolist() == [[0, 0, 0], [0, 0, 0.07], [0.1, 0.02, 0.07], [0.1, 0.02, 0]]


@given(place, place, height)
def test_foot_leaves_its_start_and_comes_to_its_end(
    start: np.ndarray, end: np.ndarray, h: float
) -> None:
    corners = box_corners(start, end, h)
    np.testing.assert_array_equal(corners[0], start)
    np.testing.assert_array_equal(corners[3], end)


@given(place, place, height)
def test_sides_are_upright_and_the_top_is_level(
    start: np.ndarray, end: np.ndarray, h: float
) -> None:
    a, b, c, d = box_corners(start, end, h)
    np.testing.assert_array_equal(a[:2], b[:2])
    np.testing.assert_array_equal(c[:2], d[:2])
    assert b[2] == c[2] == max(start[2], end[2]) + h


@given(place, place, height)
def test_walking_back_is_the_same_box_reversed(
    start: np.ndarray, end: np.ndarray, h: float
) -> None:
    there, back = box_corners(start, end, h), box_corners(end, start, h)
    np.testing.assert_array_equal(there, back[::-1])


def test_many_swings_at_once_are_the_swings_one_by_one() -> None:
    rng = np.random.default_rng(0)
    starts, ends = rng.normal(size=(6, 5, 3)), rng.normal(size=(5, 3))
    corners = box_corners(starts, ends, 0.07)
    assert corners.shape == (6, 5, 4, 3)
    for i in range(6):
        for j in range(5):
            np.testing.assert_array_equal(corners[i, j], box_corners(starts[i, j], ends[j], 0.07))


def test_inputs_stay_as_they_were() -> None:
    start, end = np.zeros(3), np.ones(3)
    box_corners(start, end, 0.07)[...] = 9.0
    assert start.tolist() == [0, 0, 0] and end.tolist() == [1, 1, 1]
