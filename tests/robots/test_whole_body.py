"""Whole-body kinematics, with Pinocchio and numerical derivatives as judges."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any, NamedTuple

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from gaitopt import Plan
from gaitopt.conventions import LEGS, FloatArray
from gaitopt.errors import InputError
from gaitopt.robots.catalog import load_robot, robot_names
from gaitopt.robots.frames import hip_frames, homogeneous, inverse_homogeneous
from gaitopt.robots.quadruped import Quadruped
from gaitopt.robots.rotations import (
    angular_to_rpy_rates,
    matrix_to_rpy,
    quaternion_to_matrix,
    quaternion_to_rpy,
    rpy_accelerations_to_angular,
    rpy_derivatives,
    rpy_rates_to_angular,
    rpy_to_matrix,
    rpy_to_quaternion,
)
from gaitopt.robots.whole_body import (
    configuration,
    feet_from_joints,
    from_configuration,
    joints_from_feet,
)
from gaitopt.robots.whole_body_rates import (
    base_twist,
    base_twist_rate,
    joint_accelerations,
    joint_motions,
    joint_rates,
)

robot = cache(load_robot)
each_robot = pytest.mark.parametrize("name", robot_names())
UP = np.array([0.0, 0.0, 1.0])
turns = st.tuples(*3 * [st.floats(-3.1, 3.1)])
level = st.tuples(st.floats(-3.1, 3.1), st.floats(-1.5, 1.5), st.floats(-3.1, 3.1))


class Poses(NamedTuple):
    """Bodies anywhere, with legs on their own branch and well within reach."""

    position: FloatArray
    rpy: FloatArray
    joints: FloatArray


def poses(model: Quadruped, count: int, seed: int = 0) -> Poses:
    rng = np.random.default_rng(seed)
    joints = np.tile(model.neutral_joints(), (count, 1))
    for name, leg in model.legs.items():
        low, high = leg.least_reach, leg.reach
        span = low + (high - low) * rng.uniform(0.3, 0.9, count)
        pitch, roll = rng.uniform(-0.6, 0.6, count), rng.uniform(-0.4, 0.4, count)
        depth = -leg.drop - span * np.cos(pitch)
        if not leg.has_roll:
            roll = 0.0 * roll
        y = leg.lateral * np.cos(roll) - depth * np.sin(roll)
        z = leg.lateral * np.sin(roll) + depth * np.cos(roll)
        feet = leg.hip + np.stack([span * np.sin(pitch), y, z], axis=-1) @ leg.axes.T
        joints[:, list(model.leg_columns[name])] = leg.inverse(feet)
    rpy = rng.uniform(-1, 1, (count, 3)) * [0.5, 0.5, 3.0]
    return Poses(rng.uniform(-2, 2, (count, 3)), rpy, joints)


def pinocchio_feet(model: Quadruped, q: FloatArray, v: FloatArray, a: FloatArray) -> FloatArray:
    """Places, velocities and accelerations of the feet in the world ``(N, 3, 4, 3)``."""
    data, out = model.model.createData(), []
    ids = [model.model.getFrameId(model.legs[leg].foot) for leg in LEGS]
    world = pin.LOCAL_WORLD_ALIGNED
    for row in zip(q, v, a, strict=True):
        pin.forwardKinematics(model.model, data, *row)
        pin.updateFramePlacements(model.model, data)
        speed = [pin.getFrameVelocity(model.model, data, i, world).linear for i in ids]
        pull = [pin.getFrameClassicalAcceleration(model.model, data, i, world).linear for i in ids]
        out.append([[data.oMf[i].translation.copy() for i in ids], speed, pull])
    return np.array(out)


def slope(values: Callable[[float], FloatArray], step: float = 1e-3) -> FloatArray:
    """Derivative at 0 from four samples; its error is of the fourth order in ``step``."""
    near, far = (values(s * step) - values(-s * step) for s in (1.0, 2.0))
    return (8.0 * near - far) / (12.0 * step)


# --- rotations --------------------------------------------------------------------------------


@given(turns)
def test_roll_pitch_yaw_is_pinocchios(rpy: tuple[float, float, float]) -> None:
    matrix = rpy_to_matrix(rpy)
    np.testing.assert_allclose(matrix, pin.rpy.rpyToMatrix(*rpy), rtol=0, atol=1e-14)
    theirs = pin.Quaternion(matrix).coeffs()
    ours = rpy_to_quaternion(rpy)
    np.testing.assert_allclose(ours * np.sign(ours @ theirs), theirs, rtol=0, atol=1e-14)
    np.testing.assert_allclose(quaternion_to_matrix(ours), matrix, rtol=0, atol=1e-14)


@given(level)
def test_angles_lead_back_to_themselves(rpy: tuple[float, float, float]) -> None:
    np.testing.assert_allclose(matrix_to_rpy(rpy_to_matrix(rpy)), rpy, rtol=0, atol=1e-13)
    np.testing.assert_allclose(quaternion_to_rpy(rpy_to_quaternion(rpy)), rpy, rtol=0, atol=1e-13)


@given(turns)
@example((0.3, np.pi / 2, 1.2))
@example((-2.0, -np.pi / 2, 0.4))
@example((1.0, np.pi / 2 - 1e-9, 0.2))
def test_every_rotation_is_made_again_from_its_angles(rpy: tuple[float, float, float]) -> None:
    """Also upright, where roll and yaw turn about the same axis."""
    matrix = rpy_to_matrix(rpy)
    again = matrix_to_rpy(matrix)
    np.testing.assert_allclose(rpy_to_matrix(again), matrix, rtol=0, atol=1e-14)
    assert abs(again[1]) <= np.pi / 2 and np.abs(again).max() <= np.pi


def test_quaternions_of_any_length_are_their_rotation() -> None:
    quaternion = np.array([0.1, -0.5, 0.3, 0.8])
    unit = pin.Quaternion(quaternion / np.linalg.norm(quaternion)).toRotationMatrix()
    for scale in (1.0, -1.0, 1e-3, 40.0):
        np.testing.assert_allclose(quaternion_to_matrix(scale * quaternion), unit, atol=1e-15)


def test_the_zero_quaternion_is_no_rotation() -> None:
    with pytest.raises(InputError) as caught:
        quaternion_to_rpy([[0.0, 0.0, 0.0, 1.0], [0.0, 0.0, 0.0, 0.0]])
    assert str(caught.value) == (
        "quaternion (1,) is zero, which is no rotation; no rotation at all is (0, 0, 0, 1)"
    )


@given(level, turns)
def test_angular_velocity_is_pinocchios_and_leads_back_to_the_rates(
    rpy: tuple[float, float, float], rates: tuple[float, float, float]
) -> None:
    jacobian = pin.rpy.computeRpyJacobian(np.array(rpy), pin.LOCAL)
    ours = rpy_rates_to_angular(rpy, rates)
    np.testing.assert_allclose(ours, jacobian @ rates, rtol=0, atol=1e-14)
    np.testing.assert_allclose(angular_to_rpy_rates(rpy, ours), rates, rtol=0, atol=1e-12)


@given(level, turns, turns)
def test_angular_acceleration_is_pinocchios(
    rpy: tuple[float, float, float],
    rates: tuple[float, float, float],
    accelerations: tuple[float, float, float],
) -> None:
    angles, speeds = np.array(rpy), np.array(rates)
    expected = pin.rpy.computeRpyJacobian(angles, pin.LOCAL) @ accelerations
    expected += pin.rpy.computeRpyJacobianTimeDerivative(angles, speeds, pin.LOCAL) @ speeds
    ours = rpy_accelerations_to_angular(rpy, rates, accelerations)
    np.testing.assert_allclose(ours, expected, rtol=0, atol=1e-13)


def test_derivatives_of_rotations_are_those_of_differences() -> None:
    angles, step = np.random.default_rng(0).uniform(-1, 1, (6, 3)), 1e-6
    first, second = rpy_derivatives(angles)
    pairs = [(a, b) for a in range(3) for b in range(a, 3)]
    for a in range(3):
        ends = [angles + s * step * np.eye(3)[a] for s in (1, -1)]
        ahead, behind = (rpy_to_matrix(end) for end in ends)
        np.testing.assert_allclose(first[a], (ahead - behind) / (2 * step), rtol=0, atol=1e-9)
        ahead, behind = (rpy_derivatives(end)[0] for end in ends)
        for k, (i, j) in enumerate(pairs):
            if a in (i, j):
                slope = (ahead - behind)[j if a == i else i] / (2 * step)
                np.testing.assert_allclose(second[k], slope, rtol=0, atol=1e-9)


def test_rotations_take_any_leading_axes() -> None:
    rng = np.random.default_rng(0)
    rpy, rates = rng.uniform(-1, 1, (2, 5, 7, 3))
    quaternion = rpy_to_quaternion(rpy)
    assert rpy_to_matrix(rpy).shape == quaternion_to_matrix(quaternion).shape == (5, 7, 3, 3)
    for whole, part in zip(rpy_derivatives(rpy), rpy_derivatives(rpy[3, 4]), strict=True):
        np.testing.assert_allclose(whole[:, 3, 4], part, rtol=0, atol=1e-15)
    np.testing.assert_array_equal(quaternion_to_rpy(quaternion)[3, 4], quaternion_to_rpy(
        quaternion[3, 4]))  # fmt: skip
    np.testing.assert_array_equal(
        rpy_accelerations_to_angular(rpy, rates, rates)[1, 2],
        rpy_accelerations_to_angular(rpy[1, 2], rates[1, 2], rates[1, 2]),
    )


# --- frames -----------------------------------------------------------------------------------


@given(turns, turns, turns)
def test_transforms_are_pinocchios_and_their_inverses_undo_them(
    position: tuple[float, float, float],
    rpy: tuple[float, float, float],
    point: tuple[float, float, float],
) -> None:
    ours = homogeneous(position, rpy)
    theirs = pin.SE3(pin.rpy.rpyToMatrix(*rpy), np.array(position))
    np.testing.assert_allclose(ours, theirs.homogeneous, rtol=0, atol=1e-14)
    back = inverse_homogeneous(ours)
    np.testing.assert_allclose(back, theirs.inverse().homogeneous, rtol=0, atol=1e-14)
    np.testing.assert_allclose(back @ ours @ [*point, 1.0], [*point, 1.0], rtol=0, atol=1e-14)


def test_hips_of_a_rectangular_body_are_its_corners() -> None:
    """[XiLing], Module C, Section 1.5: [l_b/2, w_b/2, 0] for leg 1, and so on round the body."""
    frames = hip_frames(robot("wang2020"))
    corners = 0.5 * np.array([[0.4, 0.3], [-0.4, 0.3], [-0.4, -0.3], [0.4, -0.3]])
    np.testing.assert_allclose(frames[:, :2, 3], corners, rtol=0, atol=1e-14)
    np.testing.assert_allclose(frames[:, 2, 3], 0.0, rtol=0, atol=1e-14)
    np.testing.assert_allclose(frames[:, :3, :3], np.tile(np.eye(3), (4, 1, 1)), atol=1e-15)


@each_robot
def test_hip_frames_lie_on_the_first_axis_of_their_legs(name: str) -> None:
    """Origin on the first joint's axis, that axis along the frame's x (or y without roll)."""
    model = robot(name)
    data = model.model.createData()
    pin.forwardKinematics(model.model, data, pin.neutral(model.model))
    for frame, leg in zip(hip_frames(model), model.legs.values(), strict=True):
        joint = model.model.getJointId(leg.joints[0])
        column = pin.computeJointJacobian(
            model.model, data, pin.neutral(model.model), joint
        )[:, model.model.joints[joint].idx_v]  # fmt: skip
        axis = model.body_axes.T @ data.oMi[joint].rotation @ column[3:]
        origin = model.body_axes.T @ data.oMi[joint].translation
        first = frame[:3, 0] if leg.has_roll else frame[:3, 1]
        assert abs(axis @ first) == pytest.approx(1.0, abs=1e-9)
        np.testing.assert_allclose(np.cross(frame[:3, 3] - origin, axis), 0, rtol=0, atol=1e-9)
        np.testing.assert_array_equal(frame[3], [0, 0, 0, 1])


@each_robot
def test_a_chain_of_transforms_leads_from_the_leg_to_the_world(name: str) -> None:
    """p_W = T_{W,B} T_{B,Li} p_Li, for a robot whose base faces along y as for the others."""
    model = robot(name)
    body = poses(model, 20, seed=1)
    turned = np.eye(4)
    turned[:3, :3] = model.body_axes
    frames = homogeneous(body.position, body.rpy)[:, None] @ turned @ hip_frames(model)
    feet = feet_from_joints(model, *body)
    local = np.einsum(
        "nlij,nlj->nli", inverse_homogeneous(frames), np.append(feet, np.ones((20, 4, 1)), -1)
    )
    for i, leg in enumerate(model.legs.values()):
        columns = list(model.leg_columns[leg.name])
        own = (leg.forward(body.joints[:, columns]) - leg.hip) @ leg.axes
        np.testing.assert_allclose(local[:, i, :3], own, rtol=0, atol=1e-14)


# --- configurations ---------------------------------------------------------------------------


@each_robot
def test_configurations_are_pinocchios(name: str) -> None:
    model = robot(name)
    body = poses(model, 30, seed=2)
    q = configuration(model, *body)
    still = np.zeros((30, model.model.nv))
    for row in q:
        assert pin.isNormalized(model.model, row, 1e-14)
    theirs = pinocchio_feet(model, q, still, still)[:, 0]
    np.testing.assert_allclose(feet_from_joints(model, *body), theirs, rtol=0, atol=1e-9)


@each_robot
def test_configurations_lead_back_to_position_angles_and_joints(name: str) -> None:
    model = robot(name)
    body = poses(model, 30, seed=3)
    back = from_configuration(model, configuration(model, *body))
    np.testing.assert_array_equal(back.position, body.position)
    np.testing.assert_allclose(back.rpy, body.rpy, rtol=0, atol=1e-14)
    np.testing.assert_array_equal(back.joints, body.joints)


def test_from_configuration_is_a_copy() -> None:
    q = configuration(robot("a1"), np.zeros(3), np.zeros(3), np.zeros(12))
    back = from_configuration(robot("a1"), q)
    q[:] = 9.0
    assert not back.position.any() and not back.joints.any()


def test_a_base_twist_is_what_pinocchio_integrates() -> None:
    """Base velocity and acceleration of a smooth motion, from places Pinocchio differences."""
    model, rng = robot("a1"), np.random.default_rng(4)
    shape = rng.uniform(-0.5, 0.5, (3, 6))

    def path(t: float, order: int) -> FloatArray:
        powers = np.array([[1.0, t, t * t / 2], [0.0, 1.0, t], [0.0, 0.0, 1.0]])
        return np.asarray(powers[order] @ shape)

    def place(t: float) -> FloatArray:
        return configuration(model, path(t, 0)[:3], path(t, 0)[3:], np.zeros(12))

    def twist(t: float) -> FloatArray:
        return base_twist(path(t, 0)[3:], path(t, 1)[:3], path(t, 1)[3:])

    difference = slope(lambda t: pin.difference(model.model, place(0.0), place(t)))
    np.testing.assert_allclose(twist(0.0), difference[:6], rtol=0, atol=1e-10)
    found = base_twist_rate(
        path(0.0, 0)[3:], path(0.0, 1)[:3], path(0.0, 1)[3:], path(0.0, 2)[:3], path(0.0, 2)[3:]
    )
    np.testing.assert_allclose(found, slope(twist), rtol=0, atol=1e-10)


# --- feet and joints --------------------------------------------------------------------------


@each_robot
def test_joints_of_feet_put_pinocchios_feet_there(name: str) -> None:
    model = robot(name)
    body = poses(model, 60, seed=5)
    feet = feet_from_joints(model, *body)
    joints = joints_from_feet(model, body.position, body.rpy, feet)
    np.testing.assert_allclose(joints, body.joints, rtol=0, atol=1e-9)
    q = configuration(model, body.position, body.rpy, joints)
    still = np.zeros((60, model.model.nv))
    np.testing.assert_allclose(pinocchio_feet(model, q, still, still)[:, 0], feet, atol=1e-9)


@each_robot
def test_standing_feet_stay_where_they_are_below_a_moving_body(name: str) -> None:
    """[XiLing], Module C, Section 4.2: body moved and turned within the legs' reach."""
    model = robot(name)
    joints = poses(model, 1, seed=6).joints
    feet = feet_from_joints(model, np.zeros(3), np.zeros(3), joints)
    rng, size = np.random.default_rng(6), 0.05 * model.standing_height
    roll = float(all(leg.has_roll for leg in model.legs.values()))
    # Without roll joints the body keeps to the plane in which the legs move.
    sagittal = model.body_axes[:, [0, 2]].T
    position = rng.uniform(-size, size, (40, 3 if roll else 2))
    rpy = rng.uniform(-0.05, 0.05, (40, 3)) * roll
    if not roll:
        position = position @ sagittal
    moved = joints_from_feet(model, position, rpy, feet)
    again = feet_from_joints(model, position, rpy, moved)
    np.testing.assert_allclose(again, np.tile(feet, (40, 1, 1)), rtol=0, atol=1e-12)


