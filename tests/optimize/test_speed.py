"""Three ways to the highest speed, and the number they agree on."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.optimize import linprog

import gaitopt
from gaitopt import LEGS, InputError, Quadruped, build_speed_lp, solve_speed_lp
from gaitopt.optimize.speed import arc_speed, body_speed, foot_rates, knot_times, paper_foot_speed

Array = NDArray[np.float64]


def random_states(robot: Quadruped, leg: str, count: int, seed: int) -> Array:
    """Joint angles of bent legs within limits, away from the straight and the folded leg."""
    rng = np.random.default_rng(seed)
    side = robot.legs[leg].knee
    return np.column_stack(
        [
            rng.uniform(-0.6, 0.6, count),
            rng.uniform(-0.9, 0.9, count),
            side * rng.uniform(0.3, 2.0, count),
        ]
    )


def pinocchio_jacobian(robot: Quadruped, leg: str, q: Array) -> Array:
    """Foot Jacobian ``(3, 3)`` in the body frame, by Pinocchio."""
    model, data = robot.model, robot.model.createData()
    full = pin.neutral(model)
    joints = [model.joints[model.getJointId(name)] for name in robot.legs[leg].joints]
    for joint, angle in zip(joints, q, strict=True):
        full[joint.idx_q] = angle
    frame = model.getFrameId(robot.legs[leg].foot)
    whole = pin.computeFrameJacobian(model, data, full, frame, pin.LOCAL_WORLD_ALIGNED)
    columns = [joint.idx_v for joint in joints]
    return np.asarray(robot.body_axes.T @ whole[:3, columns])


@pytest.mark.parametrize("leg", LEGS)
def test_lp_paper_and_arc_length_agree(wang: Quadruped, leg: str) -> None:
    """Section IV of the paper: the LP from Pinocchio's Jacobian, Figs. 9-10, and arc length."""
    rng = np.random.default_rng(LEGS.index(leg))
    for q in random_states(wang, leg, 100, seed=7):
        turn = rng.uniform(-np.pi, np.pi)
        up = np.array([0.0, 0.0, rng.choice([-1.0, 1.0])])
        for direction in (up, np.array([np.cos(turn), np.sin(turn), 0.0])):
            geometry = wang.legs[leg]
            limits = geometry.velocity_limits
            program = build_speed_lp(pinocchio_jacobian(wang, leg, q), direction, limits)
            lp = solve_speed_lp(program)
            paper = paper_foot_speed(geometry, q, direction)
            arc = float(arc_speed(foot_rates(geometry, q, direction), limits))
            assert paper == pytest.approx(lp, rel=1e-9)
            assert arc == pytest.approx(lp, rel=1e-9)


@pytest.mark.parametrize("name", ["a1", "anymal_c", "hyq"])
def test_lp_and_arc_length_agree_on_legs_with_offsets(name: str) -> None:
    robot = gaitopt.load_robot(name)
    rng = np.random.default_rng(3)
    for leg in LEGS:
        for q in random_states(robot, leg, 15, seed=1):
            direction = rng.normal(size=3)
            limits = robot.legs[leg].velocity_limits
            lp = solve_speed_lp(
                build_speed_lp(pinocchio_jacobian(robot, leg, q), direction, limits)
            )
            arc = float(arc_speed(foot_rates(robot.legs[leg], q, direction), limits))
            assert arc == pytest.approx(lp, rel=1e-9)


def test_the_lp_agrees_with_scipy(wang: Quadruped) -> None:
    rng = np.random.default_rng(0)
    for q in random_states(wang, "LF", 20, seed=2):
        direction = rng.normal(size=3)
        direction /= np.linalg.norm(direction)
        jacobian = wang.legs["LF"].jacobian(q)
        limit = 17 * np.pi / 180
        other = linprog(
            [0, 0, 0, -1], A_eq=np.column_stack([jacobian, -direction]), b_eq=np.zeros(3),
            bounds=[(-limit, limit)] * 3 + [(None, None)], method="highs",
        )  # fmt: skip
        ours = solve_speed_lp(build_speed_lp(jacobian, direction, np.full(3, limit)))
        assert ours == pytest.approx(-other.fun, rel=1e-7)


def test_the_papers_closed_forms_need_their_corrections(wang: Quadruped) -> None:
    """[Wang2020], eq. (14): w1/w3 has the wrong sign; its magnitude is right."""
    leg = wang.legs["RF"]
    q = np.array([0.3, -0.5, -0.8])
    rates = foot_rates(leg, q, np.array([0.0, 0.0, 1.0]))
    s1, c1 = np.sin(q[0]), np.cos(q[0])
    # theta_2 = -thigh, theta_3 = -bend for a front leg (lambda = +1).
    two, three = -q[1], q[2] + q[1]
    s2, c2, s3, c3 = np.sin(two), np.cos(two), np.sin(three), np.cos(three)
    l2, l3 = 0.30, 0.27
    hang = l2 * c2 + l3 * c3
    w1, w2, w3 = rates[0], -rates[1], -rates[2]
    printed_12 = (s1 * l2 * (c2 * s3 + c3 * s2)) / (c1 * c3 * hang)
    printed_13 = (s1 * l2 * l3 * (c2 * s3 + c3 * s2)) / (c1 * hang**2)
    assert abs(w1 / w2) == pytest.approx(abs(printed_12), rel=1e-9)
    assert w1 / w3 == pytest.approx(-printed_13, rel=1e-9)


