"""Closed-form leg kinematics, with Pinocchio as judge, for every robot of the catalogue."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any

import casadi as ca
import numpy as np
import pinocchio as pin
import pytest
import robot_texts
from hypothesis import given
from hypothesis import strategies as st
from robot_loading import quiet

from gaitopt.conventions import LEGS, FloatArray
from gaitopt.errors import InputError, RobotError
from gaitopt.robots.catalog import load_robot, robot_names
from gaitopt.robots.leg import Leg
from gaitopt.robots.leg_angles import wrap_angle
from gaitopt.robots.numbering import NUMBERINGS
from gaitopt.robots.quadruped import Quadruped

ROBOTS = robot_names()
UPPER, LOWER = 0.30, 0.27
LEFT = np.array([0.0, 1.0, 0.0])
each_robot = pytest.mark.parametrize("name", ROBOTS)
each_leg = pytest.mark.parametrize("leg_name", LEGS)

robot = cache(load_robot)

if hasattr(ca.GlobalOptions, "setNumpyMode"):  # as gaitopt.optimize does
    ca.GlobalOptions.setNumpyMode(1)


def random_joints(count: int, leg: Leg, seed: int = 0) -> FloatArray:
    """Any angle of any joint, limits or not."""
    return np.random.default_rng(seed).uniform(-np.pi, np.pi, (count, len(leg.joints)))


def branch_joints(count: int, leg: Leg, seed: int = 0) -> FloatArray:
    """Configurations on the leg's own branch: foot below the roll axis, knee on its side, every
    angle within half a turn of the middle of its limits."""
    low, high = leg.position_limits
    bounded = np.isfinite(low) & np.isfinite(high)
    middle = (np.where(bounded, low, 0) + np.where(bounded, high, 0)) / 2
    q = random_joints(20 * count, leg, seed) + middle
    thigh = leg.signs[-2] * q[:, -2] + leg.zeros[0]
    bend = leg.signs[-1] * q[:, -1] + leg.zeros[1]
    depth = leg.drop + leg.upper * np.cos(thigh) + leg.lower * np.cos(thigh + bend)
    ours = leg.knee * np.sin(bend) > 1e-3
    if leg.has_roll:
        ours &= depth > 1e-3
    return q[ours][:count]


def pinocchio_feet(model: Quadruped, joints: FloatArray) -> dict[str, FloatArray]:
    """Feet in the body frame for configurations in Pinocchio's joint order ``(n, nj)``."""
    data, q = model.model.createData(), pin.neutral(model.model)
    feet: dict[str, list[FloatArray]] = {leg: [] for leg in LEGS}
    for row in joints:
        q[7:] = row
        pin.framesForwardKinematics(model.model, data, q)
        for leg in LEGS:
            place = data.oMf[model.model.getFrameId(model.legs[leg].foot)].translation
            feet[leg].append(model.body_axes.T @ place)
    return {leg: np.array(points) for leg, points in feet.items()}


# --- the judge --------------------------------------------------------------------------------


@each_robot
def test_closed_form_is_pinocchio_s_forward_kinematics(name: str) -> None:
    model = robot(name)
    rng = np.random.default_rng(1)
    joints = rng.uniform(-np.pi, np.pi, (300, len(model.joint_names)))
    feet = pinocchio_feet(model, joints)
    for leg in LEGS:
        ours = model.legs[leg].forward(joints[:, list(model.leg_columns[leg])])
        assert np.linalg.norm(ours - feet[leg], axis=1).max() < 1e-9


@each_robot
def test_jacobian_is_pinocchio_s(name: str) -> None:
    model = robot(name)
    data, q = model.model.createData(), pin.neutral(model.model)
    rng = np.random.default_rng(2)
    for _ in range(50):
        q[7:] = rng.uniform(-np.pi, np.pi, len(model.joint_names))
        pin.computeJointJacobians(model.model, data, q)
        pin.updateFramePlacements(model.model, data)
        for leg in model.legs.values():
            columns = list(model.leg_columns[leg.name])
            frame = model.model.getFrameId(leg.foot)
            full = pin.getFrameJacobian(model.model, data, frame, pin.LOCAL_WORLD_ALIGNED)
            theirs = model.body_axes.T @ full[:3, [6 + c for c in columns]]
            np.testing.assert_allclose(leg.jacobian(q[7:][columns]), theirs, rtol=0, atol=1e-9)


