"""From body and feet to base and joints."""

from __future__ import annotations

import numpy as np

from gaitopt.conventions import FloatArray, rotation_z
from gaitopt.robots.quadruped import Quadruped
from gaitopt.robots.rotations import rpy_to_matrix


def base_poses(
    robot: Quadruped, heading: float, centre: FloatArray, turns: FloatArray
) -> FloatArray:
    """Base position and roll, pitch, yaw ``(N, 6)`` in the world.

    Args:
        robot: the robot.
        heading: of the walk [rad].
        centre: body centre in the heading frame ``(N, 3)`` [m].
        turns: the body's roll, pitch, yaw against the heading frame ``(N, 3)`` [rad].
    """
    from scipy.spatial.transform import Rotation

    body = rotation_z(heading) @ rpy_to_matrix(turns)
    out = np.empty((len(centre), 6))
    out[:, :3] = centre @ rotation_z(heading).T - body @ robot.centre
    angles = Rotation.from_matrix(body @ robot.body_axes.T).as_euler("ZYX")
    whole = 2.0 * np.pi * np.round((heading - angles[0, 0]) / (2.0 * np.pi))
    out[:, 3:] = np.unwrap(angles[:, ::-1], axis=0)
    out[:, 5] += whole
    return out
