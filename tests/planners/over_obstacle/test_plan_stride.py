"""Walks over an obstacle: certified, clear of it at all times, and refused where they cannot be.

Most are timed by joint velocities, as in the paper; those with contact forces say so.
"""

from __future__ import annotations

import json
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gaitopt import ForceLimits, InfeasibleStepError, InputError, load_robot, verify
from gaitopt.conventions import LEGS, FloatArray
from gaitopt.motion.path import MotionPath
from gaitopt.motion.pieces import joined
from gaitopt.optimize.posture.problem import BodyPose
from gaitopt.optimize.spline.limits import JointLimits
from gaitopt.optimize.spline.problem import build_spline_problem
from gaitopt.optimize.spline.solver import solve_spline
from gaitopt.plan.plan import Plan
from gaitopt.plan.settings.over_obstacle import StrideSettings
from gaitopt.planners.over_obstacle import failure, planner
from gaitopt.planners.over_obstacle.clearance import Surroundings
from gaitopt.planners.over_obstacle.layout import Gaps, footholds, lay_out
from gaitopt.planners.over_obstacle.pieces import (
    body_move,
    leg_limits,
    open_ground_swing,
    spline_swing,
    without_end_accelerations,
)
from gaitopt.robots.quadruped import Quadruped
from gaitopt.robots.whole_body import feet_from_joints
from gaitopt.terrain.obstacles import (
    Obstacle,
    rectangular_obstacle,
    round_obstacle,
    triangular_obstacle,
)

FROG, WANG, ANYMAL = (load_robot(name) for name in ("frog1", "wang2020", "anymal_c"))
BOARD = rectangular_obstacle(0.11, 0.04)
plan_stride = partial(planner.plan_stride, timing="velocity")
TABLE_I: dict[str, Any] = {
    "acceleration_limit": np.radians(20.0),
    "jerk_limit": np.radians([40.0, 50.0]),
}


@pytest.fixture(scope="module")
def board_walk() -> Plan:
    """frog1 over the paper's board, within the limits of its Table I."""
    return plan_stride(FROG, BOARD, **TABLE_I)


def shapes_apart(plan: Plan, obstacle: Obstacle, dt: float) -> float:
    """Least distance of any collision shape from the obstacle's hull, by samples alone."""
    values = plan.path.evaluate(np.append(np.arange(0.0, plan.duration, dt), plan.duration))
    return float(Surroundings.of(plan.robot, obstacle).distances(values).min())


# --- the paper's case -------------------------------------------------------------------------


def test_frog1_gets_over_the_papers_board_and_is_certified(board_walk: Plan) -> None:
    certificate = verify(board_walk)
    assert certificate.ok, certificate.report()
    names = [check.name for check in certificate]
    assert "joint jerks" in names
    assert "joint accelerations" in names


