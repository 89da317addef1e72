"""The s(t) of [XiLing], Module C, with a trapezoidal velocity."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import trapezoid

from gaitopt.errors import InputError
from gaitopt.swing.trapezoid import TrapezoidSwing

LENGTH, HEIGHT, DURATION = 0.3, 0.08, 0.5


def level(ramp: float, height: float = HEIGHT) -> TrapezoidSwing:
    return TrapezoidSwing(
        np.zeros(3), np.array([LENGTH, 0.0, 0.0]), np.array(height), np.array(DURATION), ramp
    )


@given(st.floats(0.001, 0.5))
def test_velocity_is_a_trapezoid_whose_area_is_the_step(ramp: float) -> None:
    s = np.linspace(0.0, 1.0, 101)
    plateau = LENGTH / DURATION / (1.0 - ramp)
    forward = level(ramp).velocity(s * DURATION)[:, 0]
    expected = plateau * np.minimum(np.minimum(s, 1.0 - s) / ramp, 1.0)
    np.testing.assert_allclose(forward, expected, rtol=0, atol=1e-12)
    corners = np.array([0.0, ramp, 1.0 - ramp, 1.0]) * DURATION
    speeds = level(ramp).velocity(corners)[:, 0]
    assert trapezoid(speeds, corners) == pytest.approx(LENGTH, rel=1e-12)


@given(st.floats(0.001, 0.5))
def test_acceleration_is_constant_on_each_ramp(ramp: float) -> None:
    s = np.array([0.0, 0.1, 0.9, 0.999]) * ramp * DURATION
    push = LENGTH / (ramp * (1.0 - ramp)) / DURATION**2
    np.testing.assert_allclose(level(ramp).acceleration(s)[:, 0], push, rtol=1e-13)
    np.testing.assert_allclose(level(ramp).acceleration(DURATION - s)[:, 0], -push, rtol=1e-13)


def test_plateau_has_no_acceleration() -> None:
    assert not level(0.2).acceleration(np.linspace(0.21, 0.79, 30) * DURATION)[:, 0].any()


def test_lift_is_half_a_sine_whose_height_counts_once() -> None:
    """Module C, 4.2 multiplies by h_max twice: 80 mm would rise 6.4 mm."""
    t = np.linspace(0.0, DURATION, 51)
    z = level(0.25).position(t)[:, 2]
    np.testing.assert_allclose(z, HEIGHT * np.sin(np.pi * t / DURATION), rtol=0, atol=1e-16)


def test_breaks_are_the_ends_of_the_plateau_and_the_apex() -> None:
    np.testing.assert_allclose(level(0.2).breaks, [0.2, 0.5, 0.8], rtol=1e-15)
    assert level(0.5).breaks.tolist() == [0.5]


def test_a_ramp_of_a_third_keeps_the_mean_square_acceleration_least() -> None:
    t = (np.arange(3000) + 0.5) / 3000 * DURATION

    def effort(ramp: float) -> float:
        return float(np.mean(level(ramp).acceleration(t)[:, 0] ** 2))

    default = TrapezoidSwing(
        np.zeros(3), np.array([LENGTH, 0.0, 0.0]), np.array(HEIGHT), np.array(DURATION)
    ).ramp
    assert default == 1.0 / 3.0
    assert effort(default) < min(effort(r) for r in (0.1, 0.2, 0.3, 0.36, 0.4, 0.5))


@pytest.mark.parametrize("ramp", [0.01, 0.2, 0.5])
def test_low_swing_is_fastest_on_its_plateau(ramp: float) -> None:
    low = level(ramp, height=0.0)
    assert low.peak_speed == pytest.approx(LENGTH / DURATION / (1.0 - ramp), rel=1e-14)


def test_tall_swing_is_fastest_as_it_leaves_and_lands() -> None:
    assert level(0.3, height=1.0).peak_speed == pytest.approx(np.pi / DURATION, rel=1e-15)


@pytest.mark.parametrize("ramp", [0.0, -0.1, 0.51, np.nan, None, "steep", [0.2, 0.3]])
def test_a_ramp_that_is_no_share_is_refused(ramp: object) -> None:
    with pytest.raises(InputError) as caught:
        level(ramp)  # type: ignore[arg-type]
    assert str(caught.value) == (
        f"ramp must be a share of the duration from 0.001 to 0.5, got {ramp!r}"
    )
