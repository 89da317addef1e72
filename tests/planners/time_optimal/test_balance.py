"""Time-optimal walks whose true centre of mass keeps the margin: ``com="model"``."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

import gaitopt
from gaitopt import LEGS, Footholds, Plan, Quadruped, plan_route
from gaitopt.cli.app import app
from gaitopt.conventions import rotation_z
from gaitopt.plan.com_margin import com_margin, true_com
from gaitopt.plan.settings.by_name import settings_from_dict
from gaitopt.plan.settings.freedoms import VARIANTS
from gaitopt.plan.settings.time_optimal import RouteSettings
from gaitopt.planners.time_optimal.balance import (
    COM_OVERCORRECTION,
    dense_com,
    margin_shortfall,
    with_raised_com_rows,
)
from gaitopt.planners.time_optimal.build import build_route
from gaitopt.planners.time_optimal.dense import RESERVE_KEPT
from gaitopt.planners.time_optimal.straight.densify import densify
from gaitopt.planners.time_optimal.walk import prepare_route
from gaitopt.robots.whole_body import configuration
from gaitopt.terrain.columns import s_columns

STATIC_VARIANTS = [variant for variant, free in VARIANTS.items() if not free.dynamic]
MARGIN = 0.02
"""The stability margin that fits wang2020 [m]."""


def least_margin(plan: Plan) -> float:
    """Pinocchio's, at all knots of the path once the first foot has lifted off [m]."""
    times, margins = com_margin(plan)
    return float(margins[times >= plan.phases[1].start].min())


@pytest.mark.parametrize("variant", STATIC_VARIANTS)
def test_the_true_com_keeps_the_margin_and_the_certificate_proves_it(
    com_plans: dict[str, Plan], variant: str
) -> None:
    plan = com_plans[variant]
    certificate = gaitopt.verify(plan).raise_for_violations()
    check = certificate["margin of the true COM"]
    assert check.limit == pytest.approx(MARGIN, abs=2e-6) and check.worst >= MARGIN - 1e-6
    assert certificate["margin of the body centre"].status == "unchecked"
    assert least_margin(plan) >= MARGIN
    assert "true centre of mass" in plan.record.stability


@pytest.mark.parametrize("variant", STATIC_VARIANTS)
def test_the_margin_is_kept_no_more_than_needed(com_plans: dict[str, Plan], variant: str) -> None:
    """A fast walk is at the edge: the least margin is the one asked for, to a tenth of 1 mm."""
    assert least_margin(com_plans[variant]) < MARGIN + 1e-4


def test_a_walk_planned_with_the_body_centre_violates_it(plans: dict[str, Plan]) -> None:
    plan = plans["height"]
    assert least_margin(plan) < 0.9 * MARGIN
    posing = replace(plan, settings=replace(plan.settings, com="model"))
    violated = gaitopt.verify(posing, collisions=False).violations
    assert [check.name for check in violated] == ["margin of the true COM"]


@pytest.mark.parametrize("variant", STATIC_VARIANTS)
def test_phases_tell_the_margin_of_the_true_com(com_plans: dict[str, Plan], variant: str) -> None:
    plan = com_plans[variant]
    times, margins = com_margin(plan)
    for phase in plan.phases:
        if phase.kind == "swing":
            inside = (times >= phase.start) & (times < phase.end)
            assert phase.margin == pytest.approx(margins[inside].min(), abs=2e-5)


@pytest.mark.parametrize("variant", ["swing", "height", "posture"])
def test_the_true_com_costs_little_time(
    plans: dict[str, Plan], com_plans: dict[str, Plan], variant: str
) -> None:
    assert com_plans[variant].duration < 1.05 * plans[variant].duration


def test_dense_com_and_shortfall_are_those_of_pinocchio(wang: Quadruped) -> None:
    """Where the margin is lost: in the first guess, for which the body centre keeps it."""
    free = VARIANTS["height"]
    settings = RouteSettings(
        free=free, heading=0.4, com="model", stability_margin=0.03, timing="velocity"
    )
    turn = rotation_z(0.4)
    straight = gaitopt.s_columns(5, columns=3)
    footholds = Footholds({leg: straight[leg] @ turn.T for leg in LEGS}, straight.radius)
    route = prepare_route(wang, footholds, settings)
    knots, problem = build_route(route)
    dense = densify(wang, settings, knots, problem.legs, problem.poses)
    q = configuration(wang, dense.base[:, :3], dense.base[:, 3:], dense.joints)
    points = true_com(wang, q) @ turn
    assert dense_com(wang, settings, dense) == pytest.approx(points, abs=1e-12)
    short = margin_shortfall(wang, settings, knots, dense)
    k = int(np.flatnonzero(knots.is_swing)[3])
    support = [i for i in range(4) if i != knots.leg[k]]
    part = points[dense.at_knots[k] : dense.at_knots[k + 1] + 1]
    wanted = 0.03 + RESERVE_KEPT * settings.margin_reserve
    margin = gaitopt.static_stability_margin(knots.feet[k, support], part).min()
    assert short[k].max() == pytest.approx(wanted - margin, abs=1e-12)


