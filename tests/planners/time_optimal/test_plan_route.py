"""Time-optimal walks: certified, faster with every freedom, the same however they are turned."""

from __future__ import annotations

import pickle
from typing import Any

import numpy as np
import pytest

import gaitopt
from gaitopt import LEGS, Footholds, InfeasibleStepError, InputError, Plan, Quadruped, RouteError
from gaitopt.plan.settings.freedoms import VARIANTS
from gaitopt.plan.settings.time_optimal import RouteSettings
from gaitopt.planners.time_optimal.bound import route_bound
from gaitopt.planners.time_optimal.planner import plan_route


@pytest.fixture(scope="module")
def short() -> Footholds:
    """Two cycles, eight steps."""
    return gaitopt.s_columns(3, columns=3)


@pytest.fixture(scope="module")
def rows(wang: Quadruped, short: Footholds) -> dict[str, Plan]:
    """The plan of every row over the same eight steps."""
    return {row: plan_route(wang, short, free=row) for row in VARIANTS}


STATIC_ROWS = [row for row in VARIANTS if row != "dynamic"]


def mirrored(footholds: Footholds) -> Footholds:
    """Left and right exchanged."""
    other = {"LF": "RF", "LH": "RH", "RH": "LH", "RF": "LF"}
    return Footholds({leg: footholds[other[leg]] * [1, -1, 1] for leg in LEGS}, footholds.radius)


@pytest.mark.parametrize("row", list(VARIANTS))
def test_every_row_is_certified(rows: dict[str, Plan], row: str) -> None:
    gaitopt.verify(rows[row]).raise_for_violations()


def test_each_freedom_makes_the_walk_faster(rows: dict[str, Plan], short_plan: Plan) -> None:
    times = [short_plan.duration, *(rows[row].duration for row in STATIC_ROWS)]
    assert np.all(np.diff(times) < 0)
    gains = times[0] / np.array(times)
    assert gains[3] > 1.8 and gains[4] > 2.7 and gains[5] > 4.5


def test_at_every_instant_a_joint_runs_at_its_limit(rows: dict[str, Plan]) -> None:
    for plan in (rows[row] for row in STATIC_ROWS):
        use = np.abs(plan.path.coefficients[0][:, 6:]) / plan.robot.velocity_limits
        assert use.max(axis=1) == pytest.approx(1.0, abs=1e-9)


def test_what_is_not_free_stays(rows: dict[str, Plan]) -> None:
    """Height and orientation are fixed in the first rows, and the body still in the first."""
    for row in ("route", "overlap", "swing"):
        body = rows[row].path.knots()[:, :6]
        assert np.ptp(body[:, 2:], axis=0).max() < 1e-12
    assert np.ptp(rows["height"].path.knots()[:, 2]) > 0.01
    assert np.ptp(rows["height"].path.knots()[:, 3:6], axis=0).max() < 1e-12
    for phase in rows["route"].phases:
        if phase.kind == "swing":
            assert phase.cog_end == pytest.approx(phase.cog_start, abs=1e-12)


def lowest_outside(plan: Plan) -> float:
    """Least height of a flying foot above the higher column, outside the columns' radius [m].

    Every 2 ms, and at all times more where a path has short pieces.
    """
    radius, least = plan.footholds.radius, np.inf
    assert radius is not None
    pieces = plan.path.times[:-1] + np.diff(plan.path.times) * np.linspace(0, 1, 5)[:, None]
    motion = plan.at(np.unique(np.append(np.arange(0.0, plan.duration, 0.002), pieces)))
    for phase in plan.phases:
        if phase.kind == "swing":
            inside = (motion.t >= phase.start) & (motion.t <= phase.end)
            foot = motion.feet[inside, LEGS.index(phase.leg)]
            ends = np.stack([phase.foot_start, phase.foot_end])
            away = np.linalg.norm(foot[:, None, :2] - ends[:, :2], axis=2).min(axis=1)
            high = foot[away > radius, 2] - ends[:, 2].max()
            least = min(least, float(high.min(initial=np.inf)))
    return least


