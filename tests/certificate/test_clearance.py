"""The clearance of free swings: what the certificate says of good plans and planted faults."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import gaitopt
from gaitopt import LEGS, Footholds, MotionPath, Plan, Quadruped
from gaitopt.certificate.verify import verify
from gaitopt.plan.settings.time_optimal import RouteSettings
from gaitopt.planners.time_optimal.planner import plan_route


@pytest.fixture(scope="module")
def columns() -> Footholds:
    return gaitopt.s_columns(3, columns=3)


@pytest.fixture(scope="module")
def walk(wang: Quadruped, columns: Footholds) -> Plan:
    return plan_route(wang, columns, free="swing")


def test_a_good_walk_keeps_it(walk: Plan) -> None:
    check = verify(walk, collisions=False)["swing clearance"]
    assert check.status == "ok"
    assert 0.02 <= check.worst < 0.021 and check.bound < 1e-4


def test_a_larger_clearance_than_was_flown_is_found(walk: Plan) -> None:
    assert isinstance(walk.settings, RouteSettings)
    more = dataclasses.replace(walk, settings=dataclasses.replace(walk.settings, clearance=0.09))
    check = verify(more, collisions=False)["swing clearance"]
    assert check.status == "violated" and check.worst < 0.0701


def test_a_foot_that_dips_on_its_way_is_found(walk: Plan) -> None:
    """A millimetre lower between two knots, once, at the lowest knot away from the columns."""
    motion = walk.at(walk.path.times)
    radius = walk.footholds.radius
    assert radius is not None
    lowest, knot, flown = np.inf, 0, ""
    for swing in walk.swings:
        ends = np.stack([swing.foot_start, swing.foot_end])
        foot = motion.feet[:, LEGS.index(swing.leg)]
        away = np.linalg.norm(foot[:, None, :2] - ends[:, :2], axis=2).min(axis=1)
        high = foot[:, 2] - ends[:, 2].max()
        far = (motion.t > swing.start) & (motion.t < swing.end) & (away > radius + 1e-3)
        k = int(np.argmin(np.where(far, high, np.inf)))
        if far[k] and high[k] < lowest:
            lowest, knot, flown = float(high[k]), k, swing.leg
    by = lowest - 0.019
    assert 0.001 < by < 0.01
    values = walk.path.knots().copy()
    # The whole body goes down with it, so that the leg's angles may stay.
    values[knot, 2] -= by
    dipped = dataclasses.replace(walk, path=MotionPath.polyline(walk.path.times, values))
    check = verify(dipped, collisions=False)["swing clearance"]
    assert check.status == "violated" and check.where == flown
    assert check.worst == pytest.approx(0.019, abs=2e-4)
    assert check.when == pytest.approx(float(walk.path.times[knot]), abs=0.05)


def test_walks_that_promise_none_have_no_such_check(wang: Quadruped, columns: Footholds) -> None:
    for plan in (gaitopt.plan_crawl(wang, columns), plan_route(wang, columns, free="overlap")):
        assert "swing clearance" not in {c.name for c in verify(plan, collisions=False)}
