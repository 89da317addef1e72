"""Postures: known answers by hand, what a pitch-pitch robot cannot do, and the cycle of Fig. 5."""

from __future__ import annotations

import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gaitopt import InputError, load_robot
from gaitopt.conventions import LEGS, FloatArray
from gaitopt.optimize.posture.problem import BodyPose, build_posture_problem
from gaitopt.optimize.posture.solution import PostureSolution
from gaitopt.optimize.posture.solver import (
    FEASIBILITY,
    OPTIMALITY,
    leg_gaps,
    posture_cycle,
    solve_posture,
)
from gaitopt.robots.quadruped import Quadruped
from gaitopt.robots.whole_body import feet_from_joints

FROG, WANG, ANYMAL = (load_robot(name) for name in ("frog1", "wang2020", "anymal_c"))
HEIGHTS = {"frog1": 0.72, "wang2020": 0.40, "anymal_c": 0.44}
G = 9.81


def square(robot: Quadruped) -> dict[str, FloatArray]:
    """Feet below the hips, on the ground."""
    length, width = robot.stance_size
    return {
        leg: np.array([x * length / 2, y * width / 2, 0.0])
        for leg, x, y in (("LF", 1, 1), ("LH", -1, 1), ("RH", -1, -1), ("RF", 1, -1))
    }


def level(robot: Quadruped, height: float | None = None) -> BodyPose:
    return BodyPose(np.array([0.0, 0.0, height or HEIGHTS[robot.name]]), np.zeros(3))


def by_pinocchio(robot: Quadruped, solution: PostureSolution) -> FloatArray:
    """Where Pinocchio's model has the feet, standing as the solution says ``(4, 3)``."""
    import pinocchio as pin

    base = solution.pose.base(robot)
    q = pin.neutral(robot.model)
    q[:3] = base[:3]
    q[3:7] = pin.Quaternion(pin.rpy.rpyToMatrix(*base[3:])).coeffs()
    for leg, angles in solution.joints.items():
        q[7:][list(robot.leg_columns[leg])] = angles
    data = robot.model.createData()
    pin.framesForwardKinematics(robot.model, data, q)
    frames = [robot.model.getFrameId(robot.legs[leg].foot) for leg in LEGS]
    return np.array([data.oMf[frame].translation for frame in frames])


# --- known answers ----------------------------------------------------------------------------


@pytest.mark.parametrize("leg", LEGS)
@pytest.mark.parametrize("margin", [0.01, 0.03, 0.05])
def test_without_roll_the_margin_is_the_shift_times_the_sine_of_the_diagonal(
    leg: str, margin: float
) -> None:
    """Backward for front legs and forward for hind legs, and not otherwise."""
    found = solve_posture(build_posture_problem(FROG, square(FROG), level(FROG), swing=leg,
                                                margin=margin))  # fmt: skip
    length, width = FROG.stance_size
    sine = width / np.hypot(length, width)
    sense = -1.0 if leg in ("LF", "RF") else 1.0
    assert found.solved
    assert found.pose.numbers == pytest.approx([sense * margin / sine, 0, 0.72, 0, 0, 0], abs=1e-6)
    assert found.margin == pytest.approx(margin, abs=1e-6)


def test_with_roll_joints_the_nearest_place_lies_across_the_diagonal() -> None:
    """A 3-4-5 triangle: wang2020's stance is 0.4 m times 0.3 m."""
    found = solve_posture(build_posture_problem(WANG, square(WANG), level(WANG), swing="RF",
                                                margin=0.03))  # fmt: skip
    assert found.pose.numbers == pytest.approx([-0.018, 0.024, 0.4, 0, 0, 0], abs=1e-6)


def test_a_posture_that_is_good_already_is_kept() -> None:
    for robot in (FROG, WANG, ANYMAL):
        found = solve_posture(build_posture_problem(robot, square(robot), level(robot)))
        assert found.pose.numbers == pytest.approx(level(robot).numbers, abs=1e-8)
        assert found.height_change == pytest.approx(0.0, abs=1e-8)


def test_the_largest_margin_over_three_feet_is_their_inner_circle() -> None:
    problem = build_posture_problem(WANG, square(WANG), level(WANG), swing="RF")
    found = solve_posture(problem.largest_margin())
    # Inner radius of a right triangle: half of what its legs are longer than its longest side. The
    # proximal term pulls a little towards the start.
    assert found.solved
    assert found.margin == pytest.approx((0.4 + 0.3 - 0.5) / 2, abs=2e-3)
    assert found.margin <= 0.1 + 1e-9


