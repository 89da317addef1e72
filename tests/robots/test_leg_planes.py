"""Planes in which the feet of legs without roll joint stay."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from robot_loading import feet_by_pinocchio

import gaitopt
from gaitopt import LEGS
from gaitopt.robots.leg_planes import foot_planes


@pytest.mark.parametrize("name", ["solo8", "quadruped", "frog1"])
def test_feet_stay_in_their_planes_at_any_joint_angles(name: str) -> None:
    robot = gaitopt.load_robot(name)
    planes, rng = foot_planes(robot), np.random.default_rng(0)
    assert planes is not None
    for _ in range(5):
        joints = rng.uniform(-1.0, 1.0, len(robot.joint_names))
        feet = feet_by_pinocchio(robot, joints)
        assert feet[:, 1] - robot.centre[1] == pytest.approx(planes, abs=1e-9)


def test_legs_with_roll_joints_have_no_planes() -> None:
    assert foot_planes(gaitopt.load_robot("wang2020")) is None


def test_axes_that_miss_the_sideways_direction_by_rounding_are_put_along_it() -> None:
    """Those of Bittle are off by five millionths."""
    text = gaitopt.load_robot("frog1").urdf.replace('"0 1 0"', '"0.00001 1 0"')
    robot = gaitopt.load_robot(text)
    planes = foot_planes(robot)
    assert planes is not None
    feet = feet_by_pinocchio(robot, np.full(len(robot.joint_names), 0.4))
    assert feet[:, 1] - robot.centre[1] == pytest.approx(planes, abs=1e-9)


def test_planes_that_are_not_straight_ahead_are_refused() -> None:
    robot = gaitopt.load_robot("frog1")
    c, s = np.cos(0.1), np.sin(0.1)
    turned = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    legs = {leg: replace(one, axes=turned @ one.axes) for leg, one in robot.legs.items()}
    assert set(legs) == set(LEGS)
    with pytest.raises(gaitopt.InputError, match=r"turned by 0\.1 rad"):
        foot_planes(replace(robot, legs=legs))