def test_only_rows_beside_a_shortfall_are_raised(wang: Quadruped, short: Footholds) -> None:
    settings = RouteSettings(free=VARIANTS["swing"], com="model", timing="velocity")
    route = prepare_route(wang, short, settings)
    knots, problem = build_route(route)
    assert problem.com is not None
    lacking = -np.ones((len(knots.step), 12))
    k = int(np.flatnonzero(knots.is_swing)[3])
    lacking[k, 1] = 1e-3
    more = with_raised_com_rows(problem.com, knots, lacking).offset - problem.com.offset
    assert sorted(problem.com.knot[more > 0]) == [k, k + 1]
    assert more[more > 0] == pytest.approx(COM_OVERCORRECTION * 1e-3, abs=1e-5)


def test_every_knot_but_the_first_has_rows(wang: Quadruped, short: Footholds) -> None:
    """At the first knot the robot stands where it stands."""
    settings = RouteSettings(free=VARIANTS["swing"], com="model", timing="velocity")
    route = prepare_route(wang, short, settings)
    _, problem = build_route(route)
    assert problem.com is not None
    assert set(problem.com.knot) == set(range(1, problem.knots))


def test_a_horizon_and_a_free_order_keep_the_margin(wang: Quadruped, short: Footholds) -> None:
    few = gaitopt.s_columns(1, columns=2)
    for plan in (
        plan_route(wang, short, free="swing", com="model", horizon=4, timing="velocity"),
        plan_route(wang, few, free="height", com="model", sequence="free", timing="velocity"),
    ):
        assert plan.settings.true_com
        gaitopt.verify(plan, collisions=False).raise_for_violations()


@pytest.mark.parametrize("name", ["a1", "anymal_c"])
def test_other_robots_keep_the_margin(name: str) -> None:
    robot = gaitopt.load_robot(name)
    footholds = s_columns(0, columns=3, robot=robot)
    plan = plan_route(
        robot,
        footholds,
        free="height",
        com="model",
        body_height=robot.standing_height,
        timing="velocity",
    )
    gaitopt.verify(plan, collisions=False).raise_for_violations()
    assert least_margin(plan) >= plan.settings.stability_margin


def test_a_turned_walk_takes_the_same_time(
    wang: Quadruped, short: Footholds, com_plans: dict[str, Plan]
) -> None:
    turn = rotation_z(0.7)
    turned = Footholds({leg: short[leg] @ turn.T for leg in LEGS}, short.radius)
    plan = plan_route(wang, turned, free="height", com="model", heading=0.7, timing="velocity")
    assert plan.duration == pytest.approx(com_plans["height"].duration, rel=1e-3)
    gaitopt.verify(plan, collisions=False).raise_for_violations()


def test_plan_files_say_what_keeps_the_margin(com_plans: dict[str, Plan], tmp_path: Path) -> None:
    plan = com_plans["swing"]
    plan.save(tmp_path / "walk.npz")
    assert gaitopt.load_plan(tmp_path / "walk.npz").settings == plan.settings
    before = plan.settings.to_dict()
    assert before.pop("com") == "model"
    old = settings_from_dict("route", before)
    assert isinstance(old, RouteSettings) and old.com == "body" and not old.true_com


def test_a_race_plans_with_the_true_com_but_for_walks_phase_by_phase(tmp_path: Path) -> None:
    done = CliRunner().invoke(
        app, ["race", "--columns", "3", "--rows", "swing", "--com", "model", "--no-bound",
              "--no-collisions", "--out", str(tmp_path)],
    )  # fmt: skip
    assert done.exit_code == 0, done.output
    assert gaitopt.load_plan(tmp_path / "plan_swing.npz").settings.true_com
    assert not gaitopt.load_plan(tmp_path / "plan_the_paper.npz").settings.true_com