def test_a_body_too_high_for_its_feet_comes_down_as_little_as_needed() -> None:
    high = level(FROG, 0.79)
    found = solve_posture(
        build_posture_problem(FROG, square(FROG), high, reach_fraction=0.9, free=("z",))
    )
    assert found.pose.centre[2] == pytest.approx(0.72, abs=1e-6)
    assert found.potential_energy_change == pytest.approx(-FROG.mass * G * 0.07, rel=1e-4)


def test_weight_on_potential_energy_keeps_the_height() -> None:
    """A foothold out of reach can be got at by going forward or down; the latter costs energy."""
    feet = square(FROG)
    target = feet["RF"] + [0.32, 0.0, 0.0]
    drops = []
    for weight in (0.0, 10.0, 1000.0):
        found = solve_posture(
            build_posture_problem(
                FROG,
                feet,
                level(FROG),
                swing="RF",
                places=[target],
                margin=0.02,
                reach_fraction=0.98,
                height_weight=weight,
            )
        )
        assert found.solved
        drops.append(-found.height_change)
    assert drops[0] > 0.01
    assert drops[0] >= drops[1] >= drops[2] > 0.0


@pytest.mark.parametrize("robot", [FROG, WANG, ANYMAL], ids=lambda r: r.name)
def test_pinocchio_finds_the_feet_where_they_stand(robot: Quadruped) -> None:
    feet = square(robot)
    feet["LF"] = feet["LF"] + [0.03, 0.0, 0.02]
    found = solve_posture(
        build_posture_problem(
            robot, feet, level(robot), swing="RF", margin=0.03, reach_fraction=0.97
        )
    )
    assert found.solved
    assert by_pinocchio(robot, found) == pytest.approx(np.array([feet[leg] for leg in LEGS]),
                                                       abs=1e-7)  # fmt: skip


@settings(max_examples=25, deadline=None)
@given(
    st.lists(st.floats(-0.04, 0.04), min_size=12, max_size=12),
    st.sampled_from(LEGS),
    st.floats(0.0, 0.04),
)
def test_answers_keep_their_constraints_on_uneven_feet(
    moved: list[float], leg: str, margin: float
) -> None:
    """Judged by Pinocchio and by the hull of the feet, not by the solver."""
    from scipy.spatial import ConvexHull

    feet = {k: v + d for (k, v), d in zip(square(WANG).items(), np.reshape(moved, (4, 3)),
                                          strict=True)}  # fmt: skip
    found = solve_posture(build_posture_problem(WANG, feet, level(WANG), swing=leg, margin=margin))
    assert found.solved
    assert found.residuals.violation <= FEASIBILITY
    assert found.residuals.stationarity <= OPTIMALITY
    stand = np.array([feet[x][:2] for x in LEGS if x != leg])
    inside = -(ConvexHull(stand).equations @ [*found.pose.centre[:2], 1.0]).max()
    assert inside >= margin - 1e-7
    assert by_pinocchio(WANG, found) == pytest.approx(np.array([feet[x] for x in LEGS]), abs=1e-6)


def test_exact_derivatives_agree_with_differences() -> None:
    problem = build_posture_problem(ANYMAL, square(ANYMAL), level(ANYMAL), swing="LH", margin=0.02)
    form = problem.formulation
    rng = np.random.default_rng(0)
    x = rng.uniform(-0.5, 0.5, form.nlp["x"].numel())
    p = rng.uniform(-0.5, 0.5, form.nlp["p"].numel())
    duals = rng.uniform(-1.0, 1.0, form.nlp["g"].numel())
    import casadi as ca

    value = ca.Function("v", [form.nlp["x"], form.nlp["p"]], [form.nlp["f"], form.nlp["g"]])

    def lagrangian(at: FloatArray) -> float:
        cost, rows = value(at, p)
        return float(cost) + float(duals @ np.asarray(rows).ravel())

    steps = 1e-6 * np.eye(len(x))
    judge = [(lagrangian(x + d) - lagrangian(x - d)) / 2e-6 for d in steps]
    assert np.asarray(form.gradient(x, p, duals)[0]).ravel() == pytest.approx(judge, abs=1e-6)


# --- what a pitch-pitch robot cannot do ([Shao2011], Section IV) ------------------------------


@settings(max_examples=50, deadline=None)
@given(st.floats(np.radians(0.1), np.radians(20.0)))
def test_leaning_asks_standing_feet_to_slide_apart(roll: float) -> None:
    """Legs' planes meet level ground ``2 w / cos(roll)`` apart: each foot slides by the rest."""
    half = FROG.stance_size[1] / 2.0
    leaning = BodyPose(np.array([0.0, 0.0, 0.7]), np.array([roll, 0.0, 0.0]))
    places = {}
    for leg in ("LF", "RF"):
        # Where the leg's plane meets the ground, by bisection along y.
        low, high = -2.0, 2.0
        for _ in range(60):
            middle = (low + high) / 2.0
            gap = leg_gaps(FROG, leaning, [(leg, np.array([0.45, middle, 0.0]))])[0]
            low, high = (middle, high) if gap < 0.0 else (low, middle)
        places[leg] = low
    slide = (places["LF"] - places["RF"]) / 2.0 - half
    assert slide == pytest.approx(half * (1.0 / np.cos(roll) - 1.0), abs=1e-9)