@each_robot
def test_jacobian_is_the_slope_of_the_forward_map(name: str) -> None:
    step = 1e-6
    for leg in robot(name).legs.values():
        q = random_joints(50, leg, seed=3)
        for j in range(len(leg.joints)):
            ahead, behind = q.copy(), q.copy()
            ahead[:, j] += step
            behind[:, j] -= step
            slope = (leg.forward(ahead) - leg.forward(behind)) / (2 * step)
            np.testing.assert_allclose(leg.jacobian(q)[..., j], slope, rtol=0, atol=1e-9)


# --- round trips ------------------------------------------------------------------------------


@each_robot
def test_inverse_leads_back_to_the_point(name: str) -> None:
    """FK(IK(p)) = p for points that the leg can reach."""
    for leg in robot(name).legs.values():
        points = leg.forward(branch_joints(300, leg, seed=4))
        assert len(points) == 300
        np.testing.assert_allclose(leg.forward(leg.inverse(points)), points, rtol=0, atol=1e-9)


@each_robot
def test_inverse_recovers_the_angles_on_the_leg_s_own_branch(name: str) -> None:
    for leg in robot(name).legs.values():
        q = branch_joints(300, leg, seed=5)
        # Near the straight or folded leg the angles are as the square root of the distance.
        np.testing.assert_allclose(leg.inverse(leg.forward(q)), q, rtol=0, atol=1e-6)
        bent = abs(np.sin(leg.signs[-1] * q[:, -1] + leg.zeros[1])) > 0.1
        far = np.linalg.norm(leg.jacobian(q)[..., 0], axis=-1) > 0.01  # off the roll axis
        clear = bent & far
        assert clear.sum() > 200
        np.testing.assert_allclose(leg.inverse(leg.forward(q[clear])), q[clear], rtol=0, atol=1e-10)


@each_robot
def test_foot_is_below_the_hip_and_knee_on_its_side(name: str) -> None:
    for leg in robot(name).legs.values():
        low, high = leg.least_reach, leg.reach
        foot = leg.hip + leg.axes @ [0.0, leg.lateral, -leg.drop - 0.5 * (low + high)]
        q = leg.inverse(foot)
        np.testing.assert_allclose(leg.forward(q), foot, rtol=0, atol=1e-12)
        bend = leg.signs[-1] * q[-1] + leg.zeros[1]
        assert np.sign(wrap_angle(bend)) == leg.knee


@each_robot
def test_angles_of_a_standing_robot_are_within_their_limits(name: str) -> None:
    model = robot(name)
    for leg in model.legs.values():
        depth = np.sqrt((leg.least_reach**2 + leg.reach**2) / 2)
        q = leg.inverse(leg.hip + leg.axes @ [0.0, leg.lateral, -leg.drop - depth])
        low, high = leg.position_limits
        assert (low <= q).all() and (q <= high).all()


@each_robot
def test_kinematics_take_any_leading_axes(name: str) -> None:
    leg = robot(name).legs["RF"]
    q = branch_joints(24, leg).reshape(2, 3, 4, -1)
    points, slopes, back = leg.forward(q), leg.jacobian(q), leg.inverse(leg.forward(q))
    assert points.shape == (2, 3, 4, 3)
    assert slopes.shape == (2, 3, 4, 3, len(leg.joints))
    np.testing.assert_array_equal(points[1, 2, 3], leg.forward(q[1, 2, 3]))
    np.testing.assert_array_equal(slopes[1, 2, 3], leg.jacobian(q[1, 2, 3]))
    np.testing.assert_array_equal(back[1, 2, 3], leg.inverse(points[1, 2, 3]))


def test_point_out_of_reach_gets_the_straight_leg_towards_it() -> None:
    leg = robot("wang2020").legs["LF"]
    away = np.array([0.4, 0.3, -1.2])
    foot = leg.forward(leg.inverse(leg.hip + away)) - leg.hip
    np.testing.assert_allclose(foot, (UPPER + LOWER) * away / 1.3, rtol=0, atol=1e-12)


