"""The cycloid of [Wang2024], eqs. (17)-(20), and what was wrong with them."""

from __future__ import annotations

import numpy as np
import pytest

from gaitopt.swing.cycloid import CycloidSwing

LENGTH, HEIGHT, DURATION = 0.5, 0.2, 0.25
LEVEL = CycloidSwing(
    np.array([-0.1, -0.1, 0.0]), np.array([0.2, 0.3, 0.0]), np.array(HEIGHT), np.array(DURATION)
)


def printed_progress(sigma: np.ndarray) -> np.ndarray:
    """Eqs. (17), (18) as they stand in the paper."""
    return (sigma - 2.0 * np.sin(sigma)) / (2.0 * np.pi)


def test_eq_17_as_printed_starts_backwards_and_overshoots_by_a_tenth_of_the_step() -> None:
    sigma = np.linspace(0.0, 2.0 * np.pi, 6001)
    progress = printed_progress(sigma)
    overshoot = np.sqrt(3.0) / (2.0 * np.pi) - 1.0 / 6.0  # at sigma = pi / 3
    assert overshoot == pytest.approx(0.109, abs=5e-5)
    assert progress.min() == pytest.approx(-overshoot, rel=1e-12)
    assert progress.max() == pytest.approx(1.0 + overshoot, rel=1e-12)
    assert sigma[progress.argmin()] == pytest.approx(np.pi / 3.0)


def test_eq_17_as_printed_moves_at_lift_off_and_touch_down() -> None:
    """Backwards, at the mean speed of the step."""
    sigma = np.array([0.0, 1e-6, 2.0 * np.pi - 1e-6, 2.0 * np.pi])
    rates = np.diff(printed_progress(sigma))[[0, 2]] / 1e-6 * 2.0 * np.pi
    np.testing.assert_allclose(rates, -1.0, rtol=1e-6)


def test_corrected_progress_is_that_of_a_rolling_wheel() -> None:
    """A point on the rim of a wheel that rolls one turn."""
    sigma = np.linspace(0.0, 2.0 * np.pi, 101)
    radius = LENGTH / (2.0 * np.pi)
    rolled = radius * np.column_stack([sigma - np.sin(sigma), 1.0 - np.cos(sigma)])
    wheel = CycloidSwing(np.zeros(3), np.array([LENGTH, 0, 0]), np.array(2 * radius), np.array(1.0))
    path = wheel.position(sigma / (2.0 * np.pi))
    np.testing.assert_allclose(path[:, [0, 2]], rolled, rtol=0, atol=1e-15)
    assert wheel.length == pytest.approx(8.0 * radius, rel=1e-12)


def test_eq_19_as_printed_comes_back_to_the_height_of_the_start() -> None:
    """However high the end lies; ours lands on it."""
    sigma = 2.0 * np.pi
    assert HEIGHT * (1.0 - np.cos(sigma)) / 2.0 + 0.0 == pytest.approx(0.0, abs=1e-15)
    up = CycloidSwing(np.zeros(3), np.array([0.3, 0.0, 0.1]), np.array(HEIGHT), np.array(1.0))
    assert up.position(1.0)[2] == 0.1


def test_eq_19_with_z_for_y_is_the_lift() -> None:
    t = np.linspace(0.0, DURATION, 51)
    sigma = 2.0 * np.pi * t / DURATION
    z = LEVEL.position(t)[:, 2]
    np.testing.assert_allclose(z, HEIGHT * (1.0 - np.cos(sigma)) / 2.0, rtol=0, atol=1e-15)


def test_foot_is_fastest_in_the_middle_at_twice_the_mean_speed() -> None:
    assert LEVEL.peak_speed == 2.0 * LENGTH / DURATION
    np.testing.assert_allclose(
        LEVEL.velocity(DURATION / 2.0),
        [2.0 * 0.3 / DURATION, 2.0 * 0.4 / DURATION, 0.0],
        atol=1e-14,
    )


@pytest.mark.parametrize("ratio", [0.46, 0.5, 1.0, 10.0, 200.0])
def test_a_tall_swing_is_fastest_on_its_way_up_and_down(ratio: float) -> None:
    """The closed form against the speeds of very many samples."""
    height = ratio * LENGTH
    tall = CycloidSwing(np.zeros(3), np.array([LENGTH, 0, 0]), np.array(height), np.array(DURATION))
    speeds = np.linalg.norm(tall.velocity(np.linspace(0.0, DURATION / 2.0, 400_001)), axis=-1)
    assert tall.peak_speed == pytest.approx(speeds.max(), rel=1e-10)
    assert tall.peak_speed > 2.0 * LENGTH / DURATION


def test_the_two_closed_forms_of_the_peak_speed_meet() -> None:
    heights = np.sqrt(2.0) * LENGTH / np.pi * np.array([1.0 - 1e-9, 1.0 + 1e-9])
    low, tall = CycloidSwing(
        np.zeros(3), np.array([LENGTH, 0, 0]), heights, np.array(DURATION)
    ).peak_speed
    assert low == pytest.approx(tall, rel=1e-8)


def test_stepping_in_place_is_fastest_at_a_quarter_of_the_swing() -> None:
    still = CycloidSwing(np.zeros(3), np.zeros(3), np.array(HEIGHT), np.array(DURATION))
    assert still.peak_speed == pytest.approx(np.pi * HEIGHT / DURATION, rel=1e-15)


def test_level_and_uneven_swings_go_together() -> None:
    ends = np.array([[0.5, 0.0, 0.0], [0.5, 0.0, 0.1]])
    both = CycloidSwing(np.zeros(3), ends, np.array(0.02), np.array(1.0)).peak_speed
    assert both[0] == 1.0
    alone = CycloidSwing(np.zeros(3), ends[1], np.array(0.02), np.array(1.0)).peak_speed
    assert both[1] == pytest.approx(alone, rel=1e-14)


def test_acceleration_at_the_ends_is_upward_only() -> None:
    up = 2.0 * np.pi**2 * HEIGHT / DURATION**2
    for t in (0.0, DURATION):
        np.testing.assert_allclose(LEVEL.acceleration(t), [0.0, 0.0, up], rtol=1e-14)
        assert not LEVEL.velocity(t).any()


def test_figure_11_at_a_trot_and_at_a_walk() -> None:
    """The paper's swings between (-10, -10) and (40, 40), 20 high: the period is 1 s."""
    ends = np.array([-10.0, -10.0, 0.0]), np.array([40.0, 40.0, 0.0])
    trot, walk = (CycloidSwing(*ends, np.array(20.0), np.array(mu)) for mu in (0.5, 0.25))
    t = np.linspace(0.0, 0.25, 26)
    np.testing.assert_allclose(trot.position(2.0 * t), walk.position(t), rtol=0, atol=1e-13)
    assert trot.position(0.25).tolist() == [15.0, 15.0, 20.0]
    assert walk.peak_speed == pytest.approx(2.0 * trot.peak_speed, rel=1e-15)
