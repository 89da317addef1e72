"""Sliders that plan again."""

from __future__ import annotations

import sys
from typing import Any

import numpy as np
import pytest

import gaitopt
from gaitopt import (
    HeightMap,
    InfeasibleStepError,
    InputError,
    MissingPackageError,
    Plan,
    Quadruped,
)
from gaitopt.planners.over_terrain.planned_forces import FRICTION_SHARE
from gaitopt.planners.over_terrain.setup import far_side
from gaitopt.studies.explore import ROWS


def test_sliders_plan_again_and_say_what_came_of_it(wang: Quadruped) -> None:
    columns = gaitopt.s_columns(0, columns=2)
    box = gaitopt.explore(wang, columns)
    margin, height, swing, friction, row, speed, told, shown = box.children
    assert isinstance(box.plan, Plan) and "all checks hold" in shown.value
    first = box.plan
    assert margin.value == first.settings.stability_margin
    height.value = 0.36
    assert box.plan.settings.body_height == pytest.approx(0.36)
    assert swing.value == pytest.approx(first.settings.swing_height)
    friction.value = 0.4
    forces = box.plan.settings.promised_forces
    assert forces is not None and forces.friction == pytest.approx(0.4)
    row.value = "time-optimal: swing"
    assert box.plan.settings.planner == "route" or box.plan.duration < first.duration
    speed.value = "0.05 m/s"
    assert box.plan is None and "as fast as possible" in shown.value
    row.value = next(iter(ROWS))
    assert box.plan.settings.speed == 0.05
    margin.max = margin.value = 0.3
    assert box.plan is None and "no walk:" in shown.value and not told.value


def test_what_is_wrong_at_the_start_is_an_error(
    wang: Quadruped, monkeypatch: pytest.MonkeyPatch
) -> None:
    columns = gaitopt.s_columns(0, columns=2)
    with pytest.raises(InfeasibleStepError):
        gaitopt.explore(wang, columns, stability_margin=0.2)
    monkeypatch.setitem(sys.modules, "ipywidgets", None)
    with pytest.raises(MissingPackageError, match="gaitopt\\[notebook\\]"):
        gaitopt.explore(wang, columns)


@pytest.fixture(scope="module")
def ground() -> HeightMap:
    """Level ground with a step of 3 cm across the way."""
    z = np.zeros((70, 50))
    z[30:] = 0.03
    return HeightMap(z, 0.02, (-0.5, -0.5))


def test_over_ground_the_goal_can_be_moved_and_what_is_in_the_way_is_told(
    ground: HeightMap,
) -> None:
    robot = gaitopt.load_robot("go2")
    box = gaitopt.explore(robot, ground, (0.3, 0.0), start=(0.0, 0.0, 0.0), width=1, width_limit=1)
    sliders = {child.description: child for child in box.children[:-2]}
    shown = box.children[-1]
    first = box.plan
    assert isinstance(first, Plan) and first.footholds.ground is ground
    assert first.distance == pytest.approx(0.3, abs=0.05) and "all checks hold" in shown.value
    sliders["goal x [m]"].value = 0.2
    assert box.plan.distance == pytest.approx(0.2, abs=0.05)
    sliders["friction"].value = 0.5
    forces = box.plan.settings.promised_forces
    assert forces is not None and forces.friction == pytest.approx(0.5 * FRICTION_SHARE)
    sliders["goal x [m]"].value = 0.85  # beyond it the map ends, and with it the footholds
    assert box.plan is None and "no walk:" in shown.value and "<svg" in shown.value


def test_over_ground_one_can_begin_where_there_is_no_way_and_look_for_one(
    ground: HeightMap,
) -> None:
    robot = gaitopt.load_robot("go2")
    box = gaitopt.explore(robot, ground, (0.3, 0.0), start=(0.0, 0.0, 0.0), width=1, width_limit=1,
                          body_height=0.1)  # fmt: skip
    assert box.plan is None and "no walk:" in box.children[-1].value
    next(s for s in box.children if s.description == "body height [m]").value = 0.3
    assert isinstance(box.plan, Plan)


def test_the_goal_of_a_map_is_on_its_far_side_if_none_is_given(ground: HeightMap) -> None:
    x, y = far_side(gaitopt.load_robot("go2"), ground)
    assert 0.3 < x < ground.extent[0][1] - 0.3 and y == pytest.approx(0.0, abs=0.02)


@pytest.mark.parametrize(("terrain", "goal", "words"), [
    ("map.png", None, "terrain must be a Footholds"),
    (gaitopt.s_columns(0, columns=2), (1.0, 0.0), "ends at the last ones"),
    (HeightMap(np.zeros((9, 9)), 0.1), "there", r"goal must be two finite numbers"),
    (HeightMap(np.zeros((9, 9)), 0.1), (1.0, 2.0, 3.0), r"goal must be two finite numbers"),
])  # fmt: skip
def test_what_is_no_terrain_or_no_goal_is_refused(
    wang: Quadruped, terrain: Any, goal: Any, words: str
) -> None:
    with pytest.raises(InputError, match=words):
        gaitopt.explore(wang, terrain, goal)