@given(st.floats(-50, 50), st.floats(-10, 10))
def test_wrapped_angle_is_whole_turns_away_and_near_the_centre(angle: float, c: float) -> None:
    wrapped = wrap_angle(angle, c)
    turns = (angle - wrapped) / (2 * np.pi)
    assert turns == pytest.approx(round(turns), abs=1e-12)
    assert abs(wrapped - c) <= np.pi + 1e-12


# --- the paper's equations --------------------------------------------------------------------


def paper_angles(leg: str, q: FloatArray) -> tuple[Any, Any, Any]:
    """The paper's theta: its pitch angles turn the other way on the front legs (lambda = +1)."""
    side = 1.0 if leg.endswith("F") else -1.0
    return q[..., 0], -side * q[..., 1], -side * q[..., 2]


@pytest.mark.parametrize(("number", "leg_name"), NUMBERINGS["wang2020"].items())
def test_forward_map_is_eq_11(number: int, leg_name: str) -> None:
    q = random_joints(300, robot("wang2020").legs[leg_name], seed=11)
    t1, t2, t3 = paper_angles(leg_name, q)
    a, b = 0.15, 0.20
    alpha, beta = (1 if number in (2, 4) else -1), (1 if number in (3, 4) else -1)
    lam = -1 if number in (1, 3) else 1
    s1, c1, s2, c2 = np.sin(t1), np.cos(t1), np.sin(t2), np.cos(t2)
    s3, c3 = np.sin(-t3 - t2), np.cos(-t3 - t2)
    expected = np.stack(
        [
            lam * (UPPER * s2 - LOWER * s3) + alpha * b,
            s1 * (UPPER * c2 + LOWER * c3) + beta * a,
            -c1 * (UPPER * c2 + LOWER * c3),
        ],
        axis=-1,
    )
    found = robot("wang2020").legs[leg_name].forward(q)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-14)


@each_leg
def test_eq_12_holds_with_the_rate_of_the_shank(leg_name: str) -> None:
    """Errata: w_i3 is the shank's rate -(theta2' + theta3'), not the joint's."""
    leg = robot("wang2020").legs[leg_name]
    q = random_joints(300, leg, seed=12)
    rates = random_joints(300, leg, seed=13)
    t1, t2, t3 = paper_angles(leg_name, q)
    w1, w2, joint3 = paper_angles(leg_name, rates)
    lam = 1 if leg_name.endswith("F") else -1
    s1, c1, s2, c2 = np.sin(t1), np.cos(t1), np.sin(t2), np.cos(t2)
    s3, c3 = np.sin(-t3 - t2), np.cos(-t3 - t2)

    def eq_12(w3: FloatArray) -> FloatArray:
        length, folding = UPPER * c2 + LOWER * c3, UPPER * w2 * s2 + LOWER * w3 * s3
        return np.stack(
            [
                lam * (UPPER * w2 * c2 - LOWER * w3 * c3),
                w1 * c1 * length - s1 * folding,
                w1 * s1 * length + c1 * folding,
            ],
            axis=-1,
        )

    ours = np.einsum("nij,nj->ni", leg.jacobian(q), rates)
    np.testing.assert_allclose(ours, eq_12(-(w2 + joint3)), rtol=0, atol=1e-14)
    assert np.abs(ours - eq_12(joint3)).max() > 0.1


@pytest.mark.parametrize("height", [0.35, 0.40, 0.45, 0.56])
@each_leg
def test_reach_disc_has_the_radius_of_eq_8(leg_name: str, height: float) -> None:
    leg = robot("wang2020").legs[leg_name]
    radius = np.sqrt(0.57**2 - height**2)
    angle = np.linspace(0, 2 * np.pi, 60)
    x, y = leg.hip[0] + radius * np.cos(angle), leg.hip[1] + radius * np.sin(angle)
    rim = leg.straightness(x, y, -height)
    np.testing.assert_allclose(rim, leg.reach**2, rtol=0, atol=1e-15)
    just_in, just_out = (
        np.stack([leg.hip[0] + f * (x - leg.hip[0]), leg.hip[1] + f * (y - leg.hip[1]), 0 * x], -1)
        - [0, 0, height]
        for f in (1 - 1e-6, 1 + 1e-6)
    )
    assert (leg.shortfall(just_in) == 0).all()
    assert (leg.shortfall(just_out) > 0).all()


