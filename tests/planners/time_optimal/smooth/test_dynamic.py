"""Routes with bounded accelerations: a smooth path, a ZMP inside its support, and a price."""

from __future__ import annotations

import numpy as np
import pytest

import gaitopt
from gaitopt import LEGS, Footholds, InputError, Plan, Quadruped
from gaitopt.conventions import GRAVITY
from gaitopt.optimize.route.legs import StackedLegs
from gaitopt.plan.com_margin import margins_over
from gaitopt.plan.settings.freedoms import VARIANTS
from gaitopt.plan.settings.time_optimal import RouteSettings
from gaitopt.planners.time_optimal.build import build_route
from gaitopt.planners.time_optimal.planner import plan_route
from gaitopt.planners.time_optimal.smooth.motion import SplineMotion, spline_parabolas
from gaitopt.planners.time_optimal.walk import prepare_route
from gaitopt.stability.zmp import point_mass_zmp
from gaitopt.terrain.columns import s_columns


@pytest.fixture(scope="module")
def short() -> Footholds:
    """Two cycles, eight steps."""
    return gaitopt.s_columns(3, columns=3)


@pytest.fixture(scope="module")
def dynamic(wang: Quadruped, short: Footholds) -> Plan:
    return plan_route(wang, short, free="dynamic", stability_margin=0.03)


def test_a_dynamic_walk_is_certified_and_fast(dynamic: Plan, short_plan: Plan) -> None:
    gaitopt.verify(dynamic).raise_for_violations()
    assert short_plan.duration / dynamic.duration > 3.5
    assert not dynamic.settings.static


def test_its_zmp_keeps_the_margin(dynamic: Plan) -> None:
    """From the path alone, by differences of the body centre sampled in time."""
    step = 1e-4
    times = np.linspace(2 * step, dynamic.duration - 2 * step, 3000)
    ahead, here, behind = (dynamic.at(times + k * step) for k in (1, 0, -1))
    pull = (ahead.cog - 2 * here.cog + behind.cog) / step**2
    # Where a span ends the acceleration jumps, and a difference across it is none of either.
    inside = np.abs(times[:, None] - dynamic.path.times).min(axis=1) > 2 * step
    ground = np.where(here.contacts, here.feet[..., 2], np.nan)
    # The ground lies below the centres of the feet's balls.
    level = np.nanmean(ground, axis=1) - dynamic.robot.foot_radius
    zmp = point_mass_zmp(here.cog, pull, level)
    margins = margins_over(here, zmp)
    assert margins[inside].min() >= 0.03 - 1e-4
    assert dynamic.margin == pytest.approx(margins[inside].min(), abs=2e-3)
    static = margins_over(here, here.cog)
    assert static.min() < 0.03, "the body centre itself does not keep it"


def test_joint_accelerations_are_bounded_and_used(dynamic: Plan) -> None:
    limit = dynamic.settings.acceleration_limit
    assert limit is not None
    bends = np.abs(dynamic.path.evaluate(np.linspace(0, dynamic.duration, 20001), 2)[:, 6:])
    assert 0.9 * limit < bends.max() <= limit * (1 + 1e-9)


def test_it_begins_and_ends_at_rest(dynamic: Plan) -> None:
    rates = dynamic.path.evaluate([0.0, dynamic.duration], 1)
    assert rates == pytest.approx(0.0, abs=1e-6)


def test_feet_lift_off_and_land_at_rest(dynamic: Plan) -> None:
    motion = dynamic.knots()
    velocity = np.gradient(motion.feet, motion.t, axis=0)
    for swing in dynamic.swings:
        for time in (swing.start, swing.end):
            near = dynamic.at(np.clip([time - 1e-5, time + 1e-5], 0.0, dynamic.duration))
            way = np.diff(near.feet[:, LEGS.index(swing.leg)], axis=0)
            assert np.linalg.norm(way) / 2e-5 < 1e-2
    assert np.abs(velocity).max() > 0.05


@pytest.mark.parametrize("row", ["swing", "height"])
def test_static_rows_take_an_acceleration_limit(
    wang: Quadruped, short: Footholds, row: str
) -> None:
    """At a cost in time; the tighter the limit the higher."""
    free = plan_route(wang, short, free=row)
    plans = [plan_route(wang, short, free=row, acceleration_limit=a) for a in (12.0, 4.0)]
    for plan in plans:
        gaitopt.verify(plan).raise_for_violations()
        assert plan.settings.static
    assert free.duration < plans[0].duration < plans[1].duration


def test_a_b_spline_has_its_known_derivatives() -> None:
    """Uniform spans: the curve's ends, middles and second differences are those of textbooks."""
    points = np.array([[0.0], [0.0], [1.0], [3.0], [3.0]])
    spans = np.full(5, 0.5)
    bend, slope, start = spline_parabolas(points, spans)[:, :, 0]
    assert start[2] == pytest.approx(0.5)
    assert slope[2] == pytest.approx(2.0)
    assert 2 * bend[2] == pytest.approx((3.0 - 2.0 + 0.0) / 0.25)
    middle = start[2] + slope[2] * 0.25 + bend[2] * 0.25**2
    assert middle == pytest.approx((0.0 + 6.0 * 1.0 + 3.0) / 8.0)
    ends = start + slope * spans + bend * spans**2
    assert ends[:-1] == pytest.approx(start[1:])


