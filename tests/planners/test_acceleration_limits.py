"""Limits of the joints' accelerations that belong to the robot: every plan keeps them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import gaitopt
from gaitopt.certificate.claims.known_robot import refuse_stronger
from gaitopt.conventions import FloatArray

OWN = {"FL_calf_joint": 20.0, "RR_hip_joint": 8.0, "FR_thigh_joint": 30.0}
Planner = Callable[[gaitopt.Quadruped], gaitopt.Plan]


@cache
def go2(limits: float | None = None, own: bool = False) -> gaitopt.Quadruped:
    return gaitopt.load_robot("go2", acceleration_limits=OWN if own else limits)


def crawl(robot: gaitopt.Quadruped, **options: object) -> gaitopt.Plan:
    footholds = gaitopt.s_columns(0, columns=2, robot=robot)
    return gaitopt.plan_crawl(robot, footholds, **options)  # type: ignore[arg-type]


def trot(robot: gaitopt.Quadruped) -> gaitopt.Plan:
    return gaitopt.plan_gait(robot, gaitopt.trot(1.5), velocity=(0.02, 0.0), distance=0.03)


def shares(plan: gaitopt.Plan) -> FloatArray:
    """Joint accelerations over their limits, by differences of velocities at close samples."""
    sampled = plan.sample(1e-3)
    rates = np.diff(sampled.v[:, 6:], axis=0) / np.diff(sampled.t)[:, None]
    return np.asarray(np.abs(rates).max(axis=0) / plan.robot.acceleration_limits)


def test_limits_are_one_number_or_by_joint() -> None:
    assert not np.isfinite(go2().acceleration_limits).any()
    assert (go2(25.0).acceleration_limits == 25.0).all()
    named = dict(zip(go2().joint_names, go2(own=True).acceleration_limits.tolist(), strict=True))
    assert {name: limit for name, limit in named.items() if np.isfinite(limit)} == OWN


@pytest.mark.parametrize(
    ("planner", "own", "at_limit"),
    [
        (crawl, True, True),
        (lambda robot: crawl(robot, timing="velocity"), True, True),
        pytest.param(
            lambda robot: crawl(robot, timing="velocity", swing="cycloid"),
            False,
            True,
            marks=pytest.mark.slow,
        ),
        (lambda robot: crawl(robot, objective="time"), False, True),
        pytest.param(
            lambda robot: crawl(robot, objective="time", timing="velocity"),
            False,
            True,
            marks=pytest.mark.slow,
        ),
        (trot, False, False),
    ],
    ids=["crawl", "by velocity", "cycloid", "least time", "least time by velocity", "trot"],
)
def test_plans_keep_them_and_the_certificate_says_so(
    planner: Planner, own: bool, at_limit: bool
) -> None:
    plan = planner(go2(None if own else 25.0, own))
    (check,) = [c for c in gaitopt.verify(plan).checks if c.name == "joint accelerations"]
    assert check.status == "ok"
    most = shares(plan).max()
    assert (0.8 if at_limit else 0.0) < most <= 1.0 + 1e-6


def test_walks_without_limits_exceed_them_and_the_certificate_finds_it() -> None:
    plan = crawl(go2())
    assert not [c for c in gaitopt.verify(plan).checks if c.name == "joint accelerations"]
    limited = replace(plan, robot=go2(own=True))
    (check,) = [c for c in gaitopt.verify(limited).checks if c.name == "joint accelerations"]
    assert check.status == "violated" and check.where in OWN
    assert shares(limited).max() > 1.5


def test_a_gait_that_needs_more_is_refused_with_the_joint() -> None:
    with pytest.raises(gaitopt.InfeasibleSpeedError, match=r"_joint would need .* limit is 25 rad"):
        gaitopt.plan_gait(go2(25.0), gaitopt.trot(0.5), velocity=(0.1, 0.0), distance=0.1)


def test_strides_ask_for_the_lowest_of_each_kind_of_joint() -> None:
    """Strides keep what their settings say of each joint of a leg."""
    robot = go2(own=True)
    settings = gaitopt.StrideSettings.for_robot(robot).within(robot)
    assert settings.accelerations == (8.0, 30.0, 20.0) and settings.acceleration_limit == 30.0
    low = gaitopt.StrideSettings.for_robot(robot, acceleration_limit=1.0)
    assert low.within(robot) == low
    assert settings.within(go2()) == settings


def test_plan_files_carry_them_and_raised_ones_are_no_excuse(tmp_path: Path) -> None:
    plan = crawl(go2(own=True), timing="velocity")
    plan.save(tmp_path / "plan.npz")
    back = gaitopt.load_plan(tmp_path / "plan.npz").robot
    assert back.acceleration_limits.tolist() == go2(own=True).acceleration_limits.tolist()
    refuse_stronger(back, go2())
    with pytest.raises(gaitopt.RobotError, match="acceleration limit of FL_calf_joint is wider"):
        refuse_stronger(go2(25.0), go2(own=True))


@pytest.mark.parametrize(
    ("given", "words"),
    [
        (0.0, "acceleration_limits must be a number from"),
        ({"FL_calf_joint": -1.0}, "acceleration_limits FL_calf_joint"),
        ({"tail": 5.0}, "acceleration_limits: no leg has a joint 'tail'"),
    ],
)
def test_what_is_no_limit_is_refused(given: object, words: str) -> None:
    with pytest.raises(gaitopt.InputError, match=words):
        gaitopt.load_robot("go2", acceleration_limits=given)  # type: ignore[arg-type]


@pytest.mark.parametrize("value", ["0", "-1", "nan", "1e30"])
def test_limits_in_a_text_from_somebody_else_are_checked(value: str) -> None:
    text = go2(own=True).urdf.replace('value="20.0"', f'value="{value}"')
    assert text != go2(own=True).urdf
    with pytest.raises(gaitopt.RobotError, match=r"acceleration_limit .* is no number that"):
        gaitopt.load_robot(text)
