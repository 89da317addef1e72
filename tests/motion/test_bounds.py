"""Bounds of polynomials hold everywhere, and are reached where Bernstein's theorem says."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import BPoly, PPoly

from gaitopt import MotionPath
from gaitopt.motion.bounds import derivative_range, largest_sizes
from gaitopt.motion.pieces import cut


@settings(max_examples=30)
@given(st.integers(0, 2**32 - 1), st.integers(0, 5), st.integers(0, 3))
def test_no_sample_is_beyond_its_bounds(seed: int, degree: int, derivative: int) -> None:
    rng = np.random.default_rng(seed)
    path = MotionPath(np.array([0.0, 0.7, 1.1]), rng.normal(size=(degree + 1, 2, 9)))
    low, high = derivative_range(path, derivative)
    for k, (a, b) in enumerate(((0.0, 0.7), (0.7, 1.1))):
        sampled = path.evaluate(np.linspace(a, b, 101)[:-1], derivative)
        assert (sampled >= low[k] - 1e-9).all() and (sampled <= high[k] + 1e-9).all()
        assert (np.abs(sampled) <= largest_sizes(path, derivative)[k] + 1e-9).all()


@pytest.mark.parametrize("degree", [0, 1, 3, 5])
def test_bounds_are_the_range_of_scipys_bernstein_coefficients(degree: int) -> None:
    rng = np.random.default_rng(degree)
    times = np.concatenate([[0.0], np.cumsum(rng.uniform(0.1, 1.0, 6))])
    path = MotionPath(times, rng.normal(size=(degree + 1, 6, 4)))
    for derivative in range(degree + 2):
        powers = PPoly(path.coefficients, times).derivative(derivative)
        found = BPoly.from_power_basis(powers).c
        low, high = derivative_range(path, derivative)
        assert (low == found.min(axis=0)).all() and (high == found.max(axis=0)).all()


def test_bounds_of_lines_are_their_ends() -> None:
    path = MotionPath.polyline([0.0, 2.0, 3.0], [[1.0, 0.0], [-1.0, 4.0], [0.0, 4.0]])
    low, high = derivative_range(path)
    np.testing.assert_allclose(low, [[-1.0, 0.0], [-1.0, 4.0]])
    np.testing.assert_allclose(high, [[1.0, 4.0], [0.0, 4.0]])
    np.testing.assert_allclose(largest_sizes(path), [[1.0, 2.0], [1.0, 0.0]])
    assert not largest_sizes(path, 2).any()


def test_bounds_on_short_segments_are_close() -> None:
    """The excess falls with the square of the segments' length."""
    rng = np.random.default_rng(1)
    path = MotionPath(np.array([0.0, 1.0]), rng.normal(size=(6, 1, 4)))
    times = np.linspace(0.0, 1.0, 100_001)
    true = path.evaluate(times).max(axis=0)
    excess = [
        (derivative_range(cut(path, 1.0 / parts))[1].max(axis=0) - true).max()
        for parts in (1, 8, 64)
    ]
    assert excess[1] < excess[0] / 30.0 and excess[2] < excess[1] / 30.0
    assert excess[2] == pytest.approx(0.0, abs=1e-3)


def test_a_single_knot_has_one_row_of_bounds() -> None:
    path = MotionPath.polyline([0.0], [[1.0, -2.0]])
    low, high = derivative_range(path)
    assert low == pytest.approx(np.array([[1.0, -2.0]])) and high == pytest.approx(low)
    assert not largest_sizes(path).any()
