"""Legs without roll joint walk straight ahead over footholds in their planes."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest

import gaitopt
from gaitopt import LEGS, Footholds, Plan, Quadruped, plan_crawl, s_columns
from gaitopt.certificate.certificate import Outcome
from gaitopt.conventions import rotation_z
from gaitopt.optimize.cog.solver import build_cog_problem, solve_cog
from gaitopt.robots.leg_planes import foot_planes


@pytest.fixture(scope="module")
def solo() -> Quadruped:
    return gaitopt.load_robot("solo8", velocity_limits=20.0, effort_limits=2.7)


@pytest.fixture(scope="module")
def columns(solo: Quadruped) -> Footholds:
    return s_columns(0, columns=2, robot=solo)


@pytest.fixture(scope="module")
def walk(solo: Quadruped, columns: Footholds) -> Plan:
    return plan_crawl(solo, columns)


def test_columns_for_such_a_robot_lie_in_its_legs_planes(solo: Quadruped) -> None:
    planes = foot_planes(solo)
    assert planes is not None
    points = s_columns(3, columns=5, robot=solo)
    for leg, plane in zip(LEGS, planes, strict=True):
        assert points[leg][:, 1] == pytest.approx(np.full(5, plane), abs=1e-12)
        assert np.ptp(np.diff(points[leg][:, 0])) > 1e-3  # moved at random along the way


def test_the_walk_is_certified_with_contact_forces(walk: Plan) -> None:
    certificate = gaitopt.verify(walk)
    assert certificate.outcome is Outcome.CERTIFIED, certificate
    base = walk.path.evaluate(np.linspace(0.0, walk.duration, 101))
    assert np.abs(base[:, [3, 4, 5]]).max() == 0.0
    assert np.ptp(base[:, 1]) < 1e-12  # straight ahead
    assert np.ptp(base[:, 0]) > 0.02


def test_it_passes_in_physics(walk: Plan) -> None:
    pytest.importorskip("mujoco")
    result = gaitopt.simulate(walk)
    assert result.passed, result


def test_the_body_goes_to_the_nearest_place_on_its_line(solo: Quadruped) -> None:
    """The line cuts the shrunken support triangle in an interval, by plane geometry alone."""
    planes, rng = foot_planes(solo), np.random.default_rng(5)
    assert planes is not None
    margin, tried = 0.015, 0
    for _ in range(30):
        feet = {
            leg: np.array([one.hip[0] + rng.uniform(-0.03, 0.03), plane, 0.0])
            for (leg, one), plane in zip(solo.legs.items(), planes, strict=True)
        }
        swing = LEGS[rng.integers(4)]
        target = feet[swing] + [0.03, 0.0, 0.0]
        start = np.array([rng.uniform(-0.05, 0.05), 0.0])
        found = solve_cog(
            build_cog_problem(
                solo, feet, 0.2, start, swing=swing, foothold=target, stability_margin=margin
            )
        )
        corners = [feet[leg][:2] for leg in LEGS if leg != swing]
        x = np.linspace(-0.3, 0.3, 600_001)
        inside = np.ones(len(x), dtype=bool)
        for a, b in combinations(corners, 2):
            c = next(p for p in corners if p is not a and p is not b)
            normal = np.array([-(b - a)[1], (b - a)[0]]) / np.hypot(*(b - a))
            normal *= np.sign(normal @ (c - a))
            inside &= (x - a[0]) * normal[0] - a[1] * normal[1] >= margin
        nearest = x[inside][np.abs(x[inside] - start[0]).argmin()]
        assert found.solved
        assert found.position == pytest.approx([nearest, 0.0], abs=2e-6)
        tried += nearest != start[0]
    assert tried > 5


def test_a_walk_in_another_direction_is_the_same_walk_turned(
    solo: Quadruped, columns: Footholds
) -> None:
    """Timed by velocities: the pyramids of friction do not turn with the walk."""
    turn, away = rotation_z(0.7).T, np.array([0.3, -0.2, 0.0])
    turned = columns.with_(points={leg: columns[leg] @ turn + away for leg in LEGS})
    walk = plan_crawl(solo, columns, timing="velocity")
    other = plan_crawl(solo, turned, heading=0.7, timing="velocity")
    assert other.duration == pytest.approx(walk.duration, rel=1e-6)
    times = np.linspace(0.0, walk.duration, 21)
    there = walk.at(times).feet @ turn + away
    assert other.at(times).feet == pytest.approx(there, abs=1e-5)


def test_footholds_written_with_four_digits_are_put_into_the_planes(
    solo: Quadruped, columns: Footholds
) -> None:
    written = Footholds({leg: np.round(columns[leg], 4) for leg in LEGS})
    plan = plan_crawl(solo, written)
    planes = foot_planes(solo)
    assert planes is not None
    for leg, plane in zip(LEGS, planes, strict=True):
        assert np.ptp(plan.footholds[leg][:, 1] - plane) < 1e-12
        assert plan.footholds[leg] == pytest.approx(written[leg], abs=1.1e-4)


def test_what_such_a_robot_cannot_do_is_refused_with_the_way_out(
    solo: Quadruped, columns: Footholds
) -> None:
    aside = {leg: np.array(columns[leg]) for leg in LEGS}
    aside["RF"][1, 1] -= 0.01
    with pytest.raises(gaitopt.InputError, match=r"RF .* foothold 1 .* 0\.01 m beside .*s_columns"):
        plan_crawl(solo, Footholds(aside))
    postures = np.tile([0.2, 0.0, 0.05, 0.0], (5, 1))
    order = ("RH", "RF", "LH", "LF")
    assert plan_crawl(solo, columns.with_(order=order, postures=postures)).duration > 0.0
    postures[2, 1] = 0.1
    with pytest.raises(gaitopt.InputError, match=r"posture 2 rolls .* let postures .* pitch only"):
        plan_crawl(solo, columns.with_(order=order, postures=postures))
    with pytest.raises(gaitopt.InputError, match=r"no roll joint.*plan_crawl without"):
        plan_crawl(solo, columns, objective="time")


def test_it_finds_an_order_of_legs_and_begins_in_motion(
    solo: Quadruped, columns: Footholds, walk: Plan
) -> None:
    free = plan_crawl(solo, columns, sequence="free")
    assert gaitopt.verify(free).outcome is Outcome.CERTIFIED
    now = 0.4 * walk.duration
    on = plan_crawl(solo, walk.footholds_ahead(now), start=walk.state(now))
    assert gaitopt.verify(on).outcome is Outcome.CERTIFIED