def test_free_feet_keep_their_clearance(rows: dict[str, Plan]) -> None:
    """20 mm above the higher column; what plans tell is no more than what is seen."""
    for row in ("swing", "height", "posture", "dynamic"):
        least = lowest_outside(rows[row])
        assert 0.02 <= float(rows[row].record.clearance) <= least < 0.022


@pytest.mark.parametrize(
    ("row", "limit", "clearance", "jitter"),
    [("swing", None, 0.05, 0.03), ("posture", None, 0.05, 0.03), ("swing", 6.0, 0.02, 0.03),
     ("posture", 6.0, 0.02, 0.03), ("dynamic", None, 0.02, 0.03), ("dynamic", None, 0.05, 0.0)],
)  # fmt: skip
def test_so_they_do_where_much_is_asked(
    wang: Quadruped, row: str, limit: float | None, clearance: float, jitter: float
) -> None:
    """With the foot far below its goal a spline cuts a large corner, and a leg bows out."""
    footholds = gaitopt.s_columns(0, columns=3, height_jitter=jitter)
    plan = plan_route(wang, footholds, free=row, clearance=clearance, acceleration_limit=limit)
    least = lowest_outside(plan)
    assert clearance <= float(plan.record.clearance) <= least
    check = gaitopt.verify(plan, collisions=False)["swing clearance"]
    assert check.status == "ok" and check.worst <= least


def test_windows_keep_the_clearance(wang: Quadruped) -> None:
    footholds = gaitopt.s_columns(1, columns=4, height_jitter=0.03)
    plan = plan_route(wang, footholds, free="dynamic", horizon=4)
    assert 0.02 <= float(plan.record.clearance) <= lowest_outside(plan)


@pytest.mark.parametrize(("row", "limit"), [("swing", None), ("swing", 6.0), ("posture", 6.0),
                                            ("dynamic", None)])  # fmt: skip
def test_a_start_with_little_margin_is_walked_from(
    wang: Quadruped, row: str, limit: float | None
) -> None:
    """10 mm inside four feet, where 20 mm are asked for: every flight keeps all of it."""
    plan = plan_route(
        wang,
        gaitopt.s_columns(0, columns=3),
        free=row,
        acceleration_limit=limit,
        cog_start=(0.0, 0.14),
    )
    margins = [phase.margin for phase in plan.phases]
    assert 0.005 < margins[0] < 0.0103 and min(margins[1:]) >= 0.02
    if row == "dynamic":
        assert 0.005 < float(plan.record.zmp_margin) < 0.0103
    gaitopt.verify(plan, collisions=False).raise_for_violations()


def test_time_does_not_depend_on_how_the_walk_is_turned(wang: Quadruped, short: Footholds) -> None:
    turn = 0.7
    matrix = np.array(
        [[np.cos(turn), np.sin(turn), 0], [-np.sin(turn), np.cos(turn), 0], [0, 0, 1]]
    )
    turned = Footholds({leg: short[leg] @ matrix + [5.0, -3.0, 0.2] for leg in LEGS}, short.radius)
    straight = plan_route(wang, short, free="posture")
    plan = plan_route(wang, turned, free="posture", heading=turn)
    assert plan.duration == pytest.approx(straight.duration, rel=1e-3)
    gaitopt.verify(plan, collisions=False).raise_for_violations()


def test_left_and_right_are_alike(wang: Quadruped, short: Footholds) -> None:
    one = plan_route(wang, short, free="height")
    other = plan_route(wang, mirrored(short), free="height", sequence=("LH", "LF", "RH", "RF"))
    assert other.duration == pytest.approx(one.duration, rel=2e-3)


def test_a_larger_margin_takes_longer_and_is_kept(wang: Quadruped, short: Footholds) -> None:
    plans = [plan_route(wang, short, free="height", stability_margin=s) for s in (0.0, 0.02, 0.04)]
    assert np.all(np.diff([p.duration for p in plans]) > 0)
    for plan in plans:
        assert plan.margin >= plan.settings.stability_margin


