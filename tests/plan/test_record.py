"""What planners tell of their work: typed, and stored without loss."""

from __future__ import annotations

import pytest

import gaitopt
from gaitopt import CrawlRecord, GaitRecord, InputError, Plan, RouteRecord
from gaitopt.plan.record import RECORDS, record_from_dict


def test_every_planner_has_a_record_of_its_own(plan: Plan) -> None:
    assert set(RECORDS) == {"crawl", "route", "gait", "stride"}
    assert isinstance(plan.record, CrawlRecord) and plan.record.cog_error_bound is not None
    assert plan.record.cog_error_bound < 1e-6


def test_a_record_survives_being_stored() -> None:
    record = RouteRecord(stability="ZMP", zmp_margin=0.02, solver_iterations=40, violation=0.0)
    assert record_from_dict("route", record.to_dict()) == record
    assert "windows" not in record.to_dict()


def test_what_a_later_version_may_tell_is_left_out() -> None:
    assert record_from_dict("gait", {"flight": 0.1, "mood": "good"}) == GaitRecord(flight=0.1)


@pytest.mark.parametrize("value", [float("nan"), True, [1.0]])
def test_what_says_nothing_is_refused(value: object) -> None:
    with pytest.raises(InputError, match=r"flight is .* says nothing"):
        GaitRecord(flight=value)  # type: ignore[arg-type]


def test_a_planned_walk_tells_its_residuals() -> None:
    robot = gaitopt.load_robot("wang2020")
    plan = gaitopt.plan_route(
        robot, gaitopt.s_columns(0, columns=2), free="overlap", timing="velocity"
    )
    record = plan.record
    assert isinstance(record, RouteRecord) and record.solver_iterations is not None
    assert record.violation is not None and record.violation <= 1e-6
    assert record.stationarity is not None and record.stationarity <= 1e-3