def test_a_plans_own_joints_are_found_again(short_plan: Plan) -> None:
    motion = short_plan.at(np.linspace(0.0, short_plan.duration, 200))
    model = short_plan.robot
    body = from_configuration(model, motion.q)
    np.testing.assert_allclose(feet_from_joints(model, *body), motion.feet, rtol=0, atol=1e-14)
    joints = joints_from_feet(model, body.position, body.rpy, motion.feet)
    np.testing.assert_allclose(joints, motion.q[:, 7:], rtol=0, atol=1e-9)


def test_a_base_that_faces_along_y_stands_on_feet_ahead_of_its_hips() -> None:
    model = robot("quadruped")
    feet = feet_from_joints(model, [0.0, 0.0, 0.3], np.zeros(3), model.neutral_joints())
    names = dict(zip(LEGS, feet, strict=True))
    assert names["LF"][1] > 0.1 and names["LF"][0] < -0.05  # forward is y, left is -x
    assert names["RH"][1] < -0.1 and names["RH"][0] > 0.05


@each_robot
def test_many_samples_are_the_samples_one_by_one(name: str) -> None:
    model = robot(name)
    body = poses(model, 6, seed=7)
    feet = feet_from_joints(model, *body).reshape(2, 3, 4, 3)
    position, rpy = body.position.reshape(2, 3, 3), body.rpy.reshape(2, 3, 3)
    joints = joints_from_feet(model, position, rpy, feet)
    assert joints.shape == (2, 3, len(model.joint_names))
    alone = joints_from_feet(model, position[1, 2], rpy[1, 2], feet[1, 2])
    # Numpy multiplies one matrix and many in another order.
    np.testing.assert_allclose(joints[1, 2], alone, rtol=0, atol=1e-12)
    one_body = joints_from_feet(model, position[0, 0], rpy[0, 0], feet[:1, :1])
    np.testing.assert_allclose(one_body[0, 0], joints[0, 0], rtol=0, atol=1e-12)


