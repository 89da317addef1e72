"""Feet whose balls roll nearly as far as their columns are wide are told when a walk is planned."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from robot_loading import quiet

import gaitopt
from gaitopt import FootholdsWarning, Plan, Quadruped
from gaitopt.plan.rolled_feet import TOLD, first_rolling_step, foot_rolling_off


def walk(robot: Quadruped, step: float, radius: float | None = None) -> Plan:
    """A walk of two steps a leg over columns, with steps of a share of the standing height."""
    way = 2.0 * step * robot.standing_height
    columns = gaitopt.s_columns(0, columns=3, robot=robot, forward=way)
    columns = columns if radius is None else columns.with_(radius=radius)
    return gaitopt.plan_crawl(robot, columns, timing="velocity")


def test_long_steps_are_told_with_step_leg_and_way_out(a1_walk: Plan) -> None:
    robot = a1_walk.robot
    with pytest.warns(FootholdsWarning, match=r"step \d+ \(..\): the ball .* rolls by") as told:
        plan = walk(robot, 1.0, radius=0.01)
    assert any("shorter steps, or wider columns" in str(each.message) for each in told)
    found = foot_rolling_off(plan)
    assert found is not None
    assert TOLD * found.radius < found.way < robot.foot_radius
    assert found.radius == plan.footholds.landing_radius


def test_usual_steps_and_wide_columns_are_not_told(a1_walk: Plan) -> None:
    assert foot_rolling_off(a1_walk) is None
    with warnings.catch_warnings():
        warnings.simplefilter("error", FootholdsWarning)
        assert foot_rolling_off(walk(a1_walk.robot, 1.0, radius=0.04)) is None


@pytest.mark.filterwarnings("ignore:.*the ball of the foot rolls")
def test_half_of_the_way_is_the_radius_times_half_of_the_turn_of_the_leg(a1_walk: Plan) -> None:
    """Hip and knee turn the lower leg about one axis while the body stays level, and the roll joint
    about another one."""
    plan, ways = walk(a1_walk.robot, 1.0), []
    robot = plan.robot
    for swing in plan.swings:
        later = (s.start for s in plan.swings if s.leg == swing.leg and s.start > swing.end)
        times = np.linspace(swing.end, next(later, plan.duration), 200)
        joints = plan.at(times).q[:, 7:][:, list(robot.leg_columns[swing.leg])]
        turns = np.ptp(joints[:, 0]), np.ptp(joints[:, 1] + joints[:, 2])
        ways.append(0.5 * robot.foot_radius * float(np.hypot(*turns)))
    assert max(ways) > 5e-3
    assert first_rolling_step(plan, 1.05 * max(ways)) is None
    assert first_rolling_step(plan, 0.9 * max(ways)) is not None


def test_feet_that_stand_for_long_are_not_told_because_their_joints_go_to_and_fro(
    wang: Quadruped, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The walk of the largest margin moves the body far in each stance, and back again; so the
    ranges of its joints show that no foot rolls far, without a look at thousands of samples."""
    plan = gaitopt.plan_crawl(wang, gaitopt.s_columns(0, columns=3), objective="margin",
                              timing="velocity")  # fmt: skip
    assert first_rolling_step(plan, TOLD * plan.footholds.landing_radius) is None
    monkeypatch.delattr("gaitopt.plan.rolled_feet.first_rolling_step")
    assert foot_rolling_off(plan) is None


def test_a_robot_that_takes_no_step_rolls_nowhere(wang: Quadruped) -> None:
    stand = gaitopt.s_columns(0, columns=1)
    assert foot_rolling_off(gaitopt.plan_crawl(wang, stand, timing="velocity")) is None


def test_feet_that_are_points_do_not_roll() -> None:
    points = quiet("a1", foot_radius=0.0)
    assert points.foot_radius == 0.0
    assert foot_rolling_off(walk(points, 0.2)) is None
