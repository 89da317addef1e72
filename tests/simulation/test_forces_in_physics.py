"""Plans with forces in physics: followed closely, and passing where the certificate is content."""

from __future__ import annotations

import itertools

import pytest

import gaitopt
from gaitopt.simulation.simulate import simulate

pytest.importorskip("mujoco")


@pytest.mark.parametrize("name", ["a1", pytest.param("anymal_c", marks=pytest.mark.slow), "hyq"])
def test_plan_certificate_and_physics_agree(name: str) -> None:
    """a1 is light, anymal_c is at its torque limits, hyq is at its velocity limits."""
    robot = gaitopt.load_robot(name)
    plan = gaitopt.plan_crawl(robot, gaitopt.s_columns(0, columns=3, robot=robot))
    assert gaitopt.verify(plan, collisions=False).ok
    result = simulate(plan)
    assert result.passed, str(result)
    # The body is where the plan has it, and feet are where it has them, but for rolling.
    assert result.body_error < 0.02 * robot.standing_height
    assert result.landing_error < 0.5 * plan.footholds.landing_radius
    assert result.rate_use < 1.05


def test_a_foot_that_rolls_stays_near_its_foothold() -> None:
    """The balls of b1 have a radius of 40 mm: over a stance they roll by 10 mm."""
    robot = gaitopt.load_robot("b1")
    plan = gaitopt.plan_crawl(robot, gaitopt.s_columns(0, columns=3, robot=robot))
    result = simulate(plan)
    assert result.passed, str(result)
    assert result.slip > 0.006
    assert result.landing_error < 0.008


def test_a_walk_along_splines_is_walked_without_a_stop() -> None:
    robot = gaitopt.load_robot("wang2020-fast")
    plan = gaitopt.plan_route(robot, gaitopt.s_columns(0, columns=3, robot=robot), free="swing")
    assert plan.record.instead is None and plan.settings.static
    result = simulate(plan)
    assert result.passed, str(result)
    assert result.waited == 0.0
    assert result.body_error < 0.02 * robot.standing_height


def test_a_foot_that_lands_and_lifts_off_again_at_once_stands_between() -> None:
    """In the free order a leg may step twice in a row, without a stance phase between."""
    robot = gaitopt.load_robot("go2")
    columns = gaitopt.s_columns(seed=1, columns=3, robot=robot)
    plan = gaitopt.plan_crawl(robot, columns, sequence="free")
    steps = [(swing.leg, swing.start, swing.end) for swing in plan.swings]
    again = [
        (before, after)
        for before, after in itertools.pairwise(steps)
        if before[0] == after[0] and after[1] - before[2] < 1e-9
    ]
    assert again
    result = simulate(plan)
    assert result.passed, str(result)
    # The clock waits at each of these landings.
    assert result.waited >= 0.05 * len(again)


@pytest.mark.parametrize("name", ["anymal_c", pytest.param("hyq", marks=pytest.mark.slow)])
def test_a_walk_of_the_largest_margin_is_followed(name: str) -> None:
    """Its body moves far while four feet stand."""
    robot = gaitopt.load_robot(name)
    columns = gaitopt.s_columns(seed=3, columns=3, robot=robot)
    plan = gaitopt.plan_crawl(robot, columns, objective="margin")
    assert plan.settings.promised_forces == gaitopt.ForceLimits(friction=0.3)
    assert gaitopt.verify(plan, collisions=False).ok
    result = simulate(plan)
    assert result.passed, str(result)