def test_a_horizon_loses_little(wang: Quadruped) -> None:
    footholds = gaitopt.s_columns(1, columns=6)
    whole = plan_route(wang, footholds, free="swing")
    plan = plan_route(wang, footholds, free="swing", horizon=8)
    gaitopt.verify(plan, collisions=False).raise_for_violations()
    assert plan.duration < 1.02 * whole.duration


@pytest.mark.parametrize("name", ["anymal", "a1"])
def test_other_robots_walk_too(name: str) -> None:
    from gaitopt.terrain.columns import s_columns

    robot = gaitopt.load_robot(name)
    footholds, height = s_columns(0, columns=3, robot=robot), robot.standing_height
    paper = gaitopt.plan_crawl(robot, footholds, body_height=height)
    plan = plan_route(robot, footholds, free="height", body_height=height)
    gaitopt.verify(plan).raise_for_violations()
    assert plan.duration < paper.duration / 2.0


@pytest.mark.parametrize("row", ["swing", "height", "posture"])
def test_joints_that_turn_faster_walk_faster_by_as_much(wang: Quadruped, row: str) -> None:
    """Time scales with the joints' limits: nothing else in the problem has a time in it."""
    fast, footholds = gaitopt.load_robot("wang2020-fast"), gaitopt.s_columns(0, columns=4)
    ratio = fast.legs["LF"].velocity_limits[0] / wang.legs["LF"].velocity_limits[0]
    plans = [plan_route(robot, footholds, free=row) for robot in (wang, fast)]
    assert ratio > 15.0
    assert plans[1].duration * ratio == pytest.approx(plans[0].duration, rel=0.02)
    gaitopt.verify(plans[1], collisions=False).raise_for_violations()


def test_uneven_columns(wang: Quadruped) -> None:
    footholds = gaitopt.s_columns(4, columns=3, height_jitter=0.03)
    gaitopt.verify(plan_route(wang, footholds, free="posture")).raise_for_violations()


def test_standing_still_is_a_plan(wang: Quadruped) -> None:
    plan = plan_route(wang, gaitopt.s_columns(0, columns=1))
    assert plan.duration == 0.0 and plan.phases == ()


def test_no_convergence_is_no_plan(wang: Quadruped, short: Footholds) -> None:
    """The error names steps, offers the per-phase walk and keeps the solver's report."""
    with pytest.raises(RouteError, match=r"iteration limit.*at steps [0-7]") as caught:
        plan_route(wang, short, free="swing", iterations=4)
    error = caught.value
    assert error.steps and all(0 <= s < 8 for s in error.steps)
    assert error.plan is not None
    gaitopt.verify(error.plan, collisions=False).raise_for_violations()
    assert len(error.report.splitlines()) == 5
    copy = pickle.loads(pickle.dumps(error))
    assert (str(copy), copy.steps, copy.report) == (str(error), error.steps, error.report)


def test_an_impossible_margin_names_the_step(wang: Quadruped, short: Footholds) -> None:
    with pytest.raises(InfeasibleStepError, match="margin"):
        plan_route(wang, short, stability_margin=0.2)


def test_bad_settings_are_refused(wang: Quadruped, short: Footholds) -> None:
    with pytest.raises(InputError, match="free must be one of route, overlap"):
        plan_route(wang, short, free="fast")
    with pytest.raises(InputError, match="free names 'wings'"):
        plan_route(wang, short, free=["overlap", "wings"])
    with pytest.raises(InputError, match="horizon"):
        plan_route(wang, short, horizon=1)
    with pytest.raises(InputError, match="swing_knots"):
        plan_route(wang, short, swing_knots=2)
    with pytest.raises(InputError, match="takes a Quadruped"):
        plan_route(short, wang)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"horizon": 8.5}, "horizon must be a whole number"),
        ({"horizon": "8"}, "horizon must be a whole number"),
        ({"horizon": 10**9}, "horizon must be a whole number from 2 to 10000"),
        ({"stance_knots": 0}, "stance_knots must be a whole number"),
        ({"swing_knots": 0}, "swing_knots must be a whole number"),
        ({"iterations": 0}, "iterations must be a whole number"),
        ({"iterations": 2.5}, "iterations must be a whole number"),
        ({"acceleration_limit": 1e-9}, "more than 10 s to its velocity limit"),
        ({"acceleration_limit": np.nan}, "acceleration_limit must be a number"),
        ({"com": "model", "acceleration_limit": 6.0}, "com='model' keeps static stability"),
    ],
)
@pytest.mark.parametrize("sequence", [("RH", "RF", "LH", "LF"), "free"])
def test_settings_are_looked_at_before_anything_is_planned(
    wang: Quadruped, options: dict[str, Any], words: str, sequence: Any
) -> None:
    far = gaitopt.s_columns(0, columns=3, forward=5.0)  # impossible: planning would say so
    with pytest.raises(InputError, match=words):
        plan_route(wang, far, free="swing", sequence=sequence, **options)