def test_body_height_of_table_1_is_not_the_height_of_the_hips() -> None:
    """Errata: at 0.58 m the legs of 0.57 m do not touch the ground, and eq. (8) has no root."""
    for leg in robot("wang2020").legs.values():
        assert leg.reach == pytest.approx(0.57, abs=1e-15)
        assert leg.shortfall(leg.hip - [0, 0, 0.58]) == pytest.approx(0.01, abs=1e-14)


# --- reach ------------------------------------------------------------------------------------


@each_robot
def test_straightness_is_the_squared_distance_from_the_pitch_axis(name: str) -> None:
    """By the law of cosines from the knee's bend alone."""
    for leg in robot(name).legs.values():
        q = branch_joints(200, leg, seed=6)
        bend = leg.signs[-1] * q[:, -1] + leg.zeros[1]
        squared = leg.upper**2 + leg.lower**2 + 2 * leg.upper * leg.lower * np.cos(bend)
        x, y, z = leg.forward(q).T
        np.testing.assert_allclose(leg.straightness(x, y, z), squared, rtol=0, atol=1e-9)


@each_robot
def test_reach_is_the_longest_and_shortest_that_the_knee_allows(name: str) -> None:
    """Distance of Pinocchio's foot from the knee's own law, over the knee's range."""
    model = robot(name)
    for leg in model.legs.values():
        low, high = (limit[-1] for limit in leg.position_limits)
        angles = np.linspace(max(low, -np.pi), min(high, np.pi), 20_001)
        bend = leg.signs[-1] * angles + leg.zeros[1]
        bend = bend[leg.knee * np.sin(bend) >= -1e-12]
        span = np.abs(leg.upper + leg.lower * np.exp(1j * bend))
        assert leg.reach == pytest.approx(span.max(), abs=1e-6)
        assert leg.least_reach == pytest.approx(span.min(), abs=1e-3)
        assert leg.least_reach <= span.min() + 1e-12 and span.max() <= leg.reach + 1e-12


@each_robot
def test_shortfall_is_nothing_within_reach_and_what_is_missing_beyond(name: str) -> None:
    for leg in robot(name).legs.values():
        down = leg.axes @ [0.0, 0.0, -1.0]
        pitch = leg.hip + leg.axes @ [0.0, leg.lateral, -leg.drop]
        spans = np.array([0.5 * (leg.least_reach + leg.reach), leg.reach + 0.03])
        found = leg.shortfall(pitch + spans[:, None] * down)
        np.testing.assert_allclose(found, [0.0, 0.03], rtol=0, atol=1e-9)
        if leg.least_reach > 0.02:
            folded = leg.shortfall(pitch + (leg.least_reach - 0.01) * down)
            assert folded == pytest.approx(0.01, abs=1e-9)


def test_pitch_pitch_leg_does_not_reach_sideways() -> None:
    for leg in robot("solo8").legs.values():
        foot = leg.hip + np.array([0.05, leg.lateral, -0.2])
        assert leg.shortfall(foot) == pytest.approx(0.0, abs=1e-15)
        assert leg.shortfall(foot + 0.02 * LEFT) == pytest.approx(0.02, abs=1e-14)
        assert leg.shortfall(foot - 0.02 * LEFT) == pytest.approx(0.02, abs=1e-14)


def test_leg_with_a_sideways_offset_cannot_reach_its_roll_axis() -> None:
    leg = robot("a1").legs["LF"]
    on_axis = leg.hip + leg.axes @ [0.1, 0.0, 0.0]
    assert leg.shortfall(on_axis) >= abs(leg.lateral) - 1e-12


@each_leg
def test_reach_region_is_convex_below_the_hip(leg_name: str) -> None:
    """What lets the COG problem cut it with tangents."""
    rng = np.random.default_rng(8)
    for name in ("wang2020", "a1", "hyq"):
        leg = robot(name).legs[leg_name]
        z = -leg.drop - 0.7 * leg.reach
        ends = rng.uniform(-0.3, 0.3, (2, 500, 2)) + leg.hip[:2] + [0, leg.lateral]
        values = leg.straightness(ends[..., 0], ends[..., 1], z)
        middle = leg.straightness(*ends.mean(axis=0).T, z)
        assert (middle <= values.mean(axis=0) + 1e-12).all()


