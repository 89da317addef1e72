"""Settings that say almost nothing are refused, or keep a plan from being certified."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import Any

import pytest

import gaitopt
from gaitopt import Footholds, InputError, Plan, Quadruped
from gaitopt.certificate.check import Verdict
from gaitopt.dynamics.contacts import ForceLimits, TorqueLine


@pytest.fixture(scope="module")
def still(wang: Quadruped) -> Plan:
    """A robot that stands still, with forces: the shortest plan that is certified."""
    return gaitopt.plan_crawl(wang, gaitopt.s_columns(0, columns=1))


def test_standing_still_is_certified(still: Plan) -> None:
    certificate = gaitopt.verify(still)
    assert certificate.outcome == "certified"
    assert {check.name for check in certificate}.isdisjoint({"settings", "joint torques"})


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"stability_margin": 0.0}, "a stability margin of 0 m"),
        ({"forces": ForceLimits(friction=1.6)}, "a friction of 1.6"),
        ({"forces": ForceLimits(balance_tolerance=0.05)}, "a balance tolerance of 0.05"),
        ({"forces": ForceLimits(reserve=0.0)}, "a reserve of 0 of the weight"),
        ({"forces": ForceLimits(reserve_on_four=1e-6)}, "a reserve on four feet of 1e-06"),
    ],
    ids=lambda x: x if isinstance(x, str) else "",
)
def test_a_weak_promise_is_told_and_not_certified(
    still: Plan, changes: dict[str, Any], words: str
) -> None:
    weak = replace(still, settings=replace(still.settings, **changes))
    certificate = gaitopt.verify(weak)
    assert certificate.ok and certificate.outcome == "not all checked"
    check = certificate["settings"]
    assert check.status is Verdict.UNCHECKED and words in check.note


def test_weak_limits_that_are_asked_for_are_told(still: Plan) -> None:
    certificate = gaitopt.verify(still, forces=ForceLimits(friction=5.0))
    assert certificate.outcome == "not all checked"
    assert "a friction of 5 is more than 1.5" in certificate["settings"].note


def test_huge_columns_are_told(still: Plan) -> None:
    wide = replace(still, footholds=Footholds(dict(still.footholds.points), radius=1.0))
    certificate = gaitopt.verify(wide)
    assert certificate.outcome == "not all checked"
    assert "feet may land 1 m from their footholds" in certificate["settings"].note


def test_a_foot_that_need_not_rise_is_told(short_plan: Plan) -> None:
    flat = replace(short_plan, settings=replace(short_plan.settings, swing_height=0.0))
    certificate = gaitopt.verify(flat, collisions=False)
    assert "a swing height of 0 m" in certificate["settings"].note


def test_footholds_that_grip_too_well_are_told(still: Plan) -> None:
    sticky = replace(still, footholds=still.footholds.with_(friction=2.0))
    certificate = gaitopt.verify(sticky)
    assert certificate.outcome != "certified"
    assert "a foothold's friction of 2 is more than 1.5" in certificate["settings"].note


def test_swings_that_need_not_rise_are_told_by_leg(short_plan: Plan) -> None:
    heights = {leg: [0.07, 0.07] for leg in gaitopt.LEGS} | {"RH": [0.07, 0.0]}
    footholds = short_plan.footholds.with_(swing_heights=heights)
    certificate = gaitopt.verify(replace(short_plan, footholds=footholds), collisions=False)
    assert "a swing height of 0 m" in certificate["settings"].note


def test_feet_as_large_as_legs_are_told(wang: Quadruped) -> None:
    """What lies within the ball of a foot is not held against the ground."""
    large = wang.urdf.replace('<sphere radius="0.015"/>', '<sphere radius="0.2"/>')
    robot = Quadruped.from_urdf(large, "balls")
    assert robot.foot_radius == 0.2
    points = gaitopt.s_columns(0, columns=1).points
    plan = gaitopt.plan_crawl(robot, Footholds(points), timing="velocity")
    assert "feet are balls of 0.2 m" in gaitopt.verify(plan, collisions=False)["settings"].note


def test_a_zmp_margin_that_a_plan_states_of_itself_is_told() -> None:
    """A trot's ZMP is beside the line of its two feet: what a plan says of that proves nothing."""
    trot = gaitopt.plan_gait(
        gaitopt.load_robot("a1"), gaitopt.trot(0.5), velocity=0.3, duration=0.5, timing="velocity"
    )
    assert trot.record.zmp_margin is not None and trot.record.zmp_margin < 0.0
    far = replace(trot, record=replace(trot.record, zmp_margin=-1e9))
    for plan in (trot, far):
        certificate = gaitopt.verify(plan, collisions=False)
        assert certificate.ok and certificate.outcome == "kinematics only"
        assert "is the plan's own statement" in certificate["settings"].note