def test_plan_crawl_passes_its_options_on(wang: Quadruped, short: Footholds) -> None:
    plan = gaitopt.plan_crawl(wang, short, objective="time", acceleration_limit=6.0, horizon=4)
    assert plan.settings.acceleration_limit == 6.0 and float(plan.record.windows) > 1
    with pytest.raises(InputError, match="go with the objective 'time'"):
        gaitopt.plan_crawl(wang, short, horizon=4)


def test_freedoms_are_chosen_by_name(wang: Quadruped, short: Footholds) -> None:
    """In any order; a set without a row's name is joined."""
    plan = plan_route(wang, short, free={"height", "overlap"})
    assert isinstance(plan.settings, RouteSettings)
    assert plan.settings.free == ("overlap", "height")
    assert plan.settings.row == "overlap+height"
    assert np.ptp(plan.path.knots()[:, 2]) > 0.01
    gaitopt.verify(plan, collisions=False).raise_for_violations()


def test_a_free_order_is_never_slower(wang: Quadruped, short: Footholds) -> None:
    fixed = plan_route(wang, short, free="height")
    plan = plan_route(wang, short, free="height", sequence="free")
    assert plan.duration <= fixed.duration
    assert plan.record.orders_feasible == 7.0  # the six cycles, and the order that is searched
    gaitopt.verify(plan, collisions=False).raise_for_violations()


def test_progress_counts_steps_window_by_window(wang: Quadruped) -> None:
    """Half of each window is kept; all steps at once are done when they are done."""
    footholds = gaitopt.s_columns(1, columns=4)

    def seen(horizon: int | None, free: str = "swing") -> list[tuple[int, int]]:
        calls: list[tuple[int, int]] = []
        plan_route(wang, footholds, free=free, horizon=horizon,
                   progress=lambda done, total: calls.append((done, total)))  # fmt: skip
        return calls

    assert seen(None) == [(0, 12), (12, 12)]
    assert seen(6) == [(0, 12), (3, 12), (6, 12), (12, 12)]
    assert seen(8, "dynamic") == [(0, 12), (4, 12), (12, 12)]


def test_progress_counts_orders_and_is_passed_on(wang: Quadruped, short: Footholds) -> None:
    """The six cycles and the order that is searched; the crawl for the least time tells it, too."""
    calls: list[tuple[int, int]] = []
    gaitopt.plan_crawl(wang, short, objective="time", sequence="free", free="route",
                       progress=lambda done, total: calls.append((done, total)))  # fmt: skip
    assert calls == [(k, 7) for k in range(8)]


def test_bounds_without_coupling_lie_below_and_grow(wang: Quadruped, short: Footholds) -> None:
    """The longer the windows are the higher; one over the whole walk leaves only its start."""
    plan = plan_route(wang, short, free="swing")
    bounds = [route_bound(plan, window).sum() for window in (1, 4, 8)]
    assert np.all(np.diff(bounds) > 0)
    assert bounds[-1] < plan.duration < 1.25 * bounds[-1]
    with pytest.raises(InputError, match="window"):
        route_bound(plan, 0)
    with pytest.raises(InputError, match="route_bound takes"):
        route_bound(gaitopt.plan_crawl(wang, short))