@each_leg
def test_squared_lengths_are_convex_in_the_place_of_the_foot(leg_name: str) -> None:
    """In all three coordinates: what lets the COG problem tilt the body."""
    rng = np.random.default_rng(9)
    for name in ("wang2020", "a1", "hyq"):
        leg = robot(name).legs[leg_name]
        ends = rng.uniform(-0.4, 0.4, (2, 2000, 3))
        # Below the pitch axis, wherever the leg rolls.
        ends[..., 2] = -np.hypot(leg.drop, leg.lateral) - leg.reach * np.abs(ends[..., 2])
        ends += leg.hip
        values = leg.straightness(*np.moveaxis(ends, -1, 0))
        middle = leg.straightness(*ends.mean(axis=0).T)
        assert (middle <= values.mean(axis=0) + 1e-12).all()


# --- one source, arrays and symbols -----------------------------------------------------------


@each_robot
def test_casadi_evaluates_the_same_source_to_the_same_numbers(name: str) -> None:
    for leg in robot(name).legs.values():
        count = len(leg.joints)
        angles, place = ca.SX.sym("q", count), ca.SX.sym("p", 3)
        split_q, split_p = ca.vertsplit(angles), ca.vertsplit(place)
        forward = ca.Function("f", [angles], [ca.vertcat(*leg.forward_columns(*split_q))])
        inverse = ca.Function("i", [place], [ca.vertcat(*leg.inverse_columns(*split_p))])
        reach = ca.Function("s", [place], [leg.straightness(*split_p)])
        q = branch_joints(50, leg, seed=9)
        points = leg.forward(q)
        np.testing.assert_allclose(np.array(forward(q.T)).T, points, rtol=0, atol=1e-14)
        np.testing.assert_allclose(
            np.array(inverse(points.T)).T, leg.inverse(points), rtol=0, atol=1e-12
        )
        np.testing.assert_allclose(
            np.array(reach(points.T))[0], leg.straightness(*points.T), rtol=0, atol=1e-14
        )


@each_leg
def test_casadi_s_derivative_of_the_forward_map_is_the_jacobian(leg_name: str) -> None:
    leg = robot("hyq").legs[leg_name]
    angles = ca.SX.sym("q", 3)
    place = ca.vertcat(*leg.forward_columns(*ca.vertsplit(angles)))
    slope = ca.Function("j", [angles], [ca.jacobian(place, angles)])
    for q in random_joints(50, leg, seed=10):
        np.testing.assert_allclose(np.array(slope(q)), leg.jacobian(q), rtol=0, atol=1e-14)


@each_robot
def test_leg_frame_is_square_whatever_the_digits_of_the_urdf(name: str) -> None:
    """anymal_c's and hyq's axes are square to about 1e-11 only; inverse undoes forward exactly."""
    for leg in robot(name).legs.values():
        np.testing.assert_allclose(leg.axes.T @ leg.axes, np.eye(3), rtol=0, atol=4e-16)
        assert np.linalg.det(leg.axes) == pytest.approx(1.0, abs=1e-15)


# --- constants --------------------------------------------------------------------------------


@each_leg
def test_constants_of_wang2020_are_those_of_table_1(leg_name: str) -> None:
    leg = robot("wang2020").legs[leg_name]
    ahead, left = (1 if leg_name[1] == "F" else -1), (1 if leg_name[0] == "L" else -1)
    np.testing.assert_allclose(leg.hip, [0.2 * ahead, 0.15 * left, 0.0], rtol=0, atol=1e-15)
    assert (leg.upper, leg.lower) == pytest.approx((UPPER, LOWER), abs=1e-15)
    assert (leg.lateral, leg.drop) == (0.0, 0.0)
    assert leg.knee == -ahead  # front knees backward, hind knees forward
    np.testing.assert_allclose(leg.velocity_limits, np.deg2rad(17), rtol=0, atol=1e-15)
    assert leg.has_roll and leg.joints == tuple(f"{leg_name}_{j}" for j in ("HAA", "HFE", "KFE"))


