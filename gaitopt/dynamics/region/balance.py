"""Contact forces that hold a robot at rest, as a function of free coordinates.

A robot rests when the contact forces carry its weight and their torque balances that of the
weight. With forces ``f_i`` in units of the weight, acting at ``p_i``, and the centre of mass at
the horizontal place ``c`` these are the six equations of [Bretl2008]::

    sum f_i = e_z,    sum p_i x f_i = c x e_z

Two of them give ``c``: ``c = sum(f_iz p_i) - sum(p_iz f_i)``, horizontal parts. The other four bind
the forces alone, so ``m`` feet leave ``3 m - 4`` free coordinates ``x``, in which both are affine.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from gaitopt.conventions import FloatArray, frozen
from gaitopt.errors import InputError

LEAST_SPREAD = 1e-6
"""Feet that are nearer to one vertical line than this count as one point [m]. The forces then have
no torque about it, and the formulas below would divide by zero."""


class BalancedForces(NamedTuple):
    """All forces that hold a robot at rest: ``forces + basis x`` hold it with its COM at
    ``com + com_basis x``.

    Attributes:
        forces: equal vertical forces on all feet ``(..., m, 3)``, in units of the weight.
        basis: orthonormal in the space of all forces ``(..., m, 3, 3 m - 4)``.
        com: horizontal place of the COM for ``x = 0`` ``(..., 2)`` [m].
        com_basis: ``(..., 2, 3 m - 4)`` [m].
    """

    forces: FloatArray
    basis: FloatArray
    com: FloatArray
    com_basis: FloatArray


def balanced_forces(points: FloatArray) -> BalancedForces:
    """The forces that hold a robot at rest on contacts at ``points``.

    Args:
        points: contact points ``(..., m, 3)`` [m], ``m >= 2``.

    Raises:
        InputError: all feet stand at one horizontal place.
    """
    lead, m = points.shape[:-2], points.shape[-2]
    forces = np.zeros((*lead, m, 3))
    forces[..., 2] = 1.0 / m
    internal = internal_forces(points)
    middle = points.mean(axis=-2)
    arms = points - middle[..., None, :]
    return BalancedForces(
        forces=forces,
        basis=internal,
        com=middle[..., :2],
        com_basis=np.einsum("...ma,...mj->...aj", arms[..., :2], internal[..., 2, :])
        - np.einsum("...m,...maj->...aj", arms[..., 2], internal[..., :2, :]),
    )


def internal_forces(points: FloatArray) -> FloatArray:
    """Orthonormal basis ``(..., m, 3, 3 m - 4)`` of forces without sum and without yaw torque.

    Written down without a factorisation, so that it costs little for many stances at once.

    Args:
        points: contact points ``(..., m, 3)`` [m], ``m >= 2``.

    Raises:
        InputError: all feet stand at one horizontal place.
    """
    m = points.shape[-2]
    zero_sum = zero_sum_basis(m)
    # The yaw torque of horizontal forces in coordinates of this basis, x first and then y.
    x, y = points[..., 0] @ zero_sum, points[..., 1] @ zero_sum
    yaw = np.concatenate([-y, x], axis=-1)
    length = np.linalg.norm(yaw, axis=-1, keepdims=True)
    if not (length > LEAST_SPREAD).all():
        raise InputError(
            "the feet stand at one horizontal place, and do not hold the robot; move one of them"
        )
    out = np.zeros((*points.shape[:-2], m, 3, 3 * m - 4))
    square = orthogonal_complement(yaw / length)
    out[..., 0, : 2 * m - 3] = zero_sum @ square[..., : m - 1, :]
    out[..., 1, : 2 * m - 3] = zero_sum @ square[..., m - 1 :, :]
    out[..., 2, 2 * m - 3 :] = zero_sum
    return out


@lru_cache(maxsize=8)
def zero_sum_basis(m: int) -> FloatArray:
    """Orthonormal basis ``(m, m - 1)`` of the vectors of ``m`` numbers that add up to zero.

    Column ``k`` compares the first ``k + 1`` numbers with the next one (Helmert's matrix).
    """
    column = np.arange(1, m)
    upper = np.triu(np.ones((m, m - 1)))
    upper[column, column - 1] = -column
    return frozen(upper / np.sqrt(column * (column + 1.0)))


def orthogonal_complement(unit: FloatArray) -> FloatArray:
    """Orthonormal basis ``(..., k, k - 1)`` of what is square to the unit vectors ``(..., k)``."""
    k = unit.shape[-1]
    # A Householder reflection that takes the first axis to the vector, or to its opposite.
    mirror = unit.copy()
    mirror[..., 0] += np.where(unit[..., 0] < 0.0, -1.0, 1.0)
    scale = 2.0 / (mirror**2).sum(axis=-1)[..., None, None]
    reflection = np.eye(k) - scale * mirror[..., :, None] * mirror[..., None, :]
    return np.asarray(reflection[..., :, 1:])