def test_every_leg_goes_over_in_the_papers_order(board_walk: Plan) -> None:
    over = [
        swing.leg for swing in board_walk.swings
        if swing.foot_start[0] < 0.0 < swing.foot_end[0]
    ]  # fmt: skip
    assert sorted(over) == sorted(LEGS)
    flown = [swing.leg for swing in board_walk.swings]
    assert flown == ["RF", "LH", "LF", "RH"] * (len(flown) // 4)


def test_nothing_comes_near_the_board(board_walk: Plan) -> None:
    """10 mm for every part by samples that the planner did not take, 30 mm for the feet's balls."""
    assert shapes_apart(board_walk, BOARD, 0.05) >= 0.010
    assert board_walk.record.clearance >= 0.010  # type: ignore[operator]
    motion = board_walk.sample(0.02)
    balls = BOARD.distance(motion.feet) - FROG.foot_radius
    assert balls.min() >= 0.030 - 2e-5
    assert board_walk.record.foot_margin <= balls.min() + 1e-9  # type: ignore[operator]


def test_nobody_stands_within_the_margin(board_walk: Plan) -> None:
    away = np.abs(board_walk.footholds.array[..., 0]) - 0.02 - FROG.foot_radius
    assert away.min() >= 0.030


def test_a_pitch_pitch_robot_walks_on_without_swaying(board_walk: Plan) -> None:
    """Only x, z and pitch of the body move."""
    base = board_walk.path.knots()[:, :6]
    assert np.abs(base[:, [1, 3, 5]]).max() < 1e-8
    assert np.ptp(base[:, 0]) > 1.0


def test_each_joint_keeps_its_own_limits_of_table_i(board_walk: Plan) -> None:
    """Sampled: hips 40, knees 50 deg/s^3, where the certificate knows one limit for all."""
    t = np.arange(0.0, board_walk.duration, 0.01)
    jerk = np.degrees(np.abs(board_walk.path.evaluate(t, 3)[:, 6:])).max(axis=0)
    speed = np.degrees(np.abs(board_walk.path.evaluate(t, 1)[:, 6:])).max(axis=0)
    for k, name in enumerate(FROG.joint_names):
        hip = name.endswith("HFE")
        assert jerk[k] <= (40.0 if hip else 50.0) * (1 + 1e-6)
        assert speed[k] <= (10.0 if hip else 20.0) * (1 + 1e-6)


def test_the_ground_is_where_the_board_stands(board_walk: Plan) -> None:
    assert board_walk.footholds.array[..., 2] == pytest.approx(FROG.foot_radius)


def test_the_plan_starts_before_and_ends_behind_the_board(board_walk: Plan) -> None:
    points = board_walk.footholds.array[..., 0]
    assert points[:, 0].max() < -0.02
    assert points[:, -1].min() > 0.02


# --- other robots and obstacles ---------------------------------------------------------------


@pytest.mark.parametrize(
    ("robot", "obstacle"),
    [
        pytest.param(WANG, rectangular_obstacle(0.06, 0.03), marks=pytest.mark.slow),
        (ANYMAL, rectangular_obstacle(0.10, 0.04)),
        pytest.param(
            ANYMAL, round_obstacle(0.08, position=(1.0, -2.0, 0.3), yaw=0.7), marks=pytest.mark.slow
        ),
        (FROG, triangular_obstacle(0.08, 0.06, position=(0.0, 0.0, -0.2), yaw=-2.0)),
    ],
    ids=["wang2020 board", "anymal_c board", "anymal_c log", "frog1 ridge"],
)
def test_other_robots_and_obstacles_are_certified(robot: Quadruped, obstacle: Obstacle) -> None:
    """Anywhere in the world, in any direction, and on any ground."""
    around = {} if robot is WANG else {"approach": 0, "leave": 0}
    plan = plan_stride(robot, obstacle, **around)
    certificate = verify(plan)
    assert certificate.ok, certificate.report()
    assert shapes_apart(plan, obstacle, 0.05) >= plan.settings.clearance  # type: ignore[attr-defined]
    motion = plan.sample(0.5)
    across = obstacle.to_local(motion.cog)
    assert across[0, 0] < 0.0 < across[-1, 0]
    assert np.abs(across[[0, -1], 1]).max() < 1e-9
    yaw = np.arctan2(*(motion.cog[-1] - motion.cog[0])[[1, 0]])
    assert np.cos(yaw - obstacle.yaw) == pytest.approx(1.0)


# --- contact forces ---------------------------------------------------------------------------


@pytest.mark.parametrize(
    "robot", [pytest.param(FROG, marks=pytest.mark.slow), ANYMAL], ids=["frog1", "anymal_c"]
)
def test_by_default_contact_forces_exist(robot: Quadruped) -> None:
    """The true centre of mass of anymal_c is 9 mm behind its body centre, nearer to the sides."""
    obstacle = rectangular_obstacle(0.05, 0.03)
    plan = planner.plan_stride(robot, obstacle, approach=0, leave=0)
    certificate = verify(plan, collisions=False)
    assert certificate.ok and certificate["contact forces"].status == "ok", certificate.report()
    assert certificate["obstacles cleared"].status == "ok"
    assert plan.settings.stability_margin >= round(0.07 * robot.standing_height, 4)


def test_a_jerk_limit_needs_the_timing_by_velocity() -> None:
    with pytest.raises(InputError, match=r"a jerk limit is not kept .*timing=\"velocity\""):
        planner.plan_stride(FROG, BOARD, **TABLE_I)


def test_more_reserve_than_a_margin_gives_is_refused_with_the_foot(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """(Without the search for a smaller obstacle, which has no forces, either.)"""
    monkeypatch.setattr(failure, "_largest", lambda *_: None)
    asked: dict[str, Any] = {
        "approach": 0,
        "leave": 0,
        "body_height": 0.72,
        "stability_margin": 0.04,
    }
    with pytest.raises(InfeasibleStepError, match="normal force") as caught:
        planner.plan_stride(FROG, rectangular_obstacle(0.03, 0.03),
                            forces=ForceLimits(reserve=0.25), **asked)  # fmt: skip
    assert caught.value.conflicts == ("forces",) and 'timing="velocity"' in str(caught.value)


# --- refusals ---------------------------------------------------------------------------------


def test_too_high_a_board_is_refused_with_the_height_that_would_do() -> None:
    with pytest.raises(InfeasibleStepError) as caught:
        plan_stride(WANG, rectangular_obstacle(0.4, 0.04), body_height=0.5)
    words = str(caught.value)
    assert "does not get over this obstacle" in words
    height = float(words.split("gets over one ")[1].split(" m high")[0])
    assert 0.08 < height < 0.4
    plan = plan_stride(WANG, rectangular_obstacle(height, 0.04), body_height=0.5, approach=0,
                       leave=0)  # fmt: skip
    assert plan.record.clearance >= 0.01  # type: ignore[operator]


@pytest.mark.slow
def test_too_wide_a_block_is_refused_with_the_width_that_would_do() -> None:
    """wang2020 is 0.4 m long: it cannot stand over a block of 0.4 m."""
    with pytest.raises(InfeasibleStepError, match=r"stance of .* is 0\.4 m long") as caught:
        plan_stride(WANG, rectangular_obstacle(0.05, 0.4), body_height=0.5)
    width = float(str(caught.value).split(" m high and ")[1].split(" m wide")[0])
    assert 0.01 < width < 0.3


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"margin": 0.0}, "margin must be a number from 0.0001"),
        ({"clearance": -1.0}, "clearance must be a number"),
        ({"approach": -1}, "approach must be a whole number from 0"),
        ({"leave": 1.5}, "leave must be a whole number"),
        ({"sequence": ("RF", "LH")}, "sequence must name each"),
        ({"pattern": "circle"}, "pattern must be one of"),
        ({"acceleration_limit": [1.0, 2.0, 3.0]}, "acceleration_limit must be a positive number"),
        ({"jerk_limit": -1.0}, "jerk_limit must be a positive number, or 2"),
        ({"waypoints": True}, "waypoints must be a whole number"),
    ],
)
def test_wrong_settings_are_refused(change: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError, match=words):
        plan_stride(FROG, BOARD, **change)


