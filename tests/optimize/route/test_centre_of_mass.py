"""The true centre of mass in closed form: Pinocchio judges its values, differences the rest."""

from __future__ import annotations

from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from numpy.typing import NDArray

import gaitopt
from gaitopt import LEGS, Quadruped
from gaitopt.optimize.route.centre_of_mass import ComDerivatives, MassDistribution
from gaitopt.optimize.route.leg_hessians import pose_hessian
from gaitopt.optimize.route.legs import ORIENTATION, LegKinematics, StackedLegs
from gaitopt.plan.com_margin import true_com
from gaitopt.robots.rotations import rpy_to_matrix, rpy_to_quaternion

Array = NDArray[np.float64]
ROBOTS = ["wang2020", "a1", "anymal", "anymal_c", "hyq"]


def seen(
    robot: Quadruped, poses: Array, feet: Array, swing: Array
) -> tuple[LegKinematics, ComDerivatives]:
    """Joints and centre of mass with first derivatives."""
    kinematics = StackedLegs.of(robot).kinematics(poses, feet, swing)
    return kinematics, MassDistribution.of(robot).derivatives(
        poses, kinematics, kinematics.joints_by_pose()
    )


@pytest.mark.parametrize("name", ROBOTS)
def test_the_centre_of_mass_is_pinocchio_s(name: str, random_poses: Any) -> None:
    robot = gaitopt.load_robot(name)
    poses, feet, swing = random_poses(robot, 20, seed=11, spread=0.1)
    kinematics, com = seen(robot, poses, feet, swing)
    body = rpy_to_matrix(poses[:, ORIENTATION])
    q = np.tile(pin.neutral(robot.model), (20, 1))
    q[:, 7:] = robot.neutral_joints()
    q[:, :3] = poses[:, :3] - body @ robot.centre
    turned = [pin.rpy.matrixToRpy(r) for r in body @ robot.body_axes.T]
    q[:, 3:7] = rpy_to_quaternion(np.array(turned))
    for i, leg in enumerate(LEGS):
        q[:, [7 + c for c in robot.leg_columns[leg]]] = kinematics.joints[:, i]
    assert com.com == pytest.approx(true_com(robot, q), abs=1e-12)
    points = MassDistribution.of(robot).com(poses, kinematics.joints)
    assert points == pytest.approx(com.com, abs=1e-15)


@pytest.mark.parametrize("name", ROBOTS)
def test_gradient_and_curvature_are_those_of_differences(name: str, random_poses: Any) -> None:
    robot = gaitopt.load_robot(name)
    legs, masses = StackedLegs.of(robot), MassDistribution.of(robot)
    poses, feet, swing = random_poses(robot, 8, seed=11, spread=0.1)
    kinematics, com = seen(robot, poses, feet, swing)
    weights = np.random.default_rng(1).normal(size=(8, 3))
    of_joints = masses.joint_hessian(kinematics, com, weights)
    curvature = pose_hessian(
        legs, kinematics, masses.joint_weights(kinematics, com, weights), of_joints
    )
    masses.add_orientation(curvature, kinematics, com, weights)
    step = 1e-6
    for i in range(9):
        moved = [seen(robot, poses + s * step * np.eye(9)[i], feet, swing)[1] for s in (1, -1)]
        slope = (moved[0].com - moved[1].com) / (2 * step)
        assert com.com_by_pose[:, :, i] == pytest.approx(slope, abs=1e-8)
        pulled = [np.einsum("ki,kic->kc", weights, m.com_by_pose) for m in moved]
        assert curvature[:, i] == pytest.approx((pulled[0] - pulled[1]) / (2 * step), abs=1e-7)


def test_straight_legs_by_hand(wang: Quadruped) -> None:
    """13 kg in the middle; below each hip 1.55 kg at 240 mm and 0.45 kg at 463 or 464 mm."""
    local = MassDistribution.of(wang).com_in_body(np.zeros((1, 4, 3)))[0]
    front, hind = (1.55 * 0.2395161 + 0.45 * (0.3 + z) for z in (0.1634924, 0.1640371))
    down = (2 * front + 2 * hind) / 25
    assert local == pytest.approx([0, 0, -down], abs=1e-7)


def test_a_leg_swung_forward_takes_its_share_along(wang: Quadruped) -> None:
    """A straight leg of 2 kg swung level moves the 25 kg by its first moment."""
    joints = np.zeros((2, 4, 3))
    joints[1, 0, 1] = -np.pi / 2 * np.sign(MassDistribution.of(wang).signs[0, 1])
    before, after = MassDistribution.of(wang).com_in_body(joints)
    moment = (1.55 * 0.2395161 + 0.45 * (0.3 + 0.1634924)) / 25
    assert after - before == pytest.approx([moment, 0, moment], abs=1e-7)
