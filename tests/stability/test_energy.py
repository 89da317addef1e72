"""The energy margin: closed forms, limits, symmetries, and a COG turned about the side as judge."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

from gaitopt.conventions import FloatArray, rotation_z
from gaitopt.errors import InputError
from gaitopt.stability.energy import energy_stability_margin, normalised_energy_stability_margin
from gaitopt.stability.margins import static_stability_margin

UP = np.array([0.0, 0.0, 1.0])
SQUARE = np.array([[0.2, 0.2, 0.0], [-0.2, 0.2, 0.0], [-0.2, -0.2, 0.0], [0.2, -0.2, 0.0]])
nesm = normalised_energy_stability_margin


def random_stance(rng: np.random.Generator, count: int = 4) -> tuple[FloatArray, FloatArray]:
    """Feet at different heights and a COG above them, within their hull."""
    feet = rng.uniform(-0.5, 0.5, (count, 3)) * [1.0, 1.0, 0.4]
    return feet, rng.dirichlet(np.ones(count)) @ feet + [0.0, 0.0, rng.uniform(0.3, 0.8)]


def turned_rise(feet: FloatArray, cog: FloatArray, i: int, j: int) -> float:
    """How much higher the COG gets on its circle about the line through two feet."""
    axis = (feet[j] - feet[i]) / np.linalg.norm(feet[j] - feet[i])
    best, width = 0.0, np.pi
    for _ in range(12):  # ever finer around the highest place seen
        angles = best + np.linspace(-width, width, 201)
        turned = Rotation.from_rotvec(angles[:, None] * axis).apply(cog - feet[i])
        best, width = angles[turned[:, 2].argmax()], width / 50.0
    return float(turned[:, 2].max() - (cog - feet[i])[2])


# --- closed forms -----------------------------------------------------------------------------


@pytest.mark.parametrize("height", [0.1, 0.4, 2.0])
def test_on_a_level_square_it_is_the_radius_less_the_height(height: float) -> None:
    found = nesm(SQUARE, [0.0, 0.0, height])
    assert found == pytest.approx(np.hypot(height, 0.2) - height, rel=1e-13)


def test_level_stance_is_limited_by_its_nearest_side() -> None:
    feet = SQUARE * [1.5, 1.0, 1.0]  # 0.6 m long, 0.4 m wide
    assert nesm(feet, [0.0, 0.0, 0.3]) == pytest.approx(np.hypot(0.3, 0.2) - 0.3, rel=1e-13)
    assert nesm(feet, [0.25, 0.0, 0.3]) == pytest.approx(np.hypot(0.3, 0.05) - 0.3, rel=1e-12)


def test_energy_is_weight_times_height() -> None:
    joules = energy_stability_margin(SQUARE, [0.0, 0.0, 0.4], 25.0)
    assert joules == pytest.approx(25.0 * 9.81 * (np.sqrt(0.2) - 0.4), rel=1e-13)
    on_the_moon = energy_stability_margin(SQUARE, [0.0, 0.0, 0.4], 25.0, gravity=1.62)
    assert on_the_moon == pytest.approx(joules * 1.62 / 9.81, rel=1e-14)


def test_side_that_slopes_lifts_less() -> None:
    """An axis through (0, 0, 0) and (3, 0, 4): cos(psi) = 0.6; the far foot plays no part."""
    feet = np.array([[0.0, 0.0, 0.0], [3.0, 0.0, 4.0], [1.0, 9.0, 0.0]])
    # From the axis' middle: 5 m along its normal (-0.8, 0, 0.6) within the vertical plane, 12 m
    # to the side, so that the radius is 13 m.
    cog = np.array([1.5, 0.0, 2.0]) + 5.0 * np.array([-0.8, 0.0, 0.6]) + [0.0, 12.0, 0.0]
    outside = nesm(feet[[0, 1]], cog)
    assert outside == pytest.approx(-0.6 * (13.0 - 5.0), rel=1e-14)


@given(st.integers(0, 2**32 - 1))
def test_rise_is_messuri_and_kleins_formula(seed: int) -> None:
    """|R| (1 - cos(theta)) cos(psi), theta from the vertical plane through the side."""
    feet, cog = random_stance(np.random.default_rng(seed), 2)
    cog = cog + np.random.default_rng(seed + 1).uniform(-0.3, 0.3, 3)
    axis = (feet[1] - feet[0]) / np.linalg.norm(feet[1] - feet[0])
    radius = (cog - feet[0]) - (cog - feet[0]) @ axis * axis
    in_plane = np.array([0.0, 0.0, 1.0]) - axis[2] * axis
    psi = np.arccos(np.linalg.norm(in_plane))
    length = np.linalg.norm(radius)
    theta = np.arccos(np.clip(radius @ in_plane / (length * np.cos(psi)), -1.0, 1.0))
    expected = length * (1.0 - np.cos(theta)) * np.cos(psi)
    assert nesm(feet, cog) == pytest.approx(-expected, abs=1e-12)


# --- the judge --------------------------------------------------------------------------------


@pytest.mark.parametrize("count", [3, 4, 5])
def test_it_is_the_least_rise_of_a_cog_turned_about_the_sides_of_the_hull(count: int) -> None:
    rng = np.random.default_rng(count)
    for _ in range(25):
        feet, cog = random_stance(rng, count)
        sides = ConvexHull(feet[:, :2]).simplices
        expected = min(turned_rise(feet, cog, i, j) for i, j in sides)
        assert nesm(feet, cog) == pytest.approx(expected, abs=1e-12)


def test_outside_one_side_it_is_minus_the_rise_over_that_side() -> None:
    rng = np.random.default_rng(8)
    for _ in range(25):
        feet, _ = random_stance(rng, 3)
        middle, opposite = feet[:2].mean(axis=0), feet[2]
        cog = middle + 0.1 * (middle - opposite) + [0.0, 0.0, 0.4]
        assert static_stability_margin(feet, cog) < 0
        assert nesm(feet, cog) == pytest.approx(-turned_rise(feet, cog, 0, 1), abs=1e-12)


# --- limits -----------------------------------------------------------------------------------


@given(st.integers(0, 2**32 - 1), st.floats(0.0, 1.0))
def test_above_a_side_it_is_zero(seed: int, share: float) -> None:
    feet, _ = random_stance(np.random.default_rng(seed), 3)
    cog = feet[0] + share * (feet[1] - feet[0]) + [0.0, 0.0, 0.5]
    assert nesm(feet, cog) == pytest.approx(0.0, abs=1e-15)


@pytest.mark.parametrize("distance", [1e-3, 1e-6, 1e-9])
def test_near_a_side_it_falls_as_the_square_of_the_distance(distance: float) -> None:
    """d**2 / 2 h, to full precision although it is a difference of nearly equal lengths."""
    for sign in (1.0, -1.0):
        found = nesm(SQUARE, [0.2 - sign * distance, 0.0, 0.5])
        # The distance itself is only known to the rounding of 0.2.
        assert found == pytest.approx(sign * distance**2 / 1.0, rel=1e-6)


@given(st.integers(0, 2**32 - 1))
def test_its_sign_is_that_of_the_static_margin(seed: int) -> None:
    rng = np.random.default_rng(seed)
    feet, _ = random_stance(rng)
    cog = rng.uniform(-0.6, 0.6, 3) + UP
    static = static_stability_margin(feet, cog)
    assert np.sign(nesm(feet, cog)) == np.sign(static)


@pytest.mark.parametrize("lower", [0.3, 0.1])
def test_a_lower_cog_stands_firmer(lower: float) -> None:
    """On level feet the static margin does not see it."""
    high, low = [0.05, 0.0, 0.4], [0.05, 0.0, lower]
    assert nesm(SQUARE, low) > nesm(SQUARE, high) > 0
    assert static_stability_margin(SQUARE, low) == static_stability_margin(SQUARE, high)


def test_the_downhill_side_is_the_weaker() -> None:
    """On a slope of 30 degrees, with the COG square above the middle of the feet."""
    tilt = Rotation.from_rotvec([0.0, np.pi / 6, 0.0])  # x points downhill
    feet, cog = tilt.apply(SQUARE), tilt.apply([0.0, 0.0, 0.3])
    radius = np.hypot(0.2, 0.3)
    downhill, uphill = (cog - feet[0])[2], (cog - feet[1])[2]
    assert nesm(feet, cog) == pytest.approx(radius - downhill, rel=1e-12)
    assert radius - uphill > 4 * (radius - downhill)


# --- supports without an inside ---------------------------------------------------------------


def test_two_feet_balance_at_best() -> None:
    pair = SQUARE[[0, 2]]
    assert nesm(pair, [0.05, 0.05, 0.4]) == pytest.approx(0.0, abs=1e-16)
    aside = np.array([0.03, -0.03, 0.4])
    assert nesm(pair, aside) == pytest.approx(0.4 - np.hypot(0.4, 0.03 * np.sqrt(2)), rel=1e-12)
    assert nesm(pair, aside * [-1.0, -1.0, 1.0]) == pytest.approx(nesm(pair, aside), rel=1e-14)


def test_a_row_of_feet_is_two_of_them() -> None:
    row = np.array([[-0.2, 0.0, 0.0], [0.1, 0.0, 0.0], [0.3, 0.0, 0.0]])
    cog = [0.0, 0.06, 0.4]
    assert nesm(row, cog) == pytest.approx(nesm(row[[0, 2]], cog), rel=1e-14)


def test_one_foot_is_a_pendulum_upside_down() -> None:
    foot = np.array([[0.2, 0.1, 0.05]])
    assert nesm(foot, [0.2, 0.1, 0.45]) == 0.0
    assert nesm(foot, [0.2 + 0.3, 0.1, 0.45]) == pytest.approx(0.4 - 0.5, rel=1e-14)
    assert nesm(np.repeat(foot, 4, axis=0), [0.5, 0.1, 0.45]) == pytest.approx(-0.1, rel=1e-14)


def test_in_flight_there_is_no_margin() -> None:
    contacts = np.array([[True] * 4, [False] * 4])
    found = nesm(SQUARE, [0.0, 0.0, 0.4], contacts)
    assert found[0] > 0 and np.isnan(found[1])


# --- symmetries -------------------------------------------------------------------------------


@given(
    st.integers(0, 2**32 - 1),
    st.floats(-np.pi, np.pi),
    st.tuples(*3 * [st.floats(-100.0, 100.0)]),
    st.permutations(range(4)),
)
def test_margin_does_not_depend_on_place_heading_or_order_of_the_feet(
    seed: int, angle: float, move: tuple[float, float, float], order: list[int]
) -> None:
    feet, cog = random_stance(np.random.default_rng(seed))
    turn = rotation_z(angle)
    there = nesm((feet @ turn.T + move)[order], turn @ cog + move)
    assert there == pytest.approx(nesm(feet, cog), abs=1e-11)


@given(st.integers(0, 2**32 - 1))
def test_mirrored_robots_have_the_same_margin(seed: int) -> None:
    feet, cog = random_stance(np.random.default_rng(seed))
    mirror = np.array([1.0, -1.0, 1.0])
    assert nesm(feet * mirror, cog * mirror) == pytest.approx(nesm(feet, cog), abs=1e-15)


@given(st.integers(0, 2**32 - 1), st.floats(0.1, 10.0))
def test_scaling_the_robot_scales_the_height(seed: int, scale: float) -> None:
    feet, cog = random_stance(np.random.default_rng(seed))
    assert nesm(scale * feet, scale * cog) == pytest.approx(scale * nesm(feet, cog), rel=1e-9)


def test_mixed_sets_of_standing_feet_are_those_sets_one_by_one() -> None:
    rng = np.random.default_rng(4)
    contacts = np.array([[bool(k >> i & 1) for i in range(4)] for k in range(1, 16)])
    feet, cogs = rng.uniform(-0.5, 0.5, (15, 4, 3)), rng.uniform(-0.1, 0.1, (15, 3))
    cogs[:, 2] += 0.8
    flying = np.where(contacts[..., None], feet, np.nan)  # where a foot flies does not count
    found = energy_stability_margin(flying, cogs, 3.0, contacts)
    for k in range(15):
        alone = energy_stability_margin(feet[k][contacts[k]], cogs[k], 3.0)
        assert found[k] == pytest.approx(alone, abs=1e-14)


def test_leading_axes_are_broadcast() -> None:
    rng = np.random.default_rng(1)
    feet, cogs = rng.uniform(-1, 1, (7, 1, 4, 3)), rng.uniform(-1, 1, (5, 3))
    found = nesm(feet, cogs)
    assert found.shape == (7, 5)
    assert found[3, 2] == nesm(feet[3, 0], cogs[2])


def test_unknown_places_have_no_margin() -> None:
    unknown = SQUARE.copy()
    unknown[2, 2] = np.nan
    assert np.isnan(nesm(unknown, [0.0, 0.0, 0.4]))
    assert np.isnan(nesm(SQUARE, [0.0, np.nan, 0.4]))


def test_places_without_heights_are_refused() -> None:
    with pytest.raises(InputError) as caught:
        nesm(SQUARE[:, :2], [0.0, 0.0, 0.4])
    assert str(caught.value) == (
        "tipping needs heights: feet (..., m, 3) and cog (..., 3), got (4, 2) and (3,)"
    )
