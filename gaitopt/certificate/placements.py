"""Places of a robot's links at many configurations at once."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pinocchio as pin
from scipy.spatial.transform import Rotation

from gaitopt.conventions import FloatArray
from gaitopt.errors import RobotError

AGREEMENT = 1e-9
"""Most that places may differ from Pinocchio's [m], for each metre of the base's own place and one;
rounding leaves about 1e-15."""
COMPARED = 8
"""Samples of each motion that are compared with Pinocchio."""


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
        """The places for values of a path, some of which are compared with Pinocchio's.

        Args:
            model: Pinocchio's, with a free-flying base as joint 1, and hinges.
            values: of the path's columns ``(U, 6 + nj)``.

        Raises:
            RobotError: Pinocchio places a joint elsewhere.
        """
        rotations = {1: Rotation.from_euler("ZYX", values[:, 5:2:-1]).as_matrix()}
        origins = {1: values[:, :3]}
        for joint in range(2, model.njoints):
            above, place = int(model.parents[joint]), model.jointPlacements[joint]
            x, y, z = hinge_axis(model, joint)
            across = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
            angle = values[:, int(model.joints[joint].idx_v), None, None]
            # Rodrigues' formula, behind the rotation of the joint above.
            still, first, second = (
                times(rotations[above], place.rotation @ part)
                for part in (np.eye(3), across, across @ across)
            )
            rotations[joint] = still + np.sin(angle) * first + (1.0 - np.cos(angle)) * second
            origins[joint] = origins[above] + times(rotations[above], place.translation)
        found = cls(rotations, origins)
        found._compare(model, values)
        return found

    def points(self, joint: int, point: FloatArray) -> FloatArray:
        """Places of a point fixed to a joint at ``point (3,)`` in its frame ``(U, 3)`` [m]."""
        return np.asarray(self.origins[joint] + times(self.rotations[joint], point))

    def _compare(self, model: Any, values: FloatArray) -> None:
        """Hold some of the places against Pinocchio's."""
        data = model.createData()
        chosen = np.unique(np.linspace(0, len(values) - 1, COMPARED).astype(int))
        for row, q in zip(chosen.tolist(), configurations(values[chosen]), strict=True):
            pin.forwardKinematics(model, data, q)
            for joint in range(1, model.njoints):
                place = data.oMi[joint]
                off = np.abs(place.translation - self.origins[joint][row]).max()
                turned = np.abs(place.rotation - self.rotations[joint][row]).max()
                if not max(off, turned) <= AGREEMENT * (1.0 + np.abs(values[row, :3]).max()):
                    raise RobotError(
                        f"the certificate places joint {model.names[joint]!r} {off:.2g} m and "
                        f"{turned:.2g} rad from where Pinocchio does; please report this robot"
                    )


def times(rotations: FloatArray, what: FloatArray) -> FloatArray:
    """Products of ``rotations (U, 3, 3)`` with one vector ``(3,)`` or matrix ``(3, 3)``."""
    return np.asarray((rotations.reshape(-1, 3) @ what).reshape(len(rotations), *what.shape))


def configurations(values: FloatArray) -> FloatArray:
    """Pinocchio's configurations ``(N, nq)`` for path values ``(N, 6 + nj)``."""
    turn = Rotation.from_euler("ZYX", values[:, 5:2:-1]).as_quat()
    return np.concatenate([values[:, :3], turn, values[:, 6:]], axis=1)


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