def test_what_cannot_be_smooth_is_refused(wang: Quadruped, short: Footholds) -> None:
    with pytest.raises(InputError, match="needs 'overlap'"):
        plan_route(wang, short, free=["swing"], acceleration_limit=5.0)
    with pytest.raises(InputError, match="dynamic walk needs"):
        plan_route(wang, short, free=["dynamic"])
    with pytest.raises(InputError, match="horizon"):
        plan_route(wang, short, free="dynamic", horizon=1)


def test_a_plan_tells_the_margin_that_its_zmp_keeps(
    wang: Quadruped, short: Footholds, dynamic: Plan
) -> None:
    """As a number; a walk that is statically stable promises nothing of the kind."""
    assert dynamic.record.zmp_margin == 0.03
    static = plan_route(wang, short, free="swing", acceleration_limit=8.0)
    assert static.record.zmp_margin is None


@pytest.mark.parametrize("row", ["dynamic", "height"])
def test_a_horizon_loses_little(wang: Quadruped, row: str) -> None:
    """Windows go on in motion; the joints keep their limits across their seams."""
    footholds = gaitopt.s_columns(1, columns=5)
    whole, near = (
        plan_route(wang, footholds, free=row, acceleration_limit=6.0, horizon=horizon)
        for horizon in (None, 8)
    )
    gaitopt.verify(near).raise_for_violations()
    assert 0.98 * whole.duration < near.duration < 1.02 * whole.duration
    assert near.record.windows == 3
    bends = np.abs(near.path.evaluate(np.linspace(0, near.duration, 20001), 2)[:, 6:])
    assert 5.4 < bends.max() <= 6.0 * (1 + 1e-9)
    assert near.path.jumps(1).max() < 1e-6


def test_windows_begin_in_motion(wang: Quadruped) -> None:
    """Where one begins the robot neither stands nor slows down: it has steps ahead."""
    plan = plan_route(wang, gaitopt.s_columns(1, columns=5), free="dynamic", horizon=8)
    speed = np.abs(plan.path.evaluate([swing.end for swing in plan.swings], 1)[:, 6:]).max(axis=1)
    seams = np.array([3, 7])
    assert (speed[seams] > 0.5 * np.median(speed[:-1])).all()
    assert speed[-1] == pytest.approx(0.0, abs=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [2, 19])
def test_terrains_that_once_failed(wang: Quadruped, seed: int) -> None:
    """All was solved, but nothing was left of the margin once the joints had their time."""
    plan = plan_route(wang, gaitopt.s_columns(seed), free="dynamic")
    gaitopt.verify(plan).raise_for_violations()
    assert plan.duration < 45.0
    assert float(plan.record.violation) <= 1e-6


@pytest.mark.parametrize("name", ["anymal_c", "wang2020-fast"])
def test_robots_with_fast_joints_walk_dynamically(name: str) -> None:
    """Tens of times as fast as wang2020, and quick enough to fall: the ground always bears load."""
    robot = gaitopt.load_robot(name)
    footholds = s_columns(1, columns=3, robot=robot)
    plan = plan_route(robot, footholds, free="dynamic", body_height=robot.standing_height)
    gaitopt.verify(plan).raise_for_violations()
    static = plan_route(robot, footholds, free="swing", body_height=robot.standing_height,
                        acceleration_limit=plan.settings.acceleration_limit)  # fmt: skip
    gaitopt.verify(static).raise_for_violations()
    assert plan.duration < 0.8 * static.duration < 2.0
    step = 1e-4
    times = np.linspace(2 * step, plan.duration - 2 * step, 3000)
    ahead, here, behind = (plan.at(times + k * step).cog[:, 2] for k in (1, 0, -1))
    assert ((ahead - 2 * here + behind) / step**2).min() > -0.85 * GRAVITY


def test_parts_of_a_motion_know_who_flies(wang: Quadruped, short: Footholds) -> None:
    """Cut anywhere within or between swings, every span has the leg of the whole."""
    settings = RouteSettings(free=VARIANTS["swing"], stance_knots=3)
    knots, _ = build_route(prepare_route(wang, short, settings))

    def motion(first: int, last: int) -> SplineMotion:
        count = last - first + 1
        return SplineMotion(wang, 0.0, StackedLegs.of(wang), knots.between(first, last),
                           np.zeros((count, 9)), np.ones(count))  # fmt: skip

    flies, leg = motion(0, 88).knots.flying_on_spans
    for first, last in ((0, 44), (9, 33), (11, 55), (20, 66), (31, 88)):
        mine, mine_leg = motion(first, last).knots.flying_on_spans
        assert np.array_equal(mine, flies[first : last + 1])
        assert np.array_equal(mine_leg[mine], leg[first : last + 1][mine])
