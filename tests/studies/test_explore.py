"""Sliders that plan again."""

from __future__ import annotations

import sys

import pytest

import gaitopt
from gaitopt import InfeasibleStepError, MissingPackageError, Plan, Quadruped
from gaitopt.studies.explore import ROWS


def test_sliders_plan_again_and_say_what_came_of_it(wang: Quadruped) -> None:
    columns = gaitopt.s_columns(0, columns=2)
    box = gaitopt.explore(wang, columns)
    margin, height, swing, friction, row, speed, shown = box.children
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
    assert box.plan is None and "no walk:" in shown.value


def test_what_is_wrong_at_the_start_is_an_error(
    wang: Quadruped, monkeypatch: pytest.MonkeyPatch
) -> None:
    columns = gaitopt.s_columns(0, columns=2)
    with pytest.raises(InfeasibleStepError):
        gaitopt.explore(wang, columns, stability_margin=0.2)
    monkeypatch.setitem(sys.modules, "ipywidgets", None)
    with pytest.raises(MissingPackageError, match="gaitopt\\[notebook\\]"):
        gaitopt.explore(wang, columns)
