"""Settings: one object a planner, whose fields are its keyword arguments, and that fit a robot."""

from __future__ import annotations

import dataclasses
import inspect
from typing import Any

import pytest

import gaitopt
from gaitopt import (
    CrawlSettings,
    Freedoms,
    GaitSettings,
    InputError,
    Quadruped,
    RouteSettings,
    StrideSettings,
    plan_crawl,
    plan_gait,
    plan_route,
    plan_stride,
)
from gaitopt.plan.settings.by_name import SETTINGS, settings_from_dict

KINDS = [CrawlSettings, GaitSettings, RouteSettings, StrideSettings]
PLANNERS = [(plan_crawl, CrawlSettings), (plan_gait, GaitSettings), (plan_route, RouteSettings),
            (plan_stride, StrideSettings)]  # fmt: skip


def test_on_the_papers_robot_defaults_are_the_papers_numbers(wang: Quadruped) -> None:
    assert CrawlSettings.for_robot(wang, timing="velocity") == CrawlSettings(timing="velocity")
    assert RouteSettings.for_robot(wang, timing="velocity") == RouteSettings(timing="velocity")
    settings = CrawlSettings(timing="velocity")
    assert (settings.body_height, settings.swing_height, settings.stability_margin) == (
        0.40, 0.07, 0.02,
    )  # fmt: skip


@pytest.mark.parametrize("name", ["a1", "anymal_c", "hyq", "solo12"])
def test_lengths_grow_with_the_robot(name: str, wang: Quadruped) -> None:
    """All lengths are the same shares of the standing height as on wang2020, to 0.1 mm."""
    robot = gaitopt.load_robot(name)
    scale = robot.standing_height / wang.standing_height
    mine, papers = (
        RouteSettings.for_robot(robot, timing="velocity"),
        RouteSettings(timing="velocity"),
    )
    for field in ("body_height", "swing_height", "stability_margin", "clearance"):
        assert getattr(mine, field) == pytest.approx(scale * getattr(papers, field), abs=1e-4)


@pytest.mark.parametrize("kind", KINDS)
def test_what_is_given_is_kept_and_the_rest_fits(kind: Any, wang: Quadruped) -> None:
    more = {"duration": 1.0} if kind is GaitSettings else {}
    settings = kind.for_robot(wang, body_height=0.37, swing_height=None, **more)
    assert settings.body_height == 0.37 and settings.swing_height > 0.0


@pytest.mark.parametrize("kind", KINDS)
def test_settings_survive_being_stored(kind: Any, wang: Quadruped) -> None:
    more = {"duration": 1.0, "velocity": 0.1} if kind is GaitSettings else {"reach_fraction": 0.9}
    settings = kind.for_robot(wang, **more)
    assert settings_from_dict(kind.planner, settings.to_dict()) == settings


def test_every_planner_s_settings_are_known_by_name() -> None:
    assert dict(SETTINGS) == {"crawl": CrawlSettings, "gait": GaitSettings, "route": RouteSettings,
                              "stride": StrideSettings}  # fmt: skip
    with pytest.raises(InputError, match="planner 'moonwalk' is unknown"):
        settings_from_dict("moonwalk", {})


@pytest.mark.parametrize(("planner", "kind"), PLANNERS)
def test_planners_read_alike_and_show_their_settings(planner: Any, kind: Any) -> None:
    parameters = list(inspect.signature(planner).parameters.values())
    assert [p.name for p in parameters[:4:3]] == ["robot", "progress"]
    assert parameters[2].name == "settings" and parameters[2].default is None
    assert all(p.kind is p.KEYWORD_ONLY for p in parameters[3:])
    fields = {f.name for f in dataclasses.fields(kind)} - {"schedule"}
    assert fields <= {p.name for p in parameters}


@pytest.mark.parametrize(("planner", "kind"), PLANNERS)
def test_a_misspelt_setting_is_told_with_the_one_that_was_meant(
    planner: Any, kind: Any, wang: Quadruped
) -> None:
    what: Any = {
        plan_gait: gaitopt.trot(0.5), plan_stride: gaitopt.rectangular_obstacle(0.06, 0.03),
    }.get(planner, gaitopt.s_columns(0, columns=2))  # fmt: skip
    with pytest.raises(InputError, match="no setting 'body_hight'; did you mean body_height"):
        planner(wang, what, body_hight=0.4)


