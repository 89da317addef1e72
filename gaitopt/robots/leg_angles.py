"""The trigonometry of a roll-pitch-pitch leg, in its leg frame (:mod:`gaitopt.robots.leg`).

:func:`roll_and_height`, :func:`height_in_plane` and :func:`pitch_angles` lead from the foot to the
angles, :class:`PitchDerivatives` from the angles to the foot and its derivatives. They are written
with NumPy's universal functions and take numbers, arrays of any shape (constants of many legs
included) and CasADi symbols.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np


def wrap_angle(angle: Any, centre: Any = 0.0) -> Any:
    """``angle`` [rad] shifted by whole turns into ``[centre - pi, centre + pi)``."""
    return angle - 2.0 * np.pi * np.floor((angle - centre + np.pi) / (2.0 * np.pi))


def roll_and_height(y: Any, z: Any, lateral: Any, *, clamp: bool = True) -> tuple[Any, Any]:
    """Roll angle of a leg, and height ``zeta`` of its foot over the roll axis in the leg's plane.

    Args:
        y, z: the foot in the leg frame [m].
        lateral: sideways offset ``d`` between hip and foot [m].
        clamp: a foot nearer to the roll axis than ``d`` cannot be reached: true gives the height 0
            for it, false gives NaN.

    Returns:
        Roll angle [rad] and height [m], not above 0.
    """
    height = height_in_plane(y, z, lateral, clamp=clamp)
    return np.arctan2(z, y) - np.arctan2(height, lateral), height


def height_in_plane(y: Any, z: Any, lateral: Any, *, clamp: bool = True) -> Any:
    """The height [m] of :func:`roll_and_height` alone; its arguments are the same."""
    return -np.sqrt(_not_negative(y * y + z * z - lateral**2, clamp))


def pitch_angles(
    x: Any, z: Any, upper: Any, lower: Any, knee: Any, *, clamp: bool = True
) -> tuple[Any, Any]:
    """Angles of thigh and knee [rad] that put the foot at a place in the leg's plane.

    Args:
        x, z: the foot from the first pitch axis, forward and up [m].
        upper, lower: lengths of upper and lower leg [m].
        knee: side to which the knee points, +1 forward or -1 backward.
        clamp: for a place that cannot be reached, true gives the straight or folded leg that points
            towards it, false gives NaN.
    """
    square = x * x + z * z
    # The half-angle form keeps full precision near the straight leg, where arccos loses half.
    to_straight = _not_negative((upper + lower) ** 2 - square, clamp)
    to_folded = _not_negative(square - (upper - lower) ** 2, clamp)
    angle = 2.0 * knee * np.arctan2(np.sqrt(to_straight), np.sqrt(to_folded))
    thigh = np.arctan2(-x, -z) - np.arctan2(lower * np.sin(angle), upper + lower * np.cos(angle))
    return thigh, angle


def _not_negative(value: Any, clamp: bool) -> Any:
    """``value``, raised to 0 when that is wanted."""
    return np.maximum(value, 0.0) if clamp else value


class PitchDerivatives(NamedTuple):
    """Derivatives of the foot's place in the leg's plane by the pitch angles [m/rad].

    The thigh's angle turns the whole leg about the first pitch axis. So the foot itself is at
    ``x = -thigh_z``, ``z = thigh_x`` from that axis.

    Attributes:
        thigh_x, thigh_z: derivatives of x (forward) and z (up) by the thigh's angle.
        knee_x, knee_z: derivatives by the knee's angle.
    """

    thigh_x: Any
    thigh_z: Any
    knee_x: Any
    knee_z: Any

    @classmethod
    def at(cls, thigh: Any, knee: Any, upper: Any, lower: Any) -> PitchDerivatives:
        """The derivatives at angles of thigh and knee [rad], for link lengths [m]."""
        shank = thigh + knee
        knee_x, knee_z = -lower * np.cos(shank), lower * np.sin(shank)
        return cls(knee_x - upper * np.cos(thigh), knee_z + upper * np.sin(thigh), knee_x, knee_z)

    def rates(self, thigh_rate: Any, knee_rate: Any) -> PitchDerivatives:
        """Time derivatives of these four, at given rates of both angles [rad/s]."""
        shank_rate = thigh_rate + knee_rate
        knee_x, knee_z = self.knee_z * shank_rate, -self.knee_x * shank_rate
        return PitchDerivatives(
            knee_x + (self.thigh_z - self.knee_z) * thigh_rate,
            knee_z - (self.thigh_x - self.knee_x) * thigh_rate,
            knee_x, knee_z,
        )  # fmt: skip