def test_five_degrees_of_lean_slide_frog1s_feet_by_a_millimetre() -> None:
    half = FROG.stance_size[1] / 2.0
    assert half * (1.0 / np.cos(np.radians(5.0)) - 1.0) == pytest.approx(1.07e-3, abs=1e-5)


@pytest.mark.parametrize("give", [1e-4, 1e-3, 5e-3])
def test_as_much_as_feet_give_a_body_may_lean_and_no_more(give: float) -> None:
    """From a pose that leans too much the nearest one has ``w (1 - cos(roll)) = give``."""
    start = BodyPose(np.array([0.0, 0.72 * np.sin(0.3), 0.72 * np.cos(0.3)]), np.array([0.3, 0, 0]))
    found = solve_posture(
        build_posture_problem(
            FROG,
            square(FROG),
            start,
            plane_tolerance=give,
            margin=0.0,
            free=("x", "y", "z", "roll"),
            weights=[1e-3, 1e-3, 1e-3, 1.0, 1e-3, 1e-3],
        )
    )
    assert found.solved
    assert found.pose.rpy[0] == pytest.approx(np.arccos(1.0 - give / 0.28), rel=1e-4)


def test_yaw_is_locked_in_the_first_order() -> None:
    """Feet that give by g let the body yaw by g over half its length only."""
    start = BodyPose(np.array([0.0, 0.0, 0.72]), np.array([0.0, 0.0, 0.2]))
    found = solve_posture(
        build_posture_problem(
            FROG,
            square(FROG),
            start,
            plane_tolerance=1e-3,
            margin=0.0,
            free=("x", "y", "z", "pitch", "yaw"),
        )
    )
    yaw = float(found.pose.rpy[2])
    assert 0.45 * np.sin(yaw) + 0.28 * (1.0 - np.cos(yaw)) == pytest.approx(1e-3, rel=1e-4)


def test_without_give_only_x_z_and_pitch_are_left() -> None:
    """Whatever is asked for, y, roll and yaw of the answer stay."""
    feet = square(FROG)
    found = solve_posture(
        build_posture_problem(
            FROG,
            feet,
            level(FROG),
            swing="RF",
            places=[feet["RF"] + [0.3, 0.0, 0.1]],
            margin=0.05,
            reach_fraction=0.97,
        )
    )
    assert found.solved
    assert np.abs(found.pose.numbers[[1, 3, 5]]).max() < 1e-9
    assert abs(found.pose.centre[0]) > 0.05


def test_on_a_track_that_is_wide_enough_the_body_leans_and_moves() -> None:
    """Feet 2 w / cos(roll) apart hold a leaning robot without sliding, also while it moves."""
    roll = 0.1
    feet = {leg: place * [1.0, 1.0 / np.cos(roll), 1.0] for leg, place in square(FROG).items()}
    leaning = BodyPose(np.array([0.0, 0.70 * np.tan(roll), 0.70]), np.array([roll, 0.0, 0.0]))
    found = solve_posture(build_posture_problem(FROG, feet, leaning, swing="RF", margin=0.02))
    assert found.solved
    assert found.pose.rpy == pytest.approx([roll, 0.0, 0.0], abs=1e-9)
    assert np.abs(leg_gaps(FROG, found.pose, list(feet.items()))).max() < 1e-8


def test_feet_at_different_heights_hold_a_level_and_a_leaning_body() -> None:
    """``2 w cos(roll) + d sin(roll) = 2 w`` has two answers: 0, and ``2 atan(d / 2 w)``."""
    step, width = 0.05, FROG.stance_size[1]
    feet = {
        leg: place + np.array([0.0, 0.0, step if leg[0] == "L" else 0.0])
        for leg, place in square(FROG).items()
    }
    for roll in (0.0, 2.0 * np.arctan(step / width)):
        # Sideways so that the plane of the left legs holds the left feet.
        hip = np.array([0.0, 0.28 * np.cos(roll), 0.28 * np.sin(roll)])
        left = np.array([0.0, 0.28, step]) - [0.0, 0.0, 0.74]
        y = (left - hip) @ [0.0, np.cos(roll), np.sin(roll)] / np.cos(roll)
        start = BodyPose(np.array([0.0, y, 0.74]), np.array([roll, 0.0, 0.0]))
        found = solve_posture(build_posture_problem(FROG, feet, start, margin=0.02, swing="LH"))
        assert found.solved
        assert found.pose.rpy[0] == pytest.approx(roll, abs=1e-9)
        assert np.abs(leg_gaps(FROG, found.pose, list(feet.items()))).max() < 1e-8


