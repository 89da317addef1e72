"""Time-optimal walks: certified, faster with every freedom, the same however they are turned."""

from __future__ import annotations

import pickle

import numpy as np
import pytest

import gaitopt
from gaitopt import LEGS, Footholds, InfeasibleStepError, Plan, Quadruped, RouteError, plan_route
from gaitopt.conventions import rotation_z
from gaitopt.gait.crawl import CRAWL_SEQUENCES
from gaitopt.plan.settings.freedoms import VARIANTS
from gaitopt.planners.time_optimal.straight import solve
from gaitopt.planners.time_optimal.walk import Route
from gaitopt.terrain.columns import s_columns

STATIC_VARIANTS = [variant for variant, free in VARIANTS.items() if not free.dynamic]


def mirrored(footholds: Footholds) -> Footholds:
    """Left and right exchanged."""
    other = {"LF": "RF", "LH": "RH", "RH": "LH", "RF": "LF"}
    return Footholds({leg: footholds[other[leg]] * [1, -1, 1] for leg in LEGS}, footholds.radius)


@pytest.mark.parametrize("variant", VARIANTS)
def test_every_variant_is_certified(plans: dict[str, Plan], variant: str) -> None:
    gaitopt.verify(plans[variant]).raise_for_violations()


def test_each_freedom_makes_the_walk_faster(plans: dict[str, Plan], short_plan: Plan) -> None:
    times = [short_plan.duration, *(plans[variant].duration for variant in STATIC_VARIANTS)]
    assert np.all(np.diff(times) < 0)
    gains = times[0] / np.array(times)
    assert gains[3] > 1.8 and gains[4] > 2.7 and gains[5] > 4.5


def test_at_every_instant_a_joint_runs_at_its_limit(plans: dict[str, Plan]) -> None:
    for plan in (plans[variant] for variant in STATIC_VARIANTS):
        use = np.abs(plan.path.coefficients[0][:, 6:]) / plan.robot.velocity_limits
        assert use.max(axis=1) == pytest.approx(1.0, abs=1e-9)


def test_the_phases_tell_which_joint_sets_the_time(plans: dict[str, Plan]) -> None:
    """In every phase that takes time, the shares of the joints sum to one."""
    for plan in (plans[variant] for variant in STATIC_VARIANTS):
        for phase in plan.phases:
            limits = [limit for limit in phase.limited_by if limit.kind == "joint velocity"]
            if phase.duration > 0.0:
                assert sum(limit.value for limit in limits) == pytest.approx(1.0, abs=1e-6)


def test_what_is_not_free_stays_as_it_is(plans: dict[str, Plan]) -> None:
    """Height and orientation are fixed in some variants; in ``route`` the body stands in swings."""
    for variant in ("route", "overlap", "swing"):
        body = plans[variant].path.knots()[:, :6]
        assert np.ptp(body[:, 2:], axis=0).max() < 1e-12
    assert np.ptp(plans["height"].path.knots()[:, 2]) > 0.01
    assert np.ptp(plans["height"].path.knots()[:, 3:6], axis=0).max() < 1e-12
    for phase in plans["route"].phases:
        if phase.kind == "swing":
            assert phase.cog_end == pytest.approx(phase.cog_start, abs=1e-12)


@pytest.mark.parametrize(("variant", "limit"), [("swing", None), ("swing", 6.0), ("posture", 6.0),
                                                ("dynamic", None)])  # fmt: skip
def test_a_start_with_a_small_margin_is_walked_from(
    wang: Quadruped, variant: str, limit: float | None
) -> None:
    """10 mm inside four feet, where 20 mm are asked for: every flight keeps all of it."""
    footholds = gaitopt.s_columns(0, columns=3)
    plan = plan_route(
        wang,
        footholds,
        free=variant,
        acceleration_limit=limit,
        cog_start=(0.0, 0.14),
        timing="velocity",
    )
    margins = [phase.margin for phase in plan.phases]
    assert 0.005 < margins[0] < 0.0103 and min(margins[1:]) >= 0.02
    if variant == "dynamic":
        assert 0.005 < plan.record.zmp_margin < 0.0103
    gaitopt.verify(plan, collisions=False).raise_for_violations()


