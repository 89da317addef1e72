"""Routes with bounded accelerations: a smooth path, a ZMP inside its support, and a price."""

from __future__ import annotations

import numpy as np
import pytest

import gaitopt
from gaitopt import LEGS, Footholds, InputError, Plan, Quadruped
from gaitopt.checking.balance import margins_over
from gaitopt.planning.route_crawl import plan_route
from gaitopt.planning.route_motion import _parabolas
from gaitopt.stability.zmp import point_mass_zmp


@pytest.fixture(scope="module")
def short() -> Footholds:
    """Two cycles, eight steps."""
    return gaitopt.s_columns(3, columns=3)


@pytest.fixture(scope="module")
def dynamic(wang: Quadruped, short: Footholds) -> Plan:
    return plan_route(wang, short, "dynamic", stability_margin=0.03)


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
    free = plan_route(wang, short, row)
    plans = [plan_route(wang, short, row, acceleration_limit=a) for a in (12.0, 4.0)]
    for plan in plans:
        gaitopt.verify(plan).raise_for_violations()
        assert plan.settings.static
    assert free.duration < plans[0].duration < plans[1].duration


def test_a_b_spline_has_its_known_derivatives() -> None:
    """Uniform spans: the curve's ends, middles and second differences are those of textbooks."""
    points = np.array([[0.0], [0.0], [1.0], [3.0], [3.0]])
    spans = np.full(5, 0.5)
    bend, slope, start = _parabolas(points, spans)[:, :, 0]
    assert start[2] == pytest.approx(0.5)
    assert slope[2] == pytest.approx(2.0)
    assert 2 * bend[2] == pytest.approx((3.0 - 2.0 + 0.0) / 0.25)
    middle = start[2] + slope[2] * 0.25 + bend[2] * 0.25**2
    assert middle == pytest.approx((0.0 + 6.0 * 1.0 + 3.0) / 8.0)
    ends = start + slope * spans + bend * spans**2
    assert ends[:-1] == pytest.approx(start[1:])


def test_what_cannot_be_smooth_is_refused(wang: Quadruped, short: Footholds) -> None:
    with pytest.raises(InputError, match="acceleration_limit needs"):
        plan_route(wang, short, "route", acceleration_limit=5.0)
    with pytest.raises(InputError, match="dynamic walk needs"):
        plan_route(wang, short, ["dynamic"])
    with pytest.raises(InputError, match="horizon"):
        plan_route(wang, short, "dynamic", horizon=8)
