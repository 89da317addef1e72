"""Where the joints of a robot are at many poses at once.

Pinocchio takes one pose a call. Some hundreds of poses take a fifth of the time here.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from gaitopt.conventions import FloatArray

STRAIGHT = 1e-12
"""Largest part of a hinge's velocity that is no rotation [m/rad]: rounding."""


class _Hinge(NamedTuple):
    """A hinge: its rotation in the frame of its parent is ``c * cosine + s * sine + constant``.

    Attributes:
        number, parent: of joints, in Pinocchio's order.
        column: of its angle.
        cosine, sine, constant: ``(3, 3)``, for Rodrigues' formula.
        place: in the frame of its parent ``(3,)`` [m].
    """

    number: int
    parent: int
    column: int
    cosine: FloatArray
    sine: FloatArray
    constant: FloatArray
    place: FloatArray


class _Hinges(NamedTuple):
    """Hinges as :class:`_Hinge` has one, with the hinges as last axis."""

    number: np.ndarray
    parent: np.ndarray
    column: np.ndarray
    cosine: FloatArray
    sine: FloatArray
    constant: FloatArray
    place: FloatArray


@dataclass(frozen=True, eq=False)
class Chain:
    """The joints of a robot whose base is at the origin.

    Attributes:
        count: of joints, with Pinocchio's first two, which are the world and the base.
        hinges: in an order in which parents come first.
    """

    count: int
    hinges: tuple[_Hinge, ...]

    @classmethod
    def of(cls, model: Any) -> Chain | None:
        """The chain of a model with a free base; ``None`` where a joint is no hinge."""
        import pinocchio as pin

        data, hinges = model.createData(), []
        pin.computeJointJacobians(model, data, pin.neutral(model))
        for number in range(2, model.njoints):
            joint, placement = model.joints[number], model.jointPlacements[number]
            if joint.nq != 1 or joint.nv != 1:
                return None
            moved = pin.getJointJacobian(model, data, number, pin.LOCAL)[:, joint.idx_v]
            if np.abs(moved[:3]).max() > STRAIGHT:
                return None
            axis, turn = moved[3:], placement.rotation
            along = np.outer(axis, axis)
            hinges.append(
                _Hinge(
                    number, int(model.parents[number]), joint.idx_q - 7,
                    turn @ (np.eye(3) - along), turn @ pin.skew(axis), turn @ along,
                    placement.translation.copy(),
                )
            )  # fmt: skip
        return cls(model.njoints, tuple(hinges))

    def places(self, joints: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Rotations ``(N, count, 3, 3)`` and places ``(N, count, 3)`` [m] of all joints.

        Args:
            joints: angles in Pinocchio's order ``(N, nj)`` [rad].
        """
        rotations, places = self.rows_of_places(joints)
        return np.moveaxis(rotations, (3, 2), (0, 1)), np.moveaxis(places, (2, 1), (0, 1))

    def rows_of_places(self, joints: FloatArray) -> tuple[FloatArray, FloatArray]:
        """The same as ``(3, 3, count, N)`` and ``(3, count, N)``, so that poses stand in rows.

        Args:
            joints: as above.
        """
        rotations = np.empty((3, 3, self.count, len(joints)))
        places = np.zeros((3, self.count, len(joints)))
        rotations[:, :, :2] = np.eye(3)[..., None, None]
        angles = np.ascontiguousarray(joints.T)
        cosines, sines = np.cos(angles), np.sin(angles)
        # Hinges that are as far from the base are turned together, such as those of four hips.
        for number, parent, column, cosine, sine, constant, place in self._levels:
            own = cosines[column] * cosine[..., None] + sines[column] * sine[..., None]
            own += constant[..., None]
            above = rotations[:, :, parent]
            rotations[:, :, number] = own if (parent == 1).all() else product(above, own)
            places[:, number] = places[:, parent] + turned(above, place[..., None])
        return rotations, places

    def ups(self, joints: FloatArray, up: FloatArray) -> tuple[FloatArray, FloatArray]:
        """The direction up in the frames of all joints ``(3, count, N)``, and how high they are.

        The heights are over the base ``(count, N)`` [m]. This is a third of the work of
        :meth:`rows_of_places`, and enough to tell how low something comes.

        Args:
            joints: as above.
            up: in the base's frame ``(3, N)``.
        """
        ups = np.empty((3, self.count, len(joints)))
        heights = np.zeros((self.count, len(joints)))
        ups[:, :2] = up[:, None]
        angles = np.ascontiguousarray(joints.T)
        cosines, sines = np.cos(angles), np.sin(angles)
        for number, parent, column, cosine, sine, constant, place in self._levels:
            own = cosines[column] * cosine[..., None] + sines[column] * sine[..., None]
            own += constant[..., None]
            above = ups[:, parent]
            ups[:, number] = turned(own.swapaxes(0, 1), above)
            heights[number] = heights[parent] + (above * place[..., None]).sum(axis=0)
        return ups, heights

    @cached_property
    def _levels(self) -> tuple[_Hinges, ...]:
        """The hinges by their distance from the base."""
        depth = {0: 0, 1: 0}
        levels: dict[int, list[_Hinge]] = {}
        for hinge in self.hinges:
            depth[hinge.number] = depth[hinge.parent] + 1
            levels.setdefault(depth[hinge.number], []).append(hinge)
        return tuple(
            _Hinges(
                *(np.array(numbers) for numbers in list(zip(*level, strict=True))[:3]),
                *(np.stack(arrays, axis=-1) for arrays in list(zip(*level, strict=True))[3:]),
            )
            for level in levels.values()
        )


def product(one: FloatArray, other: FloatArray) -> FloatArray:
    """Products of matrices ``(3, 3, ...)``, which NumPy's own takes one by one."""
    total: FloatArray = one[:, 0, None] * other[0]
    total += one[:, 1, None] * other[1]
    total += one[:, 2, None] * other[2]
    return total


def turned(matrices: FloatArray, vectors: FloatArray) -> FloatArray:
    """Products of matrices ``(3, 3, ...)`` and vectors ``(3, ...)``."""
    total: FloatArray = matrices[:, 0] * vectors[0]
    total += matrices[:, 1] * vectors[1]
    total += matrices[:, 2] * vectors[2]
    return total