def test_torques_without_known_limits_are_never_certified(still: Plan) -> None:
    """wang2020 with placeholders as effort limits: its check of forces holds, but says less."""
    urdf = re.sub('effort="[^"]*"', 'effort="1000"', still.robot.urdf)
    certificate = gaitopt.verify(replace(still, robot=Quadruped.from_urdf(urdf, "placeholders")))
    assert certificate["contact forces"].status is Verdict.OK
    assert certificate.outcome == "not all checked"
    check = certificate["joint torques"]
    assert check.status is Verdict.UNCHECKED and "LF_HAA" in check.note and check.promised


def test_velocity_limits_that_are_placeholders_are_told(still: Plan) -> None:
    urdf = re.sub('velocity="[^"]*"', 'velocity="1000"', still.robot.urdf)
    certificate = gaitopt.verify(replace(still, robot=Quadruped.from_urdf(urdf, "quick")))
    assert certificate.outcome == "not all checked"
    assert "LF_HAA" in certificate["velocity limits"].note


def test_limits_that_are_given_at_loading_are_known() -> None:
    solo = gaitopt.load_robot("solo12", velocity_limits=10.0, effort_limits=2.5)
    still = gaitopt.plan_crawl(solo, gaitopt.s_columns(0, columns=1, robot=solo))
    names = {check.name for check in gaitopt.verify(still, collisions=False)}
    assert names.isdisjoint({"settings", "joint torques", "velocity limits"})


@pytest.mark.parametrize("value", [float("nan"), float("inf"), -1.0, 0.0, 11.0])
def test_a_friction_that_no_ground_has_is_refused(value: float) -> None:
    with pytest.raises(InputError, match="friction"):
        ForceLimits(friction=value)


@pytest.mark.parametrize("name", ["reserve", "reserve_on_four", "torque_share"])
@pytest.mark.parametrize("value", [float("nan"), -0.01, 1.01])
def test_shares_that_mean_nothing_are_refused(name: str, value: float) -> None:
    with pytest.raises(InputError, match=name):
        ForceLimits(**{name: value})


@pytest.mark.parametrize(("knee", "no_load"), [(0.5, 0.5), (float("nan"), 1.0), (0.5, -1.0)])
def test_torque_lines_that_do_not_fall_are_refused(knee: float, no_load: float) -> None:
    with pytest.raises(InputError):
        TorqueLine(knee, no_load)


def test_settings_that_were_changed_in_memory_are_refused(still: Plan) -> None:
    for name, value in (("stability_margin", -1.0), ("reach_fraction", 2.0)):
        settings = replace(still.settings)
        object.__setattr__(settings, name, value)
        with pytest.raises(InputError, match=name):
            gaitopt.verify(replace(still, settings=settings), collisions=False)
    limits = ForceLimits()
    object.__setattr__(limits, "torque_share", 10.0)
    weak = replace(still, settings=replace(still.settings, forces=limits))
    for plan, asked in ((weak, None), (still, limits)):
        with pytest.raises(InputError, match="torque_share"):
            gaitopt.verify(plan, collisions=False, forces=asked)


def test_limits_must_be_limits(still: Plan) -> None:
    with pytest.raises(InputError, match="forces must be a ForceLimits"):
        gaitopt.verify(still, forces={"friction": 0.6})  # type: ignore[arg-type]