def test_joints_that_no_leg_owns_are_neutral() -> None:
    urdf = robot("wang2020").urdf.replace(
        "</robot>",
        '<link name="arm"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" '
        'ixz="0" iyz="0"/></inertial></link><joint name="AAA" type="revolute"><parent link="base"/>'
        '<child link="arm"/><axis xyz="0 0 1"/><limit lower="0.5" upper="1" effort="1" '
        'velocity="1"/></joint></robot>',
    )
    model, plain = Quadruped.from_urdf(urdf), robot("wang2020")
    body = poses(plain, 5, seed=8)
    feet = feet_from_joints(plain, *body)
    joints = joints_from_feet(model, body.position, body.rpy, feet)
    arm = model.joint_names.index("AAA")
    np.testing.assert_array_equal(joints[:, arm], 0.5)
    np.testing.assert_allclose(np.delete(joints, arm, 1), body.joints, rtol=0, atol=1e-9)
    rates = joint_rates(model, body.rpy, joints, np.ones(6), np.zeros((4, 3)))
    assert not rates[:, arm].any() and rates.any()


# --- out of reach -----------------------------------------------------------------------------


def standing(name: str, height: float) -> tuple[Quadruped, FloatArray, FloatArray]:
    """A robot, two samples of its body at a height, and feet straight below its hips."""
    model = robot(name)
    legs = model.legs.values()
    below = [leg.hip + leg.axes @ [0.0, leg.lateral, -leg.hip[2]] for leg in legs]
    feet = np.array(below) @ model.body_axes.T
    feet[:, 2] = 0.0
    return model, np.array([[0.0, 0.0, height]] * 2), np.tile(feet, (2, 1, 1))


