"""Piecewise quintics through exact states, refined until they are accurate."""

from __future__ import annotations

import numpy as np
import pytest

from gaitopt import SolverError
from gaitopt.conventions import FloatArray
from gaitopt.motion.differences import time_derivatives
from gaitopt.motion.pieces import States
from gaitopt.motion.smooth_path import smooth_path


def sine(times: FloatArray, inside: FloatArray) -> States:
    """One column: the sine of the time."""
    return np.sin(times)[:, None], np.cos(inside)[:, None], -np.sin(inside)[:, None]


def error(times: FloatArray, values: FloatArray) -> FloatArray:
    return np.abs(values[:, 0] - np.sin(times))


@pytest.mark.parametrize("tolerance", [1e-4, 1e-8])
def test_intervals_are_halved_until_the_error_is_small(tolerance: float) -> None:
    path = smooth_path(np.array([0.0, 2.0, 7.0]), sine, error, tolerance)
    times = np.linspace(0.0, 7.0, 1001)
    assert error(times, path.evaluate(times)).max() < 1.1 * tolerance
    assert path.jumps(2).max() < 1e-8


def test_a_finer_tolerance_takes_more_knots() -> None:
    counts = [len(smooth_path(np.array([0.0, 7.0]), sine, error, t).times) for t in (1e-4, 1e-8)]
    assert counts[0] < counts[1]


def test_a_motion_with_a_jump_has_no_smooth_path() -> None:
    def step(times: FloatArray, inside: FloatArray) -> States:
        zero = np.zeros((len(times), 1))
        return (times > 1.0 / 3.0).astype(float)[:, None], zero, zero

    def wrong(times: FloatArray, values: FloatArray) -> FloatArray:
        return np.abs(values[:, 0] - (times > 1.0 / 3.0))

    with pytest.raises(SolverError, match="leaves its path"):
        smooth_path(np.array([0.0, 1.0]), step, wrong, 1e-6)


def test_differences_are_the_derivatives_of_a_sine() -> None:
    times = np.linspace(0.0, 6.0, 50)
    first, second = time_derivatives(np.sin, times)
    assert first == pytest.approx(np.cos(times), abs=1e-10)
    assert second == pytest.approx(-np.sin(times), abs=1e-6)


def test_velocities_of_the_quickest_knees_are_known_to_a_millionth() -> None:
    """They turn at 40 rad/s, to and fro 32 times a second. More would be a jump at a knot."""
    times = np.linspace(0.0, 0.1, 200)
    first, _ = time_derivatives(lambda t: 0.2 * np.sin(200.0 * t), times)
    assert np.abs(first - 40.0 * np.cos(200.0 * times)).max() < 5e-7
