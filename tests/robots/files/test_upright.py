"""Robots whose base has another axis up than z."""

from __future__ import annotations

import math

import numpy as np
import pinocchio as pin
import pytest
from robot_loading import quiet, refusal
from robot_texts import CORNERS, MASS, mjcf, robot

import gaitopt
from gaitopt.conventions import LEGS
from gaitopt.robots.standing import foot_below_hip

QUARTER = math.pi / 2
LYING = {"y": ((1, 0, 0), (0, 0, -1), f"{-QUARTER} 0 0"),
         "-y": ((1, 0, 0), (0, 0, 1), f"{QUARTER} 0 0"),
         "x": ((0, 0, -1), (0, 1, 0), f"0 {QUARTER} 0")}  # fmt: skip
"""Where the robot's x and y axes are in the base, and how its legs' frames are turned in it."""


def lying(up: str, **legs: object) -> str:
    """The small robot of tests, with this axis of its base up."""
    text = robot(**legs)  # type: ignore[arg-type]
    forward, left, rpy = LYING[up]
    for x, y in CORNERS.values():
        place = " ".join(repr(a * x + b * y) for a, b in zip(forward, left, strict=True))
        origin = f'<origin xyz="{place}" rpy="{rpy}"/>'
        text = text.replace(f'<origin xyz="{x} {y} 0" rpy="0 0 0"/>', origin)
    return text


@pytest.mark.parametrize("up", LYING)
def test_legs_are_those_of_the_robot_that_stands(up: str) -> None:
    made, standing = quiet(lying(up)), quiet(robot())
    assert made.notes.done[0].startswith(f"the base base has its {up} axis up")
    assert made.mass == pytest.approx(MASS)
    for leg in LEGS:
        angles = standing.legs[leg].inverse(foot_below_hip(standing.legs[leg], 0.3))
        np.testing.assert_allclose(made.legs[leg].hip, standing.legs[leg].hip, rtol=0, atol=1e-12)
        np.testing.assert_allclose(
            made.legs[leg].forward(angles), standing.legs[leg].forward(angles), rtol=0, atol=1e-12
        )


def test_gravity_pulls_it_to_its_feet() -> None:
    """The centre of mass of the robot that stands is as high above its feet."""
    heights = []
    for made in (quiet(lying("y")), quiet(robot())):
        q = pin.neutral(made.model)
        q[7:] = made.standing_joints()
        com = pin.centerOfMass(made.model, made.model.createData(), q)
        heights.append(float(com[2]) + made.standing_height)
    assert heights[0] == pytest.approx(heights[1], abs=1e-12)


def test_configurations_for_the_file_s_own_model_have_its_base() -> None:
    made = quiet(lying("y"))
    theirs = pin.buildModelFromXML(lying("y"), pin.JointModelFreeFlyer())
    q = pin.neutral(made.model)
    q[:7] = [0.3, 0.1, 0.5, 0.0, 0.0, math.sin(0.2), math.cos(0.2)]
    q[7:] = made.standing_joints()
    (mapped,) = gaitopt.file_configurations(made, q, theirs)
    ours, data = made.model.createData(), theirs.createData()
    pin.framesForwardKinematics(made.model, ours, q)
    pin.framesForwardKinematics(theirs, data, mapped)
    for leg in LEGS:
        foot = made.legs[leg].foot
        here, there = (d.oMf[m.getFrameId(foot)].translation
                       for m, d in ((made.model, ours), (theirs, data)))  # fmt: skip
        np.testing.assert_allclose(here, there, rtol=0, atol=1e-12)


def test_an_mjcf_with_y_up_agrees_with_mujoco_and_walks() -> None:
    text = mjcf()
    for x, y in CORNERS.values():
        text = text.replace(f'pos="{x} {y} 0.1">', f'pos="{x} 0.1 {-y}" euler="-90 0 0">')
    assert 'euler="-90 0 0"' in text
    made = quiet(text)
    plan = gaitopt.plan_crawl(made, gaitopt.s_columns(0, columns=2, robot=made))
    assert gaitopt.verify(plan).ok
    assert not gaitopt.simulate(plan).failures


def test_legs_that_do_not_tell_what_is_below_are_refused() -> None:
    """Legs that lie in the plane of the hips, as in files whose zero is a leg stretched forward."""
    flat = lying("y").replace('<origin xyz="0 0 -0.25"', '<origin xyz="0.25 0 0"')
    flat = flat.replace('<origin xyz="0 0 -0.22"', '<origin xyz="0.22 0 0"')
    assert "turn the base so that its z axis points up" in refusal(flat)
