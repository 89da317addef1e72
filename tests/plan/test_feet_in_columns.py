"""Feet in columns beside their own, found when the walk is planned."""

from __future__ import annotations

import warnings
from dataclasses import replace

import pytest
from robot_loading import quiet

import gaitopt
from gaitopt import Footholds, FootholdsWarning
from gaitopt.plan.feet_in_columns import foot_in_column

STANDING, FLYING = "feet on the ground", "flying feet clear of the ground"


def over(footholds: Footholds) -> gaitopt.Plan:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FootholdsWarning)
        return gaitopt.plan_crawl(quiet("wang2020"), footholds, timing="velocity")


def test_level_columns_hold_no_feet_but_their_own() -> None:
    assert foot_in_column(over(gaitopt.s_columns(columns=3))) is None


def test_a_foot_beside_a_higher_column_is_told_with_its_depth() -> None:
    """The ball of the foot reaches 2 mm into the side of a column that is 20 mm higher."""
    columns = gaitopt.s_columns(columns=3)
    told = foot_in_column(_on(over(columns), _crowded(columns)))
    assert told is not None and (told.leg, told.number, told.column) == ("RF", 1, "RF")
    assert told.step == -1 and told.depth == pytest.approx(0.002)


def test_a_foot_that_flies_through_a_column_is_told_and_found_by_the_certificate() -> None:
    columns = gaitopt.s_columns(columns=3)
    plan = over(columns)
    swing = plan.swings[0]
    points = {leg: places.copy() for leg, places in columns.points.items()}
    middle = (swing.foot_start + swing.foot_end) / 2.0
    halfway = plan.at([(swing.start + swing.end) / 2.0])
    high = float(halfway.feet[0, gaitopt.LEGS.index(swing.leg), 2])
    other = "LH" if swing.leg != "LH" else "RF"
    # A column in the way, whose top is 5 mm higher than the foot's lowest point above it.
    points[other][2] = [*middle[:2], high + 0.005]
    told = foot_in_column(_on(plan, columns.with_(points=points)))
    assert told is not None and told.step == 0 and told.leg == swing.leg
    assert told.depth == pytest.approx(0.005, abs=2e-3)
    found = gaitopt.verify(_on(plan, columns.with_(points=points)), collisions=False)[FLYING]
    assert found.worst == pytest.approx(-told.depth, abs=2e-3)


def test_a_walk_over_crowded_columns_is_warned_of() -> None:
    columns = _crowded(gaitopt.s_columns(columns=3))
    robot = quiet("wang2020")
    with pytest.warns(
        FootholdsWarning, match=r"foothold 1 of RF: the foot stands 2\.0 mm within a"
    ):
        plan = gaitopt.plan_crawl(robot, columns, timing="velocity")
    found = gaitopt.verify(plan, collisions=False)
    assert found[STANDING].worst == pytest.approx(0.002, abs=1e-4)


def _crowded(columns: Footholds) -> Footholds:
    """With the third column of RF beside its second one, 20 mm higher: 2 mm in the foot there."""
    points = {leg: places.copy() for leg, places in columns.points.items()}
    aside = columns.landing_radius + quiet("wang2020").foot_radius - 0.002
    points["RF"][2] = points["RF"][1] + [aside, 0.0, 0.02]
    return columns.with_(points=points)


def _on(plan: gaitopt.Plan, footholds: Footholds) -> gaitopt.Plan:
    """The plan over other columns."""
    return replace(plan, footholds=footholds)