def test_wrong_arguments_are_refused() -> None:
    with pytest.raises(InputError, match=r"a Quadruped .* and an Obstacle"):
        plan_stride(BOARD, FROG)  # type: ignore[arg-type]


# --- settings ---------------------------------------------------------------------------------


def test_settings_go_through_json_with_their_obstacles() -> None:
    asked = StrideSettings(
        obstacles=(BOARD, round_obstacle(0.1, yaw=0.3)), accelerations=(0.3, 0.4), jerks=(1.0, 2.0)
    )
    text = json.dumps(asked.to_dict(), allow_nan=False)
    assert StrideSettings(**json.loads(text)) == asked


@pytest.mark.parametrize("broken", [{"shape": "round"}, 3, {"core": [[0, 1]], "shape": "heap"}])
def test_broken_obstacles_are_refused(broken: object) -> None:
    with pytest.raises(InputError, match="obstacle"):
        StrideSettings(obstacles=(broken,))  # type: ignore[arg-type]


# --- footholds --------------------------------------------------------------------------------


@settings(max_examples=60, deadline=None)
@given(
    st.tuples(*[st.floats(0.06, 0.2)] * 4), st.integers(0, 3), st.integers(0, 3),
    st.floats(0.01, 0.1),
)  # fmt: skip
def test_layouts_keep_their_gaps_and_no_step_is_longer_than_the_strides(
    gaps: tuple[float, float, float, float], approach: int, leave: int, width: float
) -> None:
    obstacle = rectangular_obstacle(0.1, width, position=(3.0, 1.0, 0.0), yaw=0.4)
    layout = lay_out(FROG, obstacle, Gaps(*gaps), approach, leave)
    local = obstacle.to_local(footholds(FROG, obstacle, layout).array)
    for leg, before, after in (("LF", 0, 1), ("RF", 0, 1), ("LH", 2, 3), ("RH", 2, 3)):
        x = local[LEGS.index(leg), :, 0]
        assert (np.diff(x) > -1e-12).all()
        assert -x[x < 0].max() - width / 2 == pytest.approx(gaps[before])
        assert x[x > 0].min() - width / 2 == pytest.approx(gaps[after])
    steps = np.diff(layout.centres)
    longest = max(gaps[0] + gaps[1], gaps[2] + gaps[3]) + width
    assert steps.max() <= longest + 1e-9
    assert steps[[layout.front, layout.hind]].max() == pytest.approx(longest)
    assert layout.front == approach
    assert layout.cycles == layout.hind + 1 + leave


