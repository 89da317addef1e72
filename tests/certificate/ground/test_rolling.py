"""How far feet roll on their footholds, against the controller's own formula."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import gaitopt
from gaitopt import LEGS, Footholds, HeightMap, Plan, Quadruped
from gaitopt.certificate.ground.rolling import NAME, rolling_feet
from gaitopt.certificate.trace import trace
from gaitopt.motion.rolling import rolled_away


@pytest.fixture(scope="module")
def walk(wang: Quadruped) -> Plan:
    points = gaitopt.s_columns(3, columns=3).raised(wang.foot_radius).points
    ground = HeightMap(np.zeros((71, 71)), 0.02, (-0.6, -0.6))
    return gaitopt.plan_crawl(wang, Footholds(points, ground=ground), timing="velocity")


def half_way(plan: Plan) -> float:
    """Half of the longest way by Jacobians, every 2 ms [m]."""
    times = np.arange(0.0, plan.duration, 0.002)
    at = plan.at(times)
    away = rolled_away(plan.robot, at.q, at.v, np.array(at.contacts), 0.002)
    worst = 0.0
    for k, leg in enumerate(LEGS):
        for swing in (s for s in plan.swings if s.leg == leg):
            later = [s.start for s in plan.swings if s.leg == leg and s.start > swing.start]
            own = (times > swing.end) & (times < min([*later, plan.duration]))
            worst = max(worst, float(np.linalg.norm(away[own, k], axis=1).max(initial=0.0)))
    return worst


def test_half_of_the_way_is_that_of_the_controller(walk: Plan) -> None:
    check = gaitopt.verify(walk, collisions=False)[NAME]
    assert check.status == "ok" and check.limit == walk.footholds.landing_radius
    expected = half_way(walk)
    assert expected > 0.1 * walk.robot.foot_radius
    # What may lie between the ends of the pieces is added.
    assert expected - 1e-4 < check.worst < 1.1 * expected + 1e-4


def test_larger_feet_roll_farther_and_too_far_is_violated(walk: Plan) -> None:
    motion = trace(walk)
    own = rolling_feet(walk, motion).worst
    times = 1.05 * walk.footholds.landing_radius / own
    large = gaitopt.load_robot("wang2020", foot_radius=times * walk.robot.foot_radius)
    check = rolling_feet(dataclasses.replace(walk, robot=large), motion)
    assert check.worst == pytest.approx(times * own) and check.status == "violated"


def test_a_swing_to_a_foothold_that_there_is_not_is_violated_and_no_crash(walk: Plan) -> None:
    """A phase in which LF does not stand makes one swing more than it has footholds for."""
    upright = {leg: np.tile([0.0, 0.0, 1.0], (len(walk.footholds[leg]), 1)) for leg in LEGS}
    phases = list(walk.phases)
    # Not beside a flight of its own, which would last longer.
    shift = next(
        k for k in range(1, len(phases) - 1)
        if len(phases[k].support) == 4
        and "LF" in phases[k - 1].support and "LF" in phases[k + 1].support
    )  # fmt: skip
    phases[shift] = dataclasses.replace(phases[shift], support=("LH", "RH", "RF"))
    more = dataclasses.replace(
        walk, phases=tuple(phases), footholds=walk.footholds.with_(normals=upright)
    )
    lf = [swing.index for swing in more.swings if swing.leg == "LF"]
    assert lf[-1] + 1 == len(walk.footholds["LF"])
    found = gaitopt.verify(more, collisions=False)
    assert found["contact sequence"].status == "violated"
    assert found[NAME].status == "ok"
