"""The papers' own kinematics against our closed form and Pinocchio, and where they are wrong.

They are those of [XiLing], Modules A to C, and of [Wang2024], Section 5.1. The formulae stand here
as they are printed, each beside its correction.
Both know a leg of three joints without drop ``u``; hyq, which has one, is left out.
"""

from __future__ import annotations

from functools import cache

import numpy as np
import pinocchio as pin
import pytest

from gaitopt.conventions import LEGS, FloatArray
from gaitopt.robots.catalog import load_robot
from gaitopt.robots.frames import XILING_LEG_AXES, hip_frames, homogeneous, inverse_homogeneous
from gaitopt.robots.leg import Leg
from gaitopt.robots.leg_angles import wrap_angle
from gaitopt.robots.quadruped import Quadruped
from gaitopt.robots.rotations import rpy_to_matrix
from gaitopt.robots.whole_body import configuration, feet_from_joints, joints_from_feet

robot = cache(load_robot)
OFFSET = ["a1", "go1", "go2", "b1", "laikago", "anymal", "anymal_c", "solo12"]
ROBOTS = ["wang2020", *OFFSET]
each_robot = pytest.mark.parametrize("name", ROBOTS)
each_robot_with_offset = pytest.mark.parametrize("name", OFFSET)


def geometric(leg: Leg, q: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Roll about x (forward), thigh angle and knee's bend about y (left), as in ``Leg``."""
    roll, thigh, knee = np.moveaxis(q * np.array(leg.signs), -1, 0)
    return roll, thigh + leg.zeros[0], knee + leg.zeros[1]


def any_joints(leg: Leg, count: int = 300) -> FloatArray:
    return np.random.default_rng(0).uniform(-np.pi, np.pi, (count, len(leg.joints)))


def branch(leg: Leg, count: int = 300, folded: float = 3.0) -> FloatArray:
    """Joints with the foot below the roll axis and the knee bent to its own side."""
    rng = np.random.default_rng(1)
    roll, thigh = rng.uniform(-1.2, 1.2, 40 * count), rng.uniform(-np.pi, np.pi, 40 * count)
    bend = leg.knee * rng.uniform(0.05, folded, 40 * count)
    below = leg.upper * np.cos(thigh) + leg.lower * np.cos(thigh + bend) > 0.02
    angles = np.stack([roll, thigh - leg.zeros[0], bend - leg.zeros[1]], axis=-1)[below][:count]
    assert len(angles) == count
    return np.asarray(angles * np.array(leg.signs))


def pinocchio_points(model: Quadruped, name: str, q: FloatArray) -> FloatArray:
    """Places of one leg's foot in the body frame for its joint angles ``q (n, 3)``."""
    data, full = model.model.createData(), pin.neutral(model.model)
    frame = model.model.getFrameId(model.legs[name].foot)
    points = []
    for row in q:
        full[[7 + c for c in model.leg_columns[name]]] = row
        pin.framesForwardKinematics(model.model, data, full)
        points.append(model.body_axes.T @ data.oMf[frame].translation)
    return np.array(points)


def same_angles(found: FloatArray, expected: FloatArray, atol: float = 1e-9) -> None:
    np.testing.assert_allclose(wrap_angle(found - expected), 0.0, rtol=0, atol=atol)


# --- [XiLing]: forward kinematics ---------------------------------------------------------------


def forward_003(
    leg: Leg, q1: FloatArray, q2: FloatArray, q3: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Module B, Section 4, less the hip: x', y', z' in the report's leg frame."""
    l1, l2, l3 = leg.lateral, leg.upper, leg.lower
    x = -l1 * np.sin(q1) + l2 * np.cos(q1) * np.cos(q2) + l3 * np.cos(q1) * np.cos(q2 + q3)
    y = l2 * np.sin(q2) + l3 * np.sin(q2 + q3)
    z = -l1 * np.cos(q1) - l2 * np.sin(q1) * np.cos(q2) - l3 * np.sin(q1) * np.cos(q2 + q3)
    return x, y, z


def angles_003(leg: Leg, q: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """The report's q1, q2, q3: its pitch axes point right, ours left."""
    roll, thigh, bend = geometric(leg, q)
    return roll, -thigh, -bend


def report_frame(leg: Leg) -> FloatArray:
    """R_{B,Li}: the report's leg frame in the body frame."""
    return np.asarray(leg.axes @ XILING_LEG_AXES)


def local_003(leg: Leg, points: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """x', y', z' of points in the body frame (Module 2, with the rotation that it leaves out)."""
    x, y, z = np.moveaxis((points - leg.hip) @ report_frame(leg), -1, 0)
    return x, y, z


@each_robot
@pytest.mark.parametrize("leg_name", LEGS)
def test_xiling_forward_kinematics_are_pinocchios(name: str, leg_name: str) -> None:
    leg = robot(name).legs[leg_name]
    q = any_joints(leg, 100)
    local = np.stack(forward_003(leg, *angles_003(leg, q)), axis=-1)
    found = leg.hip + local @ report_frame(leg).T
    np.testing.assert_allclose(found, leg.forward(q), rtol=0, atol=1e-14)
    np.testing.assert_allclose(found, pinocchio_points(robot(name), leg_name, q), atol=1e-9)


@each_robot
def test_xiling_leg_frame_is_no_identity(name: str) -> None:
    """Erratum: with R_{B,Li} = 1 the foot of a leg at zero lies ahead of its hip, not below."""
    for leg in robot(name).legs.values():
        q = any_joints(leg)
        printed = leg.hip + np.stack(forward_003(leg, *angles_003(leg, q)), axis=-1)
        assert np.linalg.norm(printed - leg.forward(q), axis=1).max() > leg.upper
        straight = np.array(forward_003(leg, *np.zeros(3)))
        np.testing.assert_allclose(straight, [leg.upper + leg.lower, 0, -leg.lateral], atol=1e-15)


def test_xiling_fixed_rotation_is_one_and_its_axes_are_those_of_the_joints() -> None:
    """x down, y along the axis of HAA, z along the axes of HFE and KFE; right-handed."""
    np.testing.assert_array_equal(XILING_LEG_AXES @ XILING_LEG_AXES.T, np.eye(3))
    np.testing.assert_array_equal(np.cross(*XILING_LEG_AXES.T[:2]), XILING_LEG_AXES[:, 2])
    down, forward, right = XILING_LEG_AXES.T
    assert (down[2], forward[0], right[1]) == (-1.0, 1.0, -1.0)


def test_xiling_chain_of_seven_transforms_is_the_analytical_form() -> None:
    """Module B, Sections 2 and 3: shifts and turns multiplied out, for the left front leg of a1."""
    leg = robot("a1").legs["LF"]

    def shift(x: float, y: float, z: float) -> FloatArray:
        return homogeneous([x, y, z], [0.0, 0.0, 0.0])

    for q in any_joints(leg, 50):
        q1, q2, q3 = angles_003(leg, q)
        hip = shift(*leg.hip)
        hip[:3, :3] = report_frame(leg)  # left out in the report
        to_hfe = hip @ homogeneous(np.zeros(3), [0.0, float(q1), 0.0]) @ shift(0, 0, -leg.lateral)
        to_kfe = to_hfe @ homogeneous(np.zeros(3), [0.0, 0.0, float(q2)]) @ shift(leg.upper, 0, 0)
        foot = to_kfe @ homogeneous(np.zeros(3), [0.0, 0.0, float(q3)]) @ shift(leg.lower, 0, 0)
        np.testing.assert_allclose(foot[:3, 3], leg.forward(q), rtol=0, atol=1e-15)


# --- [XiLing]: inverse kinematics ---------------------------------------------------------------


def q1_arcsin(leg: Leg, x: FloatArray, z: FloatArray) -> FloatArray:
    """Module 6, first form."""
    return np.asarray(np.arcsin(-leg.lateral / np.hypot(x, z)) - np.arctan2(z, x))


def q1_stable(leg: Leg, x: FloatArray, z: FloatArray) -> FloatArray:
    """Module 6, "alternate numerically stable form"."""
    l1 = leg.lateral
    root = np.sqrt(x**2 + z**2 - l1**2)
    return np.asarray(np.arctan2(-x * l1 - z * root, -z * l1 + x * root))


def q3_printed(leg: Leg, rho: FloatArray, y: FloatArray) -> FloatArray:
    l2, l3 = leg.upper, leg.lower
    return np.asarray(np.arccos((rho**2 + y**2 - l2**2 - l3**2) / (2.0 * l2 * l3)))


def q2_printed(leg: Leg, rho: FloatArray, y: FloatArray, q3: FloatArray) -> FloatArray:
    beta = np.arcsin(leg.lower * np.sin(q3) / np.hypot(rho, y))
    return np.asarray(np.arctan2(y, rho) - beta)


def q2_corrected(leg: Leg, rho: FloatArray, y: FloatArray, q3: FloatArray) -> FloatArray:
    beta = np.arctan2(leg.lower * np.sin(q3), leg.upper + leg.lower * np.cos(q3))
    return np.asarray(np.arctan2(y, rho) - beta)


def inverse_003(leg: Leg, points: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """The report's inverse kinematics with the knee's own side, and atan2 for q2."""
    x, y, z = local_003(leg, points)
    q1 = q1_stable(leg, x, z)
    rho = x * np.cos(q1) - z * np.sin(q1)
    q3 = -leg.knee * q3_printed(leg, rho, y)
    return q1, q2_corrected(leg, rho, y, q3), q3


@each_robot
def test_xiling_inverse_kinematics_with_their_corrections_are_ours(name: str) -> None:
    for leg in robot(name).legs.values():
        q = branch(leg)
        points = leg.forward(q)
        expected = angles_003(leg, q)
        ours = angles_003(leg, leg.inverse(points))
        for found, own, theirs in zip(inverse_003(leg, points), ours, expected, strict=True):
            same_angles(found, theirs)
            same_angles(found, own)


@each_robot
def test_xiling_both_forms_of_q1_are_the_roll(name: str) -> None:
    for leg in robot(name).legs.values():
        q = branch(leg)
        x, _, z = local_003(leg, leg.forward(q))
        same_angles(q1_arcsin(leg, x, z), angles_003(leg, q)[0])
        same_angles(q1_stable(leg, x, z), angles_003(leg, q)[0])


@each_robot
def test_xiling_definitions_on_the_way_hold(name: str) -> None:
    """Modules 4 and 5: rho two ways, x' sin q1 + z' cos q1 = -l1, and the law of cosines for s."""
    for leg in robot(name).legs.values():
        q = any_joints(leg)
        q1, q2, q3 = angles_003(leg, q)
        x, y, z = local_003(leg, leg.forward(q))
        rho = leg.upper * np.cos(q2) + leg.lower * np.cos(q2 + q3)
        np.testing.assert_allclose(x * np.cos(q1) - z * np.sin(q1), rho, rtol=0, atol=1e-14)
        np.testing.assert_allclose(x * np.sin(q1) + z * np.cos(q1), -leg.lateral, atol=1e-14)
        radius, phi = np.hypot(x, z), np.arctan2(z, x)
        np.testing.assert_allclose(radius * np.sin(q1 + phi), -leg.lateral, rtol=0, atol=1e-14)
        np.testing.assert_allclose(radius**2, rho**2 + leg.lateral**2, rtol=0, atol=1e-14)
        square = leg.upper**2 + leg.lower**2 + 2 * leg.upper * leg.lower * np.cos(q3)
        np.testing.assert_allclose(rho**2 + y**2, square, rtol=0, atol=1e-14)
        straightness = leg.straightness(*leg.forward(q).T)
        np.testing.assert_allclose(straightness, square, rtol=0, atol=1e-13)


def test_xiling_arcsin_of_q2_is_on_the_wrong_branch_in_a_folded_leg() -> None:
    """Erratum: where l2 + l3 cos q3 < 0, which takes a shank longer than the thigh."""
    leg = robot("anymal").legs["LF"]
    assert leg.lower > leg.upper
    q = branch(leg, 600)
    _, q2, q3 = angles_003(leg, q)
    x, y, z = local_003(leg, leg.forward(q))
    rho = np.sqrt(x**2 + z**2 - leg.lateral**2)
    folded = leg.upper + leg.lower * np.cos(q3) < 0
    assert 50 < folded.sum() < 550
    same_angles(q2_corrected(leg, rho, y, q3), q2)
    same_angles(q2_printed(leg, rho, y, q3)[~folded], q2[~folded], 1e-6)  # arcsin near 1
    wrong = np.stack(forward_003(leg, 0.0 * q2, q2_printed(leg, rho, y, q3), q3), axis=-1)
    right = np.stack(forward_003(leg, 0.0 * q2, q2, q3), axis=-1)
    missed = np.linalg.norm(wrong - right, axis=1)
    deep = leg.upper + leg.lower * np.cos(q3) < -0.01
    assert missed[deep].min() > 0.01 and missed[~folded].max() < 1e-6


@pytest.mark.parametrize("leg_name", LEGS)
def test_xiling_arccos_of_q3_is_one_side_of_the_knee(leg_name: str) -> None:
    """Erratum: right where knees point backward, the front legs; the hind knee goes astray."""
    leg = robot("wang2020").legs[leg_name]
    q = branch(leg)
    q1, _, q3 = angles_003(leg, q)
    x, y, z = local_003(leg, leg.forward(q))
    rho = x * np.cos(q1) - z * np.sin(q1)
    printed = q3_printed(leg, rho, y)
    same_angles(-leg.knee * printed, q3)
    if leg.knee > 0:  # the bend -q3 that is printed lies beyond the joint's lower limit
        assert leg.signs[2] == 1.0 and leg.zeros[1] == 0.0
        assert (-printed < leg.position_limits[0, 2]).all()


@each_robot_with_offset
def test_xiling_workspace_leaves_out_l1(name: str) -> None:
    """Erratum: |l2 - l3| < d < l2 + l3 is no condition on d but on s, and r must exceed l1."""
    for leg in robot(name).legs.values():
        least, most = abs(leg.upper - leg.lower), leg.upper + leg.lower

        def in_reach(points: FloatArray, leg: Leg = leg) -> tuple[FloatArray, FloatArray]:
            x, y, z = local_003(leg, points)
            r, d = np.hypot(x, z), np.sqrt(x**2 + y**2 + z**2)
            s = np.sqrt(np.maximum(r**2 - leg.lateral**2, 0.0) + y**2)
            least, most = abs(leg.upper - leg.lower), leg.upper + leg.lower
            corrected = (least <= s) & (s <= most) & (r >= abs(leg.lateral))
            return (least < d) & (d < most), corrected

        # A nearly straight leg, whatever its knee's limits say: s just below, d above the limit.
        nearly = np.array([0.0, leg.lateral, -(most - 1e-4)])
        printed, corrected = in_reach(leg.hip + leg.axes @ nearly)
        assert corrected and not printed
        back = inverse_003(leg, (leg.hip + leg.axes @ nearly)[None])
        again = np.stack(forward_003(leg, *back), axis=-1) @ report_frame(leg).T + leg.hip
        np.testing.assert_allclose(again[0], leg.hip + leg.axes @ nearly, rtol=0, atol=1e-9)
        # A foot on the roll axis: d is allowed, yet the hip link is in the way.
        on_axis = leg.hip + leg.axes @ [0.5 * (least + most), 0.0, 0.0]
        printed, corrected = in_reach(on_axis)
        assert printed and not corrected and leg.shortfall(on_axis) > 0


@each_robot
def test_xiling_reach_with_its_correction_is_ours(name: str) -> None:
    """Points anywhere, against shortfall, for knees that may straighten and fold."""
    for leg in robot(name).legs.values():
        points = leg.hip + np.random.default_rng(2).uniform(-0.9, 0.9, (4000, 3))
        x, y, z = local_003(leg, points)
        r = np.hypot(x, z)
        s = np.sqrt(np.maximum(r**2 - leg.lateral**2, 0.0) + y**2)
        corrected = (leg.least_reach <= s) & (s <= leg.reach) & (r >= abs(leg.lateral))
        np.testing.assert_array_equal(leg.shortfall(points) == 0.0, corrected)
        assert 0 < corrected.sum() < 4000


# --- [XiLing]: the whole body -------------------------------------------------------------------


def bodies(name: str) -> tuple[Quadruped, FloatArray, FloatArray, FloatArray]:
    """A robot, poses of its base, and joints on the legs' own branches."""
    model, rng = robot(name), np.random.default_rng(3)
    joints = np.zeros((50, len(model.joint_names)))
    for leg in model.legs.values():
        joints[:, list(model.leg_columns[leg.name])] = branch(leg, 50, 2.0)
    return model, rng.uniform(-1, 1, (50, 3)), rng.uniform(-1, 1, (50, 3)), joints


@each_robot
def test_xiling_body_pose_is_yaw_times_pitch_times_roll(name: str) -> None:
    """Module C, Sections 1.2 to 1.4, with the turns written out, and Pinocchio's base placement."""
    model, position, rpy, joints = bodies(name)
    data = model.model.createData()
    for i in range(10):
        turns = [rpy_to_matrix(rpy[i] * axis) for axis in np.eye(3)]
        rotation = turns[2] @ turns[1] @ turns[0]
        expected = np.block([[rotation, position[i][:, None]], [np.zeros(3), 1.0]])
        np.testing.assert_allclose(homogeneous(position[i], rpy[i]), expected, atol=1e-15)
        inverse = np.block([[rotation.T, -(rotation.T @ position[i])[:, None]], [np.zeros(3), 1.0]])
        np.testing.assert_allclose(inverse_homogeneous(expected), inverse, rtol=0, atol=1e-15)
        pin.forwardKinematics(
            model.model, data, configuration(model, position[i], rpy[i], joints[i])
        )
        np.testing.assert_allclose(data.oMi[1].homogeneous, expected, rtol=0, atol=1e-14)


@each_robot
def test_xiling_whole_body_inverse_kinematics_are_ours(name: str) -> None:
    """Module C, Sections 2.1 and 2.2 (3.1 and 3.2): each foot into its leg frame, then q1 to q3."""
    model, position, rpy, joints = bodies(name)
    feet = feet_from_joints(model, position, rpy, joints)
    ours = joints_from_feet(model, position, rpy, feet, on_unreachable="mask")[0]
    body = rpy_to_matrix(rpy) @ model.body_axes  # R_{W,B}
    for i, (leg, frame) in enumerate(zip(model.legs.values(), hip_frames(model), strict=True)):
        in_body = np.einsum("nij,ni->nj", body, feet[:, i] - position)
        local = (in_body - frame[:3, 3]) @ frame[:3, :3] @ XILING_LEG_AXES
        # inverse_003 starts from the body frame, so lead the point back into it.
        points = local @ (frame[:3, :3] @ XILING_LEG_AXES).T + frame[:3, 3]
        columns = list(model.leg_columns[leg.name])
        for found, expected in zip(
            inverse_003(leg, points), angles_003(leg, ours[:, columns]), strict=True
        ):
            same_angles(found, expected)


@each_robot
def test_xiling_chain_leads_from_the_leg_frame_to_the_world(name: str) -> None:
    """p_W = R_WB R_BL p_L + R_WB p_BL + p_WB, with R_BL from leg to body.

    Erratum: Section 1.5 calls R_BL a rotation from body to leg; Sections 2.1 to 3.1 use it, and
    rightly, from leg to body. Its transpose in its place misses.
    """
    model, position, rpy, joints = bodies(name)
    feet = feet_from_joints(model, position, rpy, joints)
    body = rpy_to_matrix(rpy) @ model.body_axes
    for i, leg in enumerate(model.legs.values()):
        q = joints[:, list(model.leg_columns[leg.name])]
        local = np.stack(forward_003(leg, *angles_003(leg, q)), axis=-1)
        turn = report_frame(leg)
        for rotation, holds in ((turn, True), (turn.T, False)):
            chain = np.einsum("nij,jk,nk->ni", body, rotation, local) + body @ leg.hip + position
            assert (np.abs(chain - feet[:, i]).max() < 1e-9) == holds


# --- [Wang2024]: forward kinematics ---------------------------------------------------------------


def angles_002(leg: Leg, q: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """gamma, alpha, beta: about x forward and about y right, so the pitch angles change sign."""
    roll, thigh, bend = geometric(leg, q)
    return roll, -thigh, -bend


def frame_002(leg: Leg, points: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """x forward, y right, z down, at the hip: the frame in which eqs. (1)-(14) hold."""
    x, y, z = np.moveaxis((points - leg.hip) @ leg.axes, -1, 0)
    return x, -y, -z


def in_plane_002(leg: Leg, alpha: FloatArray, beta: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Eqs. (1)-(3): x, and hu' + hl'. The shank's angle theta is nowhere defined; with its
    projections hl cos(theta) on x and hl sin(theta) on the vertical it is 90 deg - alpha - beta.
    """
    theta = np.pi / 2 - alpha - beta
    x = leg.upper * np.sin(alpha) + leg.lower * np.cos(theta)
    return x, leg.upper * np.cos(alpha) + leg.lower * np.sin(theta)


@each_robot
@pytest.mark.parametrize("leg_name", LEGS)
def test_wang2024_forward_kinematics_with_one_sign_are_pinocchios(name: str, leg_name: str) -> None:
    """Eqs. (1)-(5), the sign in eq. (4) corrected: y = h cos(gamma) - (hu' + hl') sin(gamma)."""
    model = robot(name)
    leg = model.legs[leg_name]
    q, h = any_joints(leg, 100), -leg.lateral  # h points right, as y does
    gamma, alpha, beta = angles_002(leg, q)
    x, length = in_plane_002(leg, alpha, beta)
    y = h * np.cos(gamma) - length * np.sin(gamma)
    z = h * np.sin(gamma) + length * np.cos(gamma)
    for points, atol in ((leg.forward(q), 1e-14), (pinocchio_points(model, leg_name, q), 1e-9)):
        found = np.array(frame_002(leg, points))
        np.testing.assert_allclose(found, [x, y, z], rtol=0, atol=atol)


@each_robot_with_offset
def test_wang2024_eqs_4_and_5_as_printed_are_no_rotation(name: str) -> None:
    """Erratum: they do not keep the distance of the foot from the roll axis."""
    for leg in robot(name).legs.values():
        q, h = any_joints(leg), -leg.lateral
        gamma, alpha, beta = angles_002(leg, q)
        _, length = in_plane_002(leg, alpha, beta)
        y = h * np.cos(gamma) + length * np.sin(gamma)
        z = h * np.sin(gamma) + length * np.cos(gamma)
        distance = np.hypot(h, length)
        np.testing.assert_allclose(
            np.hypot(y, z) ** 2 - distance**2, 2 * h * length * np.sin(2 * gamma), atol=1e-14
        )
        assert np.abs(np.hypot(y, z) - distance).max() > 0.02
        assert np.abs(y - frame_002(leg, leg.forward(q))[1]).max() > 0.1
        np.testing.assert_allclose(z, frame_002(leg, leg.forward(q))[2], rtol=0, atol=1e-14)


def test_wang2024_printed_matrix_has_no_unit_determinant() -> None:
    gamma = np.linspace(0.1, 1.0, 10)
    c, s = np.cos(gamma), np.sin(gamma)
    np.testing.assert_allclose(c * c - s * s, np.cos(2 * gamma), rtol=0, atol=1e-15)  # (4), (5)
    np.testing.assert_allclose(c * c + s * s, 1.0, rtol=0, atol=1e-15)  # with one sign turned
    assert np.cos(2 * gamma).max() < 0.99


# --- [Wang2024]: inverse kinematics ---------------------------------------------------------------


def gamma_002(leg: Leg, y: FloatArray, z: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Eqs. (6)-(8), and l: it is not defined either; in Fig. 8 it is the leg's height in its
    plane, hu' + hl' = sqrt(y^2 + z^2 - h^2)."""
    h = -leg.lateral
    length = np.sqrt(y**2 + z**2 - h**2)
    second, first = -np.arctan2(y, z), -np.arctan(h / length)
    return second - first, length


def beta_002(leg: Leg, x: FloatArray, length: FloatArray) -> tuple[FloatArray, ...]:
    """Eqs. (9)-(11): s, n and beta as printed."""
    hu, hl = leg.upper, leg.lower
    s = np.sqrt(length**2 + x**2)
    n = (s**2 - hl**2 - hu**2) / (2.0 * hu)
    return s, n, -np.arccos(n / hl)


def inverse_002(leg: Leg, points: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Eqs. (6)-(14) with + in eq. (12), and the knee's own side in eqs. (11) and (13)."""
    x, y, z = frame_002(leg, points)
    gamma, length = gamma_002(leg, y, z)
    s, n, beta = beta_002(leg, x, length)
    alpha = np.arctan(x / length) + leg.knee * np.arccos((leg.upper + n) / s)
    return gamma, alpha, leg.knee * beta


@each_robot
def test_wang2024_inverse_kinematics_with_their_corrections_are_ours(name: str) -> None:
    for leg in robot(name).legs.values():
        q = branch(leg)
        points = leg.forward(q)
        ours = angles_002(leg, leg.inverse(points))
        for found, expected, own in zip(
            inverse_002(leg, points), angles_002(leg, q), ours, strict=True
        ):
            same_angles(found, expected, 1e-8)  # arccos near the folded leg
            same_angles(found, own, 1e-8)


@each_robot
def test_wang2024_eqs_6_to_8_are_the_roll_of_the_corrected_eq_4_only(name: str) -> None:
    """They tell which of eqs. (4) and (5) has the wrong sign: (4), in a frame with z down."""
    for leg in robot(name).legs.values():
        q, h = branch(leg), -leg.lateral
        gamma, alpha, beta = angles_002(leg, q)
        _, length = in_plane_002(leg, alpha, beta)
        z = h * np.sin(gamma) + length * np.cos(gamma)
        corrected = h * np.cos(gamma) - length * np.sin(gamma)
        same_angles(gamma_002(leg, corrected, z)[0], gamma)
        np.testing.assert_allclose(gamma_002(leg, corrected, z)[1], length, rtol=0, atol=1e-12)
        printed = h * np.cos(gamma) + length * np.sin(gamma)
        known = printed**2 + z**2 > h**2
        off = gamma_002(leg, printed[known], z[known])[0] - gamma[known]
        assert np.abs(wrap_angle(off)).max() > 0.5


@pytest.mark.parametrize("name", ["wang2020", "anymal", "anymal_c", "solo12"])
def test_wang2024_signs_of_x_in_eqs_1_and_12_contradict_each_other(name: str) -> None:
    """Erratum, by a round trip: eq. (12) as printed undoes eq. (1) with -x, not eq. (1).

    On the hind legs, whose knee is on the side of eq. (11).
    """
    for leg_name in ("LH", "RH"):
        leg = robot(name).legs[leg_name]
        assert leg.knee > 0
        _, alpha, beta = angles_002(leg, branch(leg, 300, 2.0))
        x, length = in_plane_002(leg, alpha, beta)
        s, n, found = beta_002(leg, x, length)
        same_angles(found, beta)
        second = np.arccos((leg.upper + n) / s)
        same_angles(np.arctan(x / length) + second, alpha)  # eq. (12) corrected
        same_angles(-np.arctan(-x / length) + second, alpha)  # or eq. (1) turned round
        printed = -np.arctan(x / length) + second
        again = in_plane_002(leg, printed, beta)[0]
        np.testing.assert_allclose(again, in_plane_002(leg, alpha, beta)[0] * -1.0, atol=1e-9)
        assert np.abs(wrap_angle(printed - alpha)).max() > 0.5


@pytest.mark.parametrize("leg_name", LEGS)
def test_wang2024_eq_11_is_one_side_of_the_knee(leg_name: str) -> None:
    """Erratum: right for knees that point forward; the others take + in (11) and - in (13)."""
    leg = robot("wang2020").legs[leg_name]
    _, alpha, beta = angles_002(leg, branch(leg))
    x, length = in_plane_002(leg, alpha, beta)
    _, _, printed = beta_002(leg, x, length)
    same_angles(leg.knee * printed, beta)
    if leg.knee < 0:
        assert np.abs(printed - beta).min() > 0.05


def test_wang2024_eq_13_needs_no_other_branch() -> None:
    """Unlike [XiLing]'s arcsin, the arccos of eq. (13) holds for the folded leg, hu + n < 0."""
    leg = robot("anymal").legs["LH"]
    _, alpha, beta = angles_002(leg, branch(leg, 600))
    x, length = in_plane_002(leg, alpha, beta)
    s, n, _ = beta_002(leg, x, length)
    assert (leg.upper + n < 0).sum() > 50
    same_angles(np.arctan(x / length) + np.arccos((leg.upper + n) / s), alpha, 1e-8)
