"""Walks over an obstacle that begin where the robot is."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from gaitopt import (
    LEGS,
    InputError,
    State,
    StrideSettings,
    load_plan,
    load_robot,
    plan_crawl,
    plan_stride,
    s_columns,
    verify,
)
from gaitopt.conventions import FloatArray
from gaitopt.errors import InfeasibleStateError
from gaitopt.plan.record import StrideRecord
from gaitopt.planners.over_obstacle.approach import Stand, way_to
from gaitopt.planners.over_obstacle.layout import square_stances
from gaitopt.robots.quadruped import Quadruped
from gaitopt.robots.rotations import rpy_to_matrix
from gaitopt.terrain.obstacles import Obstacle, rectangular_obstacle


@pytest.fixture(scope="module")
def board() -> Obstacle:
    return rectangular_obstacle(0.03, 0.03, yaw=0.3)


def feet_at(robot: Quadruped, obstacle: Obstacle, x: float, y: float, yaw: float) -> FloatArray:
    """Square feet in the obstacle's frame, in the world."""
    return np.asarray(obstacle.to_world(square_stances(robot, np.array([x, y, yaw]))))


def test_a_robot_that_stands_turned_and_away_walks_there(
    wang: Quadruped, board: Obstacle, tmp_path: Path
) -> None:
    feet = feet_at(wang, board, -0.9, 0.1, -0.4)
    state = State.standing(wang, feet, heading=0.3 - 0.4)
    plan = plan_stride(wang, board, start=state, leave=0)
    assert np.allclose([plan.footholds[leg][0] for leg in LEGS], feet, atol=1e-9)
    assert np.allclose(plan.state(0.0).q, state.q, atol=1e-9)
    certificate = verify(plan)
    assert certificate.outcome == "certified", str(certificate)
    plan.save(tmp_path / "stride.npz")
    again = load_plan(tmp_path / "stride.npz")
    assert np.array_equal(again.path.coefficients, plan.path.coefficients)
    assert again.entry == plan.entry
    assert again.settings == plan.settings
    # All feet end behind the obstacle.
    ends = board.to_local(np.array([plan.footholds[leg][-1] for leg in LEGS]))
    assert (ends[:, 0] > board.extent[1]).all()
    assert isinstance(plan.record, StrideRecord)
    assert plan.record.clearance >= plan.settings.obstacle_clearance


def test_a_robot_that_walks_goes_on_over_an_obstacle(wang: Quadruped) -> None:
    walk = plan_crawl(wang, s_columns(0, columns=2))
    time = 0.4 * walk.duration
    state = walk.state(time)
    assert state.support != LEGS
    ground = float(walk.footholds["LF"][0, 2]) - wang.foot_radius
    ahead = (float(state.columns[0]) + 0.75, float(state.columns[1]), ground)
    plan = plan_stride(wang, rectangular_obstacle(0.02, 0.02, position=ahead), start=state, leave=0)
    begin = plan.state(0.0)
    assert np.allclose(begin.q, state.q, atol=1e-9)
    assert np.allclose(begin.v, state.v, atol=1e-6)
    assert begin.support == state.support
    assert verify(plan, collisions=False).ok


def test_stances_turn_and_become_square(wang: Quadruped, board: Obstacle) -> None:
    """No step is longer than allowed, and one stance fewer would not do."""
    rng = np.random.default_rng(0)
    feet = feet_at(wang, board, -1.1, 0.2, 1.2)
    feet[:, :2] += rng.uniform(-0.03, 0.03, (4, 2))
    way = way_to(wang, board, Stand(feet, 1.5), -0.3, 0.15)
    steps = np.linalg.norm(np.diff(way.feet, axis=0)[..., :2], axis=-1)
    assert steps.max() <= 0.15 * (1.0 + 1e-9)
    assert steps.max() * way.cycles / (way.cycles - 1) > 0.15 * 0.95
    assert np.allclose(way.feet[0], feet)
    assert np.allclose(way.feet[-1], feet_at(wang, board, -0.3, 0.0, 0.0), atol=1e-12)
    # Where they stand already nothing is added.
    assert way_to(wang, board, Stand(way.feet[-1], 0.3), -0.3, 0.15).cycles == 0


@pytest.mark.parametrize(("along", "up", "words"), [
    (0.0, 0.0, "beyond the front of the obstacle; walk back first"),
    (-0.9, 0.02, "20.0 mm above the level ground"),
])  # fmt: skip
def test_feet_beyond_the_obstacle_or_off_its_ground(
    wang: Quadruped, board: Obstacle, along: float, up: float, words: str
) -> None:
    feet = feet_at(wang, board, along, 0.0, 0.0)
    feet[:, 2] += up
    with pytest.raises(InfeasibleStateError, match=words) as caught:
        plan_stride(wang, board, start=State.standing(wang, feet, heading=0.3))
    assert caught.value.limit.startswith("contact ")


def test_feet_too_near_to_the_obstacle(wang: Quadruped, board: Obstacle) -> None:
    front = -0.015 - wang.foot_radius - 0.004
    feet = feet_at(wang, board, front - wang.stance_size[0] / 2.0, 0.0, 0.0)
    with pytest.raises(InfeasibleStateError, match=r"F_FOOT.* within 0\.004 m") as caught:
        plan_stride(wang, board, start=State.standing(wang, feet, heading=0.3))
    assert caught.value.limit == "clearance"
    assert caught.value.value == pytest.approx(0.004, abs=1e-4)


def test_a_stride_by_velocities_refuses_a_start(wang: Quadruped, board: Obstacle) -> None:
    state = State.standing(wang, feet_at(wang, board, -0.9, 0.0, 0.0), heading=0.3)
    with pytest.raises(InputError, match="timed by contact forces"):
        plan_stride(wang, board, start=state, timing="velocity")
    with pytest.raises(InputError, match="start"):
        plan_stride(wang, board, start=3)  # type: ignore[arg-type]


def test_rotated_square_stances(wang: Quadruped) -> None:
    here = square_stances(wang, np.zeros(3))
    turned = square_stances(wang, np.array([0.2, -0.1, 0.7]))
    expected = here @ rpy_to_matrix([0.0, 0.0, 0.7]).T + [0.2, -0.1, 0.0]
    assert np.allclose(turned, expected, atol=1e-12)


@pytest.mark.slow
def test_a_stride_from_a_foot_in_the_air_takes_the_accelerations_that_it_needs() -> None:
    """At this instant a hind foot of go2 comes down: its joints need six times the usual ones."""
    robot = load_robot("go2")
    crawl = plan_crawl(robot, s_columns(0, columns=3, robot=robot))
    state = crawl.state(0.37 * crawl.duration)
    q = np.array(state.q)
    q[2] -= crawl.at([0.0]).feet[0, :, 2].mean() - robot.foot_radius
    q[0] = -0.8
    there = State(q, state.v, state.support, state.joint_names)
    board = rectangular_obstacle(0.03, 0.03)
    plan = plan_stride(robot, board, start=there)
    assert verify(plan).outcome == "certified"
    assert isinstance(plan.settings, StrideSettings)
    usual = StrideSettings.for_robot(robot).acceleration_limit
    assert plan.settings.acceleration_limit == pytest.approx(10.0 * usual)
    with pytest.raises(InfeasibleStateError, match="joint acceleration"):
        plan_stride(robot, board, start=there, acceleration_limit=usual)