def test_the_misprint_of_eq_16(wang: Quadruped) -> None:
    """[Wang2020], eq. (16): the denominator must read l3 s3 - l2 s2, not l3 s2 - l2 s2."""
    leg = wang.legs["RF"]
    q, slope = np.array([0.3, -0.5, -0.8]), 0.4
    rates = foot_rates(leg, q, np.array([1.0, slope, 0.0]))
    s1, c1 = np.sin(q[0]), np.cos(q[0])
    s2, c2 = np.sin(-q[1]), np.cos(-q[1])
    s3, c3 = np.sin(q[2] + q[1]), np.cos(q[2] + q[1])
    l2, l3 = 0.30, 0.27
    hang, cross = l2 * c2 + l3 * c3, c2 * s3 + c3 * s2
    top = c1 * l2 * l3 * slope * cross

    def printed(first: float) -> float:
        return float(top / (hang * (l3 * first - l2 * s2 - s1 * slope * hang)))

    ratio = -rates[0] / rates[2]
    assert ratio == pytest.approx(-printed(s3), rel=1e-9)
    assert abs(ratio) != pytest.approx(abs(printed(s2)), rel=1e-3)
    printed_12 = -(c1 * l2 * slope * cross) / (hang * (s3 - c3 * s1 * slope))
    assert -rates[0] / rates[1] == pytest.approx(-printed_12, rel=1e-9)


def test_a_straight_leg_cannot_move_its_foot_outwards(wang: Quadruped) -> None:
    speeds = [
        float(arc_speed(foot_rates(wang.legs["LF"], np.array([0.0, 0.0, -bend]),
                                   np.array([0.0, 0.0, -1.0])),
                        wang.legs["LF"].velocity_limits))
        for bend in (1e-1, 1e-2, 1e-3)
    ]  # fmt: skip
    assert speeds[0] > 5 * speeds[1] > 25 * speeds[2] > 0


def test_body_speed_is_the_slowest_legs() -> None:
    assert body_speed(np.array([[0.3, 0.1, 0.2, 0.4], [1, 2, 3, 0.5]])) == pytest.approx([0.1, 0.5])


@given(st.floats(0.1, 10), st.lists(st.floats(-1, 1), min_size=3, max_size=3))
def test_speed_is_proportional_to_the_limits(factor: float, rates: list[float]) -> None:
    dq, limits = np.array(rates) + 1e-3, np.array([1.0, 2.0, 3.0])
    assert arc_speed(dq, factor * limits) == pytest.approx(factor * arc_speed(dq, limits))


def test_duration_is_length_in_the_joint_norm() -> None:
    joints = np.array([[0.0, 0.0], [0.3, 0.1], [0.3, -0.5]])
    times, slowest = knot_times(joints, np.array([1.0, 0.5]), np.array([0.2, 0.2]), None)
    assert times == pytest.approx([0.3, 1.2])
    assert slowest.tolist() == [0, 1]


def test_a_given_speed_never_beats_the_joints() -> None:
    joints = np.array([[0.0, 0.0], [0.3, 0.1], [0.3, -0.5]])
    times, slowest = knot_times(joints, np.array([1.0, 0.5]), np.array([0.2, 0.2]), 0.4)
    assert times == pytest.approx([0.5, 1.2])
    assert slowest.tolist() == [-1, 1]


@pytest.mark.parametrize(
    ("jacobian", "direction", "limits", "words"),
    [
        (np.eye(3), [1, 0], np.ones(3), "shapes do not fit"),
        (np.eye(3), [0, 0, 0], np.ones(3), "direction not zero"),
        (np.eye(3), [1, 0, 0], [1, 1, 0], "limits positive"),
        (np.full((3, 3), np.nan), [1, 0, 0], np.ones(3), "finite"),
    ],
)
def test_bad_speed_problems(jacobian: Array, direction: Array, limits: Array, words: str) -> None:
    with pytest.raises(InputError, match=words):
        build_speed_lp(jacobian, direction, limits)


def test_the_papers_formulae_refuse_what_they_do_not_cover(wang: Quadruped) -> None:
    q = np.array([0.1, -0.4, -0.9])
    with pytest.raises(InputError, match="without offsets"):
        paper_foot_speed(gaitopt.load_robot("a1").legs["LF"], q, np.array([0, 0, 1.0]))
    with pytest.raises(InputError, match="vertical or horizontal"):
        paper_foot_speed(wang.legs["LF"], q, np.array([1.0, 0, 1.0]))