def test_a_foot_out_of_reach_is_named_with_its_sample_and_its_distance() -> None:
    model, position, feet = standing("wang2020", 0.4)
    feet[1, 2] = [-0.2 - 0.56, -0.15, -0.02]
    with pytest.raises(InputError) as caught:
        joints_from_feet(model, position, np.zeros(3), feet)
    assert str(caught.value) == (
        "wang2020: leg RH does not reach its foot at sample 1: it is 0.7 m from the hip's "
        "pitch axis, and the knee allows 0.1013 to 0.57 m (0.13 m short); move the body or the foot"
    )


def test_a_mask_says_which_feet_are_reached() -> None:
    model, position, feet = standing("wang2020", 0.4)
    feet[1, 2, 0] -= 0.5
    feet[0, 3] = np.nan
    joints, reached = joints_from_feet(
        model, position, np.zeros(3), feet, on_unreachable="mask"
    )  # fmt: skip
    expected = np.ones((2, 4), dtype=bool)
    expected[1, 2] = expected[0, 3] = False
    np.testing.assert_array_equal(reached, expected)
    again = feet_from_joints(model, position, np.zeros(3), joints)
    np.testing.assert_allclose(again[reached], feet[reached], rtol=0, atol=1e-14)
    # The straight leg towards it: 0.57 of the way's hypot(0.5, 0.4) m.
    hip = np.array([-0.2, -0.15, 0.4])
    straight = hip + 0.57 / np.hypot(0.5, 0.4) * (feet[1, 2] - hip)
    np.testing.assert_allclose(again[1, 2], straight, rtol=0, atol=1e-12)


