"""The polynomial swing: no velocity and no acceleration at its ends."""

from __future__ import annotations

import numpy as np
import pytest

from gaitopt.swing.curve import smooth_step
from gaitopt.swing.polynomial import PolynomialSwing

LENGTH, HEIGHT, DURATION = 0.3, 0.08, 0.5
LEVEL = PolynomialSwing(
    np.zeros(3), np.array([LENGTH, 0.0, 0.0]), np.array(HEIGHT), np.array(DURATION)
)


def fitted(conditions: list[tuple[float, int, float]]) -> np.polynomial.Polynomial:
    """The polynomial whose derivative of each order takes each value at each place."""
    count = len(conditions)
    basis = [np.polynomial.Polynomial.basis(k) for k in range(count)]
    rows = [[b.deriv(order)(x) if order else b(x) for b in basis] for x, order, _ in conditions]
    return np.polynomial.Polynomial(np.linalg.solve(rows, [value for *_, value in conditions]))


def test_progress_is_the_quintic_that_starts_and_ends_at_rest() -> None:
    quintic = fitted([(0, 0, 0), (0, 1, 0), (0, 2, 0), (1, 0, 1), (1, 1, 0), (1, 2, 0)])
    s = np.linspace(0.0, 1.0, 41)
    foot = LEVEL.position(s * DURATION)
    np.testing.assert_allclose(foot[:, 0], LENGTH * quintic(s), rtol=0, atol=1e-14)
    for order in (1, 2, 3):
        np.testing.assert_allclose(smooth_step(s, order), quintic.deriv(order)(s), atol=1e-11)


def test_lift_is_the_quintic_that_reaches_the_apex_without_velocity_and_jerk() -> None:
    quintic = fitted([(0, 0, 0), (0, 1, 0), (0, 2, 0), (1, 0, 1), (1, 1, 0), (1, 3, 0)])
    u = np.linspace(0.0, 1.0, 41)
    rising, falling = LEVEL.position(u * DURATION / 2), LEVEL.position((2 - u) * DURATION / 2)
    np.testing.assert_allclose(rising[:, 2], HEIGHT * quintic(u), rtol=0, atol=1e-14)
    np.testing.assert_allclose(falling[:, 2], HEIGHT * quintic(u), rtol=0, atol=1e-14)


def test_apex_between_level_ends_has_four_continuous_derivatives() -> None:
    """Odd derivatives of an even function vanish where they are continuous: the first and third.

    The fourth is the jerk's slope, even again.
    """
    middle = DURATION / 2.0
    assert LEVEL.velocity(middle)[2] == 0.0 and LEVEL.jerk(middle)[2] == 0.0
    down = -20.0 / 3.0 * 4.0 * HEIGHT / DURATION**2
    assert LEVEL.acceleration(middle)[2] == pytest.approx(down, rel=1e-14)
    step = 1e-5
    before, at, after = LEVEL.jerk(middle + step * np.array([-1.0, 0.0, 1.0]))[:, 2]
    assert after - at == pytest.approx(at - before, rel=1e-3)


@pytest.mark.parametrize("end", [[0.3, 0.1, 0.2], [0.3, 0.1, -0.2], [0.0, 0.0, 0.1]])
@pytest.mark.parametrize("height", [0.0, 0.05])
def test_ends_are_at_rest_whatever_their_heights(end: list[float], height: float) -> None:
    curve = PolynomialSwing(np.zeros(3), np.array(end), np.array(height), np.array(DURATION))
    assert not curve.velocity([0.0, DURATION]).any()
    assert not curve.acceleration([0.0, DURATION]).any()


def test_low_swing_is_fastest_in_the_middle_at_15_eighths_of_the_mean_speed() -> None:
    assert LEVEL.peak_speed == pytest.approx(15.0 / 8.0 * LENGTH / DURATION, rel=1e-15)


def test_stepping_in_place_is_fastest_where_the_quintic_is_steepest() -> None:
    still = PolynomialSwing(np.zeros(3), np.zeros(3), np.array(HEIGHT), np.array(DURATION))
    u = (15.0 - np.sqrt(33.0)) / 16.0  # root of 6 - 15 u + 8 u^2
    steepest = 40.0 / 3.0 * u**2 * (1.0 - u) * (3.0 - 2.0 * u)
    assert steepest * HEIGHT / DURATION * (1.0 - 1e-6) <= still.peak_speed
    assert still.peak_speed <= steepest * HEIGHT / DURATION * (1.0 + 1e-14)
