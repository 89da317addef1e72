"""Continuous walks whose path and pace are one problem: rows, gains, and what is taken instead."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import gaitopt
from gaitopt import Plan
from gaitopt.errors import SolverError
from gaitopt.optimize.paced_path import PacedPathProblem, PacedRows
from gaitopt.plan.record import RouteRecord
from gaitopt.plan.settings.time_optimal import RouteSettings
from gaitopt.planners.time_optimal.continuous import paced, planner
from gaitopt.planners.time_optimal.continuous.asked import Asked
from gaitopt.planners.time_optimal.continuous.body import BalancedMotion, balanced, missing_margins
from gaitopt.planners.time_optimal.smooth.motion import SplineMotion
from gaitopt.planners.time_optimal.walk import Route, prepare_route


@cache
def route(free: str) -> Route:
    robot = gaitopt.load_robot("a1")
    footholds = gaitopt.s_columns(0, columns=2, robot=robot)
    return prepare_route(robot, footholds, RouteSettings.for_robot(robot, free=free))


@cache
def first(free: str) -> SplineMotion:
    """The motion that keeps balance, before its pace is looked at."""
    return balanced(route(free), planner._first_motion(route(free), 1.0)).motion


def rows_of(free: str, motion: SplineMotion) -> PacedRows:
    walk, asked = route(free), Asked.of(route(free), motion)
    assert asked is not None
    both = (paced._normal_rows, paced._friction_rows)
    return PacedRows.joined([of(walk, motion, asked, end) for of in both for end in (0, 1)])


def test_rows_know_what_a_path_beside_asks_for() -> None:
    """To first order: against the rows that are measured along the other path."""
    motion, rng = first("swing"), np.random.default_rng(0)
    count = len(motion.spans)
    # Smooth shifts of a few millimetres.
    shifts = 2e-3 * np.sin(np.linspace(0.0, 6.0, count)[:, None] + rng.uniform(0.0, 6.0, 2))
    poses = motion.poses.copy()
    poses[:, :2] += shifts
    here, there = rows_of("swing", motion), rows_of("swing", replace(motion, poses=poses))
    u, x = rng.uniform(-5.0, 5.0, count), rng.uniform(1.0, 4.0, (count, 2))
    padded = np.pad(shifts, ((1, 1), (0, 0)))
    around = np.concatenate([padded[:-2], padded[1:-1], padded[2:]], axis=1)[here.span]
    by = (here.by_place + here.by_first * u[here.span, None]
          + here.by_second * x[here.span, here.end][:, None])  # fmt: skip
    foreseen = (by * around).sum(axis=1)
    measured = there.values(u, x) - here.values(u, x)
    assert np.abs(measured).max() > 1e-3
    assert np.abs(foreseen - measured).max() < 0.25 * np.abs(measured).max()
    assert np.corrcoef(foreseen, measured)[0, 1] > 0.99


@pytest.mark.parametrize("free", ["swing", "dynamic"])
def test_the_other_path_is_faster_within_all_limits(free: str) -> None:
    """Judged by the timing with exact forces, along both paths."""
    walk = route(free)
    found = paced.faster(walk, first(free))
    assert found is not None
    assert not missing_margins(walk, found.motion).any()
    times = [planned(walk, motion).duration for motion in (first(free), found.motion)]
    assert times[1] < 0.95 * times[0]
    gaitopt.verify(planned(walk, found.motion), collisions=False).raise_for_violations()


@cache
def planned(walk: Route, motion: SplineMotion) -> Plan:
    found = balanced(walk, planner._first_motion(walk, 1.0))
    return planner._timed(walk, BalancedMotion(motion, found.solutions), 0.0)


def test_the_plain_path_is_taken_where_the_other_one_fails(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    walk, plain = route("swing"), planned(route("swing"), first("swing"))

    def torn(route: Route, motion: SplineMotion) -> paced.PacedMotion | None:
        found = paced.faster(route, motion)
        if found is None:
            return None
        poses = found.motion.poses.copy()
        poses[5:, 1] += 0.03
        return found._replace(motion=replace(found.motion, poses=poses))

    for other in (torn, lambda route, motion: None):
        monkeypatch.setattr(planner, "faster", other)
        plan = gaitopt.plan_route(walk.robot, walk.footholds, walk.settings)
        assert isinstance(plan.record, RouteRecord)
        assert plan.record.instead is None
        assert plan.duration == plain.duration


def test_a_walk_without_any_margin_is_continuous_and_faster() -> None:
    """The margin was the unit of lengths: with none of it the walk phase by phase was taken."""
    walk = route("swing")
    plan = gaitopt.plan_route(walk.robot, walk.footholds, free="swing", stability_margin=0.0)
    assert isinstance(plan.record, RouteRecord) and plan.record.instead is None
    assert plan.duration < planned(walk, first("swing")).duration
    gaitopt.verify(plan, collisions=False).raise_for_violations()


def test_no_motion_whose_feet_are_out_of_reach(monkeypatch: pytest.MonkeyPatch) -> None:
    away = np.array([1.0, 0.0])
    moved = PacedPathProblem.moved
    monkeypatch.setattr(PacedPathProblem, "moved", lambda self, x: moved(self, x) + away)
    assert paced.faster(route("swing"), first("swing")) is None


def test_a_motion_without_its_margin_is_refused() -> None:
    walk, motion = route("swing"), first("swing")
    poses = motion.poses.copy()
    poses[:, 1] += 0.02
    with pytest.raises(SolverError, match=r"step \d.*margin"):
        planner._check(walk, replace(motion, poses=poses))


@pytest.mark.parametrize("friction", [0.6, 0.3])
def test_rows_of_friction_have_the_normals_and_the_friction_of_footholds(friction: float) -> None:
    """At rest on a slope: what friction holds, less what the weight pulls down along it."""
    slope, robot = 0.2, gaitopt.load_robot("a1")
    points = gaitopt.s_columns(0, columns=2, robot=robot).points
    normal = np.array([-np.sin(slope), 0.0, np.cos(slope)])
    tilted = gaitopt.Footholds(
        points, normals={leg: np.tile(normal, (len(own), 1)) for leg, own in points.items()},
        friction=friction,
    )  # fmt: skip
    walk = prepare_route(
        robot, tilted, RouteSettings.for_robot(robot, free="dynamic", forces=gaitopt.ForceLimits())
    )
    motion = planner._first_motion(walk, 1.0)
    asked = Asked.of(walk, motion)
    assert asked is not None
    rows = paced._friction_rows(walk, motion, asked, 0)
    limits = paced._limits(walk)
    most = limits.friction * limits.friction_share * friction / 0.6
    feet = motion.knots.flying_on_spans.stands.sum(axis=1)[rows.span]
    room = rows.rest / asked.height.mean() + paced.FRICTION_SLACK * feet
    least = [room[rows.span == k].min() for k in range(len(motion.spans))]
    np.testing.assert_allclose(least, most * np.cos(slope) - np.sin(slope), atol=1e-9)