def test_the_very_end_of_the_reach_is_within_reach() -> None:
    model, position, feet = standing("wang2020", 0.57)
    joints = joints_from_feet(model, position, np.zeros(3), feet)
    assert np.abs(joints).max() < 1e-7
    with pytest.raises(InputError, match=r"0\.57 m \(2e-09 m short\)"):
        joints_from_feet(model, position + 2e-9 * UP, np.zeros(3), feet)


def test_a_leg_without_roll_does_not_reach_beside_its_plane() -> None:
    model, position, feet = standing("solo8", 0.25)
    assert joints_from_feet(model, position, np.zeros(3), feet).shape == (2, 8)
    feet[0, 1, 1] += 0.03
    with pytest.raises(InputError) as caught:
        joints_from_feet(model, position[0], np.zeros(3), feet[0])
    assert "leg LH does not reach its foot: it is 0.25 m from" in str(caught.value)
    assert "and 0.03 m beside the plane of a leg without roll (0.03 m short)" in str(caught.value)
    # A body that rolls takes the leg's plane with it.
    _, reached = joints_from_feet(
        model, position, [[0.0, 0.1, 0.0], [0.05, 0.0, 0.0]], feet[1], on_unreachable="mask"
    )
    assert reached.tolist() == [[True] * 4, [False] * 4]


