"""Time-optimal walks whose true centre of mass keeps the margin: ``com="model"``."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

import gaitopt
from gaitopt import LEGS, Footholds, InputError, Plan, Quadruped, RouteError
from gaitopt.plan.com_margin import com_margin, true_com
from gaitopt.plan.settings.by_name import settings_from_dict
from gaitopt.plan.settings.freedoms import VARIANTS
from gaitopt.plan.settings.time_optimal import RouteSettings
from gaitopt.planners.time_optimal.balance import dense_com, margin_shortfall, with_raised_com_rows
from gaitopt.planners.time_optimal.bound import route_bound
from gaitopt.planners.time_optimal.build import build_route
from gaitopt.planners.time_optimal.planner import plan_route
from gaitopt.planners.time_optimal.straight.densify import densify
from gaitopt.planners.time_optimal.walk import prepare_route
from gaitopt.robots.whole_body import configuration

STATIC_ROWS = [row for row in VARIANTS if row != "dynamic"]
S0 = 0.02


@pytest.fixture(scope="module")
def short() -> Footholds:
    """Two cycles, eight steps."""
    return gaitopt.s_columns(3, columns=3)


@pytest.fixture(scope="module")
def plans(wang: Quadruped, short: Footholds) -> dict[str, Plan]:
    """Every static row over the same eight steps."""
    return {row: plan_route(wang, short, free=row, com="model") for row in STATIC_ROWS}


def least_margin(plan: Plan) -> float:
    """Pinocchio's, at all knots of the path once the first foot has lifted off [m]."""
    times, margins = com_margin(plan)
    return float(margins[times >= plan.phases[1].start].min())


@pytest.mark.parametrize("row", STATIC_ROWS)
def test_the_true_com_keeps_the_margin_and_the_certificate_proves_it(
    plans: dict[str, Plan], row: str
) -> None:
    plan = plans[row]
    certificate = gaitopt.verify(plan).raise_for_violations()
    check = certificate["margin of the true COM"]
    assert check.limit == pytest.approx(S0, abs=2e-6) and check.worst >= S0 - 1e-6
    assert certificate["margin of the body centre"].status == "unchecked"
    assert least_margin(plan) >= S0
    assert "true centre of mass" in str(plan.record.stability)


def test_it_is_kept_no_more_than_needed(plans: dict[str, Plan]) -> None:
    """A faster walk is at the edge: the least margin is the one asked for, to a tenth of 1 mm."""
    for plan in plans.values():
        assert least_margin(plan) < S0 + 1e-4


def test_planned_with_the_body_s_centre_it_is_lost(wang: Quadruped, short: Footholds) -> None:
    plan = plan_route(wang, short, free="height")
    assert least_margin(plan) < 0.9 * S0
    # The body's plan does not become the model's by saying so.
    posing = replace(plan, settings=replace(plan.settings, com="model"))  # type: ignore[call-arg]
    violated = gaitopt.verify(posing, collisions=False).violations
    assert [check.name for check in violated] == ["margin of the true COM"]


def test_margins_told_are_those_of_the_true_com(plans: dict[str, Plan]) -> None:
    for plan in plans.values():
        times, margins = com_margin(plan)
        for phase in plan.phases:
            if phase.kind == "swing":
                inside = (times >= phase.start) & (times < phase.end)
                assert phase.margin == pytest.approx(margins[inside].min(), abs=2e-5)


def test_it_costs_little_time(plans: dict[str, Plan], wang: Quadruped, short: Footholds) -> None:
    for row in ("swing", "height", "posture"):
        assert plans[row].duration < 1.05 * plan_route(wang, short, free=row).duration


def test_dense_com_and_shortfall_are_pinocchio_s(wang: Quadruped) -> None:
    """Far from stable here: the first guess, which is the body centre's walk, turned."""
    free = VARIANTS["height"]
    settings = RouteSettings(free=free, heading=0.4, com="model", stability_margin=0.03)
    turn = gaitopt.conventions.rotation_z(0.4)
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
    margin = gaitopt.static_stability_margin(knots.feet[k, support], part).min()
    assert short[k].max() == pytest.approx(0.03 + 1e-5 - margin, abs=1e-12)


def test_only_rows_beside_a_shortfall_are_raised(wang: Quadruped, short: Footholds) -> None:
    settings = RouteSettings(free=VARIANTS["swing"], com="model")
    route = prepare_route(wang, short, settings)
    knots, problem = build_route(route)
    assert problem.com is not None
    lacking = -np.ones((len(knots.step), 12))
    k = int(np.flatnonzero(knots.is_swing)[3])
    lacking[k, 1] = 1e-3
    more = with_raised_com_rows(problem.com, knots, lacking).offset - problem.com.offset
    assert sorted(problem.com.knot[more > 0]) == [k, k + 1]
    assert more[more > 0] == pytest.approx(1.1e-3, abs=1e-5)


