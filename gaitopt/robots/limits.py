"""Limits and motors of a robot's joints, read off its model in one way.

A joint without a limit has an infinite one: comparisons and divisions then need no special case. A
URDF says that there is none by a missing number, by a zero velocity or effort, or by a lower limit
that is no less than the upper one; Pinocchio hands these on as they are.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from gaitopt.conventions import FloatArray, frozen


def position_limits(model: Any) -> FloatArray:
    """Lower and upper limits of all joints after the free-flyer ``(2, nj)`` [rad].

    ``-inf`` and ``inf`` for joints without.
    """
    low, high = model.lowerPositionLimit[7:], model.upperPositionLimit[7:]
    stated = low < high
    return frozen([np.where(stated, low, -np.inf), np.where(stated, high, np.inf)])


def velocity_limits(model: Any) -> FloatArray:
    """Velocity limits of all joints after the free-flyer ``(nj,)`` [rad/s]; ``inf`` for none."""
    return _positive(model.velocityLimit[6:])


def effort_limits(model: Any) -> FloatArray:
    """Torque limits of all joints after the free-flyer ``(nj,)`` [N m]; ``inf`` for none."""
    return _positive(model.effortLimit[6:])


def acceleration_limits(model: Any, known: Mapping[str, float]) -> FloatArray:
    """Acceleration limits of all joints after the free-flyer ``(nj,)`` [rad/s^2]; ``inf`` for none.

    Args:
        model: as in :func:`motor_inertia`.
        known: the limits that were given, by joint.
    """
    return frozen(_by_joint(model, known, np.inf))


def motor_inertia(model: Any, known: Mapping[str, float]) -> FloatArray:
    """Inertia of the motors at all joints after the free-flyer ``(nj,)`` [kg m^2]; 0 for none.

    Args:
        model: the Pinocchio model, whose joints after the free-flyer have one velocity each.
        known: the inertias that are known, by joint.
    """
    return frozen(_by_joint(model, known, 0.0))


def torque_lines(model: Any, known: Mapping[str, tuple[float, float]]) -> FloatArray:
    """Speeds up to which joints have their whole torque, and at which they have none.

    Args:
        model: as in :func:`motor_inertia`.
        known: the speeds that are known, by joint [rad/s].

    Returns:
        ``(2, nj)`` [rad/s]; ``inf`` for joints whose torque does not fall.
    """
    found = np.full((2, model.nv - 6), np.inf)
    for name, joint in zip(list(model.names)[2:], list(model.joints)[2:], strict=True):
        if str(name) in known and joint.nv == 1:
            found[:, joint.idx_v - 6] = known[str(name)]
    return frozen(found)


def _by_joint(model: Any, known: Mapping[str, float], otherwise: float) -> FloatArray:
    """Numbers of all joints after the free-flyer ``(nj,)``, of which some are known by joint."""
    found = np.full(model.nv - 6, otherwise)
    for name, joint in zip(list(model.names)[2:], list(model.joints)[2:], strict=True):
        found[joint.idx_v - 6 : joint.idx_v - 6 + joint.nv] = known.get(str(name), otherwise)
    return found


def _positive(limits: FloatArray) -> FloatArray:
    return frozen(np.where(limits > 0.0, limits, np.inf))
