"""Places of a robot's links at many configurations at once."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pinocchio as pin
from scipy.spatial.transform import Rotation

from gaitopt.certificate.trace import configurations
from gaitopt.conventions import FloatArray


@dataclass(frozen=True, eq=False)
class Placements:
    """Where the frames of joints are, at ``U`` configurations.

    Attributes:
        rotations: by joint ``(U, 3, 3)``.
        origins: by joint ``(U, 3)`` [m].
    """

    rotations: dict[int, FloatArray]
    origins: dict[int, FloatArray]

    @classmethod
    def of(cls, model: Any, values: FloatArray) -> Placements:
        """The places for values of a path.

        Args:
            model: Pinocchio's, with a free-flying base as joint 1, and hinges.
            values: of the path's columns ``(U, 6 + nj)``.
        """
        rotations = {1: Rotation.from_euler("ZYX", values[:, 5:2:-1]).as_matrix()}
        origins = {1: values[:, :3]}
        for joint in range(2, model.njoints):
            above, place = int(model.parents[joint]), model.jointPlacements[joint]
            turn = Rotation.from_rotvec(
                values[:, int(model.joints[joint].idx_v), None] * hinge_axis(model, joint)
            )
            rotations[joint] = rotations[above] @ place.rotation @ turn.as_matrix()
            origins[joint] = origins[above] + rotations[above] @ place.translation
        return cls(rotations, origins)


def hinge_axis(model: Any, joint: int) -> FloatArray:
    """The axis of a hinge in its own frame ``(3,)``."""
    kind = model.joints[joint]
    data = kind.createData()
    kind.calc(data, pin.neutral(model))
    return np.array(data.S, dtype=np.float64).reshape(-1)[3:]


def placement_of(
    model: Any, data: Any, values: FloatArray, joint: int
) -> tuple[FloatArray, FloatArray]:
    """Rotation ``(3, 3)`` and origin ``(3,)`` of one joint, for values ``(6 + nj,)`` of the path.

    Args:
        model, data: Pinocchio's.
        values: of the path's columns.
        joint: the joint.
    """
    pin.forwardKinematics(model, data, configurations(values[None])[0])
    place = data.oMi[joint]
    return place.rotation.copy(), place.translation.copy()