def test_the_time_does_not_depend_on_how_the_walk_is_turned(
    plans: dict[str, Plan], wang: Quadruped, short: Footholds
) -> None:
    turn = rotation_z(0.7).T
    turned = Footholds({leg: short[leg] @ turn + [5.0, -3.0, 0.2] for leg in LEGS}, short.radius)
    plan = plan_route(wang, turned, free="posture", heading=0.7, timing="velocity")
    assert plan.duration == pytest.approx(plans["posture"].duration, rel=1e-3)
    gaitopt.verify(plan, collisions=False).raise_for_violations()


def test_left_and_right_take_the_same_time(
    plans: dict[str, Plan], wang: Quadruped, short: Footholds
) -> None:
    other = plan_route(
        wang, mirrored(short), free="height", sequence=("LH", "LF", "RH", "RF"), timing="velocity"
    )
    assert other.duration == pytest.approx(plans["height"].duration, rel=2e-3)


def test_a_larger_margin_takes_longer_and_is_kept(wang: Quadruped, short: Footholds) -> None:
    plans = [
        plan_route(wang, short, free="height", stability_margin=s, timing="velocity")
        for s in (0.0, 0.02, 0.04)
    ]
    assert np.all(np.diff([plan.duration for plan in plans]) > 0)
    for plan in plans:
        assert plan.margin >= plan.settings.stability_margin


def test_a_horizon_loses_little_time(wang: Quadruped) -> None:
    footholds = gaitopt.s_columns(1, columns=6)
    whole = plan_route(wang, footholds, free="swing", timing="velocity")
    plan = plan_route(wang, footholds, free="swing", horizon=8, timing="velocity")
    gaitopt.verify(plan, collisions=False).raise_for_violations()
    assert plan.duration < 1.02 * whole.duration