def test_a_foot_beside_the_hip_is_nearer_than_the_offset() -> None:
    model, position, feet = standing("anymal_c", 0.5)
    feet[0, 0] = model.legs["LF"].hip + position[0] + [0.3, 0.0, 0.0]
    with pytest.raises(InputError, match=r"nearer to its roll axis than its sideways offset of "
                       r"0\.1972 m \(0\.197 m short\)"):  # fmt: skip
        joints_from_feet(model, position, np.zeros(3), feet)


def test_a_place_that_is_no_number_is_no_place() -> None:
    model, position, feet = standing("a1", 0.3)
    feet[1, 3, 2] = np.nan
    with pytest.raises(InputError, match="a1: the place asked for foot RF at sample 1 is not fin"):
        joints_from_feet(model, position, np.zeros(3), feet)


# --- velocities and accelerations -------------------------------------------------------------


@each_robot
def test_rates_and_accelerations_of_pinocchios_feet_are_the_joints_own(name: str) -> None:
    """Feet moved by Pinocchio with random v and a; the closed form finds both again."""
    model = robot(name)
    body, rng = poses(model, 60, seed=9), np.random.default_rng(9)
    q = configuration(model, *body)
    v, a = rng.uniform(-2, 2, (60, model.model.nv)), rng.uniform(-9, 9, (60, model.model.nv))
    places, speeds, pulls = np.moveaxis(pinocchio_feet(model, q, v, a), 1, 0)
    np.testing.assert_allclose(places, feet_from_joints(model, *body), rtol=0, atol=1e-9)
    rates = joint_rates(model, body.rpy, body.joints, v[:, :6], speeds)
    np.testing.assert_allclose(rates, v[:, 6:], rtol=0, atol=1e-8)
    found = joint_accelerations(model, body.rpy, body.joints, v[:, :6], v[:, 6:], a[:, :6], pulls)
    np.testing.assert_allclose(found, a[:, 6:], rtol=0, atol=1e-7)
    both = joint_motions(model, body.rpy, body.joints, (v[:, :6], a[:, :6]), (speeds, pulls))
    np.testing.assert_allclose(both[0], rates, rtol=0, atol=1e-12)
    np.testing.assert_allclose(both[1], found, rtol=0, atol=1e-7)


@each_robot
def test_rates_and_accelerations_are_the_slopes_of_the_joints(name: str) -> None:
    """Along a motion of body and feet given in time, differenced numerically."""
    model, rng = robot(name), np.random.default_rng(10)
    start = poses(model, 1, seed=10)
    feet = feet_from_joints(model, *start)[0]
    ends = np.concatenate([start.position[0], start.rpy[0]])
    if all(leg.has_roll for leg in model.legs.values()):
        body_shape, foot_shape = rng.uniform(-0.2, 0.2, (2, 6)), rng.uniform(-0.2, 0.2, (2, 4, 3))
    else:  # within the legs' planes
        across = rpy_to_matrix(start.rpy[0]) @ model.body_axes[:, [0, 2]]
        body_shape = np.zeros((2, 6))
        body_shape[:, :3] = rng.uniform(-0.2, 0.2, (2, 2)) @ across.T
        foot_shape = rng.uniform(-0.2, 0.2, (2, 4, 2)) @ across.T

    def along(start: FloatArray, shape: FloatArray, t: float, order: int) -> Any:
        speed, pull = shape
        return (start + speed * t + pull * t * t / 2, speed + pull * t, pull)[order]

    def joints(t: float) -> FloatArray:
        body = along(ends, body_shape, t, 0)
        return joints_from_feet(model, body[:3], body[3:], along(feet, foot_shape, t, 0))

    def twist(t: float) -> FloatArray:
        place, speed = (along(ends, body_shape, t, k) for k in (0, 1))
        return base_twist(place[3:], speed[:3], speed[3:])

    def rates(t: float) -> FloatArray:
        rpy, speed = along(ends, body_shape, t, 0)[3:], along(feet, foot_shape, t, 1)
        return joint_rates(model, rpy, joints(t), twist(t), speed)

    np.testing.assert_allclose(rates(0.0), slope(joints), rtol=0, atol=1e-7)
    (speed, pull), rpy = body_shape, start.rpy[0]
    found = joint_accelerations(
        model, rpy, joints(0.0), twist(0.0), rates(0.0),
        base_twist_rate(rpy, speed[:3], speed[3:], pull[:3], pull[3:]), foot_shape[1],
    )  # fmt: skip
    np.testing.assert_allclose(found, slope(rates), rtol=0, atol=1e-6)


