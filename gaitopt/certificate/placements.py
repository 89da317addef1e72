"""Places of a robot's links at many configurations at once."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pinocchio as pin

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

    Arrays lie in memory with samples last, on which NumPy is three times as fast here.

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
        rotations, origins = {1: base_rotations(values)}, {1: values[:, :3]}
        angles = np.ascontiguousarray(values.T)
        sines, others = np.sin(angles), 1.0 - np.cos(angles)
        for joint in range(2, model.njoints):
            above, place = int(model.parents[joint]), model.jointPlacements[joint]
            x, y, z = hinge_axis(model, joint)
            across = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
            column = int(model.joints[joint].idx_v)
            # Rodrigues' formula, behind the rotation of the joint above.
            parts = [place.rotation @ part for part in (np.eye(3), across, across @ across)]
            turned = samples_last(times(rotations[above], np.concatenate(parts, axis=1)))
            found = sines[column] * turned[:, 3:6]
            found += turned[:, :3]
            found += others[column] * turned[:, 6:]
            rotations[joint] = np.moveaxis(found, -1, 0)
            origins[joint] = origins[above] + times(rotations[above], place.translation)
        placed = cls(rotations, origins)
        placed._compare(model, values)
        return placed

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
    """Products of ``rotations (U, 3, 3)`` with one vector ``(3,)`` or matrix ``(3, n)``."""
    return np.asarray(np.moveaxis(what.T @ samples_last(rotations), -1, 0))


def samples_last(rotations: FloatArray) -> FloatArray:
    """The same numbers, seen as ``(3, n, U)``."""
    return np.moveaxis(rotations, 0, -1)


def base_rotations(values: FloatArray) -> FloatArray:
    """Rotations of the base ``(U, 3, 3)``, by roll, then pitch, then yaw about the world's axes."""
    return rotations_of(values[:, 3:6])


def rotations_of(rpy: FloatArray) -> FloatArray:
    """Rotations ``(U, 3, 3)`` by roll, then pitch, then yaw ``(U, 3)`` about the world's axes."""
    (sx, sy, sz), (cx, cy, cz) = (f(rpy.T) for f in (np.sin, np.cos))
    rows = np.stack([
        [cz * cy, cz * sy * sx - sz * cx, cz * sy * cx + sz * sx],
        [sz * cy, sz * sy * sx + cz * cx, sz * sy * cx - cz * sx],
        [-sy, cy * sx, cy * cx],
    ])  # fmt: skip
    return np.moveaxis(rows, -1, 0)


def configurations(values: FloatArray) -> FloatArray:
    """Pinocchio's configurations ``(N, nq)`` for path values ``(N, 6 + nj)``."""
    (sx, sy, sz), (cx, cy, cz) = (f(0.5 * values[:, 3:6].T) for f in (np.sin, np.cos))
    turn = [
        sx * cy * cz - cx * sy * sz, cx * sy * cz + sx * cy * sz,
        cx * cy * sz - sx * sy * cz, cx * cy * cz + sx * sy * sz,
    ]  # fmt: skip
    return np.concatenate([values[:, :3], np.stack(turn, axis=1), values[:, 6:]], axis=1)


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
