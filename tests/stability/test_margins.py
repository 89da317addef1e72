"""The static stability margin: known values, symmetries, and the convex hull as judge."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial import ConvexHull

from gaitopt.conventions import rotation_z
from gaitopt.errors import InputError
from gaitopt.stability.margins import static_stability_margin
from gaitopt.stability.support import shrunken_polygon

STANCE = np.array([[0.2, 0.15], [-0.2, 0.15], [-0.2, -0.15], [0.2, -0.15]])
RIGHT_ANGLE = np.array([[0.0, 0.0], [4.0, 0.0], [0.0, 3.0]])


@pytest.mark.parametrize(
    ("cog", "margin"),
    [
        ((1.0, 1.0), 1.0),  # the incentre of 3-4-5
        ((0.5, 1.0), 0.5),
        ((2.0, 1.5), 0.0),  # middle of the hypotenuse
        ((0.0, 0.0), 0.0),
        ((1.0, -0.25), -0.25),
        ((2.0 + 0.6, 1.5 + 0.8), -1.0),  # one metre off the hypotenuse
    ],
)
def test_right_angle_has_known_margins(cog: tuple[float, float], margin: float) -> None:
    assert static_stability_margin(RIGHT_ANGLE, cog) == pytest.approx(margin, abs=1e-15)


def test_standing_on_four_feet_the_margin_is_half_the_width() -> None:
    assert static_stability_margin(STANCE, [0.0, 0.0]) == pytest.approx(0.15, abs=1e-15)
    assert static_stability_margin(STANCE, [0.1, 0.0]) == pytest.approx(0.1, abs=1e-15)


@pytest.mark.parametrize("lifted", range(4))
def test_lifting_a_foot_puts_the_centre_on_the_diagonal(lifted: int) -> None:
    standing = np.delete(STANCE, lifted, axis=0)
    assert static_stability_margin(standing, [0.0, 0.0]) == pytest.approx(0.0, abs=1e-16)
    away = -0.1 * STANCE[lifted]
    across = 0.4 * 0.3 / np.hypot(0.4, 0.3)  # of the lifted foot's corner from the diagonal
    assert static_stability_margin(standing, away) == pytest.approx(0.1 * across, abs=1e-15)


@pytest.mark.parametrize("count", [3, 4, 5, 6])
def test_margin_is_that_of_the_convex_hull(count: int) -> None:
    rng = np.random.default_rng(count)
    for _ in range(200):
        feet, cogs = rng.uniform(-1, 1, (count, 2)), rng.uniform(-1.5, 1.5, (5, 2))
        outward = ConvexHull(feet).equations
        expected = -(outward[:, :2] @ cogs.T + outward[:, 2:]).max(axis=0)
        np.testing.assert_allclose(
            static_stability_margin(feet, cogs), expected, rtol=0, atol=1e-12
        )


@given(
    st.integers(0, 2**32 - 1),
    st.floats(-np.pi, np.pi),
    st.floats(-1e6, 1e6),
    st.floats(-1e6, 1e6),
    st.permutations(range(4)),
)
def test_margin_does_not_depend_on_place_heading_or_order_of_the_feet(
    seed: int, angle: float, x: float, y: float, order: list[int]
) -> None:
    rng = np.random.default_rng(seed)
    feet, cog = rng.uniform(-0.5, 0.5, (4, 2)), rng.uniform(-0.5, 0.5, 2)
    turn, move = rotation_z(angle)[:2, :2], np.array([x, y])
    there = static_stability_margin((feet @ turn.T + move)[order], turn @ cog + move)
    # At 1e6 m a coordinate is only good to 1e-10 m; nearly collinear feet amplify that.
    assert there == pytest.approx(static_stability_margin(feet, cog), abs=1e-6)


@pytest.mark.parametrize("away", [1.0, 1e3, 2.0**19])
def test_margin_a_thousand_kilometres_away_is_the_same_to_the_last_bit(away: float) -> None:
    """With coordinates in whole multiples of 2**-20 m, so that moving them loses nothing."""
    rng = np.random.default_rng(3)
    feet, cogs = (rng.integers(-(2**19), 2**19, shape) / 2**20 for shape in ((4, 2), (50, 2)))
    move = np.array([away, -away])
    here, there = (static_stability_margin(feet + m, cogs + m) for m in (0.0, move))
    np.testing.assert_array_equal(here, there)


def test_scaling_the_robot_scales_the_margin() -> None:
    one = static_stability_margin(RIGHT_ANGLE, [0.7, 0.9])
    assert static_stability_margin(3 * RIGHT_ANGLE, [2.1, 2.7]) == pytest.approx(3 * one, rel=1e-14)


def test_heights_do_not_count() -> None:
    feet = np.column_stack([RIGHT_ANGLE, [0.0, 0.5, -2.0]])
    assert static_stability_margin(feet, [1.0, 1.0, 0.4]) == pytest.approx(1.0, abs=1e-15)


def test_cog_in_the_shrunken_polygon_has_that_margin() -> None:
    rng = np.random.default_rng(5)
    for _ in range(100):
        feet = STANCE + rng.uniform(-0.05, 0.05, STANCE.shape)
        corners = shrunken_polygon(feet, 0.03)
        np.testing.assert_allclose(static_stability_margin(feet, corners), 0.03, rtol=0, atol=1e-12)
        assert static_stability_margin(feet, corners.mean(axis=0)) > 0.03


@pytest.mark.parametrize("angle", np.linspace(0.0, np.pi, 9))
def test_feet_in_one_line_never_stand(angle: float) -> None:
    feet = np.array([0.3, 0.2]) + np.outer([0.0, 0.1, 0.4], rotation_z(angle)[:2, 0])
    off = 0.05 * rotation_z(angle)[:2, 1]
    assert static_stability_margin(feet, feet[1]) == pytest.approx(0.0, abs=1e-15)
    assert static_stability_margin(feet, feet[1] + off) == pytest.approx(-0.05, abs=1e-15)
    assert static_stability_margin(feet, feet[1] - off) == pytest.approx(-0.05, abs=1e-15)


def test_feet_in_one_point_never_stand() -> None:
    assert static_stability_margin(np.ones((3, 2)), [1.0, 1.0]) == 0.0
    assert static_stability_margin(np.ones((4, 2)), [1.3, 1.4]) == pytest.approx(-0.5, abs=1e-15)


def test_unknown_places_have_no_margin() -> None:
    unknown = STANCE.copy()
    unknown[2, 0] = np.nan
    assert np.isnan(static_stability_margin(unknown, [0.0, 0.0]))
    assert np.isnan(static_stability_margin(STANCE, [np.nan, 0.0]))


def test_leading_axes_are_broadcast() -> None:
    rng = np.random.default_rng(1)
    feet, cogs = rng.uniform(-1, 1, (7, 1, 4, 3)), rng.uniform(-1, 1, (5, 2))
    found = static_stability_margin(feet, cogs)
    assert found.shape == (7, 5)
    for i in range(7):
        for j in range(5):
            assert found[i, j] == static_stability_margin(feet[i, 0], cogs[j])


@pytest.mark.parametrize("shape", [(0, 2), (1, 2), (2, 2), (9, 2, 3), (3,)])
def test_two_feet_are_too_few(shape: tuple[int, ...]) -> None:
    with pytest.raises(InputError) as caught:
        static_stability_margin(np.zeros(shape), [0.0, 0.0])
    assert str(caught.value).startswith("a support polygon needs three feet or more, got (")