# --- energies and the cycle -------------------------------------------------------------------


def test_energies_are_the_rise_over_the_diagonal() -> None:
    margin = 0.03
    found = solve_posture(build_posture_problem(FROG, square(FROG), level(FROG), swing="RF",
                                                margin=margin))  # fmt: skip
    rise = np.hypot(0.72, margin) - 0.72
    assert found.energy_margin == pytest.approx(FROG.mass * G * rise, rel=1e-3)
    assert found.diagonal_energy == pytest.approx(FROG.mass * G * rise, rel=1e-3)


def test_on_the_wrong_side_of_the_diagonal_eq_11_is_negative() -> None:
    problem = build_posture_problem(FROG, square(FROG), level(FROG), swing="RF", margin=-1.0)
    ahead = solve_posture(problem.starting_at(BodyPose(np.array([0.05, 0, 0.72]), np.zeros(3))))
    assert ahead.diagonal_energy < 0.0
    assert ahead.margin < 0.0


def test_the_cycle_has_six_states_and_ends_as_it_began() -> None:
    states = posture_cycle(FROG, square(FROG), 0.25, level(FROG), margin=0.02, reach_fraction=0.98)
    assert [s.solved for s in states] == [True] * 6
    lifted = [sorted(set(LEGS) - set(s.problem.support)) for s in states]
    assert lifted == [[], ["RF"], ["LH"], ["LF"], ["RH"], []]
    assert all(s.margin >= 0.02 - 1e-7 for s in states)
    gone = states[-1].pose.numbers - states[0].pose.numbers
    assert gone == pytest.approx([0.25, 0, 0, 0, 0, 0], abs=1e-7)


def test_the_body_goes_back_for_rf_forward_for_lh_and_back_to_recover() -> None:
    states = posture_cycle(FROG, square(FROG), 0.25, level(FROG), margin=0.02, reach_fraction=0.98)
    x = [float(s.pose.centre[0]) for s in states]
    assert x[1] < x[0] < x[2]
    assert x[5] < x[4]


# --- refusals ---------------------------------------------------------------------------------


def test_what_cannot_be_is_said_to_be_infeasible() -> None:
    feet = square(FROG)
    far = solve_posture(
        build_posture_problem(
            FROG, feet, level(FROG), swing="RF", places=[feet["RF"] + [1.5, 0.0, 0.0]]
        )
    )
    assert not far.solved
    assert far.residuals.violation > 1e-3


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"swing": "XX"}, "swing must be one of LF, LH, RH, RF or None, got 'XX'"),
        ({"margin": np.nan}, "margin must be a number"),
        ({"reach_fraction": 0.0}, "reach_fraction must be a number from 0.001 to 1"),
        ({"plane_tolerance": -1.0}, "plane_tolerance"),
        ({"free": ("x", "sideways")}, "free names 'sideways'"),
        ({"weights": [1, 1, 1]}, "six positive numbers"),
        ({"places": [[0, 0, 0]]}, "places are for the leg that swings"),
        ({"objective": "least"}, "objective must be 'motion' or 'margin'"),
    ],
)
def test_wrong_requests_are_refused(change: dict[str, object], words: str) -> None:
    with pytest.raises(InputError, match=words):
        build_posture_problem(FROG, square(FROG), level(FROG), **change)  # type: ignore[arg-type]


def test_feet_in_a_line_and_missing_feet_are_refused() -> None:
    feet = square(FROG)
    with pytest.raises(InputError, match="one line"):
        build_posture_problem(FROG, {leg: p * [1, 0, 1] for leg, p in feet.items()}, level(FROG))
    with pytest.raises(InputError, match="exactly LF, LH, RH, RF"):
        build_posture_problem(FROG, {"LF": feet["LF"]}, level(FROG))
    with pytest.raises(InputError, match="centre must be three finite numbers"):
        BodyPose(np.array([0.0, np.nan, 0.0]), np.zeros(3))


def test_base_and_centre_are_told_apart() -> None:
    """A pose places the body centre; a plan's columns place the URDF's root link."""
    for robot in (FROG, WANG, ANYMAL):
        pose = BodyPose(np.array([0.1, 0.2, 0.4]), np.array([0.05, -0.1, 0.3]))
        base = pose.base(robot)
        joints = np.zeros(len(robot.joint_names))
        hips = [pose.in_body(robot, p) for p in feet_from_joints(robot, base[:3], base[3:], joints)]
        own = [robot.legs[leg].forward(joints[list(robot.leg_columns[leg])]) for leg in LEGS]
        assert np.array(hips) == pytest.approx(np.array(own), abs=1e-12)
    assert json.dumps(pose.numbers.tolist())