# --- clearances -------------------------------------------------------------------------------


def standing_path(robot: Quadruped, bases: FloatArray) -> MotionPath:
    """A path through base poses at all joints zero, a second apart."""
    joints = np.zeros((len(bases), len(robot.joint_names)))
    return MotionPath.polyline(
        np.arange(float(len(bases))), np.concatenate([bases, joints], axis=1)
    )


def test_distances_of_balls_are_those_of_their_centres_less_the_radius() -> None:
    around = Surroundings.of(FROG, BOARD)
    rng = np.random.default_rng(1)
    bases = np.column_stack([rng.uniform(-0.8, 0.8, 40), np.zeros(40), rng.uniform(0.95, 1.3, 40),
                             np.zeros((40, 3))])  # fmt: skip
    path = standing_path(FROG, bases)
    found = around.distances(path.knots())
    for leg in LEGS:
        ball = next(k for k, name in enumerate(around.names) if name.startswith(f"{leg}_FOOT"))
        foot = bases[:, :3] + FROG.legs[leg].hip - [0.0, 0.0, 0.8]
        assert around.owners[ball] == leg
        assert found[:, ball] == pytest.approx(BOARD.distance(foot) - 0.02, abs=1e-6)


def test_what_is_proven_of_a_motion_holds_at_all_samples() -> None:
    around = Surroundings.of(FROG, BOARD)
    bases = np.array(
        [[-0.6, 0, 0.96, 0, 0, 0], [-0.2, 0, 0.99, 0, 0.1, 0], [0.7, 0, 0.94, 0, 0, 0]]
    )
    path = standing_path(FROG, bases.astype(float))
    seen = around.distances(path.evaluate(np.linspace(0.0, path.duration, 4001))).min()
    for wanted in (0.0, 0.01, 0.05):
        closest = around.along(path, wanted)
        assert closest.proven <= seen + 1e-9
        if seen >= wanted + 2e-3:
            assert closest.proven >= wanted


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_no_ball_moves_faster_than_the_bound(seed: int) -> None:
    """The foot's ball by differences, on random motions of body and joints."""
    rng = np.random.default_rng(seed)
    ends = rng.uniform(-0.4, 0.4, (2, 6 + len(ANYMAL.joint_names)))
    path = MotionPath.polyline([0.0, 1.0], ends)
    around = Surroundings.of(ANYMAL, BOARD)
    t = np.linspace(0.0, 1.0, 2001)
    values = path.evaluate(t)
    feet = feet_from_joints(ANYMAL, values[:, :3], values[:, 3:6], values[:, 6:])
    speed = np.linalg.norm(np.diff(feet, axis=0), axis=2).max() * 2000.0
    assert speed <= around.speeds(path).min() * (1 + 1e-9)


def test_every_shape_has_its_owner() -> None:
    for robot in (FROG, WANG, ANYMAL):
        around = Surroundings.of(robot, BOARD)
        for name, owner in zip(around.names, around.owners, strict=True):
            assert owner == (name[:2] if name[:2] in LEGS else "")


def test_lines_stand_for_meshes() -> None:
    """solo8's shapes are meshes: thighs and shanks count as lines from joint to joint."""
    solo = load_robot("solo8")
    around = Surroundings.of(solo, BOARD)
    assert len(around.stand_ins) == 1 + 4 * 2
    assert all(around.owners.count(leg) >= 2 for leg in LEGS)
    base = np.array([[-0.5, 0.0, 0.3, 0.0, 0.0, 0.0]])
    path = standing_path(solo, base)
    found = dict(zip(around.names, around.distances(path.knots())[0], strict=True))
    leg = solo.legs["LF"]
    foot = base[0, :3] + leg.forward(np.zeros(len(leg.joints)))
    radius = solo.foot_radius or 0.02
    shank = found[f"{leg.joints[-1]} as a line"]
    # The straight leg stands upright before the board, and its foot is its lowest point.
    assert shank == pytest.approx(float(BOARD.distance(foot)) - radius, abs=2e-3)


# --- timed pieces -----------------------------------------------------------------------------

STANDING = BodyPose(np.array([0.0, 0.0, 0.72]), np.zeros(3))
FEET = np.array([[0.45, 0.28, 0.0], [-0.45, 0.28, 0.0], [-0.45, -0.28, 0.0], [0.45, -0.28, 0.0]])
LIMITS = leg_limits(FROG, np.radians([20.0, 20.0]).tolist(), np.radians([40.0, 50.0]).tolist())


