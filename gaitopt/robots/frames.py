"""Transforms between the world, the body and the frames of the legs, as 4 x 4 matrices.

Source: [XiLing], Module C.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from gaitopt.conventions import LEGS, FloatArray, frozen
from gaitopt.inputs import check_leads, check_shape
from gaitopt.robots.quadruped import Quadruped
from gaitopt.robots.rotations import rpy_to_matrix

XILING_LEG_AXES: Final = frozen([[0.0, 1.0, 0.0], [0.0, 0.0, -1.0], [-1.0, 0.0, 0.0]])
"""Axes of the leg frame of [XiLing] as columns in gaitopt's leg frame ``(3, 3)``.

Its formulae hold with x down the straight leg, y forward along the axis of HAA, and z right along
the axes of HFE and KFE. So its R_{B,Li} is no identity, as it says, but this matrix.
"""


def homogeneous(position: ArrayLike, rpy: ArrayLike) -> FloatArray:
    """Transforms ``T_{W,B}`` ``(..., 4, 4)`` to the world from a frame with this pose.

    Args:
        position: ``(..., 3)`` [m].
        rpy: roll, pitch and yaw ``(..., 3)`` [rad].

    Source: [XiLing], Module C, Sections 1.2 to 1.4 and 4.1.
    """
    place = check_shape("position", position, 3)
    return _transform(rpy_to_matrix(check_shape("rpy", rpy, 3)), place)


def inverse_homogeneous(transform: ArrayLike) -> FloatArray:
    """Inverses ``(..., 4, 4)`` of rigid transforms; the rotation's is its transpose.

    Source: [XiLing], Module C, Section 1.4.
    """
    given = check_shape("transform", transform, 4, 4)
    back = np.swapaxes(given[..., :3, :3], -1, -2)
    return _transform(back, -(back @ given[..., :3, 3:])[..., 0])


def hip_frames(robot: Quadruped) -> FloatArray:
    """Transforms ``T_{B,Li}`` from each leg's frame to the body frame ``(4, 4, 4)``.

    Legs are in the order of :data:`gaitopt.LEGS`. Multiply the rotation by
    :data:`XILING_LEG_AXES` for the leg frames of [XiLing] (Module C, Section 1.5).
    """
    legs = [robot.legs[name] for name in LEGS]
    return _transform(np.array([leg.axes for leg in legs]), np.array([leg.hip for leg in legs]))


def _transform(rotation: FloatArray, position: FloatArray) -> FloatArray:
    """Homogeneous transforms ``(..., 4, 4)``."""
    lead = check_leads(rotation=rotation.shape[:-2], position=position.shape[:-1])
    out = np.zeros((*lead, 4, 4))
    out[..., :3, :3], out[..., :3, 3], out[..., 3, 3] = rotation, position, 1.0
    return out
