"""Smooth walks: a ZMP inside its support, bounded accelerations, and what they cost."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np
import pytest

import gaitopt
from gaitopt import LEGS, Footholds, Plan, Quadruped, plan_route
from gaitopt.conventions import GRAVITY
from gaitopt.plan.com_margin import margins_over
from gaitopt.planners.time_optimal.smooth.build import LEAST_LOAD_SHARE
from gaitopt.stability.zmp import point_mass_zmp
from gaitopt.terrain.columns import s_columns

MARGIN = 0.03


@pytest.fixture(scope="module")
def dynamic(wang: Quadruped, short: Footholds) -> Plan:
    return plan_route(wang, short, free="dynamic", stability_margin=MARGIN, timing="velocity")


def test_a_dynamic_walk_is_certified_and_fast(dynamic: Plan, short_plan: Plan) -> None:
    gaitopt.verify(dynamic).raise_for_violations()
    assert short_plan.duration / dynamic.duration > 3.5
    assert not dynamic.settings.static


def test_the_zmp_keeps_the_margin(dynamic: Plan) -> None:
    """From the path alone, by differences of the body centre sampled in time."""
    step = 1e-4
    times = np.linspace(2 * step, dynamic.duration - 2 * step, 3000)
    after, now, before = (dynamic.at(times + k * step) for k in (1, 0, -1))
    acceleration = (after.cog - 2 * now.cog + before.cog) / step**2
    # Where a span ends the acceleration jumps, and a difference across it is none of either.
    inside = np.abs(times[:, None] - dynamic.path.times).min(axis=1) > 2 * step
    ground = np.where(now.contacts, now.feet[..., 2], np.nan)
    # The ground lies below the centres of the feet's balls.
    level = np.nanmean(ground, axis=1) - dynamic.robot.foot_radius
    zmp = point_mass_zmp(now.cog, acceleration, level)
    margins = margins_over(now, zmp)
    assert margins[inside].min() >= MARGIN - 1e-4
    assert dynamic.margin == pytest.approx(margins[inside].min(), abs=2e-3)
    static = margins_over(now, now.cog)
    assert static.min() < MARGIN, "the body centre itself does not keep it"


def largest_acceleration(plan: Plan) -> float:
    """Largest joint acceleration at many samples [rad/s^2]."""
    times = np.linspace(0.0, plan.duration, 20001)
    return float(np.abs(plan.path.evaluate(times, 2)[:, 6:]).max())


def test_joint_accelerations_are_bounded_and_used(dynamic: Plan) -> None:
    limit = dynamic.settings.acceleration_limit
    assert limit is not None
    assert 0.9 * limit < largest_acceleration(dynamic) <= limit * (1 + 1e-9)


def test_a_dynamic_walk_begins_and_ends_at_rest(dynamic: Plan) -> None:
    velocities = dynamic.path.evaluate([0.0, dynamic.duration], 1)
    assert velocities == pytest.approx(0.0, abs=1e-6)


def test_feet_lift_off_and_land_at_rest(dynamic: Plan) -> None:
    for swing in dynamic.swings:
        foot, middle = LEGS.index(swing.leg), (swing.start + swing.end) / 2.0
        for time, least, most in ((swing.start, 0.0, 0.01), (middle, 0.05, np.inf),
                                  (swing.end, 0.0, 0.01)):  # fmt: skip
            near = dynamic.at(np.clip([time - 1e-5, time + 1e-5], 0.0, dynamic.duration))
            speed = np.linalg.norm(np.diff(near.feet[:, foot], axis=0)) / 2e-5
            assert least <= speed < most


@pytest.mark.parametrize("variant", ["swing", pytest.param("height", marks=pytest.mark.slow)])
def test_a_stricter_acceleration_limit_costs_more_time(
    plans: dict[str, Plan], wang: Quadruped, short: Footholds, variant: str
) -> None:
    loose, strict = (
        plan_route(wang, short, free=variant, acceleration_limit=a, timing="velocity")
        for a in (12.0, 4.0)
    )
    for plan in (loose, strict):
        gaitopt.verify(plan).raise_for_violations()
        assert plan.settings.static
    assert plans[variant].duration < loose.duration < strict.duration


def test_a_plan_tells_the_margin_that_its_zmp_keeps(
    wang: Quadruped, short: Footholds, dynamic: Plan
) -> None:
    """As a number; a walk that is statically stable promises nothing of the kind."""
    assert dynamic.record.zmp_margin == MARGIN
    static = plan_route(wang, short, free="swing", acceleration_limit=8.0, timing="velocity")
    assert static.record.zmp_margin is None


@pytest.fixture(scope="module")
def in_windows(wang: Quadruped) -> Callable[[str, int | None], Plan]:
    """Twelve steps by variant and horizon, with accelerations up to 6 rad/s^2."""
    footholds = gaitopt.s_columns(1, columns=4)
    return cache(
        lambda variant, horizon: plan_route(
            wang,
            footholds,
            free=variant,
            acceleration_limit=6.0,
            horizon=horizon,
            timing="velocity",
        )
    )


@pytest.mark.parametrize("variant", ["dynamic", pytest.param("height", marks=pytest.mark.slow)])
def test_a_horizon_loses_little_time(
    in_windows: Callable[[str, int | None], Plan], variant: str
) -> None:
    """Windows go on in motion, and the joints keep their limits where two of them meet."""
    whole, near = in_windows(variant, None), in_windows(variant, 6)
    gaitopt.verify(near).raise_for_violations()
    assert 0.98 * whole.duration < near.duration < 1.02 * whole.duration
    assert near.record.windows == 3
    assert 5.4 < largest_acceleration(near) <= 6.0 * (1 + 1e-9)
    assert near.path.jumps(1).max() < 1e-6


def test_windows_begin_in_motion(in_windows: Callable[[str, int | None], Plan]) -> None:
    """Where one begins the robot neither stands nor slows down: it has steps ahead."""
    plan = in_windows("dynamic", 6)
    speed = np.abs(plan.path.evaluate([swing.end for swing in plan.swings], 1)[:, 6:]).max(axis=1)
    last_kept = np.array([2, 5])
    assert (speed[last_kept] > 0.5 * np.median(speed[:-1])).all()
    assert speed[-1] == pytest.approx(0.0, abs=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [2, 19])
def test_terrains_that_once_failed_are_certified(wang: Quadruped, seed: int) -> None:
    """Their solutions lost the margin once the motion was stretched to what its joints need."""
    plan = plan_route(wang, gaitopt.s_columns(seed), free="dynamic", timing="velocity")
    gaitopt.verify(plan).raise_for_violations()
    assert plan.duration < 45.0
    assert float(plan.record.violation) <= 1e-6


@pytest.mark.parametrize(
    ("name", "columns"),
    [pytest.param("anymal_c", 3, marks=pytest.mark.slow), ("wang2020-fast", 2)],
)
def test_robots_with_fast_joints_walk_dynamically(name: str, columns: int) -> None:
    """Tens of times as fast as wang2020, and quick enough to fall: the ground always bears load."""
    robot = gaitopt.load_robot(name)
    footholds = s_columns(4, columns=columns, robot=robot)
    plan = plan_route(
        robot, footholds, free="dynamic", body_height=robot.standing_height, timing="velocity"
    )
    gaitopt.verify(plan).raise_for_violations()
    static = plan_route(
        robot,
        footholds,
        free="swing",
        body_height=robot.standing_height,
        acceleration_limit=plan.settings.acceleration_limit,
        timing="velocity",
    )
    gaitopt.verify(static).raise_for_violations()
    assert plan.duration < 0.8 * static.duration < 2.0
    step = 1e-4
    times = np.linspace(2 * step, plan.duration - 2 * step, 3000)
    after, now, before = (plan.at(times + k * step).cog[:, 2] for k in (1, 0, -1))
    least = ((after - 2 * now + before) / step**2).min()
    assert least > -(1.0 - LEAST_LOAD_SHARE + 0.05) * GRAVITY
