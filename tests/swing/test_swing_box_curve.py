"""The box swing in time."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gaitopt.swing.box import box_corners
from gaitopt.swing.box_curve import BoxSwing

height = st.just(0.0) | st.floats(1e-4, 0.3)


def box(end: list[float], h: float, duration: float = 0.8) -> BoxSwing:
    return BoxSwing(np.zeros(3), np.array(end), np.array(h), np.array(duration))


@given(st.floats(-0.3, 0.3), st.floats(-0.3, 0.3), height)
def test_foot_is_at_the_boxs_corners_at_the_breaks_and_at_rest(
    x: float, z: float, h: float
) -> None:
    curve = box([x, 0.1, z], h)
    times = np.array([0.0, *curve.breaks, 1.0]) * 0.8
    corners = box_corners(np.zeros(3), np.array([x, 0.1, z]), h)
    np.testing.assert_allclose(curve.position(times), corners, rtol=0, atol=1e-15)
    np.testing.assert_allclose(curve.velocity(times), 0.0, rtol=0, atol=1e-12)


def test_sides_are_upright_and_the_top_is_level_all_the_way() -> None:
    curve = box([0.2, 0.1, 0.03], 0.07)
    b, c = curve.breaks * 0.8
    up, across, down = (
        curve.position(np.linspace(s, e, 31)) for s, e in ((0, b), (b, c), (c, 0.8))
    )
    np.testing.assert_array_equal(up[:, :2], np.zeros((31, 2)))
    np.testing.assert_allclose(across[:, 2], 0.1, rtol=1e-15)
    np.testing.assert_allclose(down[:, :2], np.broadcast_to([0.2, 0.1], (31, 2)), rtol=1e-15)


def test_every_edge_is_run_with_the_same_largest_acceleration() -> None:
    curve = box([0.3, 0.0, 0.05], 0.07)
    t = np.linspace(0.0, 0.8, 80_001)
    b, c = curve.breaks * 0.8
    size = np.linalg.norm(curve.acceleration(t), axis=-1)
    edges = [size[(t >= s) & (t <= e)].max() for s, e in ((0, b), (b, c), (c, 0.8))]
    np.testing.assert_allclose(edges, edges[0], rtol=1e-6)


def test_a_box_of_one_length_all_round_takes_a_third_for_each_edge() -> None:
    curve = box([0.1, 0.0, 0.0], 0.1)
    np.testing.assert_allclose(curve.breaks, [1 / 3, 2 / 3], rtol=1e-15)
    assert curve.length == pytest.approx(0.3, rel=1e-15)
    assert curve.peak_speed == pytest.approx(1.875 * 0.3 / 0.8, rel=1e-15)


def test_edges_without_length_take_no_time() -> None:
    """And the three of a foot that stands still a third each."""
    assert box([0.2, 0.0, 0.0], 0.0).breaks.tolist() == [0.0, 1.0]  # slides
    assert box([0.0, 0.0, 0.0], 0.1).breaks.tolist() == [0.5, 0.5]  # steps on the spot
    assert box([0.2, 0.0, 0.2], 0.0).breaks.tolist() == [0.5, 1.0]  # climbs
    assert box([0.2, 0.0, -0.2], 0.0).breaks.tolist() == [0.0, 0.5]  # descends
    np.testing.assert_allclose(box([0.0, 0.0, 0.0], 0.0).breaks, [1 / 3, 2 / 3], rtol=1e-15)


def test_a_step_too_short_for_the_clock_does_no_harm() -> None:
    """Its share of the duration is lost in rounding; corners stay in order, derivatives small."""
    rng = np.random.default_rng(4)
    up, down = rng.uniform(0.01, 0.2, (2, 1000))
    ends = np.zeros((1000, 3))
    ends[:, 0] = 10.0 ** rng.uniform(-40, -25, 1000)
    ends[:, 2] = up - down
    curve = BoxSwing(np.zeros(3), ends, np.minimum(up, down), np.array(1.0))
    assert (np.diff(curve.breaks) >= 0.0).all()
    corner = curve.breaks[:, 0] + np.arange(-4, 5)[:, None] * 2.0**-53
    assert np.abs(curve.acceleration(corner)).max() < 10.0
    np.testing.assert_allclose(curve.position(corner)[..., 2] - curve.apex, 0.0, atol=1e-15)


@pytest.mark.parametrize("tiny", [1e-3, 1e-9, 1e-15, 5e-324])
def test_a_tiny_edge_asks_for_no_larger_acceleration(tiny: float) -> None:
    """As it would, were the times in proportion to the lengths.

    The largest acceleration of the quintic is 10 / sqrt(3) ways over the square of the time.
    """
    curve, t = box([0.2, 0.0, 0.0], tiny), np.linspace(0.0, 0.8, 2001)
    largest = 10.0 / np.sqrt(3.0) * (np.sqrt(0.2) + 2.0 * np.sqrt(tiny)) ** 2 / 0.8**2
    assert np.abs(curve.acceleration(t)).max() <= largest * (1.0 + 1e-12)
    assert np.isfinite(curve.jerk(t)).all()
