"""Base and joints from body and feet: held against Pinocchio, against differences, and by hand."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

import gaitopt
from gaitopt import InputError, MotionPath, Quadruped
from gaitopt.conventions import LEGS, FloatArray
from gaitopt.motion.body_and_feet import (
    base_poses,
    body_and_feet_path,
    foot_errors,
    largest_slip,
    path_states,
    slip_between,
)
from gaitopt.motion.differences import time_derivatives
from gaitopt.motion.pieces import States
from gaitopt.robots.rotations import rpy_to_matrix, rpy_to_quaternion
from gaitopt.robots.whole_body import joints_from_feet


@pytest.mark.parametrize("name", ["wang2020", "a1", "frog1"])
@pytest.mark.parametrize("heading", [0.0, 0.7, 9.0])
def test_the_base_is_where_pinocchio_puts_the_body_centre(name: str, heading: float) -> None:
    """By the mean of the four hips; and the base never turns by a whole turn at once."""
    robot = gaitopt.load_robot(name)
    rng = np.random.default_rng(0)
    centre, rpy = rng.normal(size=(20, 3)), rng.uniform(-0.3, 0.3, (20, 3))
    base = base_poses(robot, heading, centre, rpy)
    turned = pin.utils.rotate("z", heading)
    data = robot.model.createData()
    for row, c, angles in zip(base, centre, rpy, strict=True):
        q = np.concatenate([row[:3], rpy_to_quaternion(row[3:]), robot.neutral_joints()])
        pin.forwardKinematics(robot.model, data, q)
        found = data.oMi[1].act(robot.body_axes @ robot.centre)
        np.testing.assert_allclose(found, turned @ c, atol=1e-12)
        axes = data.oMi[1].rotation @ robot.body_axes
        np.testing.assert_allclose(axes, turned @ rpy_to_matrix(angles), atol=1e-12)
    assert np.abs(base[:, 5] - heading).max() < np.pi + 0.4


def test_a_level_body_has_no_roll_and_pitch_at_all(wang: Quadruped) -> None:
    base = base_poses(wang, 0.7, np.zeros((3, 3)))
    assert not base[:, 3:5].any()


def swaying(wang: Quadruped) -> tuple[FloatArray, FloatArray]:
    """A base pose and feet below it."""
    base = np.array([0.0, 0.0, wang.standing_height, 0.0, 0.0, 0.0])
    hips = np.array([wang.legs[leg].hip for leg in LEGS])
    return base, hips * [1.0, 1.0, 0.0]


def sine(values: FloatArray, amplitude: FloatArray, times: FloatArray) -> States:
    """``values + amplitude sin(t)`` and two derivatives, for each time."""
    lead = (slice(None),) + (None,) * values.ndim
    s, c = amplitude * np.sin(times)[lead], amplitude * np.cos(times)[lead]
    return values + s, c, -s


def test_derivatives_of_path_states_are_those_of_differences(wang: Quadruped) -> None:
    start, feet = swaying(wang)
    rng = np.random.default_rng(1)
    body, way = rng.uniform(-0.05, 0.05, 6), rng.uniform(-0.03, 0.03, (4, 3))

    def states(times: FloatArray) -> States:
        return path_states(wang, sine(start, body, times), sine(feet, way, 2.0 * times))

    # The feet's derivatives by the doubled time, put right by the chain rule.
    def chained(times: FloatArray) -> States:
        place, velocity, acceleration = sine(feet, way, 2.0 * times)
        return path_states(
            wang, sine(start, body, times), (place, 2.0 * velocity, 4.0 * acceleration)
        )

    times = np.linspace(0.0, 3.0, 11)
    first, second = time_derivatives(lambda t: states(t)[0], times, 1e-3)
    _, velocity, acceleration = chained(times)
    assert velocity == pytest.approx(first, abs=1e-8)
    assert acceleration == pytest.approx(second, abs=1e-6)


def test_a_path_keeps_the_feet_in_their_places(wang: Quadruped) -> None:
    start, feet = swaying(wang)
    body = np.array([0.05, 0.03, 0.02, 0.05, 0.05, 0.1])

    def still(times: FloatArray) -> States:
        zero = np.zeros((len(times), 4, 3))
        return feet + zero, zero, zero

    knots = np.linspace(0.0, 3.0, 4)
    path = body_and_feet_path(wang, knots, lambda t: sine(start, body, t), still, 1e-6)
    times = np.linspace(0.0, 3.0, 501)
    values = path.evaluate(times)
    places = np.broadcast_to(feet, (501, 4, 3))
    assert foot_errors(wang, values, places).max() < 2e-6
    assert path.jumps(1).max() < 1e-9 and path.jumps(2).max() < 1e-6
    with pytest.raises(InputError, match="does not reach"):
        body_and_feet_path(wang, knots, lambda t: sine(start, 9.0 * body, t), still, 1e-6)


def test_slip_is_that_of_the_worst_standing_foot(wang: Quadruped) -> None:
    start, feet = swaying(wang)
    joints = joints_from_feet(wang, start[:3], start[3:], feet)
    values = np.concatenate([start, joints])[None].repeat(3, axis=0)
    places = feet[None].repeat(3, axis=0)
    places[:, 1, 0] += 0.02
    places[:, 3, 1] -= 0.05
    standing = np.array([[True] * 4, [True, True, True, False], [False] * 4])
    assert largest_slip(wang, values, places, standing) == pytest.approx([0.05, 0.02, 0.0])


def test_slip_between_knots_is_that_of_the_chord(wang: Quadruped) -> None:
    """Body and joints half-way between two knots, where a polyline's feet are off most."""
    start, feet = swaying(wang)
    base = np.stack([start, start])
    base[1, 0] += 0.1
    places = np.stack([feet, feet])
    joints = joints_from_feet(wang, base[:, :3], base[:, 3:], places)
    values = np.concatenate([base, joints], axis=1)
    standing = np.ones((1, 4), dtype=np.bool_)
    path = MotionPath.polyline([0.0, 1.0], values)
    along = foot_errors(wang, path.evaluate(np.linspace(0, 1, 101)), feet[None].repeat(101, 0))
    assert slip_between(wang, values, places[:1], standing) == pytest.approx(along.max(), rel=2e-2)
