"""Limits of a robot's joints, read off its model in one way.

A joint without a limit has an infinite one: comparisons and divisions then need no special case. A
URDF says that there is none by a missing number, by a zero velocity or effort, or by a lower limit
that is no less than the upper one; Pinocchio hands these on as they are.
"""

from __future__ import annotations

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


def _positive(limits: FloatArray) -> FloatArray:
    return frozen(np.where(limits > 0.0, limits, np.inf))
