"""Closed-form kinematics of one leg: roll-pitch-pitch with offsets, or pitch-pitch.

The leg frame sits at the hip: x along the roll axis (forward), y along the pitch axes (left),
z = x cross y (up). In it, with the roll angle a1, the thigh's angle A and the knee's bend B (both
about +y; at A = B = 0 the leg hangs straight down)::

    px   = -l2 sin A - l3 sin(A + B)
    zeta = -u - l2 cos A - l3 cos(A + B)
    foot = (px, d cos a1 - zeta sin a1, d sin a1 + zeta cos a1)

``d`` is the sideways offset between hip and foot, ``u`` how far the pitch axis lies below the roll
axis. Eq. (11) of [Wang2020] is the case ``d = u = 0``. All functions are written
with NumPy's universal functions, so the same source runs on arrays and on CasADi symbols.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from gaitopt.conventions import FloatArray, frozen


def wrap_angle(angle: Any, centre: Any = 0.0) -> Any:
    """``angle`` [rad] shifted by whole turns into ``[centre - pi, centre + pi)``."""
    return angle - 2.0 * np.pi * np.floor((angle - centre + np.pi) / (2.0 * np.pi))


@dataclass(frozen=True, eq=False)
class Leg:
    """One leg, as constants read off the robot's model once.

    Attributes:
        name: one of ``"LF" "LH" "RH" "RF"``.
        joints: joint names from body to foot, two (pitch-pitch) or three (roll-pitch-pitch).
        foot: name of the foot's frame.
        hip: origin of the leg frame in the body frame ``(3,)`` [m].
        axes: leg frame's axes as columns, in the body frame ``(3, 3)``.
        lateral: offset ``d`` of the foot from the hip along the pitch axis [m], left positive.
        drop: how far the first pitch axis lies below the roll axis, ``u`` [m].
        upper, lower: lengths ``l2``, ``l3`` of upper and lower leg [m].
        signs: +1 or -1 for each joint: its sense of turning against the leg frame's axes.
        zeros: thigh angle and knee bend at zero joint angles ``(2,)`` [rad].
        knee: side to which the knee points: +1 forward, -1 backward.
        position_limits: lower and upper joint limits ``(2, nj)`` [rad].
        velocity_limits: joint velocity limits ``(nj,)`` [rad/s].
    """

    name: str
    joints: tuple[str, ...]
    foot: str
    hip: FloatArray
    axes: FloatArray
    lateral: float
    drop: float
    upper: float
    lower: float
    signs: tuple[float, ...]
    zeros: tuple[float, float]
    knee: float
    position_limits: FloatArray
    velocity_limits: FloatArray

    def __post_init__(self) -> None:
        for name in ("hip", "axes", "position_limits", "velocity_limits"):
            object.__setattr__(self, name, frozen(getattr(self, name)))

    @property
    def has_roll(self) -> bool:
        """Whether the leg has a roll joint, and so can move its foot sideways."""
        return len(self.joints) == 3

    def forward(self, q: Any) -> Any:
        """Foot position in the body frame.

        Args:
            q: joint angles ``(..., nj)`` [rad].

        Returns:
            ``(..., 3)`` [m]. Source: [Wang2020], eq. (11), with offsets.
        """
        q = np.asarray(q, dtype=np.float64)
        columns = [q[..., i] for i in range(len(self.joints))]
        return np.stack(self.forward_columns(*columns), axis=-1)

    def forward_columns(self, *q: Any) -> tuple[Any, Any, Any]:
        """:meth:`forward` on separate columns; takes arrays or CasADi symbols."""
        roll, thigh, bend = self._geometric(*q)
        px = -self.upper * np.sin(thigh) - self.lower * np.sin(thigh + bend)
        zeta = -self.drop - self.upper * np.cos(thigh) - self.lower * np.cos(thigh + bend)
        y = self.lateral * np.cos(roll) - zeta * np.sin(roll)
        z = self.lateral * np.sin(roll) + zeta * np.cos(roll)
        out = [self.hip[i] + self._row(i, px, y, z) for i in range(3)]
        return out[0], out[1], out[2]

    def inverse(self, point: Any) -> FloatArray:
        """Joint angles that put the foot at ``point``.

        The foot is taken below the roll axis and the knee on the leg's own :attr:`knee` side.
        Where the point cannot be reached the straight (or fully folded) leg towards it is
        returned: ask :meth:`shortfall` first when that matters.

        Args:
            point: foot position in the body frame ``(..., 3)`` [m].

        Returns:
            ``(..., nj)`` [rad], each angle within half a turn of the middle of its limits.
        """
        point = np.asarray(point, dtype=np.float64)
        columns = self.inverse_columns(point[..., 0], point[..., 1], point[..., 2])
        return np.stack(columns, axis=-1)

    def inverse_columns(self, x: Any, y: Any, z: Any) -> tuple[Any, ...]:
        """:meth:`inverse` on separate columns; takes arrays or CasADi symbols."""
        px, py, pz = self._in_leg_frame(x, y, z)
        zeta = self._hang(py, pz)
        roll = np.arctan2(pz, py) - np.arctan2(zeta, self.lateral)
        down = zeta + self.drop
        square = px * px + down * down
        # The half-angle form keeps full precision near the straight leg, where arccos loses half.
        straight, folded = (self.upper + self.lower) ** 2, (self.upper - self.lower) ** 2
        bend = (2.0 * self.knee) * np.arctan2(
            np.sqrt(np.maximum(straight - square, 0.0)), np.sqrt(np.maximum(square - folded, 0.0))
        )
        thigh = np.arctan2(-px, -down) - np.arctan2(
            self.lower * np.sin(bend), self.upper + self.lower * np.cos(bend)
        )
        angles: tuple[Any, ...] = (thigh - self.zeros[0], bend - self.zeros[1])
        if self.has_roll:
            angles = (roll, *angles)
        return tuple(
            wrap_angle(sign * angle, centre)
            for sign, angle, centre in zip(self.signs, angles, self._centres, strict=True)
        )

    def jacobian(self, q: Any) -> FloatArray:
        """Derivative of :meth:`forward`, ``(..., 3, nj)`` [m/rad], in the body frame.

        Source: [Wang2020], eq. (12), with the joint rate of the knee
        (``docs/papers.md``, errata).
        """
        q = np.asarray(q, dtype=np.float64)
        roll, thigh, bend = self._geometric(*[q[..., i] for i in range(len(self.joints))])
        s1, c1 = np.sin(roll), np.cos(roll)
        shank = thigh + bend
        low_x, low_z = -self.lower * np.cos(shank), self.lower * np.sin(shank)
        up_x, up_z = -self.upper * np.cos(thigh), self.upper * np.sin(thigh)
        zeta = -self.drop - self.upper * np.cos(thigh) - self.lower * np.cos(shank)
        zero = np.zeros_like(thigh)
        columns = [
            (zero, -self.lateral * s1 - zeta * c1, self.lateral * c1 - zeta * s1),
            (up_x + low_x, -(up_z + low_z) * s1, (up_z + low_z) * c1),
            (low_x, -low_z * s1, low_z * c1),
        ][-len(self.joints) :]
        local = np.stack([np.stack(np.broadcast_arrays(*c), axis=-1) for c in columns], axis=-1)
        return np.asarray(self.axes @ (local * np.array(self.signs)))

    def straightness(self, x: Any, y: Any, z: Any) -> Any:
        """Squared distance from the first pitch axis to the foot, ``s**2`` [m^2].

        The foot at ``(x, y, z)`` (body frame, [m]) is within reach when ``s**2 <= reach**2``. For
        ``d = u = 0`` this is the squared distance from the hip, eqs. (8), (9) of
        [Wang2020]. Convex in ``x, y`` for a foot below the hip.
        """
        px, py, pz = self._in_leg_frame(x, y, z)
        down = self._hang(py, pz) + self.drop
        return px * px + down * down

    @property
    def reach(self) -> float:
        """Greatest distance from first pitch axis to foot that the knee's limits allow [m]."""
        return self._extent[1]

    @property
    def least_reach(self) -> float:
        """Least distance from first pitch axis to foot that the knee's limits allow [m]."""
        return self._extent[0]

    def shortfall(self, point: Any) -> FloatArray:
        """How far ``point`` ``(..., 3)`` lies outside the leg's reach ``(...)`` [m]; 0 inside.

        Counts length (knee limits), and for a pitch-pitch leg the sideways distance to its plane.
        """
        point = np.asarray(point, dtype=np.float64)
        columns = point[..., 0], point[..., 1], point[..., 2]
        distance = np.sqrt(self.straightness(*columns))
        low, high = self._extent
        out = np.maximum(np.maximum(distance - high, low - distance), 0.0)
        _, py, pz = self._in_leg_frame(*columns)
        if not self.has_roll:
            return np.asarray(np.hypot(out, py - self.lateral))
        inside = np.maximum(abs(self.lateral) - np.hypot(py, pz), 0.0)
        return np.asarray(np.maximum(out, inside))

    @cached_property
    def _extent(self) -> tuple[float, float]:
        low, high = self.position_limits[:, -1]
        centre = self._centres[-1]
        ends = self.signs[-1] * np.array([max(low, centre - np.pi), min(high, centre + np.pi)])
        bends = np.sort(ends + self.zeros[1])
        side = np.clip(bends, 0.0, np.pi) if self.knee > 0 else np.clip(-bends, 0.0, np.pi)
        lengths = np.sqrt(
            self.upper**2 + self.lower**2 + 2.0 * self.upper * self.lower * np.cos(side)
        )
        return float(lengths.min()), float(lengths.max())

    @cached_property
    def _centres(self) -> tuple[float, ...]:
        low, high = self.position_limits
        bounded = np.isfinite(low) & np.isfinite(high)
        middle = (np.where(bounded, low, 0.0) + np.where(bounded, high, 0.0)) / 2.0
        return tuple(float(m) for m in middle)

    def _geometric(self, *q: Any) -> tuple[Any, Any, Any]:
        angles = [sign * angle for sign, angle in zip(self.signs, q, strict=True)]
        roll = angles[0] if self.has_roll else angles[0] * 0.0
        return roll, angles[-2] + self.zeros[0], angles[-1] + self.zeros[1]

    def _in_leg_frame(self, x: Any, y: Any, z: Any) -> tuple[Any, Any, Any]:
        dx, dy, dz = x - self.hip[0], y - self.hip[1], z - self.hip[2]
        a = self.axes
        return (
            a[0, 0] * dx + a[1, 0] * dy + a[2, 0] * dz,
            a[0, 1] * dx + a[1, 1] * dy + a[2, 1] * dz,
            a[0, 2] * dx + a[1, 2] * dy + a[2, 2] * dz,
        )

    def _row(self, i: int, px: Any, py: Any, pz: Any) -> Any:
        return self.axes[i, 0] * px + self.axes[i, 1] * py + self.axes[i, 2] * pz

    def _hang(self, py: Any, pz: Any) -> Any:
        """Height ``zeta`` of the foot below the roll axis in the leg's own plane (negative)."""
        if not self.has_roll:
            return pz
        return -np.sqrt(np.maximum(py * py + pz * pz - self.lateral**2, 0.0))