@each_robot
def test_constants_cannot_be_changed(name: str) -> None:
    leg = robot(name).legs["LF"]
    with pytest.raises(AttributeError):
        leg.upper = 1.0  # type: ignore[misc]
    for array in (leg.hip, leg.axes, leg.position_limits, leg.velocity_limits):
        with pytest.raises(ValueError, match="read-only"):
            array[...] = 0.0


@each_robot
def test_left_and_right_legs_mirror_each_other(name: str) -> None:
    """Mirrored hips, equal links: the same foot, mirrored, by the same bend of the knee."""
    model = robot(name)
    mirror = np.array([1.0, -1.0, 1.0])
    for left, right in (("LF", "RF"), ("LH", "RH")):
        ours, theirs = model.legs[left], model.legs[right]
        point = ours.forward(branch_joints(50, ours, seed=7))
        away = (point - ours.hip) * mirror + theirs.hip
        np.testing.assert_allclose(ours.hip * mirror, theirs.hip, rtol=0, atol=1e-6)
        bend = [
            leg.signs[-1] * leg.inverse(p)[..., -1] + leg.zeros[1]
            for leg, p in ((ours, point), (theirs, away))
        ]
        np.testing.assert_allclose(wrap_angle(bend[0] - bend[1]), 0, rtol=0, atol=1e-4)


@pytest.mark.parametrize("limit", ["6.28318530717959", "8.0", "inf"])
def test_a_knee_that_turns_all_around_folds_and_stretches_wherever_its_zero_is(limit: str) -> None:
    """The zero of some files is the folded leg, half a turn from that of the closed form."""
    text = robot_texts.robot(limits=(robot_texts.LIMIT,) * 3)
    folded = text.replace(
        f'xyz="0 0 {-robot_texts.LOWER}"', f'xyz="0 0 {robot_texts.LOWER}"'
    ).replace('lower="-2.5" upper="2.5"', f'lower="-{limit}" upper="{limit}"')
    for leg in quiet(folded).legs.values():
        assert leg.reach == pytest.approx(robot_texts.UPPER + robot_texts.LOWER)
        assert leg.least_reach == pytest.approx(robot_texts.UPPER - robot_texts.LOWER)
        foot = leg.hip + leg.axes[:, 1] * leg.lateral - [0.0, 0.0, 0.3]
        np.testing.assert_allclose(leg.forward(leg.inverse(foot)), foot, rtol=0, atol=1e-12)


def test_links_of_one_length_fold_to_nothing_whatever_their_digits() -> None:
    """The sum under the root was -3e-17 for links that differ in their last digit."""
    leg = load_robot("wang2020").legs["LF"]
    full = np.array([[-3.0, -3.0, -4.0], [3.0, 3.0, 4.0]])
    for ends in ((0.20000000000000004, 0.2000000000000001), (0.2, 0.2), (0.3, 0.1)):
        folding = replace(leg, upper=ends[0], lower=ends[1], position_limits=full)
        assert folding.least_reach == pytest.approx(abs(ends[0] - ends[1]), abs=1e-8)


@pytest.mark.parametrize("name", ["wang2020", "solo8"])
def test_angles_and_places_of_another_shape_are_refused(name: str) -> None:
    leg = quiet(name).legs["LF"]
    count = len(leg.joints)
    for method in (leg.forward, leg.jacobian):
        with pytest.raises(InputError, match=rf"q must be \(\.\.\., {count}\), got \(2, 7\)"):
            method(np.zeros((2, 7)))
    for method in (leg.inverse, leg.length, leg.shortfall):
        with pytest.raises(InputError, match=r"point must be \(\.\.\., 3\), got \(2,\)"):
            method([0.0, 0.1])
    with pytest.raises(InputError, match=r"q \(3,\), rates \(2,\)"):
        leg.jacobian_rate(np.zeros((3, count)), np.zeros((2, count)))


def test_a_leg_that_its_knee_lets_only_fold_is_refused() -> None:
    """Links of one length fold to nothing, and a leg of no reach divided by zero in planners."""
    knee = robot_texts.KNEE.replace("-2.6", "3.1").replace("-0.3", "3.2")
    folds = robot_texts.robot().replace("0 0 -0.22", "0 0 -0.25").replace(robot_texts.KNEE, knee)
    with pytest.raises(RobotError, match=r"leg LF: the limits of LF_j2 \(3.1 to 3.2 rad\) .* fold"):
        quiet(folds)
