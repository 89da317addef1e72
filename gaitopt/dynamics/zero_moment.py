"""The zero moment point of many samples of a motion, with inverse dynamics in one call."""

from __future__ import annotations

import numpy as np

from gaitopt.conventions import GRAVITY, FloatArray
from gaitopt.dynamics.whole_body import Motion
from gaitopt.robots.at_many_poses.inverse_dynamics import inverse_dynamics
from gaitopt.robots.quadruped import Quadruped
from gaitopt.robots.rotations import quaternion_to_matrix
from gaitopt.stability.zmp import zmp_of_wrench


def zero_moment_points(robot: Quadruped, motion: Motion, ground_height: FloatArray) -> FloatArray:
    """ZMP of the whole robot ``(N, 2)`` [m], as :func:`gaitopt.stability.zmp.whole_body_zmp`.

    Args:
        robot: the robot.
        motion: of ``N`` samples.
        ground_height: of the level plane in which the points are taken ``(N,)`` [m].
    """
    # No joint exerts the force on the free-flying base, so the ground must.
    found = inverse_dynamics(robot.model, *motion)[:, :6].reshape(-1, 2, 3)
    to_world = np.swapaxes(quaternion_to_matrix(motion.q[:, 3:7]), 1, 2)
    wrench = (found @ to_world).reshape(-1, 6)
    return zmp_of_wrench(wrench, motion.q[:, :3], robot.mass * GRAVITY, ground_height)
