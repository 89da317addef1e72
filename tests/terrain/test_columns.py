"""The S of columns, Fig. 3 of [Wang2020]."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.spatial.distance import pdist

from gaitopt.conventions import LEGS
from gaitopt.errors import InputError
from gaitopt.robots.catalog import load_robot
from gaitopt.robots.numbering import NUMBERINGS
from gaitopt.terrain.columns import s_columns

JITTER = 0.02
SEED_0_RF_STARTS = [[0.21207522, -0.13305879, 0], [0.28439521, -0.11017428, 0]]


def nominal(
    leg: str, columns: int = 17, forward: float = 1.5, amplitude: float = 0.1, wave: float = 1.5
) -> Any:
    """Below the hip of `leg` while the body follows the sine."""
    x = np.linspace(0, forward, columns)
    hip = np.array([0.2 if leg[1] == "F" else -0.2, 0.15 if leg[0] == "L" else -0.15])
    return hip + np.column_stack([x, amplitude * np.sin(2 * np.pi * x / wave)])


def test_there_are_17_columns_for_each_of_4_legs_and_64_steps() -> None:
    feet = s_columns(seed=0)
    assert feet.array.shape == (4, 17, 3)
    assert feet.steps == 64


def test_columns_are_4_cm_wide_and_level() -> None:
    feet = s_columns(seed=0)
    assert feet.radius == 0.02
    assert (feet.array[..., 2] == 0).all()


@pytest.mark.parametrize("leg", LEGS)
@pytest.mark.parametrize("seed", range(20))
def test_every_column_lies_within_the_jitter_of_the_s(seed: int, leg: str) -> None:
    away = s_columns(seed=seed)[leg][:, :2] - nominal(leg)
    assert np.abs(away).max() <= JITTER
    assert np.abs(away).max() > JITTER / 2  # and is not on it


@pytest.mark.parametrize("leg", LEGS)
def test_without_jitter_the_columns_are_the_s(leg: str) -> None:
    feet = s_columns(jitter=0.0, diameter=0.005)
    np.testing.assert_allclose(feet[leg][:, :2], nominal(leg), rtol=0, atol=1e-15)


def test_middle_of_the_stance_goes_1_5_m_forward_along_one_sine() -> None:
    path = s_columns(jitter=0.0, diameter=0.005).array[..., :2].mean(axis=0)
    np.testing.assert_allclose(path[-1] - path[0], [1.5, 0.0], rtol=0, atol=1e-15)
    left, right = path[np.argmax(path[:, 1])], path[np.argmin(path[:, 1])]
    np.testing.assert_allclose(left, [0.375, 0.1], rtol=0, atol=1e-15)
    np.testing.assert_allclose(right, [1.125, -0.1], rtol=0, atol=1e-15)


def test_jitter_is_even_handed() -> None:
    """Mean and spread of a uniform square, over 400 terrains (5 standard errors)."""
    drawn = [s_columns(seed=s)[leg][:, :2] - nominal(leg) for s in range(100) for leg in LEGS]
    away = np.array(drawn).reshape(-1, 2)
    error = JITTER / np.sqrt(3) / np.sqrt(len(away))
    assert np.abs(away.mean(axis=0)).max() < 5 * error
    np.testing.assert_allclose(away.std(axis=0), JITTER / np.sqrt(3), rtol=0.03)


@pytest.mark.parametrize("diameter", [0.04, 0.045])
def test_no_two_columns_stand_in_one_another(diameter: float) -> None:
    """Also where a left front column comes to stand beside a left hind one, four steps on."""
    for seed in range(300):
        places = s_columns(seed=seed, diameter=diameter).array[..., :2].reshape(-1, 2)
        assert pdist(places).min() >= diameter


def test_a_long_walk_has_no_overlaps_either() -> None:
    places = s_columns(columns=401, forward=37.5).array[..., :2].reshape(-1, 2)
    assert pdist(places).min() >= 0.04


def test_same_seed_gives_the_same_terrain_and_another_seed_another() -> None:
    terrains = [s_columns(seed=s) for s in range(5)]
    for s, terrain in enumerate(terrains):
        assert terrain == s_columns(seed=s)
        assert all(terrain != other for other in terrains[s + 1 :])


def test_seed_0_is_the_default_and_stays_what_it_is() -> None:
    """The terrain of the documentation: a change of it changes every published number."""
    assert s_columns() == s_columns(seed=0)
    np.testing.assert_allclose(s_columns()["RF"][:2], SEED_0_RF_STARTS, rtol=0, atol=1e-8)


def test_legs_are_on_their_sides_and_in_the_paper_s_order() -> None:
    start = {leg: s_columns(jitter=0.0, diameter=0.005)[leg][0] for leg in LEGS}
    for number, leg in NUMBERINGS["wang2020"].items():
        alpha, beta = (1 if number in (2, 4) else -1), (1 if number in (3, 4) else -1)
        np.testing.assert_allclose(start[leg], [0.2 * alpha, 0.15 * beta, 0], rtol=0, atol=1e-15)


@pytest.mark.parametrize("columns", [2, 3, 9, 33])
def test_shorter_and_longer_walks_keep_the_step_of_the_paper(columns: int) -> None:
    """1.5 m in 16 steps; the S goes on, or is cut short."""
    feet = s_columns(columns=columns)
    expected = nominal("LH", columns, 1.5 / 16 * (columns - 1))
    assert np.abs(feet["LH"][:, :2] - expected).max() <= JITTER


def test_every_parameter_can_be_set() -> None:
    feet = s_columns(
        7, columns=5, forward=0.8, amplitude=0.05, wavelength=0.7, jitter=0.001, body_length=0.6,
        body_width=0.5, diameter=0.03,
    )  # fmt: skip
    assert feet.array.shape == (4, 5, 3) and feet.radius == 0.015
    shift = np.array([0.1, 0.1]) * [1, -1]  # a longer and wider body
    expected = nominal("RF", 5, 0.8, 0.05, 0.7) + shift
    assert np.abs(feet["RF"][:, :2] - expected).max() <= 0.001


def test_tops_may_differ() -> None:
    level, rough = s_columns(seed=2), s_columns(seed=2, height_jitter=0.05)
    np.testing.assert_array_equal(level.array[..., :2], rough.array[..., :2])
    tops = rough.array[..., 2]
    assert np.abs(tops).max() <= 0.05
    assert tops.min() < -0.03 and tops.max() > 0.03 and len(np.unique(tops)) == tops.size


def test_one_column_a_leg_is_standing_still() -> None:
    assert s_columns(columns=1).steps == 0


def test_places_too_narrow_for_the_columns_are_still_within_the_jitter() -> None:
    """Where there is no room for all, the draw ends all the same."""
    feet = s_columns(columns=5, forward=0.02, diameter=0.2)
    assert np.abs(feet["LH"][:, :2] - nominal("LH", 5, 0.02)).max() <= JITTER


LENGTHS = (
    "forward", "amplitude", "wavelength", "jitter", "height_jitter", "body_length", "body_width",
    "diameter",
)  # fmt: skip


@pytest.mark.parametrize(
    ("name", "bad"),
    [
        (name, bad)
        for name in LENGTHS
        for bad in (np.nan, np.inf, -0.01, "wide", None)
        # None fits all lengths but one to the robot.
        if bad is not None or name == "height_jitter"
    ],
)
def test_bad_length_is_named(name: str, bad: Any) -> None:
    lowest = "0" if name in ("amplitude", "jitter", "height_jitter") else "1e-06"
    with pytest.raises(InputError) as caught:
        s_columns(**{name: bad})
    assert str(caught.value) == (
        f"{name} must be a finite length from {lowest} to 1e+06 m, got {bad!r}"
    )


@pytest.mark.parametrize("bad", [0, -3, 2.5, 17.0, "17", None, 100_001])
def test_bad_number_of_columns_is_named(bad: Any) -> None:
    with pytest.raises(InputError) as caught:
        s_columns(columns=bad)
    assert str(caught.value) == f"columns must be a whole number from 1 to 100000, got {bad!r}"


@pytest.mark.parametrize("bad", [-1, 0.5, "0", None, 2**63])
def test_bad_seed_is_named(bad: Any) -> None:
    """None too: a terrain that nobody can draw again is no test terrain."""
    with pytest.raises(InputError) as caught:
        s_columns(seed=bad)
    assert str(caught.value) == f"seed must be a whole number from 0 to {2**63 - 1}, got {bad!r}"


def test_columns_are_wide_enough_for_balls_as_large_as_wheels() -> None:
    usual, wheels = load_robot("go2"), load_robot("go2", foot_radius=0.086)
    assert s_columns(robot=usual).landing_radius == pytest.approx(0.02 * 0.3894 / 0.57, rel=0.02)
    assert s_columns(robot=wheels).landing_radius == pytest.approx(0.3 * 0.086)
    assert s_columns(robot=wheels, diameter=0.02).landing_radius == pytest.approx(0.01)
