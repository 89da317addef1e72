"""Continuous walks: robots with quick joints, whose body moves on while feet fly."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import gaitopt
from gaitopt import LEGS, Footholds, Plan, Quadruped
from gaitopt.plan.record import RouteRecord
from gaitopt.robots.abilities import has_quick_joints

ROBOTS = ("a1", "anymal_c", "solo12")


@cache
def ground(name: str) -> Footholds:
    return gaitopt.s_columns(0, columns=3, robot=gaitopt.load_robot(name))


@cache
def walk(name: str, free: str) -> Plan:
    return gaitopt.plan_route(gaitopt.load_robot(name), ground(name), free=free)


@cache
def boxes(name: str) -> Plan:
    return gaitopt.plan_crawl(gaitopt.load_robot(name), ground(name))


@pytest.mark.parametrize("name", ROBOTS)
@pytest.mark.parametrize("free", ["swing", "dynamic"])
def test_promises_are_kept_and_the_walk_is_faster(name: str, free: str) -> None:
    plan = walk(name, free)
    assert isinstance(plan.record, RouteRecord)
    assert plan.record.instead is None
    gaitopt.verify(plan, collisions=False).raise_for_violations()
    assert boxes(name).duration / plan.duration > (1.6 if free == "dynamic" else 1.2)


def test_a_static_walk_keeps_its_margin_of_the_true_com() -> None:
    plan = walk("a1", "swing")
    check = gaitopt.verify(plan, collisions=False)["margin of the true COM"]
    assert check.status == "ok"
    assert plan.settings.static
    dynamic = walk("a1", "dynamic")
    assert not dynamic.settings.static
    assert dynamic.duration < plan.duration


def test_the_body_moves_while_feet_fly() -> None:
    for free in ("swing", "dynamic"):
        plan = walk("a1", free)
        speeds = []
        for swing in plan.swings[1:-1]:
            middle = (swing.start + swing.end) / 2.0
            near = plan.at([middle - 1e-3, middle + 1e-3])
            speeds.append(np.linalg.norm(np.diff(near.cog, axis=0)) / 2e-3)
        assert min(speeds) > 0.02


def test_feet_keep_the_clearance_outside_their_columns() -> None:
    plan = walk("a1", "dynamic")
    radius, clearance = plan.footholds.landing_radius, plan.settings.clearance
    for swing in plan.swings:
        foot = plan.at(np.linspace(swing.start, swing.end, 500)).feet[:, LEGS.index(swing.leg)]
        ends = np.stack([swing.foot_start, swing.foot_end])
        away = np.linalg.norm(foot[:, None, :2] - ends[:, :2], axis=2).min(axis=1)
        heights = foot[away > radius, 2] - ends[:, 2].max()
        assert heights.min() >= clearance


def test_slow_joints_set_the_pace_themselves() -> None:
    for name, quick in (("wang2020", False), ("a1", True), ("anymal_c", True)):
        assert has_quick_joints(gaitopt.load_robot(name)) is quick


def test_the_margin_may_be_that_of_the_body_centre() -> None:
    """As asked for: it is kept, and that of the true centre of mass is another one."""
    robot = gaitopt.load_robot("a1")
    plan = gaitopt.plan_route(robot, ground("a1"), free="swing", com="body")
    certificate = gaitopt.verify(plan, collisions=False)
    certificate.raise_for_violations()
    assert certificate["margin of the body centre"].worst >= plan.settings.stability_margin - 1e-9
    assert min(p.margin for p in plan.phases if p.kind == "swing") == pytest.approx(
        plan.settings.stability_margin, abs=2e-3
    )


def test_accelerations_are_limited_if_asked_for() -> None:
    robot = gaitopt.load_robot("a1")
    plan = gaitopt.plan_route(robot, ground("a1"), free="swing", acceleration_limit=150.0)
    gaitopt.verify(plan, collisions=False).raise_for_violations()
    times = np.linspace(0.0, plan.duration, 20001)
    assert np.abs(plan.path.evaluate(times, 2)[:, 6:]).max() <= 150.0 * (1.0 + 1e-9)
    assert plan.duration > walk("a1", "swing").duration


def test_a_walk_that_is_not_found_is_explained() -> None:
    """Feet that have to be at the top when they leave narrow columns: a box does this, no spline.

    The walk phase by phase is taken, and its record says why.
    """
    robot = gaitopt.load_robot("a1")
    narrow = replace(ground("a1"), radius=1e-3)
    plan = gaitopt.plan_route(robot, narrow, free="swing", swing_height=0.05, clearance=0.05)
    assert isinstance(plan.record, RouteRecord)
    assert plan.record.instead is not None
    assert "clearance" in plan.record.instead
    # A ball rolls by more than the radius of such a column.
    violations = gaitopt.verify(plan, collisions=False).violations
    assert [check.name for check in violations] == ["rolling of standing feet"]
    # Its corners are not rounded, as a rounded box is lower where it leaves the column.
    assert plan.duration > gaitopt.plan_crawl(robot, narrow, swing_height=0.05).duration


def test_no_margin_at_all_is_no_slower() -> None:
    """A margin that forces may need is not kept where the walk has forces without it."""
    robot = gaitopt.load_robot("a1")
    plan = gaitopt.plan_route(robot, ground("a1"), free="swing", stability_margin=0.0)
    assert isinstance(plan.record, RouteRecord) and plan.record.instead is None
    assert plan.settings.stability_margin == 0.0
    certificate = gaitopt.verify(plan, collisions=False)
    # No margin is too weak a promise to certify, and all that is promised holds.
    assert (certificate.ok, certificate.outcome) == (True, "not all checked")
    assert plan.duration < walk("a1", "swing").duration


def test_no_margin_at_all_leaves_what_the_least_forces_of_feet_need(wang: Quadruped) -> None:
    """The path has no forces else, and the walk phase by phase would take its place."""
    columns = gaitopt.s_columns(0, columns=2)
    plan = gaitopt.plan_route(wang, columns, free="swing", stability_margin=0.0)
    assert isinstance(plan.record, RouteRecord) and plan.record.instead is None
    assert plan.settings.stability_margin == 0.0
    assert gaitopt.verify(plan, collisions=False)["margin of the true COM"].worst > 0.005
