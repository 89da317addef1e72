"""Upper bounds on derivatives in time of what a robot's links do, that hold on whole pieces.

A *series* is an array ``(ORDER + 1, P)``: row ``k`` is an upper bound on the norm of the ``k``-th
time derivative of a vector or matrix, on each of ``P`` pieces. Sums of vectors have the sum of
their series. Products follow Leibniz' rule, and a rotation by an angle follows the chain rule with
all derivatives of sine and cosine bounded by one. So the series of every link follow from those of
the path's columns, by sums and products of positive numbers, whatever the configuration is.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from math import comb
from typing import Any

import numpy as np

from gaitopt.certificate.enclosure import Pieces
from gaitopt.conventions import GRAVITY, FloatArray

ORDER = 4
"""Highest derivative that is bounded: forces hold second derivatives of places, and the deviation
of a curve from its chord two more."""


def product(one: FloatArray, other: FloatArray) -> FloatArray:
    """Series of a product: ``(fg)^(k)`` is the sum of ``C(k, i) f^(i) g^(k - i)``."""
    count = min(len(one), len(other))
    out = np.zeros((count, *np.broadcast_shapes(one.shape[1:], other.shape[1:])))
    for k in range(count):
        for i in range(k + 1):
            term = one[i] * other[k - i]
            # NumPy multiplies by one as slowly as by any number.
            out[k] += term if i in (0, k) else comb(k, i) * term
    return out


def rotation_series(angle: FloatArray) -> FloatArray:
    """Series of a rotation about a fixed axis ``(5, P)``.

    Args:
        angle: bounds on the angle's derivatives of order 1 to 4 ``(4, P)``.

    Source: Faà di Bruno's formula, with all derivatives by the angle bounded by one.
    """
    a, b, c, d = angle
    return np.stack([
        np.ones_like(a), a, b + a**2, c + 3.0 * a * b + a**3,
        d + 4.0 * a * c + 3.0 * b**2 + 6.0 * a**2 * b + a**4,
    ])  # fmt: skip


def turning_series(rotation: FloatArray) -> FloatArray:
    """Series of the angular velocity of a rotation ``(4, P)``: that of ``R' R^T``."""
    return product(rotation[1:], rotation[:-1])


@dataclass(frozen=True, eq=False)
class LinkBounds:
    """Series of all links of a robot on the pieces of a path.

    Attributes:
        model: Pinocchio's, with the base as joint 1 and the path's columns as velocities.
        rotations: of each joint's frame ``(njoints, 5, P)``.
        base: place of the base's origin, from where it is at the piece's start ``(5, P)`` [m].
    """

    model: Any
    rotations: FloatArray
    base: FloatArray

    @classmethod
    def of(cls, model: Any, pieces: Pieces) -> LinkBounds:
        """Bounds for the motion of ``pieces``."""
        # Arrays with the pieces last are faster.
        columns = np.stack([pieces.largest(k).T for k in range(1, ORDER + 1)])
        yaw, pitch, roll = (rotation_series(columns[:, c]) for c in (5, 4, 3))
        rotations = np.zeros((model.njoints, ORDER + 1, len(pieces.starts)))
        rotations[0, 0] = 1.0
        rotations[1] = product(product(yaw, pitch), roll)
        for joint in range(2, model.njoints):
            turn = rotation_series(columns[:, int(model.joints[joint].idx_v)])
            rotations[joint] = product(rotations[model.parents[joint]], turn)
        moves = np.sqrt((columns[:, :3] ** 2).sum(axis=1))
        base = np.concatenate([(moves[0] * pieces.lengths)[None], moves])
        return cls(model, rotations, base)

    def lever(self, joint: int, start: int, point: FloatArray) -> FloatArray:
        """Series of the vector from the origin of joint ``start`` to a point ``(5, P)`` [m].

        Args:
            joint: the joint that the point is fixed to; ``start`` or one that it carries.
            start: the joint from whose origin the vector goes.
            point: place of the point in the frame of ``joint`` ``(3,)`` [m].
        """
        found = self.rotations[joint] * float(np.linalg.norm(point))
        while joint != start:
            offset = float(np.linalg.norm(self.model.jointPlacements[joint].translation))
            joint = int(self.model.parents[joint])
            found = found + self.rotations[joint] * offset
        return np.asarray(found)

    def inertial_force(self, joint: int) -> FloatArray:
        """Series of the force ``m (c'' - g)`` that moves and carries a link ``(3, P)`` [N].

        It is read-only, for it is kept.
        """
        return self._forces[joint]

    @cached_property
    def _forces(self) -> list[FloatArray]:
        """:meth:`inertial_force` of all links."""
        out = []
        for joint, inertia in enumerate(self.model.inertias):
            place = self.base + self.lever(joint, 1, inertia.lever) if joint else self.base
            force = inertia.mass * place[2:]
            force[0] += inertia.mass * GRAVITY
            force.setflags(write=False)
            out.append(force)
        return out

    @cached_property
    def _turning(self) -> list[FloatArray]:
        """Series of the changes of the links' own angular momenta ``(3, P)`` [N m]."""
        out = []
        for rotation, inertia in zip(self.rotations, self.model.inertias, strict=True):
            largest = float(np.linalg.eigvalsh(inertia.inertia).max())
            momentum = product(product(rotation, rotation), turning_series(rotation))
            out.append(largest * momentum[1:])
        return out

    def inertial_moment(self, joint: int, lever: FloatArray) -> FloatArray:
        """Series of the moment that moves and carries a link ``(3, P)`` [N m].

        It is ``r x m (c'' - g) + L'``, with the angular momentum ``L`` about the link's centre of
        mass.

        Args:
            joint: the link.
            lever: series of ``r``, from the moment's reference to the link's centre of mass.
        """
        return product(lever, self.inertial_force(joint)) + self._turning[joint]

    def carried(self, joint: int) -> list[int]:
        """The joints that a joint carries, itself among them."""
        found = []
        for other in range(1, self.model.njoints):
            at = other
            while at > joint:
                at = int(self.model.parents[at])
            if at == joint:
                found.append(other)
        return found
