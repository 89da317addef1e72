"""Contacts, friction pyramids, torque limits."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import gaitopt
from gaitopt import Quadruped
from gaitopt.dynamics.contacts import (
    Contacts,
    ForceLimits,
    TorqueLine,
    pyramid_rows,
    tangents,
    unit_normals,
)
from gaitopt.dynamics.torque_limits import effort_limits, torque_bounds, torque_lines
from gaitopt.errors import InputError

NORMALS = [(0.0, 0.0, 1.0), (0.3, -0.2, 1.0), (1.0, 0.0, 0.0), (-2.0, 3.0, -1.0)]


def test_a_pyramid_on_level_ground_bounds_both_components() -> None:
    rows = pyramid_rows(ForceLimits(friction=0.5))
    slope = 0.5 / np.sqrt(2.0)
    expected = [[-1, 0, slope], [0, -1, slope], [1, 0, slope], [0, 1, slope]]
    np.testing.assert_allclose(rows, expected, atol=1e-15)


@pytest.mark.parametrize("normal", NORMALS)
@pytest.mark.parametrize("sides", [3, 4, 5, 8, 64])
def test_a_pyramid_touches_the_cone_from_inside(normal: tuple[float, ...], sides: int) -> None:
    limits = ForceLimits(friction=0.7, sides=sides)
    up, rows = unit_normals(normal), pyramid_rows(limits, normal)
    # Neighbouring faces meet in the edges.
    edges = np.cross(rows, np.roll(rows, -1, axis=0))
    edges *= np.sign(edges @ up)[:, None]
    assert (rows @ edges.T >= -1e-12).all()
    normal_part = edges @ up
    tangential = np.linalg.norm(edges - normal_part[:, None] * up, axis=1)
    np.testing.assert_allclose(tangential / normal_part, 0.7, rtol=1e-12)
    # Across a face the pyramid keeps the stated share of the friction.
    middle = (edges + np.roll(edges, 1, axis=0)) / 2.0
    part = middle @ up
    share = np.linalg.norm(middle - part[:, None] * up, axis=1) / part / 0.7
    np.testing.assert_allclose(share, limits.friction_share, rtol=1e-12)


@given(
    st.tuples(*[st.floats(-5, 5)] * 3), st.floats(0.01, 2.0), st.integers(3, 12), st.integers(0, 3)
)
def test_forces_in_the_pyramid_lie_in_the_cone(
    force: tuple[float, float, float], friction: float, sides: int, which: int
) -> None:
    up = unit_normals(NORMALS[which])
    rows = pyramid_rows(ForceLimits(friction=friction, sides=sides), NORMALS[which])
    if (rows @ force >= 0.0).all():
        part = float(np.dot(force, up))
        assert part >= -1e-12
        assert np.linalg.norm(np.subtract(force, part * up)) <= friction * part + 1e-9


@pytest.mark.parametrize("normal", NORMALS)
def test_tangents_and_normal_are_a_right_handed_frame(normal: tuple[float, ...]) -> None:
    frame = np.vstack([tangents(normal), unit_normals(normal)])
    np.testing.assert_allclose(frame @ frame.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(frame) == pytest.approx(1.0)


def test_on_level_ground_the_tangents_are_forward_and_left() -> None:
    np.testing.assert_array_equal(tangents((0.0, 0.0, 2.0)), np.eye(3)[:2])


def test_the_contact_lies_below_the_ball_along_the_normal() -> None:
    feet = np.arange(24.0).reshape(2, 4, 3)
    standing = np.ones((2, 4), dtype=bool)
    level = Contacts.below_feet(feet, standing, 0.02)
    np.testing.assert_allclose(feet - level.points, np.broadcast_to([0, 0, 0.02], feet.shape))
    tilted = Contacts.below_feet(feet, standing, 0.02, (0.0, 3.0, 4.0))
    np.testing.assert_allclose(feet[1, 3] - tilted.points[1, 3], [0.0, 0.012, 0.016])
    assert not tilted.points.flags.writeable


def test_four_feet_keep_half_of_what_fewer_keep() -> None:
    standing = np.array([[True] * 4, [True, True, False, True], [False, True, False, True]])
    shares = ForceLimits(reserve=0.04).least_normal_shares(standing)
    np.testing.assert_allclose(shares, [[0.02] * 4, [0.04, 0.04, 0, 0.04], [0, 0.04, 0, 0.04]])
    shares = ForceLimits(reserve=0.04, reserve_on_four=0.01).least_normal_shares(standing)
    np.testing.assert_allclose(shares[0], 0.01)


@pytest.mark.parametrize("name", ["wang2020", "a1", "go2", "anymal_c", "hyq"])
def test_limits_of_real_robots_are_limits(name: str) -> None:
    robot = gaitopt.load_robot(name)
    found = effort_limits(robot)
    assert found.unknown == ()
    np.testing.assert_array_equal(found.limits, robot.model.effortLimit[6:])


def test_the_limits_of_solo_are_placeholders() -> None:
    robot = gaitopt.load_robot("solo12")
    found = effort_limits(robot)
    assert found.unknown == robot.joint_names
    assert np.isinf(found.limits).all()
    low, high = torque_bounds(
        robot, ForceLimits(torque_line=TorqueLine(0.0, 0.5)), np.full(12, 1e9)
    )
    assert (low == -np.inf).all() and (high == np.inf).all()


def test_a_joint_without_effort_is_reported(wang: Quadruped) -> None:
    text = wang.urdf.replace('effort="50', 'effort="0')
    found = effort_limits(Quadruped.from_urdf(text, "weak"))
    assert found.unknown == tuple(n for n in wang.joint_names if n.endswith("KFE"))
    np.testing.assert_allclose(found.limits[:3], [75.0, 75.0, np.inf])


def test_driving_torque_falls_along_the_line_and_braking_torque_does_not(wang: Quadruped) -> None:
    limits = ForceLimits(torque_share=0.8, torque_line=TorqueLine(knee=0.5, no_load=1.5))
    speeds = np.zeros((5, 12))
    speeds[:, 0] = wang.velocity_limits[0] * np.array([0.0, 0.5, 1.0, -1.0, 2.0])
    low, high = torque_bounds(wang, limits, speeds)
    np.testing.assert_allclose(high[:, 0], np.array([60.0, 60.0, 30.0, 60.0, 0.0]))
    np.testing.assert_allclose(low[:, 0], np.array([-60.0, -60.0, -60.0, -30.0, -60.0]))
    np.testing.assert_allclose(high[:, 1:], np.tile([60, 40] + [60, 60, 40] * 3, (5, 1)))


@pytest.mark.parametrize(
    "wrong, words",
    [
        ({"friction": 0.0}, "friction"),
        ({"friction": float("nan")}, "friction"),
        ({"reserve": 0.5}, "reserve"),
        ({"reserve": -0.01}, "reserve"),
        ({"reserve_on_four": 0.3}, "reserve_on_four"),
        ({"torque_share": 1.01}, "torque_share"),
        ({"sides": 2}, "sides"),
        ({"torque_line": (0.5, 1.0)}, "torque_line"),
        ({"speed_share": 1.01}, "speed_share"),
    ],
)
def test_wrong_limits_are_refused(wrong: dict[str, object], words: str) -> None:
    with pytest.raises(InputError, match=words):
        ForceLimits(**wrong)  # type: ignore[arg-type]


def test_the_lower_speeds_of_both_lines_count(wang: Quadruped) -> None:
    """The motor's own line is in rad/s, that of the limits in shares of the velocity limit."""
    unit = float(wang.velocity_limits[0])
    names = {"LF_HAA": (0.8 * unit, 1.2 * unit), "LF_HFE": (0.1 * unit, 2.0 * unit)}
    robot = gaitopt.load_robot("wang2020", torque_line=names)
    asked = ForceLimits(torque_line=TorqueLine(knee=0.5, no_load=1.5))
    assert torque_lines(wang, ForceLimits()) is None
    for limits, knee, no_load in (
        (ForceLimits(), [0.8, 0.1, np.inf], [1.2, 2.0, np.inf]),
        (asked, [0.5, 0.1, 0.5], [1.2, 1.5, 1.5]),
        (replace(asked, speed_share=0.5), [0.25, 0.05, 0.25], [0.6, 0.75, 0.75]),
    ):
        found = torque_lines(robot, limits)
        assert found is not None
        np.testing.assert_allclose(found.knee[:3], unit * np.array(knee))
        np.testing.assert_allclose(found.no_load[:3], unit * np.array(no_load))
    # Nowhere is more torque left than either line leaves.
    speeds = np.random.default_rng(0).uniform(-2.0 * unit, 2.0 * unit, (200, 12))
    both = np.abs(torque_bounds(robot, asked, speeds))
    for other in (torque_bounds(wang, asked, speeds), torque_bounds(robot, ForceLimits(), speeds)):
        assert (both <= np.abs(other) + 1e-9).all()


def test_wrong_lines_normals_and_feet_are_refused() -> None:
    with pytest.raises(InputError, match="no_load must be above knee"):
        TorqueLine(0.5, 0.5)
    with pytest.raises(InputError, match="have a length"):
        pyramid_rows(ForceLimits(), (0.0, 0.0, 0.0))
    with pytest.raises(InputError, match="have a length"):
        unit_normals((0.0, np.nan, 1.0))
    with pytest.raises(InputError, match="straight down"):
        tangents((0.0, 0.0, -1.0))
    with pytest.raises(InputError, match="standing must be truth values"):
        Contacts.below_feet(np.zeros((4, 3)), np.ones(4))
    with pytest.raises(InputError, match="finite where they stand"):
        Contacts.below_feet(np.full((4, 3), np.nan), np.ones(4, dtype=bool))
