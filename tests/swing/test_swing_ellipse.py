"""The sine arch and the half-ellipse of [XiLing], eq. (40), which confuses the two."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.special import ellipe

from gaitopt.swing.ellipse import HalfEllipseSwing
from gaitopt.swing.sine_arch import SineArchSwing

LENGTH, HEIGHT, DURATION = 0.2, 0.07, 0.4
T = np.linspace(0.0, DURATION, 81)
S = T / DURATION
LEVEL = np.zeros(3), np.array([LENGTH, 0.0, 0.0]), np.array(HEIGHT), np.array(DURATION)
ARCH, ELLIPSE = SineArchSwing(*LEVEL), HalfEllipseSwing(*LEVEL)


def ellipse_equation(path: np.ndarray) -> np.ndarray:
    """Is 1 on the ellipse whose semi-axes are half the step and the height."""
    return ((path[:, 0] - LENGTH / 2.0) / (LENGTH / 2.0)) ** 2 + (path[:, 2] / HEIGHT) ** 2


def test_sine_arch_is_eq_40_as_printed() -> None:
    printed = np.column_stack([LENGTH * S, 0.0 * S, HEIGHT * np.sin(np.pi * S)])
    np.testing.assert_allclose(ARCH.position(T), printed, rtol=0, atol=1e-16)


def test_half_ellipse_lies_on_its_ellipse() -> None:
    np.testing.assert_allclose(ellipse_equation(ELLIPSE.position(T)), 1.0, rtol=1e-13)


def test_eq_40_as_printed_is_no_ellipse() -> None:
    """Its feet are inside: at a quarter of the way 1/4 + 1/2 takes the place of 1."""
    inside = ellipse_equation(ARCH.position(T))[1:-1]
    assert (inside[np.arange(len(inside)) != 39] < 1.0).all()
    assert ellipse_equation(ARCH.position([DURATION / 4.0])) == pytest.approx(0.75)


def test_half_ellipse_has_the_circumference_of_half_an_ellipse() -> None:
    long, short = LENGTH / 2.0, HEIGHT
    assert ELLIPSE.length == pytest.approx(
        2.0 * long * ellipe(1.0 - (short / long) ** 2), rel=1e-12
    )


def test_half_ellipse_as_high_as_half_its_step_is_a_half_circle_at_constant_speed() -> None:
    circle = HalfEllipseSwing(*LEVEL[:2], np.array(LENGTH / 2.0), LEVEL[3])
    speeds = np.linalg.norm(circle.velocity(T), axis=-1)
    np.testing.assert_allclose(speeds, np.pi * LENGTH / 2.0 / DURATION, rtol=1e-14)
    assert circle.length == pytest.approx(np.pi * LENGTH / 2.0, rel=1e-14)


def test_sine_arch_has_the_length_of_a_sine() -> None:
    """Its arc length is a complete elliptic integral, too."""
    square = LENGTH**2 + (np.pi * HEIGHT) ** 2
    exact = 2.0 / np.pi * np.sqrt(square) * ellipe((np.pi * HEIGHT) ** 2 / square)
    assert ARCH.length == pytest.approx(exact, rel=1e-12)


def test_sine_arch_lands_with_a_blow_and_its_largest_speed() -> None:
    """The report says that it lands smoothly."""
    forward, up = LENGTH / DURATION, np.pi * HEIGHT / DURATION
    np.testing.assert_allclose(
        ARCH.velocity([0.0, DURATION]), [[forward, 0, up], [forward, 0, -up]]
    )
    assert ARCH.peak_speed == pytest.approx(np.hypot(forward, up), rel=1e-15)
    assert not ARCH.acceleration([0.0, DURATION]).any()


def test_half_ellipse_leaves_and_lands_upright() -> None:
    up, push = np.pi * HEIGHT / DURATION, np.pi**2 / 2.0 * LENGTH / DURATION**2
    np.testing.assert_allclose(ELLIPSE.velocity([0.0, DURATION]), [[0, 0, up], [0, 0, -up]])
    np.testing.assert_allclose(ELLIPSE.acceleration([0.0, DURATION]), [[push, 0, 0], [-push, 0, 0]])


@pytest.mark.parametrize("height", [0.01, 0.0999, 0.1001, 0.3])
def test_half_ellipse_is_fastest_along_its_longer_axis(height: float) -> None:
    curve = HalfEllipseSwing(*LEVEL[:2], np.array(height), LEVEL[3])
    peak = np.pi * max(LENGTH / 2.0, height) / DURATION
    assert curve.peak_speed == pytest.approx(peak, rel=1e-15)