def worst_use(path: MotionPath) -> list[float]:
    """Largest share of each kind of limit, by dense samples."""
    t = np.linspace(0.0, path.duration, 20001)
    bounds = (LIMITS.velocity, LIMITS.acceleration, LIMITS.jerk)
    return [
        float((np.abs(path.evaluate(t, k)[:, 6:]) / bound).max())
        for k, bound in enumerate(bounds, start=1)
    ]


def test_moves_and_swings_use_their_tightest_limit_and_break_none() -> None:
    ahead = BodyPose(np.array([0.08, 0.0, 0.70]), np.array([0.0, 0.05, 0.0]))
    move = body_move(FROG, STANDING, ahead, FEET, LIMITS)
    swing = open_ground_swing(FROG, STANDING, FEET, "RF", FEET[3] + [0.2, 0.0, 0.0], 0.08, LIMITS)
    assert move is not None
    for path in (move, swing):
        use = worst_use(path)
        assert max(use) <= 1.0 + 1e-9
        assert max(use) > 0.9
        ends = path.evaluate([0.0, path.duration], 1), path.evaluate([0.0, path.duration], 2)
        assert np.abs(ends[0]).max() < 1e-9
        assert np.abs(ends[1]).max() < 1e-8


def test_a_body_that_stays_makes_no_move() -> None:
    assert body_move(FROG, STANDING, STANDING, FEET, LIMITS) is None


def spline_path() -> MotionPath:
    angles = np.array([[0.4, -0.9], [0.3, -1.1], [0.1, -1.2], [-0.1, -1.1], [-0.1, -0.9]])
    columns = list(FROG.leg_columns["RF"])
    bounds = JointLimits(LIMITS.velocity[columns], LIMITS.acceleration[columns],
                         LIMITS.jerk[columns])  # fmt: skip
    spline = solve_spline(build_spline_problem(angles, bounds))
    return spline_swing(FROG, STANDING, FEET, "RF", spline, LIMITS)


def test_changed_ends_have_no_jump_of_acceleration() -> None:
    """The clamped spline starts with an acceleration, the changed one with none."""
    hard = spline_path()
    soft = without_end_accelerations(hard, LIMITS)
    assert np.abs(hard.evaluate([0.0], 2)).max() > 0.01
    assert np.abs(soft.evaluate([0.0, soft.duration], 2)).max() < 1e-9
    assert soft.jumps(2).max() < 1e-9
    assert max(worst_use(soft)) <= 1.0 + 1e-9
    assert hard.duration < soft.duration < 1.5 * hard.duration
    ends = [path.evaluate([0.0, path.duration]) for path in (hard, soft)]
    assert ends[1] == pytest.approx(ends[0], abs=1e-12)


def test_joined_pieces_follow_one_another() -> None:
    one, two = spline_path(), open_ground_swing(
        FROG, STANDING, FEET, "LH", FEET[1] + [0.1, 0.0, 0.0], 0.05, LIMITS
    )  # fmt: skip
    both = joined([one, two])
    assert both.duration == pytest.approx(one.duration + two.duration)
    assert both.evaluate([one.duration + 1.0]) == pytest.approx(two.evaluate([1.0]), abs=1e-9)


def test_every_joint_keeps_its_own_acceleration_limit_with_forces() -> None:
    """The hip of frog1 may accelerate half as fast as its knee; its limit was the knee's once."""
    robot = load_robot("frog1")
    plan = planner.plan_stride(robot, rectangular_obstacle(0.03, 0.03), approach=0, leave=0)
    assert isinstance(plan.settings, StrideSettings)
    own = plan.settings.joint_accelerations(robot)
    assert own.min() < 0.6 * own.max()
    times = np.linspace(0.0, plan.duration, 20_001)
    share = np.abs(plan.path.evaluate(times, 2))[:, 6:].max(axis=0) / own
    assert 0.8 < share.max() <= 1.0
    certificate = verify(plan, collisions=False)
    assert certificate["joint accelerations"].status == "ok"
    # A planted fault: hips that may accelerate less than they do.
    slower = tuple(0.5 * a if i == 0 else a for i, a in enumerate(plan.settings.accelerations))
    weak = replace(plan, settings=replace(plan.settings, accelerations=slower))
    found = verify(weak, collisions=False)["joint accelerations"]
    assert found.status == "violated" and "HFE" in found.where
