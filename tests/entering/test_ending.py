"""Plans that end in a given state."""

from __future__ import annotations

import numpy as np
import pytest
from continuing import assert_certified

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