def test_sections_of_a_long_walk_lose_little_time(
    wang: Quadruped, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Sections of eight steps stand for those of 64: their ends are as near as they can be."""
    footholds, calls = gaitopt.s_columns(0, columns=6), list[tuple[int, int]]()
    at_once = plan_route(wang, footholds, free="height", timing="velocity")
    monkeypatch.setattr(solve, "SECTION", 8)
    plan = plan_route(
        wang, footholds, free="height", timing="velocity",
        progress=lambda done, total: calls.append((done, total)),
    )  # fmt: skip
    assert calls == [(0, 20), (4, 20), (8, 20), (12, 20), (20, 20)]
    assert plan.duration == pytest.approx(at_once.duration, rel=5e-3)
    gaitopt.verify(plan, collisions=False).raise_for_violations()


def test_where_a_section_fails_all_steps_are_solved_at_once(
    wang: Quadruped, short: Footholds, plans: dict[str, Plan], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The walk is then the one that would have been planned without sections."""
    monkeypatch.setattr(solve, "SECTION", 4)
    monkeypatch.setattr(solve, "SECTION_OVERLAP", 2)
    monkeypatch.setattr(solve, "solve_in_windows", fail_in_windows)
    plan = plan_route(wang, short, free="swing", timing="velocity")
    assert plan.duration == plans["swing"].duration


def fail_in_windows(route: Route, *_: object, **__: object) -> None:
    """A window that finds nothing."""
    raise RouteError(f"nothing over {route.count} steps", (), None, "")


@pytest.mark.parametrize("name", ["anymal", "a1"])
def test_other_robots_walk_twice_as_fast_as_phase_by_phase(name: str) -> None:
    robot = gaitopt.load_robot(name)
    footholds, height = s_columns(0, columns=3, robot=robot), robot.standing_height
    paper = gaitopt.plan_crawl(robot, footholds, body_height=height, timing="velocity")
    plan = plan_route(robot, footholds, free="height", body_height=height, timing="velocity")
    gaitopt.verify(plan).raise_for_violations()
    assert plan.duration < paper.duration / 2.0


@pytest.mark.parametrize("variant", ["swing", "height", "posture"])
def test_joints_that_turn_faster_walk_faster_by_as_much(wang: Quadruped, variant: str) -> None:
    """Time scales with the joints' limits: nothing else in the problem has a time in it."""
    fast, footholds = gaitopt.load_robot("wang2020-fast"), gaitopt.s_columns(0, columns=3)
    ratio = fast.legs["LF"].velocity_limits[0] / wang.legs["LF"].velocity_limits[0]
    slow_plan, fast_plan = (
        plan_route(robot, footholds, free=variant, timing="velocity") for robot in (wang, fast)
    )
    assert ratio > 15.0
    assert fast_plan.duration * ratio == pytest.approx(slow_plan.duration, rel=0.02)
    gaitopt.verify(fast_plan, collisions=False).raise_for_violations()


def test_walks_over_uneven_columns_are_certified(wang: Quadruped) -> None:
    footholds = gaitopt.s_columns(4, columns=3, height_jitter=0.03)
    gaitopt.verify(
        plan_route(wang, footholds, free="posture", timing="velocity")
    ).raise_for_violations()


def test_standing_still_is_a_plan(wang: Quadruped) -> None:
    plan = plan_route(wang, gaitopt.s_columns(0, columns=1), timing="velocity")
    assert plan.duration == 0.0 and plan.phases == ()


def test_no_convergence_is_no_plan(wang: Quadruped, short: Footholds) -> None:
    """The error names steps, offers the walk phase by phase and keeps the solver's report."""
    with pytest.raises(RouteError, match=r"iteration limit.*at steps [0-7]") as caught:
        plan_route(wang, short, free="swing", iterations=4, timing="velocity")
    error = caught.value
    assert error.steps and all(0 <= step < 8 for step in error.steps)
    assert error.plan is not None
    gaitopt.verify(error.plan, collisions=False).raise_for_violations()
    copy = pickle.loads(pickle.dumps(error))
    assert (str(copy), copy.steps, copy.report) == (str(error), error.steps, error.report)
    assert [line.split()[:2] for line in error.report.splitlines()][-1][1] == "barrier"


def test_a_window_without_convergence_names_its_steps(wang: Quadruped) -> None:
    """Of twelve steps the first window has four."""
    footholds = gaitopt.s_columns(1, columns=4)
    with pytest.raises(RouteError, match=r"over steps 0 to 3 ") as caught:
        plan_route(wang, footholds, free="swing", horizon=4, iterations=3, timing="velocity")
    assert all(0 <= step < 4 for step in caught.value.steps)


def test_an_impossible_margin_names_the_step(wang: Quadruped, short: Footholds) -> None:
    with pytest.raises(InfeasibleStepError, match="margin"):
        plan_route(wang, short, stability_margin=0.2, timing="velocity")


def test_a_free_order_is_the_fastest_of_all_that_are_tried(wang: Quadruped) -> None:
    """The six cycles, and the order that is searched for phase by phase."""
    short = gaitopt.s_columns(3, columns=2)
    plan = plan_route(wang, short, free="height", sequence="free", timing="velocity")
    cycles = [
        plan_route(wang, short, free="height", sequence=order, timing="velocity")
        for order in CRAWL_SEQUENCES
    ]
    assert plan.duration <= min(cycle.duration for cycle in cycles)
    assert plan.record.orders_feasible == 7
    gaitopt.verify(plan, collisions=False).raise_for_violations()


def test_progress_counts_steps_window_by_window(wang: Quadruped) -> None:
    """Half of each window is kept; all steps at once are done when they are done."""
    footholds = gaitopt.s_columns(1, columns=3)

    def told(horizon: int | None, free: str = "swing") -> list[tuple[int, int]]:
        calls: list[tuple[int, int]] = []
        plan_route(
            wang,
            footholds,
            free=free,
            horizon=horizon,
            progress=lambda done, total: calls.append((done, total)),
            timing="velocity",
        )
        return calls

    assert told(None) == [(0, 8), (8, 8)]
    assert told(4) == [(0, 8), (2, 8), (4, 8), (8, 8)]
    assert told(6, "dynamic") == [(0, 8), (3, 8), (8, 8)]


def test_progress_counts_orders_and_plan_crawl_passes_it_on(wang: Quadruped) -> None:
    calls: list[tuple[int, int]] = []
    gaitopt.plan_crawl(
        wang,
        gaitopt.s_columns(3, columns=2),
        objective="time",
        sequence="free",
        free="route",
        progress=lambda done, total: calls.append((done, total)),
        timing="velocity",
    )
    assert calls == [(k, 7) for k in range(8)]
