"""Walks whose contact forces and joint torques are promised, and certified."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

import gaitopt
from gaitopt import ForceLimits, InputError, Plan, RouteSettings
from gaitopt.dynamics.contacts import TorqueLine

LIMITS = ForceLimits()


@pytest.fixture(scope="module")
def walk() -> Plan:
    """Four steps of the paper's robot with fast joints: forces hold it back, not joints."""
    robot = gaitopt.load_robot("wang2020-fast")
    return gaitopt.plan_crawl(robot, gaitopt.s_columns(0, columns=2), forces=LIMITS)


def test_forces_are_promised_and_certified(walk: Plan) -> None:
    assert walk.settings.promised_forces == LIMITS and walk.settings.true_com
    certificate = gaitopt.verify(walk)
    assert certificate.outcome == "certified", certificate.report()
    assert certificate["contact forces"].promised


@pytest.mark.parametrize("name", ["a1", "go2", "anymal_c"])
def test_robots_that_people_own_get_forces_too(name: str) -> None:
    robot = gaitopt.load_robot(name)
    plan = gaitopt.plan_crawl(robot, gaitopt.s_columns(0, columns=2, robot=robot), forces=LIMITS)
    certificate = gaitopt.verify(plan, collisions=False)
    assert certificate.ok, certificate.report()


def test_forces_cost_time_where_joints_are_quick(walk: Plan) -> None:
    kinematic = gaitopt.plan_crawl(
        walk.robot, walk.footholds, objective="time", free="route", timing="velocity"
    )
    assert walk.duration > 1.5 * kinematic.duration
    assert gaitopt.verify(kinematic, forces=LIMITS).outcome == "kinematics only"


def test_a_promise_that_is_not_kept_is_a_violation(walk: Plan) -> None:
    """Asked for half the friction that it was planned with."""
    settings: Any = replace(walk.settings, forces=replace(LIMITS, friction=0.3))  # type: ignore[call-arg]
    certificate = gaitopt.verify(replace(walk, settings=settings), collisions=False)
    assert certificate.outcome == "violated"
    assert [c.name for c in certificate.violations] == ["contact forces"]


def test_what_is_asked_beyond_the_promise_is_no_violation(walk: Plan) -> None:
    certificate = gaitopt.verify(walk, forces=replace(LIMITS, friction=0.3))
    assert certificate.ok and certificate.outcome == "kinematics only"


def test_the_promise_survives_the_plan_s_file(walk: Plan, tmp_path: Path) -> None:
    limits = replace(LIMITS, torque_line=TorqueLine(0.5, 1.0))
    settings: Any = replace(walk.settings, forces=limits)  # type: ignore[call-arg]
    planned = replace(walk, settings=settings)
    planned.save(tmp_path / "plan.npz")
    assert gaitopt.load_plan(tmp_path / "plan.npz").settings == planned.settings


def test_where_the_robot_cannot_even_rest_the_limits_in_the_way_are_named(walk: Plan) -> None:
    weak = replace(LIMITS, torque_share=0.02)
    with pytest.raises(gaitopt.InfeasibleStepError, match=r"at rest: .*torque LF_HFE") as caught:
        gaitopt.plan_crawl(walk.robot, walk.footholds, forces=weak)
    assert caught.value.step == 0 and "torque" in " ".join(caught.value.conflicts)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"forces": LIMITS, "timing": "velocity"}, "limits of the timing 'forces'"),
        ({"forces": 0.6}, "forces must be ForceLimits or None"),
        ({"forces": {"friction": 0.6, "luck": 1.0}}, "no force limits"),
    ],
)
def test_settings_that_make_no_sense_are_refused(options: dict[str, object], words: str) -> None:
    with pytest.raises(InputError, match=words):
        RouteSettings(**options)  # type: ignore[arg-type]
