"""Piecewise polynomials over time."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.interpolate import PPoly

from gaitopt import InputError, MotionPath
from gaitopt.motion.path import IN_CACHE, derived
from gaitopt.robots.rotations import rpy_rates_to_angular, rpy_to_matrix, rpy_to_quaternion

Array = NDArray[np.float64]


@pytest.mark.parametrize("degree", [0, 1, 2, 3, 5])
def test_values_and_derivatives_are_scipys(degree: int) -> None:
    rng = np.random.default_rng(degree)
    times = np.concatenate([[0.0], np.cumsum(rng.uniform(0.1, 1.0, 6))])
    coefficients = rng.normal(size=(degree + 1, 6, 4))
    path, other = MotionPath(times, coefficients), PPoly(coefficients, times)
    t = rng.uniform(0, times[-1], 200)
    for derivative in range(degree + 2):
        assert (path.evaluate(t, derivative) == other(t, derivative)).all()
        assert (derived(coefficients, derivative) == other.derivative(derivative).c).all()


def test_values_at_many_instants_are_those_at_one_after_the_other() -> None:
    rng = np.random.default_rng(0)
    path = MotionPath(np.array([0.0, 0.4, 1.0]), rng.normal(size=(4, 2, 3)))
    t = rng.uniform(0.0, 1.0, 2 * IN_CACHE + 7)
    each = np.concatenate([path.evaluate([time], 1) for time in t[::101]])
    assert (path.evaluate(t, 1)[::101] == each).all()
    assert (path.evaluate(t.reshape(5, -1), 1).reshape(len(t), 3) == path.evaluate(t, 1)).all()


def test_a_polyline_passes_through_its_knots_and_is_straight_between() -> None:
    times, values = np.array([0.0, 1.0, 3.0]), np.array([[0.0, 1], [2, 1], [0, 5]])
    path = MotionPath.polyline(times, values)
    assert path.degree == 1 and path.duration == 3.0
    assert path.knots() == pytest.approx(values)
    assert path.evaluate([2.0]) == pytest.approx(np.array([[1.0, 3.0]]))
    assert path.evaluate([0.5, 1.0], 1) == pytest.approx(np.array([[2.0, 0], [-1, 2]]))


def test_a_single_knot_stands_still() -> None:
    path = MotionPath.polyline([0.0], [[1.0, 2.0]])
    assert path.duration == 0.0
    assert path.evaluate([0.0]) == pytest.approx(np.array([[1.0, 2.0]]))
    assert not path.evaluate([0.0], 1).any()


def test_times_beyond_the_ends_are_moved_to_them() -> None:
    path = MotionPath.polyline([0.0, 1.0], [[0.0], [1.0]])
    assert path.evaluate([-1.0, 2.0]).ravel() == pytest.approx([0.0, 1.0])


@pytest.mark.parametrize(
    ("times", "coefficients", "words"),
    [
        ([0.0, 1.0, 1.0], np.zeros((2, 2, 3)), "increase"),
        ([0.5, 1.0], np.zeros((2, 1, 3)), "start at 0"),
        ([0.0, 1.0], np.zeros((2, 2, 3)), "needs 1 segments"),
        ([0.0, 1.0], np.full((2, 1, 3), np.nan), "finite"),
        ([0.0, np.inf], np.zeros((2, 1, 3)), "finite"),
        ([0.0, 1.0], np.zeros((1, 3)), "coefficients"),
    ],
)
def test_what_is_no_path(times: Array, coefficients: Array, words: str) -> None:
    with pytest.raises(InputError, match=words):
        MotionPath(np.array(times), coefficients)


def test_a_path_cannot_be_changed() -> None:
    path = MotionPath.polyline([0.0, 1.0], [[0.0], [1.0]])
    with pytest.raises(ValueError, match="read-only"):
        path.times[0] = 1.0
    with pytest.raises(ValueError, match="read-only"):
        path.coefficients[0, 0, 0] = 1.0


angles = st.lists(st.floats(-1.5, 1.5), min_size=3, max_size=3)


@given(angles)
def test_roll_pitch_yaw_is_pinocchios(rpy: list[float]) -> None:
    matrix = rpy_to_matrix(np.array(rpy))
    assert matrix == pytest.approx(pin.rpy.rpyToMatrix(*rpy), abs=1e-12)
    quaternion = rpy_to_quaternion(np.array(rpy))
    x, y, z, w = quaternion
    assert pin.Quaternion(w, x, y, z).toRotationMatrix() == pytest.approx(matrix, abs=1e-12)


@given(angles, angles)
def test_body_rates_are_pinocchios(rpy: list[float], rates: list[float]) -> None:
    jacobian = pin.rpy.computeRpyJacobian(np.array(rpy), pin.LOCAL)
    ours = rpy_rates_to_angular(np.array(rpy), np.array(rates))
    assert ours == pytest.approx(jacobian @ np.array(rates), abs=1e-12)
