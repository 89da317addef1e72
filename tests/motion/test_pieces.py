"""Paths stretched, cut and joined; quintics through given states."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import BPoly

from gaitopt import MotionPath
from gaitopt.motion.pieces import cut, cut_at, joined, quintic_hermite, stretched


@settings(max_examples=30)
@given(st.integers(0, 2**32 - 1), st.floats(0.2, 5.0), st.floats(0.05, 1.0))
def test_cutting_keeps_a_path_and_stretching_its_shape(
    seed: int, factor: float, longest: float
) -> None:
    rng = np.random.default_rng(seed)
    path = MotionPath(np.array([0.0, 0.4, 1.3]), rng.normal(size=(6, 2, 9)))
    t = np.linspace(0.0, 1.3, 57)
    parts = cut(path, longest)
    assert np.diff(parts.times).max() <= longest + 1e-12
    assert parts.evaluate(t) == pytest.approx(path.evaluate(t), abs=1e-9)
    assert stretched(path, factor).evaluate(factor * t) == pytest.approx(path.evaluate(t), abs=1e-9)


def test_a_path_with_further_knots_is_the_same() -> None:
    path = MotionPath(np.array([0.0, 0.4, 1.3]), np.random.default_rng(1).normal(size=(6, 2, 9)))
    t = np.linspace(0.0, 1.3, 57)
    more = cut_at(path, np.array([0.5, 0.1, 1.2]))
    assert more.times == pytest.approx([0.0, 0.1, 0.4, 0.5, 1.2, 1.3], abs=0.0)
    assert more.evaluate(t) == pytest.approx(path.evaluate(t), abs=1e-9)
    same = cut_at(path, np.zeros(0))
    assert np.array_equal(same.times, path.times)
    assert np.array_equal(same.coefficients, path.coefficients)


def test_joined_paths_follow_one_another() -> None:
    rng = np.random.default_rng(2)
    one = MotionPath(np.array([0.0, 0.1, 2.0]), rng.normal(size=(4, 2, 3)))
    two = MotionPath(np.array([0.0, 9.0]), rng.normal(size=(6, 1, 3)) * 1e-3)
    both = joined([one, two])
    assert both.degree == 5 and both.duration == pytest.approx(11.0)
    t = np.linspace(0.01, 1.99, 23)
    assert both.evaluate(t) == pytest.approx(one.evaluate(t), abs=1e-9)
    t = np.linspace(0.01, 9.0, 23)
    assert both.evaluate(2.0 + t) == pytest.approx(two.evaluate(t), abs=1e-6)
    assert np.diff(both.times).max() <= 30.0 * 0.1 + 1e-9


def test_quintics_are_those_of_scipy() -> None:
    """``BPoly.from_derivatives``, for states that do not jump at knots."""
    rng = np.random.default_rng(3)
    times = np.concatenate([[0.0], np.cumsum(rng.uniform(0.1, 1.0, 5))])
    states = rng.normal(size=(3, 6, 4))
    ours = MotionPath(
        times,
        quintic_hermite(np.diff(times), tuple(states[:, :-1]), tuple(states[:, 1:])),  # type: ignore[arg-type]
    )
    scipys = BPoly.from_derivatives(times, np.moveaxis(states, 0, 1))
    t = np.linspace(0.0, times[-1], 301)
    for order in range(3):
        assert ours.evaluate(t, order) == pytest.approx(scipys(t, order), abs=1e-8)