@each_robot
def test_rate_of_the_jacobian_is_pinocchios(name: str) -> None:
    """Any joint angles, also beyond limits and on no branch; the base at rest."""
    model, rng = robot(name), np.random.default_rng(11)
    data, world = model.model.createData(), pin.LOCAL_WORLD_ALIGNED
    q, v = pin.neutral(model.model), np.zeros(model.model.nv)
    for _ in range(30):
        q[7:], v[6:] = rng.uniform(-np.pi, np.pi, len(q) - 7), rng.uniform(-3, 3, len(v) - 6)
        pin.computeJointJacobiansTimeVariation(model.model, data, q, v)
        pin.updateFramePlacements(model.model, data)
        for leg in model.legs.values():
            columns = list(model.leg_columns[leg.name])
            frame = model.model.getFrameId(leg.foot)
            full = pin.getFrameJacobianTimeVariation(model.model, data, frame, world)
            theirs = model.body_axes.T @ full[:3, [6 + c for c in columns]]
            ours = leg.jacobian_rate(q[7:][columns], v[6:][columns])
            np.testing.assert_allclose(ours, theirs, rtol=0, atol=1e-8)


@each_robot
def test_rate_of_the_jacobian_is_its_slope(name: str) -> None:
    rng = np.random.default_rng(12)
    for leg in robot(name).legs.values():
        q, dq = rng.uniform(-np.pi, np.pi, (2, 30, len(leg.joints)))
        expected = slope(lambda t, leg=leg, q=q, dq=dq: leg.jacobian(q + t * dq))  # type: ignore[misc]
        np.testing.assert_allclose(leg.jacobian_rate(q, dq), expected, rtol=0, atol=1e-9)


def test_feet_that_stand_need_no_rates_below_a_body_at_rest() -> None:
    model = robot("a1")
    body = poses(model, 4, seed=13)
    rates = joint_rates(model, body.rpy, body.joints, np.zeros(6), np.zeros((4, 3)))
    np.testing.assert_array_equal(rates, 0.0)


def test_a_stiff_robot_carries_its_feet_along() -> None:
    """Feet that move with the body as one rigid whole ask nothing of the joints."""
    model, rng = robot("anymal_c"), np.random.default_rng(14)
    body = poses(model, 30, seed=14)
    twist, change = rng.uniform(-1, 1, (2, 30, 6))
    v, a = np.zeros((2, 30, model.model.nv))
    v[:, :6], a[:, :6] = twist, change
    q = configuration(model, *body)
    _, speeds, pulls = np.moveaxis(pinocchio_feet(model, q, v, a), 1, 0)
    rates = joint_rates(model, body.rpy, body.joints, twist, speeds)
    np.testing.assert_allclose(rates, 0.0, rtol=0, atol=1e-9)
    found = joint_accelerations(model, body.rpy, body.joints, twist, 0 * rates, change, pulls)
    np.testing.assert_allclose(found, 0.0, rtol=0, atol=1e-9)


def test_a_leg_without_roll_follows_within_its_plane() -> None:
    model = robot("solo8")
    body = poses(model, 10, seed=15)
    body = body._replace(rpy=np.zeros((10, 3)))
    aside = np.tile([0.0, 1.0, 0.0], (4, 1))
    still = joint_rates(model, body.rpy, body.joints, np.zeros(6), aside)
    np.testing.assert_allclose(still, 0.0, rtol=0, atol=1e-14)
    ahead = np.tile([0.3, 0.0, -0.2], (4, 1))
    rates = joint_rates(model, body.rpy, body.joints, np.zeros(6), ahead + aside)
    np.testing.assert_allclose(
        rates, joint_rates(model, body.rpy, body.joints, np.zeros(6), ahead), rtol=0, atol=1e-13
    )


