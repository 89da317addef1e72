"""A plan's motion at instants."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gaitopt.conventions import BoolArray, FloatArray
from gaitopt.inputs import check_kind


@dataclass(frozen=True, eq=False)
class Trajectory:
    """A plan sampled in time; all arrays are read-only.

    Attributes:
        t: times ``(N,)`` [s].
        q: configurations ``(N, nq)``, Pinocchio's for ``plan.robot.model``: base position,
            quaternion xyzw, joints. This is the model of ``plan.robot.urdf``, in which a joint
            without an end has one angle, and joints of no leg are fixed; Pinocchio's own reading of
            the robot's file may have more numbers (:func:`gaitopt.file_configurations`).
        v: velocities ``(N, nv)``, Pinocchio's: base twist in the base's frame, joint rates.
        contacts: which feet stand ``(N, 4)``.
        cog: body centre ``(N, 3)`` [m].
        feet: foot frames ``(N, 4, 3)`` [m].
        legs: names of the columns of ``contacts`` and ``feet``.
        joint_names: names of the joint columns of ``q[:, 7:]`` and ``v[:, 6:]``.
    """

    t: FloatArray
    q: FloatArray
    v: FloatArray
    contacts: BoolArray
    cog: FloatArray
    feet: FloatArray
    legs: tuple[str, ...]
    joint_names: tuple[str, ...]

    def __post_init__(self) -> None:
        for name in ("t", "q", "v", "contacts", "cog", "feet"):
            check_kind(name, getattr(self, name), np.ndarray)
            getattr(self, name).setflags(write=False)

    def __len__(self) -> int:
        return len(self.t)
