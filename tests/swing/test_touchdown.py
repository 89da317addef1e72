"""Landing points from commanded and measured velocity."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gaitopt.errors import InputError
from gaitopt.swing.touchdown import com_touchdown, velocity_touchdown

HIPS = np.array([[0.3, 0.2], [-0.3, 0.2], [-0.3, -0.2], [0.3, -0.2]])
number = st.floats(-2.0, 2.0)
pair = st.tuples(number, number).map(np.array)


# --- [Wang2024], eqs. (15), (16)


@given(pair, st.floats(0.05, 2.0))
def test_at_constant_velocity_the_foot_is_as_long_before_its_place_as_behind_it(
    velocity: np.ndarray, stance_time: float
) -> None:
    """Seen from the body, the foot's place averaged over the stance is the nominal one."""
    landed = velocity_touchdown(HIPS, velocity, velocity, stance_time, 0.1)
    lifted = landed - velocity * stance_time
    np.testing.assert_allclose((landed + lifted) / 2.0, HIPS, rtol=0, atol=1e-14)


def printed_eq_15(velocity: float, commanded: float, mu: float, period: float, k: float) -> float:
    return velocity * mu * period / 2.0 - k * (commanded - velocity)


def test_eq_15_as_printed_is_right_where_swing_and_stance_last_equally_long() -> None:
    trot = velocity_touchdown([0.0, 0.0], [0.5, 0.0], [0.6, 0.0], 0.5 * 0.8, 0.05)
    assert trot[0] == pytest.approx(printed_eq_15(0.5, 0.6, 0.5, 0.8, 0.05), rel=1e-14)


def test_eq_15_as_printed_lands_a_walking_foot_too_near() -> None:
    """At mu = 1/4 at a third of the way: seen from the body the foot drags behind its hip."""
    speed, period, mu = 0.3, 1.0, 0.25
    walk = velocity_touchdown([0.0, 0.0], [speed, 0.0], [speed, 0.0], (1 - mu) * period, 0.05)
    printed = printed_eq_15(speed, speed, mu, period, 0.05)
    assert walk[0] == pytest.approx(3.0 * printed, rel=1e-14)
    lifted = printed - speed * (1 - mu) * period
    assert (printed + lifted) / 2.0 == pytest.approx(-0.075, rel=1e-14)


def test_known_landing_points_of_four_legs() -> None:
    landed = velocity_touchdown(HIPS, [0.4, -0.1], [0.5, 0.0], 0.5, [0.1, 0.2])
    np.testing.assert_allclose(landed - HIPS, np.tile([0.09, -0.045], (4, 1)), rtol=1e-13)


def test_a_robot_that_stands_as_commanded_steps_in_place() -> None:
    np.testing.assert_array_equal(velocity_touchdown(HIPS, [0, 0], [0, 0], 0.4, 0.1), HIPS)


@given(pair, pair)
def test_a_body_that_is_too_fast_steps_farther(velocity: np.ndarray, push: np.ndarray) -> None:
    """In the direction of the push."""
    steady = velocity_touchdown(HIPS, velocity, velocity, 0.4, 0.1)
    pushed = velocity_touchdown(HIPS, velocity + push, velocity, 0.4, 0.1)
    np.testing.assert_allclose(pushed - steady, np.tile(0.3 * push, (4, 1)), rtol=0, atol=1e-14)


def test_legs_may_stand_for_different_times_and_samples_go_in_front() -> None:
    times, speeds = np.array([0.2, 0.4, 0.6, 0.8]), np.random.default_rng(2).normal(size=(7, 1, 2))
    landed = velocity_touchdown(HIPS, speeds, [0.3, 0.0], times, 0.1)
    assert landed.shape == (7, 4, 2)
    for i in range(7):
        for j in range(4):
            alone = velocity_touchdown(HIPS[j], speeds[i, 0], [0.3, 0.0], times[j], 0.1)
            np.testing.assert_array_equal(landed[i, j], alone)


# --- [XiLing], eqs. (42), (43)


@given(pair, pair, st.floats(-0.9, 20.0), number)
def test_closed_form_solves_eqs_42_and_43(
    com: np.ndarray, velocity: np.ndarray, k_p: float, k_v: float
) -> None:
    p = com_touchdown(HIPS, com, velocity, k_p, [k_v, 0.0])
    right_x = k_p * (com[0] - p[:, 0]) + velocity[0] * k_v + HIPS[:, 0]
    right_y = k_p * (com[1] - p[:, 1]) + HIPS[:, 1]
    np.testing.assert_allclose(p, np.column_stack([right_x, right_y]), rtol=0, atol=1e-11)


