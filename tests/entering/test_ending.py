"""Plans that end in a given state."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np
import pytest
from continuing import assert_certified

import gaitopt
from gaitopt import LEGS, InputError, Plan, State, plan_crawl, plan_route
from gaitopt.errors import InfeasibleStateError


def last_feet(plan: Plan) -> np.ndarray:
    return np.array([plan.footholds[leg][-1] for leg in LEGS])


@pytest.mark.parametrize("planner", [plan_crawl, plan_route])
def test_the_body_ends_as_high_and_turned_as_asked(a1_walk: Plan, planner: type) -> None:
    robot = a1_walk.robot
    end = State.standing(
        robot, last_feet(a1_walk), height=0.85 * robot.standing_height, heading=0.1
    )
    plan = planner(robot, a1_walk.footholds, end=end)
    reached = plan.state(plan.duration)
    assert np.abs(reached.columns - end.columns).max() < 1e-6
    assert np.abs(reached.v).max() < 1e-6
    assert plan.path.jumps(1).max() < 1e-5
    assert_certified(plan)
    assert plan.phases[-1].kind == "stance" and plan.phases[-1].margin > 0.0


def gait_of(robot: gaitopt.Quadruped, **asked: object) -> Plan:
    return gaitopt.plan_gait(robot, gaitopt.trot(0.5), velocity=0.3, duration=0.1, **asked)


def stride_of(robot: gaitopt.Quadruped, **asked: object) -> Plan:
    obstacle = gaitopt.rectangular_obstacle(0.02, 0.02)
    return gaitopt.plan_stride(robot, obstacle, approach=0, leave=0, **asked)


@cache
def ground_and_way(name: str) -> tuple[gaitopt.HeightMap, gaitopt.TerrainSearch]:
    robot = gaitopt.load_robot(name)
    ground = gaitopt.make_ground("rubble", robot=robot, difficulty=0.2, length=1.0)
    return ground, gaitopt.search_terrain(robot, ground, (0.1, 0.0))


def terrain_of(robot: gaitopt.Quadruped, **asked: object) -> Plan:
    ground, way = ground_and_way(robot.name)
    return gaitopt.plan_terrain(robot, ground, (0.1, 0.0), search=way, **asked)


@pytest.mark.parametrize(
    "planned", [gait_of, stride_of, pytest.param(terrain_of, marks=pytest.mark.slow)]
)
def test_planners_that_choose_footholds_end_as_asked_on_them(
    a1_walk: Plan, planned: Callable[..., Plan]
) -> None:
    a1 = a1_walk.robot
    plan = planned(a1)
    stops = plan.state(plan.duration)
    place, turn = stops.columns[:3] - np.array([0.0, 0.0, 0.02]), stops.columns[3:6]
    end = State.of(a1, place, turn, gaitopt.joints_from_feet(a1, place, turn, last_feet(plan)))
    plan = planned(a1, end=end)
    reached = plan.state(plan.duration)
    assert np.abs(reached.columns - end.columns).max() < 1e-9
    assert np.abs(reached.v).max() < 1e-6 and plan.path.jumps(1).max() < 1e-5
    assert_certified(plan)


def test_a_gait_does_not_end_on_other_footholds(a1_walk: Plan) -> None:
    a1 = a1_walk.robot
    elsewhere = State.standing(a1, last_feet(gait_of(a1)) + np.array([0.1, 0.0, 0.0]))
    with pytest.raises(InfeasibleStateError, match="those of the plan without end"):
        gait_of(a1, end=elsewhere)


def test_a_stride_does_not_end_on_its_obstacle(a1_walk: Plan) -> None:
    a1 = a1_walk.robot
    low = State.standing(a1, last_feet(stride_of(a1)), height=0.4 * a1.standing_height)
    with pytest.raises(InfeasibleStateError, match=r"end: .* is within .* m of the obstacle"):
        stride_of(a1, end=low)
    with pytest.raises(InputError, match=r"a plan to a state .* leave out end"):
        stride_of(a1, end=low, timing="velocity")


def test_an_end_elsewhere_is_refused(a1_walk: Plan) -> None:
    robot, feet = a1_walk.robot, last_feet(a1_walk)
    ahead = feet + np.array([0.05, 0.0, 0.0])
    for end, words in (
        (
            State.standing(robot, ahead),
            r"foot LF is 50\.0 mm from its last",
        ),
        (a1_walk.state(0.4 * a1_walk.duration), "the robot has to rest on four feet"),
    ):
        with pytest.raises(InfeasibleStateError, match=words):
            plan_crawl(robot, a1_walk.footholds, end=end)
    standing = State.standing(robot, feet)
    place = standing.q[:3] + np.array([0.0, 0.14, -0.04])
    aside = State.of(
        robot, place, standing.columns[3:6], _joints(a1_walk, place, standing.columns[3:6])
    )
    with pytest.raises(InfeasibleStateError, match=r"margin falls to|no contact forces hold"):
        plan_crawl(robot, a1_walk.footholds, end=aside)
    with pytest.raises(InputError, match="end must be a State"):
        plan_crawl(robot, a1_walk.footholds, end=0.3)  # type: ignore[arg-type]


def _joints(plan: Plan, place: np.ndarray, rpy: np.ndarray) -> np.ndarray:
    from gaitopt import joints_from_feet

    return joints_from_feet(plan.robot, place, rpy, last_feet(plan))


def test_a_plan_that_is_timed_anew_keeps_gentle_moves_before_and_after_its_walk(
    a1_walk: Plan,
) -> None:
    """Feet carry 75 to 125 % of the weight while the body moves on four feet to and from a walk."""
    robot = a1_walk.robot
    columns = gaitopt.s_columns(columns=2, robot=robot, height_jitter=0.02)
    low = 0.8 * robot.standing_height
    begin, end = (
        State.standing(robot, np.array([columns[leg][k] for leg in LEGS]), height=low)
        for k in (0, -1)
    )
    plan = plan_crawl(robot, columns, start=begin, end=end)
    again = gaitopt.retimed(plan)
    for each in (plan, again):
        times = np.linspace(0.0, each.duration, 3001)
        lift = np.abs(each.path.evaluate(times, 2)[:, 2]) / 9.81
        entry, last = each.phases[each.entry - 1].end, each.phases[-1].start
        assert 0.2 < lift[times <= entry].max() < 0.28
        assert 0.2 < lift[times >= last].max() < 0.28
    assert gaitopt.verify(again, collisions=False).outcome != "violated"