def test_settings_as_one_object_are_taken_as_they_are(wang: Quadruped) -> None:
    footholds = gaitopt.s_columns(3, columns=2)
    settings = CrawlSettings(body_height=0.37, stability_margin=0.03, timing="velocity")
    plan = plan_crawl(wang, footholds, settings)
    assert plan.settings == settings
    changed = plan_crawl(wang, footholds, settings, body_height=0.39)
    assert changed.settings == dataclasses.replace(settings, body_height=0.39)


def test_the_objective_time_takes_the_settings_of_the_time_optimal_walk(wang: Quadruped) -> None:
    footholds = gaitopt.s_columns(3, columns=2)
    by_object = plan_crawl(
        wang,
        footholds,
        RouteSettings(free=Freedoms.from_name("overlap"), swing_knots=12, timing="velocity"),
    )
    by_name = plan_crawl(wang, footholds, objective="time", free="overlap", timing="velocity")
    assert by_object.settings == by_name.settings
    # With numpy 2.0 the last digits depend on where arrays lie in memory.
    assert by_object.duration == pytest.approx(by_name.duration, rel=1e-13)
    with pytest.raises(InputError, match="takes RouteSettings, got CrawlSettings"):
        plan_crawl(wang, footholds, CrawlSettings(timing="velocity"), objective="time")


def test_settings_of_another_planner_are_refused(wang: Quadruped) -> None:
    footholds = gaitopt.s_columns(3, columns=2)
    with pytest.raises(InputError, match=r"must be RouteSettings, got .*stability_margin="):
        plan_route(wang, footholds, CrawlSettings(timing="velocity"))  # type: ignore[arg-type]
    with pytest.raises(InputError, match="settings must be CrawlSettings, got 'margin'"):
        plan_crawl(wang, footholds, "margin")  # type: ignore[arg-type]
    trot = gaitopt.trot(0.5)
    with pytest.raises(InputError, match="give the same schedule twice"):
        plan_gait(wang, gaitopt.pace(0.5), GaitSettings(schedule=trot))


@pytest.mark.parametrize("name", ["acceleration_limit", "jerk_limit"])
def test_a_walk_phase_by_phase_promises_no_accelerations(name: str) -> None:
    with pytest.raises(InputError, match=f"{name} goes with the objective 'time'"):
        CrawlSettings(**{name: 5.0}, timing="velocity")  # type: ignore[arg-type]


def test_a_free_order_is_none_until_it_is_found() -> None:
    settings = CrawlSettings(sequence="free", timing="velocity")
    assert settings.swing_legs(3) is None
    assert settings.order_over(gaitopt.s_columns(0, columns=3)) == CrawlSettings().sequence


def test_a_body_height_is_searched_for_where_none_is_given() -> None:
    """At its standing height hyq's joints do not let it walk; somewhat higher they do."""
    hyq = gaitopt.load_robot("hyq")
    footholds = gaitopt.s_columns(0, columns=3, robot=hyq)
    plan = plan_crawl(hyq, footholds, timing="velocity")
    assert plan.settings.body_height > hyq.standing_height
    timed = plan_crawl(hyq, footholds, objective="time", free="overlap", timing="velocity")
    assert timed.settings.body_height == plan.settings.body_height
    with pytest.raises(gaitopt.InfeasibleStepError, match="would turn to"):
        plan_crawl(hyq, footholds, body_height=hyq.standing_height, timing="velocity")


@pytest.mark.parametrize(
    ("name", "hint"),
    [
        ("friction", r"forces=gaitopt\.ForceLimits\(friction=\.\.\.\) sets that limit"),
        ("frction", r"forces=gaitopt\.ForceLimits\(friction=\.\.\.\) sets that limit"),
        ("reach_fracton", "did you mean reach_fraction"),
    ],
)
def test_limits_on_forces_are_told_from_settings(name: str, hint: str) -> None:
    robot = gaitopt.load_robot("wang2020")
    for planner in (gaitopt.plan_crawl, gaitopt.plan_route):
        with pytest.raises(InputError, match=hint):
            planner(robot, gaitopt.s_columns(0, columns=1), **{name: 0.4})


def test_a_limit_of_a_stride_for_all_joints_is_the_largest_of_theirs() -> None:
    """Nobody keeps the other number, so it is no promise."""
    settings = StrideSettings.for_robot(gaitopt.load_robot("frog1"), acceleration_limit=2.0)
    assert settings.acceleration_limit == max(settings.accelerations) == 2.0
    with pytest.raises(InputError, match=r"acceleration_limit is 1, and the largest of acceler"):
        dataclasses.replace(settings, acceleration_limit=1.0)
