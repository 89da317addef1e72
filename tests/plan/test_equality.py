"""Plans and what belongs to them are equal where they say the same."""

from __future__ import annotations

import pickle
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import gaitopt
from gaitopt import Plan
from gaitopt.conventions import same_values


@pytest.fixture(scope="module")
def plan() -> Plan:
    robot = gaitopt.load_robot("wang2020")
    return gaitopt.plan_crawl(robot, gaitopt.s_columns(3, columns=2), timing="velocity")


def test_two_loads_of_one_file_are_equal(plan: Plan, tmp_path: Path) -> None:
    plan.save(tmp_path / "plan.npz")
    one, other = (gaitopt.load_plan(tmp_path / "plan.npz") for _ in range(2))
    assert one == other == plan and hash(one) == hash(other) == hash(plan)
    assert one.phases == other.phases and one.path == other.path
    assert one.robot.legs["LF"] == other.robot.legs["LF"]
    assert one.sample(0.1) == other.sample(0.1) and one.state(0.3) == other.state(0.3)
    assert pickle.loads(pickle.dumps(one)) == one


def test_one_number_makes_plans_unequal(plan: Plan) -> None:
    coefficients = plan.path.coefficients.copy()
    coefficients[-1, 0, 0] = np.nextafter(coefficients[-1, 0, 0], np.inf)
    moved = replace(plan, path=replace(plan.path, coefficients=coefficients))
    assert moved != plan and moved.path != plan.path and moved.phases == plan.phases
    later = replace(plan.phases[1], step=plan.phases[1].step + 1)
    assert later != plan.phases[1] and plan.phases[0] != plan.phases[1]
    assert plan.slowed(2.0) != plan and plan != "plan"


def test_the_time_that_planning_took_is_no_part_of_a_plan(plan: Plan) -> None:
    one, other = (gaitopt.plan_route(plan.robot, plan.footholds, timing="velocity")
                  for _ in range(2))  # fmt: skip
    assert one.record.solver_seconds != other.record.solver_seconds  # type: ignore[attr-defined]
    assert one == other


@pytest.mark.parametrize(
    ("one", "other", "same"),
    [
        (np.nan, np.nan, True),
        (np.array([1.0, np.nan]), np.array([1.0, np.nan]), True),
        (np.array([1.0]), np.array([1.0, 1.0]), False),
        (np.array([True]), np.array([True]), True),
        ({"a": np.zeros(2)}, {"a": np.zeros(2)}, True),
        ({"a": 1}, {"b": 1}, False),
        ((1, np.ones(2)), (1, np.ones(2)), True),
        ((1, 2), (1, 2, 3), False),
        (1, 1.0, False),
        (None, None, True),
    ],
)
def test_values_are_the_same_number_by_number(one: object, other: object, same: bool) -> None:
    assert same_values(one, other) is same
