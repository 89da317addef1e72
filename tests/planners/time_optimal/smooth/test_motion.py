"""The spline of a smooth walk."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from gaitopt import Footholds, Quadruped
from gaitopt.motion.quadratic_spline import spline_parabolas
from gaitopt.optimize.route.legs import BODY, FOOT
from gaitopt.plan.settings.freedoms import VARIANTS
from gaitopt.plan.settings.time_optimal import RouteSettings
from gaitopt.planners.time_optimal.build import build_route
from gaitopt.planners.time_optimal.smooth.clearance import lowest_heights
from gaitopt.planners.time_optimal.smooth.guess import rough_guess
from gaitopt.planners.time_optimal.smooth.motion import SplineMotion
from gaitopt.planners.time_optimal.walk import Route, prepare_route


@pytest.fixture(scope="module")
def route(wang: Quadruped, short: Footholds) -> Route:
    settings = RouteSettings(
        free=VARIANTS["posture"], acceleration_limit=6.0, stance_knots=3, timing="velocity"
    )
    return prepare_route(wang, short, settings).window(0, 4)


@pytest.fixture(scope="module")
def motion(route: Route) -> SplineMotion:
    """The motion through the first guess of four steps."""
    knots, problem = build_route(route)
    poses, spans = rough_guess(route, problem.time_unit)
    spans = np.append(spans, spans[-1])
    return SplineMotion(route.robot, 0.0, problem.legs, knots, poses, spans)


def test_a_b_spline_has_its_known_values_and_derivatives() -> None:
    """Uniform spans: ends, middles and second differences are those of textbooks."""
    points = np.array([[0.0], [0.0], [1.0], [3.0], [3.0]])
    spans = np.full(5, 0.5)
    a, b, c = spline_parabolas(points, spans)[:, :, 0]
    assert c[2] == pytest.approx(0.5)
    assert b[2] == pytest.approx(2.0)
    assert 2 * a[2] == pytest.approx((3.0 - 2.0 + 0.0) / 0.25)
    middle = c[2] + b[2] * 0.25 + a[2] * 0.25**2
    assert middle == pytest.approx((0.0 + 6.0 * 1.0 + 3.0) / 8.0)
    ends = c + b * spans + a * spans**2
    assert ends[:-1] == pytest.approx(c[1:])


def test_a_spline_begins_and_ends_at_rest_at_its_first_and_last_point() -> None:
    points, spans = np.random.default_rng(0).normal(size=(6, 3)), np.linspace(0.2, 0.5, 6)
    a, b, c = spline_parabolas(points, spans)
    d = spans[-1]
    assert c[0] == pytest.approx(points[0]) and b[0] == pytest.approx(0.0)
    assert (a[-1] * d + b[-1]) * d + c[-1] == pytest.approx(points[-1])
    assert 2.0 * a[-1] * d + b[-1] == pytest.approx(0.0)


def test_standing_feet_do_not_slip_along_the_path(motion: SplineMotion) -> None:
    path = motion.path()
    times = np.linspace(0.0, path.times[-1], 301)[:-1]
    piece = motion.piece_at(times)
    exact = motion.values_at(times, piece)
    assert path.evaluate(times) == pytest.approx(exact, abs=1e-5)
    poses, stands = motion.poses_at(times, piece), motion.contacts(piece).flying.stands
    assert np.isfinite(exact).all() and np.isfinite(poses).all()
    assert (stands.sum(axis=1) >= 3).all()


def test_a_slower_motion_has_smaller_velocities_and_accelerations(motion: SplineMotion) -> None:
    slow = motion.slower(2.0)
    for one, other, power in zip(motion.joint_demand, slow.joint_demand, (2.0, 4.0), strict=True):
        assert one == pytest.approx(power * other, rel=1e-4, abs=1e-4)


def test_the_zmp_of_a_very_slow_motion_is_the_body_centre(motion: SplineMotion) -> None:
    slow = motion.slower(1e4)
    times, span = slow.samples
    centre = slow.poses_at(times, span)[:, BODY][:, :2].reshape(slow.zero_moment_points.shape)
    assert slow.zero_moment_points == pytest.approx(centre, abs=1e-6)
    assert slow.margins(dynamic=True) == pytest.approx(slow.margins(dynamic=False), abs=1e-6)


def test_lowest_heights_are_bounds_and_close(motion: SplineMotion, route: Route) -> None:
    """Against many samples; the middle control points are raised, so that heights are not zero."""
    radius = route.footholds.landing_radius
    poses = motion.poses.copy()
    poses[motion.knots.in_air.any(axis=1), FOOT.stop - 1] += 0.01
    motion = replace(motion, poses=poses)
    found = lowest_heights(motion, radius)
    flying = motion.knots.flying_on_spans
    for lift_off, touchdown in motion.knots.flights.tolist():
        ends = motion.knots.feet[[lift_off, touchdown], flying.leg[lift_off]]
        for span in range(lift_off, touchdown + 1):
            times = np.linspace(motion.times[span], motion.times[span + 1], 2001)
            foot = motion.poses_at(times, np.full(len(times), span))[:, FOOT]
            away = np.linalg.norm(foot[:, None, :2] - ends[:, :2], axis=2).min(axis=1)
            seen = (foot[away > radius, 2] - ends[:, 2].max()).min(initial=np.inf)
            assert found[span] <= seen + 1e-12
            if np.isfinite(seen):
                assert found[span] > seen - 2e-3
    assert np.isinf(found[~flying.flies]).all()