def test_eq_42_read_as_an_update_settles_at_the_closed_form() -> None:
    """Only for gains below 1; the closed form needs no such care."""
    com, velocity, k_v = np.array([0.02, -0.01]), np.array([0.3, 0.1]), 0.2
    for k_p, settles in ((0.5, True), (1.5, False)):
        p = HIPS.copy()
        for _ in range(60):
            p = k_p * (com - p) + velocity * k_v + HIPS
        gap = np.abs(p - com_touchdown(HIPS, com, velocity, k_p, k_v)).max()
        assert gap < 1e-15 if settles else gap > 1e3


def test_without_position_feedback_the_foot_lands_at_its_place_and_the_velocitys_share() -> None:
    landed = com_touchdown(HIPS, [0.1, 0.1], [0.5, 0.2], 0.0, 0.1)
    np.testing.assert_allclose(landed, HIPS + np.array([0.05, 0.02]), rtol=1e-15)


def test_a_gain_of_one_lands_half_way_to_the_centre_of_mass() -> None:
    com = np.array([0.04, -0.02])
    landed = com_touchdown(HIPS, com, [0.0, 0.0], 1.0, 0.0)
    np.testing.assert_allclose(landed, (HIPS + com) / 2.0, rtol=1e-15)


def test_a_great_gain_lands_below_the_centre_of_mass() -> None:
    com = np.array([0.04, -0.02])
    landed = com_touchdown(HIPS, com, [0.5, 0.2], 1e9, 0.1)
    np.testing.assert_allclose(landed, np.tile(com, (4, 1)), rtol=0, atol=1e-9)


def test_position_feedback_narrows_the_stance_of_a_robot_at_rest() -> None:
    """A property of eqs. (42), (43) themselves: all feet draw in by 1 / (1 + k_p)."""
    landed = com_touchdown(HIPS, [0.0, 0.0], [0.0, 0.0], 0.25, 0.1)
    np.testing.assert_allclose(landed, HIPS / 1.25, rtol=1e-15)


def test_samples_go_in_front_of_the_legs() -> None:
    rng = np.random.default_rng(3)
    coms, speeds = rng.normal(size=(5, 1, 2)), rng.normal(size=(5, 1, 2))
    landed = com_touchdown(HIPS, coms, speeds, [0.3, 0.1], [0.2, 0.0])
    assert landed.shape == (5, 4, 2)
    for i in range(5):
        for j in range(4):
            alone = com_touchdown(HIPS[j], coms[i, 0], speeds[i, 0], [0.3, 0.1], [0.2, 0.0])
            np.testing.assert_array_equal(landed[i, j], alone)


# --- what is refused


@pytest.mark.parametrize("k_p", [-1.0, [0.5, -1.0]])
def test_a_gain_of_minus_one_has_no_landing_point(k_p: object) -> None:
    with pytest.raises(InputError) as caught:
        com_touchdown(HIPS, [0.0, 0.0], [0.1, 0.0], k_p, 0.1)  # type: ignore[arg-type]
    assert str(caught.value) == (
        "position_gain must not be -1: the landing point drops out of its own equation; take 0 or "
        "more"
    )


@pytest.mark.parametrize(
    ("argument", "value", "message"),
    [
        ("nominal", [0.0, 0.0, 0.0], "nominal must have the shape (..., 2), x and y, got (3,)"),
        ("velocity", 0.5, "velocity must have the shape (..., 2), x and y, got ()"),
        ("commanded", [0.0, np.nan], "commanded must be finite, got nan"),
        ("commanded", "fast", "commanded must be numbers, got 'fast'"),
        ("stance_time", -0.1, "stance_time must be 0 s or more, got -0.1"),
        ("stance_time", np.inf, "stance_time must be finite, got inf"),
        ("gain", [0.1, 0.1, 0.1], "gain must be a number or two, for x and y, got (3,)"),
        (
            "velocity",
            np.zeros((3, 2)),
            "places, velocities and times must each be given for all legs at once or for as many "
            "as the others, got (4,), (3,), (), ()",
        ),
    ],
)
def test_nonsense_is_refused_with_its_name(argument: str, value: object, message: str) -> None:
    given: dict[str, object] = {
        "nominal": HIPS, "velocity": [0.1, 0.0], "commanded": [0.1, 0.0], "stance_time": 0.5,
        "gain": 0.1,
    }  # fmt: skip
    with pytest.raises(InputError) as caught:
        velocity_touchdown(**(given | {argument: value}))  # type: ignore[arg-type]
    assert str(caught.value) == message
