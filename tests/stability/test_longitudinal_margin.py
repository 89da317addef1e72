"""The longitudinal margin: known values, symmetries, and a search along the heading as judge."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gaitopt.conventions import FloatArray, rotation_z
from gaitopt.errors import InputError
from gaitopt.stability.contacts import support_margin
from gaitopt.stability.longitudinal_margin import (
    longitudinal_margins,
    longitudinal_stability_margin,
)
from gaitopt.stability.margins import static_stability_margin

STANCE = np.array([[0.2, 0.15], [-0.2, 0.15], [-0.2, -0.15], [0.2, -0.15]])
RIGHT_ANGLE = np.array([[0.0, 0.0], [4.0, 0.0], [0.0, 3.0]])


@pytest.mark.parametrize(
    ("cog", "heading", "front", "rear"),
    [
        ((1.0, 1.0), 0.0, 5.0 / 3.0, 1.0),  # the hypotenuse is met at x = 4 - 4/3
        ((1.0, 1.0), np.pi / 2, 1.25, 1.0),  # ... and at y = 3 - 3/4
        ((1.0, 1.0), np.pi, 1.0, 5.0 / 3.0),
        ((-0.5, 1.0), 0.0, 0.5 + 8.0 / 3.0, -0.5),  # behind the rear edge
        ((3.0, 1.5), 0.0, -1.0, 3.0),  # ahead of the front edge
        ((1.0, 4.0), 0.0, -np.inf, -np.inf),  # the line passes the support
    ],
)
def test_right_angle_has_known_distances(
    cog: tuple[float, float], heading: float, front: float, rear: float
) -> None:
    found = longitudinal_margins(RIGHT_ANGLE, cog, heading)
    assert found == (pytest.approx(front, abs=1e-14), pytest.approx(rear, abs=1e-14))
    assert longitudinal_stability_margin(RIGHT_ANGLE, cog, heading) == min(found)


def test_standing_on_four_feet_it_is_half_the_length() -> None:
    assert longitudinal_stability_margin(STANCE, [0.0, 0.0]) == pytest.approx(0.2, abs=1e-16)
    assert longitudinal_stability_margin(STANCE, [0.05, 0.1]) == pytest.approx(0.15, abs=1e-16)
    sideways = longitudinal_stability_margin(STANCE, [0.0, 0.0], np.pi / 2)
    assert sideways == pytest.approx(0.15, abs=1e-16)


@pytest.mark.parametrize("lifted", range(4))
def test_lifting_a_foot_puts_the_centre_on_an_edge(lifted: int) -> None:
    standing = np.arange(4) != lifted
    front, rear = longitudinal_margins(STANCE, [0.0, 0.0], contacts=standing)
    edge_ahead = STANCE[lifted, 0] > 0  # the diagonal bounds the side where the foot is missing
    assert (front if edge_ahead else rear) == pytest.approx(0.0, abs=1e-16)
    assert (rear if edge_ahead else front) == pytest.approx(0.2, abs=1e-16)


def test_two_feet_across_the_way_are_front_and_rear_edge_at_once() -> None:
    pair = np.array([[0.2, 0.1], [-0.2, -0.1]])
    assert longitudinal_margins(pair, [0.05, 0.0]) == pytest.approx((-0.05, 0.05), abs=1e-16)
    assert longitudinal_stability_margin(pair, [0.05, 0.0]) == pytest.approx(-0.05, abs=1e-16)
    assert longitudinal_stability_margin(pair, [0.1, 0.05]) == pytest.approx(0.0, abs=1e-16)
    assert longitudinal_stability_margin(pair, [0.0, 0.2]) == -np.inf


def test_two_feet_along_the_way_are_the_thinnest_of_polygons() -> None:
    pair = np.array([[0.2, 0.0], [-0.2, 0.0]])
    thin = np.array([[0.2, 1e-9], [-0.2, 1e-9], [-0.2, -1e-9], [0.2, -1e-9]])
    for feet in (pair, thin):
        assert longitudinal_margins(feet, [0.05, 0.0]) == pytest.approx((0.15, 0.25), abs=1e-15)
        assert longitudinal_stability_margin(feet, [0.3, 0.0]) == pytest.approx(-0.1, abs=1e-15)
        assert longitudinal_stability_margin(feet, [0.0, 0.01]) == -np.inf


def test_one_foot_is_a_point() -> None:
    foot = np.array([[0.2, 0.0]])
    assert longitudinal_margins(foot, [0.0, 0.0]) == (0.2, -0.2)
    assert longitudinal_stability_margin(foot, [0.0, 0.01]) == -np.inf


def test_in_flight_there_is_no_margin() -> None:
    contacts = np.array([[True] * 4, [False] * 4])
    found = longitudinal_stability_margin(STANCE, [0.0, 0.0], contacts=contacts)
    assert found[0] == pytest.approx(0.2) and np.isnan(found[1])


def searched(feet: FloatArray, cog: FloatArray, direction: FloatArray) -> tuple[float, float]:
    """Front and rear by bisection on the static margin, from a place within."""
    ends = []
    for sign in (1.0, -1.0):
        low, high = 0.0, 10.0
        for _ in range(60):
            middle = (low + high) / 2.0
            inside = static_stability_margin(feet, cog + sign * middle * direction) >= 0
            low, high = (middle, high) if inside else (low, middle)
        ends.append(low)
    return ends[0], ends[1]


@pytest.mark.parametrize("count", [3, 4, 6])
def test_distances_are_where_the_static_margin_vanishes(count: int) -> None:
    rng = np.random.default_rng(count)
    for _ in range(30):
        feet, angle = rng.uniform(-1, 1, (count, 2)), rng.uniform(-np.pi, np.pi)
        cog = rng.dirichlet(np.ones(count)) @ feet
        found = longitudinal_margins(feet, cog, angle)
        assert found == pytest.approx(searched(feet, cog, rotation_z(angle)[:2, 0]), abs=1e-9)


@given(st.integers(0, 2**32 - 1), st.floats(-4.0, 4.0), st.floats(-10.0, 10.0))
def test_margin_does_not_depend_on_place_or_choice_of_the_world(
    seed: int, angle: float, away: float
) -> None:
    rng = np.random.default_rng(seed)
    feet, heading = rng.uniform(-0.5, 0.5, (4, 2)), rng.uniform(-np.pi, np.pi)
    cog, turn = rng.dirichlet(np.ones(4)) @ feet, rotation_z(angle)[:2, :2]
    here = longitudinal_margins(feet, cog, heading)
    there = longitudinal_margins(feet @ turn.T + away, turn @ cog + away, heading + angle)
    # A side nearly along the way moves its crossing by much when the feet move by rounding.
    np.testing.assert_allclose(there, here, rtol=0, atol=1e-9)


@given(st.integers(0, 2**32 - 1))
def test_mirrored_robots_have_the_same_margin_and_reversed_ones_change_ends(seed: int) -> None:
    rng = np.random.default_rng(seed)
    feet, cog = rng.uniform(-0.5, 0.5, (4, 2)), rng.uniform(-0.2, 0.2, 2)
    heading = rng.uniform(-np.pi, np.pi)
    front, rear = longitudinal_margins(feet, cog, heading)
    mirror = np.array([1.0, -1.0])
    mirrored = longitudinal_margins(feet * mirror, cog * mirror, -heading)
    np.testing.assert_allclose(mirrored, (front, rear), rtol=0, atol=1e-9)
    reversed_ends = longitudinal_margins(feet, cog, heading + np.pi)
    np.testing.assert_allclose(reversed_ends, (rear, front), rtol=0, atol=1e-9)


@given(st.integers(0, 2**32 - 1))
def test_inside_it_is_no_smaller_than_the_static_margin(seed: int) -> None:
    """The nearest border lies at least as near as the border straight ahead or behind."""
    rng = np.random.default_rng(seed)
    feet, heading = rng.uniform(-0.5, 0.5, (4, 2)), rng.uniform(-np.pi, np.pi)
    cog = rng.dirichlet(np.ones(4)) @ feet
    static = static_stability_margin(feet, cog)
    assert longitudinal_stability_margin(feet, cog, heading) >= static - 1e-12


@given(st.integers(0, 2**32 - 1))
def test_outside_it_is_the_way_back_to_the_support(seed: int) -> None:
    rng = np.random.default_rng(seed)
    feet, heading = rng.uniform(-0.5, 0.5, (4, 2)), rng.uniform(-np.pi, np.pi)
    within = rng.dirichlet(np.ones(4)) @ feet
    direction, all_stand = rotation_z(heading)[:2, 0], np.ones(4, dtype=bool)
    front, rear = longitudinal_margins(feet, within, heading)
    for start, sign in ((within + (front + 0.3) * direction, -1.0),
                        (within - (rear + 0.3) * direction, 1.0)):  # fmt: skip
        margin = longitudinal_stability_margin(feet, start, heading)
        assert margin == pytest.approx(-0.3, abs=1e-9)
        back = start - sign * margin * direction
        assert support_margin(feet, all_stand, back) == pytest.approx(0.0, abs=1e-9)


def test_mixed_sets_of_standing_feet_are_those_sets_one_by_one() -> None:
    rng = np.random.default_rng(4)
    contacts = np.array([[bool(k >> i & 1) for i in range(4)] for k in range(1, 16)])
    feet, cogs = rng.uniform(-0.5, 0.5, (15, 4, 3)), rng.uniform(-0.1, 0.1, (15, 3))
    headings = rng.uniform(-np.pi, np.pi, 15)
    flying = np.where(contacts[..., None], feet, np.nan)  # where a foot flies does not count
    found = longitudinal_stability_margin(flying, cogs, headings, contacts)
    for k in range(15):
        alone = longitudinal_stability_margin(feet[k][contacts[k]], cogs[k], headings[k])
        assert found[k] == alone


def test_leading_axes_are_broadcast() -> None:
    rng = np.random.default_rng(1)
    feet, cogs, headings = rng.uniform(-1, 1, (7, 1, 4, 3)), rng.uniform(-1, 1, (5, 2)), 0.3
    found = longitudinal_stability_margin(feet, cogs, headings)
    assert found.shape == (7, 5)
    assert found[3, 2] == longitudinal_stability_margin(feet[3, 0], cogs[2], headings)


def test_unknown_places_have_no_margin() -> None:
    unknown = STANCE.copy()
    unknown[2, 0] = np.nan
    assert np.isnan(longitudinal_stability_margin(unknown, [0.0, 0.0]))
    assert np.isnan(longitudinal_stability_margin(STANCE, [np.nan, 0.0]))
    assert np.isnan(longitudinal_stability_margin(STANCE, [0.0, 0.0], np.nan))


def test_what_is_no_place_is_refused() -> None:
    with pytest.raises(InputError, match=r"cog must be \(\.\.\., 2\) or \(\.\.\., 3\), got \(4,\)"):
        longitudinal_stability_margin(STANCE, np.zeros(4))
    with pytest.raises(InputError, match=r"feet must be .* got \(3,\)"):
        longitudinal_stability_margin(np.zeros(3), [0.0, 0.0])
    with pytest.raises(InputError, match=r"contacts must have one value a foot: \(3,\) for feet"):
        longitudinal_stability_margin(STANCE, [0.0, 0.0], contacts=np.ones(3, dtype=bool))
