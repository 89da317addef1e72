"""The nominal way of a body: its derivatives are true, and an arc is an arc."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gaitopt.planners.by_velocity.body_route import BodyRoute

speeds = st.floats(-1.0, 1.0)
times = st.floats(0.1, 3.0)


@settings(max_examples=60, deadline=None)
@given(vx=speeds, vy=speeds, rate=speeds, heading=st.floats(-3, 3), ramp=times, plateau=times)
def test_derivatives_are_those_of_the_place(
    vx: float, vy: float, rate: float, heading: float, ramp: float, plateau: float
) -> None:
    route = BodyRoute((vx, vy), rate, heading, 0.3, ramp, plateau)
    t = np.linspace(0.0, route.end + 0.3, 400)
    # Away from the breaks, where the third derivative jumps.
    t = t[np.abs(t[:, None] - np.array(route.breaks)).min(axis=1) > 2e-3]
    h = 1e-4
    place, speed, change = route.motion(t)
    ahead, behind = route.motion(t + h), route.motion(t - h)
    np.testing.assert_allclose(speed, (ahead[0] - behind[0]) / (2 * h), atol=1e-4)
    np.testing.assert_allclose(change, (ahead[1] - behind[1]) / (2 * h), atol=3e-3)
    yaws = [route.yaw(t + d) for d in (-h, 0.0, h)]
    np.testing.assert_allclose(yaws[1][1], (yaws[2][0] - yaws[0][0]) / (2 * h), atol=1e-4)
    np.testing.assert_allclose(yaws[1][2], (yaws[2][1] - yaws[0][1]) / (2 * h), atol=3e-3)
    assert place.shape == (len(t), 2)


def test_straight_ahead_the_plateau_is_walked_at_the_command_and_each_ramp_at_half_of_it() -> None:
    route = BodyRoute((0.3, 0.0), 0.0, 0.0, 1.0, 0.8, 5.0)
    way = route.position(np.array(route.breaks))[:, 0]
    assert np.diff(way) == pytest.approx([0.12, 1.5, 0.12], abs=1e-12)
    middle = route.motion(np.linspace(1.8, 6.8, 20))
    np.testing.assert_allclose(middle[1], [[0.3, 0.0]] * 20, atol=1e-12)
    np.testing.assert_allclose(middle[2], 0.0, atol=1e-12)


def test_turning_while_walking_goes_round_a_circle() -> None:
    """Its radius is speed over yaw rate, whatever the ramps."""
    route = BodyRoute((0.4, 0.0), 0.5, 0.0, 0.0, 1.0, 6.0)
    places = route.position(np.linspace(0, route.end, 200))
    np.testing.assert_allclose(np.linalg.norm(places - [0.0, 0.8], axis=1), 0.8, atol=1e-12)


def test_before_and_after_it_rests() -> None:
    route = BodyRoute((0.3, 0.1), 0.2, 0.7, 0.5, 1.0, 2.0)
    for t in (0.0, 0.5, route.end, route.end + 1.0):
        _, speed, change = route.motion(np.array([t]))
        assert np.abs(speed).max() == 0.0 and np.abs(change).max() == 0.0
    np.testing.assert_array_equal(route.position(np.array([route.end])),
                                  route.position(np.array([route.end + 9.0])))  # fmt: skip


def test_a_way_that_hardly_turns_is_straight() -> None:
    straight = BodyRoute((0.3, 0.2), 0.0, 0.4, 0.0, 1.0, 2.0)
    hardly = BodyRoute((0.3, 0.2), 1e-13, 0.4, 0.0, 1.0, 2.0)
    t = np.linspace(0, 4, 50)
    np.testing.assert_allclose(hardly.position(t), straight.position(t), atol=1e-12)
