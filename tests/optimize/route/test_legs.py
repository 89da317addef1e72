"""Four legs at once, judged leg by leg and by differences."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import gaitopt
from gaitopt import LEGS, Quadruped
from gaitopt.optimize.route.leg_hessians import pose_hessian
from gaitopt.optimize.route.legs import FOOT, ORIENTATION, StackedLegs
from gaitopt.robots.rotations import rpy_to_matrix

Array = NDArray[np.float64]
ROBOTS = ["wang2020", "anymal", "a1"]


@pytest.mark.parametrize("name", ROBOTS)
def test_angles_are_those_of_each_leg_s_inverse(name: str, random_poses: Any) -> None:
    robot = gaitopt.load_robot(name)
    poses, feet, swing = random_poses(robot, 20, seed=7, spread=0.05)
    angles = StackedLegs.of(robot).joints(poses, feet, swing)
    turned = rpy_to_matrix(poses[:, ORIENTATION])
    for i, leg in enumerate(LEGS):
        foot = np.where(swing[:, i, None] > 0, poses[:, FOOT], feet[:, i])
        local = np.einsum("nij,ni->nj", turned, foot - poses[:, :3]) + robot.centre
        assert angles[:, i] == pytest.approx(robot.legs[leg].inverse(local), abs=1e-12)


@pytest.mark.parametrize("name", ROBOTS)
def test_gradients_and_curvature_are_those_of_differences(name: str, random_poses: Any) -> None:
    robot = gaitopt.load_robot(name)
    legs = StackedLegs.of(robot)
    poses, feet, swing = random_poses(robot, 8, seed=7, spread=0.05)
    kinematics = legs.kinematics(poses, feet, swing)
    weights = np.random.default_rng(1).normal(size=(8, 4, 3))
    curvature = pose_hessian(legs, kinematics, weights)
    step = 1e-6
    for i in range(9):
        moved = [legs.kinematics(poses + s * step * np.eye(9)[i], feet, swing) for s in (1, -1)]
        slope = (moved[0].joints - moved[1].joints).reshape(8, 12) / (2 * step)
        assert kinematics.joints_by_pose()[:, :, i] == pytest.approx(slope, abs=1e-7)
        pulled = [
            np.einsum("kj,kjc->kc", weights.reshape(8, 12), m.joints_by_pose()) for m in moved
        ]
        assert curvature[:, i] == pytest.approx((pulled[0] - pulled[1]) / (2 * step), abs=1e-6)


def test_the_slopes_are_the_inverse_of_the_jacobian(wang: Quadruped, random_poses: Any) -> None:
    poses, feet, swing = random_poses(wang, 10, seed=7, spread=0.05)
    kinematics = StackedLegs.of(wang).kinematics(poses, feet, swing)
    for i, leg in enumerate(LEGS):
        product = kinematics.joints_by_foot[:, i] @ wang.legs[leg].jacobian(kinematics.joints[:, i])
        assert product == pytest.approx(np.broadcast_to(np.eye(3), (10, 3, 3)), abs=1e-12)


@pytest.mark.parametrize("name", ROBOTS)
def test_slopes_stay_finite_where_a_leg_is_straight(name: str) -> None:
    """There the inverse has none; next to it those large ones have the same sign."""
    legs = StackedLegs.of(gaitopt.load_robot(name))
    joints = np.zeros((3, 4, 3))
    joints[..., 1:] = -legs.signs[:, 1:] * legs.zeros
    joints[1:, :, 2] += legs.signs[:, 2] * legs.knee * np.array([[1e-12], [1e-6]])
    slopes = legs.joints_by_foot(legs.in_plane(joints))
    assert np.isfinite(slopes).all()
    assert np.abs(slopes[:2]).max() > 1e8
    assert np.all(slopes[0] * slopes[2] >= -1e-6 * np.abs(slopes[0]).max())