def test_the_first_pose_is_where_the_robot_stands(wang: Quadruped, short: Footholds) -> None:
    """No row asks anything of the first knot, and all of the others are asked."""
    settings = RouteSettings(free=VARIANTS["swing"], com="model")
    route = prepare_route(wang, short, settings)
    _, problem = build_route(route)
    assert problem.com is not None
    assert set(problem.com.knot) == set(range(1, problem.knots))


def test_a_horizon_and_a_free_order_keep_it_too(wang: Quadruped, short: Footholds) -> None:
    footholds = gaitopt.s_columns(1, columns=5)
    for plan in (
        plan_route(wang, footholds, free="swing", com="model", horizon=8),
        plan_route(wang, short, free="height", com="model", sequence="free"),
    ):
        assert plan.settings.true_com
        gaitopt.verify(plan, collisions=False).raise_for_violations()


@pytest.mark.parametrize("name", ["a1", "anymal_c"])
def test_other_robots_keep_it_too(name: str) -> None:
    from gaitopt.terrain.columns import s_columns

    robot = gaitopt.load_robot(name)
    footholds = s_columns(0, columns=3, robot=robot)
    plan = plan_route(
        robot, footholds, free="height", com="model", body_height=robot.standing_height
    )
    gaitopt.verify(plan, collisions=False).raise_for_violations()
    assert least_margin(plan) >= S0


def test_a_turned_walk_takes_the_same_time(
    wang: Quadruped, short: Footholds, plans: dict[str, Plan]
) -> None:
    turn: NDArray[np.float64] = gaitopt.conventions.rotation_z(0.7)
    turned = Footholds({leg: short[leg] @ turn.T for leg in LEGS}, short.radius)
    plan = plan_route(wang, turned, free="height", com="model", heading=0.7)
    assert plan.duration == pytest.approx(plans["height"].duration, rel=1e-3)
    gaitopt.verify(plan, collisions=False).raise_for_violations()


def test_plan_files_say_what_keeps_the_margin(plans: dict[str, Plan], tmp_path: Path) -> None:
    plan = plans["swing"]
    plan.save(tmp_path / "walk.npz")
    assert gaitopt.load_plan(tmp_path / "walk.npz").settings == plan.settings
    before = plan.settings.to_dict()
    assert before.pop("com") == "model"
    old = settings_from_dict("route", before)
    assert isinstance(old, RouteSettings) and old.com == "body" and not old.true_com


def test_bounds_lie_below(plans: dict[str, Plan]) -> None:
    plan = plans["swing"]
    assert 0.8 * plan.duration < route_bound(plan, 8).sum() < plan.duration


def test_plan_crawl_passes_it_on(wang: Quadruped, short: Footholds, plans: dict[str, Plan]) -> None:
    plan = gaitopt.plan_crawl(wang, short, objective="time", free="swing", com="model")
    assert plan.duration == plans["swing"].duration
    with pytest.raises(InputError, match="com, acceleration_limit and horizon go with"):
        gaitopt.plan_crawl(wang, short, com="model")


def test_the_command_line_passes_it_on(tmp_path: Path) -> None:
    """In a race the rows that are planned phase by phase run along as ever."""
    from typer.testing import CliRunner

    from gaitopt.cli.app import app

    done = CliRunner().invoke(
        app, ["race", "--columns", "3", "--rows", "swing", "--com", "model", "--no-bound",
              "--no-collisions", "--out", str(tmp_path)],
    )  # fmt: skip
    assert done.exit_code == 0, done.output
    assert gaitopt.load_plan(tmp_path / "plan_swing.npz").settings.true_com
    assert not gaitopt.load_plan(tmp_path / "plan_the_paper.npz").settings.true_com


def test_what_is_not_planned_is_refused(wang: Quadruped, short: Footholds) -> None:
    with pytest.raises(InputError, match="leave 'dynamic' and acceleration_limit out"):
        plan_route(wang, short, free="dynamic", com="model")
    with pytest.raises(InputError, match="leave 'dynamic' and acceleration_limit out"):
        plan_route(wang, short, free="swing", com="model", acceleration_limit=8.0)
    with pytest.raises(InputError, match="com must be one of 'body', 'model', got 'mass'"):
        plan_route(wang, short, com="mass")  # type: ignore[arg-type]


def test_the_walk_that_is_offered_says_whose_margin_it_keeps(
    wang: Quadruped, short: Footholds
) -> None:
    with pytest.raises(RouteError, match="its margin is that of the body centre"):
        plan_route(wang, short, free="swing", com="model", iterations=4)