def test_a_straight_leg_has_no_rates() -> None:
    model, position, feet = standing("wang2020", 0.4)
    joints = joints_from_feet(model, position, np.zeros(3), feet)
    joints[1, list(model.leg_columns["LH"])] = 0.0
    ahead = np.tile([0.1, 0.0, 0.0], (4, 1))
    with pytest.raises(InputError) as caught:
        joint_rates(model, np.zeros(3), joints, np.zeros(6), ahead)
    assert str(caught.value) == (
        "wang2020: no finite joint velocity moves foot LH in all directions at sample 1: the leg "
        "is straight or folded, or its foot is on the roll axis; keep off the end of its reach, "
        "or ask with on_singular='nan'"
    )
    rates = joint_rates(model, np.zeros(3), joints, np.zeros(6), ahead, on_singular="nan")
    unknown = np.zeros((2, 12), dtype=bool)
    unknown[1, list(model.leg_columns["LH"])] = True
    np.testing.assert_array_equal(np.isnan(rates), unknown)
    with pytest.raises(InputError, match="foot LH"):
        joint_accelerations(
            model, np.zeros(3), joints, np.zeros(6), np.zeros(12), np.zeros(6), ahead
        )


@each_robot
def test_a_leg_bent_by_a_millionth_has_rates_and_a_straight_one_none(name: str) -> None:
    """Rates of the bent one grow as one over its bend, whatever the robot's size."""
    model = robot(name)
    leg, columns = model.legs["RH"], list(model.leg_columns["RH"])
    joints, up = poses(model, 1, seed=17).joints[0], np.zeros((4, 3))
    up[2] = model.body_axes @ leg.axes @ [0.0, 0.0, 1.0]
    bends = []
    for bend in (1e-4, 1e-6, 1e-13):
        joints[columns] = 0.0
        joints[columns[-2]] = -leg.signs[-2] * leg.zeros[0]
        joints[columns[-1]] = leg.signs[-1] * (leg.knee * bend - leg.zeros[1])
        rates = joint_rates(model, np.zeros(3), joints, np.zeros(6), up, on_singular="nan")
        bends.append(rates[columns[-1]])
    assert abs(bends[1] / bends[0]) == pytest.approx(100.0, rel=1e-3)
    assert np.isnan(bends[2])


def test_velocities_are_broadcast() -> None:
    model = robot("hyq")
    body = poses(model, 6, seed=16)
    rng = np.random.default_rng(16)
    twist, speeds = rng.normal(size=(5, 1, 6)), rng.normal(size=(4, 3))
    rates = joint_rates(model, body.rpy, body.joints, twist, speeds)
    assert rates.shape == (5, 6, 12)
    alone = joint_rates(model, body.rpy[4], body.joints[4], twist[3, 0], speeds)
    np.testing.assert_allclose(rates[3, 4], alone, rtol=0, atol=1e-12)
    found = joint_accelerations(model, body.rpy, body.joints, twist, rates, twist, speeds)
    assert found.shape == (5, 6, 12)


# --- what is refused --------------------------------------------------------------------------


def test_arrays_of_another_shape_are_refused() -> None:
    model, three = robot("a1"), np.zeros(3)
    with pytest.raises(InputError, match=r"feet must be \(\.\.\., 4, 3\), got \(3, 3\)"):
        joints_from_feet(model, three, three, np.zeros((3, 3)))
    with pytest.raises(InputError, match=r"joints must be \(\.\.\., 12\), got \(8,\)"):
        feet_from_joints(model, three, three, np.zeros(8))
    with pytest.raises(InputError, match=r"position must be \(\.\.\., 3\), got \(2,\)"):
        configuration(model, np.zeros(2), three, np.zeros(12))
    with pytest.raises(InputError, match=r"q must be \(\.\.\., 19\), got \(18,\)"):
        from_configuration(model, np.zeros(18))
    with pytest.raises(InputError, match=r"twist must be \(\.\.\., 6\), got \(3,\)"):
        joint_rates(model, three, np.zeros(12), three, np.zeros((4, 3)))
    with pytest.raises(InputError, match=r"rates must be \(\.\.\., 3\), got \(2,\)"):
        model.legs["LF"].jacobian_rate(three, np.zeros(2))
    with pytest.raises(InputError, match=r"transform must be \(\.\.\., 4, 4\), got \(3, 3\)"):
        inverse_homogeneous(np.eye(3))


def test_unknown_wishes_are_refused() -> None:
    model, position, feet = standing("a1", 0.3)
    with pytest.raises(InputError, match="on_unreachable must be 'raise' or 'mask', got 'nan'"):
        joints_from_feet(model, position, np.zeros(3), feet, on_unreachable="nan")  # type: ignore[call-overload]
    with pytest.raises(InputError, match="on_singular must be 'raise' or 'nan', got 'mask'"):
        joint_rates(model, np.zeros(3), np.zeros(12), np.zeros(6), feet, on_singular="mask")  # type: ignore[arg-type]
