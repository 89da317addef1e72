"""Closed-form kinematics of one leg: roll-pitch-pitch with offsets, or pitch-pitch.

The leg frame sits at the hip: x along the roll axis (forward), y along the pitch axes (left),
z = x cross y (up). In it, with the roll angle a1, the thigh's angle A and the knee's angle B (both
about +y; at A = B = 0 the leg hangs straight down)::

    px   = -l2 sin A - l3 sin(A + B)
    zeta = -u - l2 cos A - l3 cos(A + B)
    foot = (px, d cos a1 - zeta sin a1, d sin a1 + zeta cos a1)

``d`` is the sideways offset between hip and foot, ``u`` how far the pitch axis lies below the roll
axis. Eq. (11) of [Wang2020] is the case ``d = u = 0``.

The trigonometry stands once, in :mod:`gaitopt.robots.leg_angles`. Legs with other axes are a
:class:`gaitopt.robots.general_leg.leg.GeneralLeg`, with the same interface.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike

from gaitopt.conventions import ByValue, FloatArray, frozen
from gaitopt.errors import InputError
from gaitopt.inputs import check_array, check_leads, check_shape
from gaitopt.robots.leg_angles import (
    PitchDerivatives,
    height_in_plane,
    pitch_angles,
    roll_and_height,
    wrap_angle,
)

REACH_TOLERANCE: Final = 1e-9
"""A foot that is out of reach by no more than this counts as reached [m], for rounding."""


FULL_TURN = 2.0 * np.pi - 1e-9
"""Range of a knee from which on it bends to every angle [rad]: a full turn, less rounding."""


@dataclass(frozen=True, eq=False)
class Leg(ByValue):
    """One leg, as constants read off the robot's model once.

    Angles and places that are not finite give NaN.

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
        zeros: angles of thigh and knee at zero joint angles ``(2,)`` [rad].
        knee: side to which the knee points: +1 forward, -1 backward.
        position_limits: lower and upper joint limits ``(2, nj)`` [rad]; ``-inf`` and ``inf`` for
            joints without.
        velocity_limits: joint velocity limits ``(nj,)`` [rad/s]; ``inf`` for joints without.
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

    def __repr__(self) -> str:
        knee = "forward" if self.knee > 0 else "backward"
        return (
            f"Leg({self.name}, {' '.join(self.joints)}, links {self.upper:.3f} and "
            f"{self.lower:.3f} m, knee {knee})"
        )

    def __post_init__(self) -> None:
        for name in ("hip", "axes", "position_limits", "velocity_limits"):
            object.__setattr__(self, name, frozen(check_array(name, getattr(self, name))))

    @property
    def has_roll(self) -> bool:
        """Whether the leg has a roll joint, and so can move its foot sideways."""
        return len(self.joints) == 3

    @property
    def is_general(self) -> bool:
        """Whether the leg has other axes than roll-pitch-pitch or pitch-pitch.

        It is then a :class:`gaitopt.robots.general_leg.leg.GeneralLeg`.
        """
        return False

    @property
    def is_closed_form(self) -> bool:
        """Whether :meth:`inverse` needs no iteration."""
        return True

    @property
    def constants(self) -> FloatArray:
        """All numbers that set the leg's kinematics ``(n,)``."""
        lengths = (self.upper, self.lower, self.lateral, self.drop)
        return np.hstack([self.hip, self.axes.ravel(), lengths, self.zeros])

    def forward(self, q: Any) -> Any:
        """Foot position in the body frame.

        Args:
            q: joint angles ``(..., nj)`` [rad].

        Returns:
            ``(..., 3)`` [m]. Source: [Wang2020], eq. (11), with offsets.
        """
        q = check_shape("q", q, len(self.joints))
        columns = [q[..., i] for i in range(len(self.joints))]
        return np.stack(self.forward_columns(*columns), axis=-1)

    def forward_columns(self, *q: Any) -> tuple[Any, Any, Any]:
        """:meth:`forward` on separate columns; takes arrays or CasADi symbols."""
        roll, thigh, knee = self._geometric(*q)
        pitch = PitchDerivatives.at(thigh, knee, self.upper, self.lower)
        height = pitch.thigh_x - self.drop
        sine, cosine = np.sin(roll), np.cos(roll)
        y = self.lateral * cosine - height * sine
        z = self.lateral * sine + height * cosine
        place = (-pitch.thigh_z, y, z)
        if not self._is_upright:
            place = tuple(self._row(i, *place) for i in range(3))
        return self.hip[0] + place[0], self.hip[1] + place[1], self.hip[2] + place[2]

    def inverse(self, point: Any) -> FloatArray:
        """Joint angles that put the foot at ``point``.

        The foot is taken below the roll axis and the knee on the leg's own :attr:`knee` side.
        For a point that cannot be reached, the straight or folded leg that points towards it is
        returned; :meth:`shortfall` tells whether it can.

        Args:
            point: foot position in the body frame ``(..., 3)`` [m].

        Returns:
            ``(..., nj)`` [rad], each angle within half a turn of the middle of its limits.
        """
        point = check_shape("point", point, 3)
        columns = self.inverse_columns(point[..., 0], point[..., 1], point[..., 2])
        return np.stack(columns, axis=-1)

    def inverse_columns(self, x: Any, y: Any, z: Any) -> tuple[Any, ...]:
        """:meth:`inverse` on separate columns; takes arrays or CasADi symbols."""
        px, py, pz = self._in_leg_frame(x, y, z)
        roll, height = roll_and_height(py, pz, self.lateral) if self.has_roll else (None, pz)
        thigh, knee = pitch_angles(px, height + self.drop, self.upper, self.lower, self.knee)
        angles: tuple[Any, ...] = (thigh - self.zeros[0], knee - self.zeros[1])
        if self.has_roll:
            angles = (roll, *angles)
        return tuple(
            wrap_angle(sign * angle, centre)
            for sign, angle, centre in zip(self.signs, angles, self.centres, strict=True)
        )

    def jacobian(self, q: Any) -> FloatArray:
        """Derivative of :meth:`forward`, ``(..., 3, nj)`` [m/rad], in the body frame.

        Args:
            q: joint angles ``(..., nj)`` [rad].

        Source: [Wang2020], eq. (12), with the joint rate of the knee (its errata).
        """
        angles = check_shape("q", q, len(self.joints))
        roll, thigh, knee = self._geometric(*np.moveaxis(angles, -1, 0))
        pitch = PitchDerivatives.at(thigh, knee, self.upper, self.lower)
        sine, cosine, height = np.sin(roll), np.cos(roll), pitch.thigh_x - self.drop
        return self._matrix([
            (0.0, -self.lateral * sine - height * cosine, self.lateral * cosine - height * sine),
            (pitch.thigh_x, -pitch.thigh_z * sine, pitch.thigh_z * cosine),
            (pitch.knee_x, -pitch.knee_z * sine, pitch.knee_z * cosine),
        ])  # fmt: skip

    def jacobian_rate(self, q: ArrayLike, rates: ArrayLike) -> FloatArray:
        """Derivative of :meth:`jacobian` over time ``(..., 3, nj)``, in the body frame.

        Its product with ``rates`` is the foot's acceleration at constant joint velocities.

        Args:
            q: joint angles ``(..., nj)`` [rad].
            rates: their derivatives ``(..., nj)`` [rad/s].

        Raises:
            InputError: an array has another shape.
        """
        count = len(self.joints)
        given = check_shape("q", q, count), check_shape("rates", rates, count)
        check_leads(q=given[0].shape[:-1], rates=given[1].shape[:-1])
        angles = np.moveaxis(given[0], -1, 0)
        speeds = np.moveaxis(given[1] * np.array(self.signs), -1, 0)
        roll, thigh, knee = self._geometric(*angles)
        turn = speeds[0] if self.has_roll else 0.0
        pitch = PitchDerivatives.at(thigh, knee, self.upper, self.lower)
        change = pitch.rates(speeds[-2], speeds[-1])
        sine, cosine, height = np.sin(roll), np.cos(roll), pitch.thigh_x - self.drop

        def pitch_column(z: Any, dx: Any, dz: Any) -> tuple[Any, Any, Any]:
            """Derivative of a pitch joint's column ``(x, -z sin, z cos)``."""
            return (dx, -dz * sine - z * cosine * turn, dz * cosine - z * sine * turn)

        climb = change.thigh_x
        return self._matrix([
            (
                0.0,
                (height * sine - self.lateral * cosine) * turn - climb * cosine,
                -(height * cosine + self.lateral * sine) * turn - climb * sine,
            ),
            pitch_column(pitch.thigh_z, change.thigh_x, change.thigh_z),
            pitch_column(pitch.knee_z, change.knee_x, change.knee_z),
        ])  # fmt: skip

    def joint_points(self, q: FloatArray) -> FloatArray:
        """Hip, pitch axis, knee and foot in the body frame ``(..., 4, 3)`` [m].

        Args:
            q: joint angles ``(..., nj)`` [rad].
        """
        # A leg without lower link ends at the knee; one without both links at the pitch axis.
        ends = (replace(self, upper=0.0, lower=0.0), replace(self, lower=0.0), self)
        points = [leg.forward(q) for leg in ends]
        return np.stack([np.broadcast_to(self.hip, points[0].shape), *points], axis=-2)

    def _matrix(self, columns: Sequence[tuple[Any, Any, Any]]) -> FloatArray:
        """Matrix ``(..., 3, nj)`` in the body frame of columns for roll, thigh and knee.

        The columns are in the leg frame, for the angles of :meth:`_geometric`.
        """
        own = columns[-len(self.joints) :]
        entries = np.broadcast_arrays(*[entry for column in own for entry in column])
        local = np.stack(entries, axis=-1).reshape(*entries[0].shape, len(own), 3)
        return np.asarray(self.axes @ (np.swapaxes(local, -1, -2) * np.array(self.signs)))

    def straightness(self, x: Any, y: Any, z: Any) -> Any:
        """Squared distance from the first pitch axis to the foot, ``s**2`` [m^2].

        The foot at ``(x, y, z)`` (body frame, [m]) is within reach when ``s**2 <= reach**2``. For
        ``d = u = 0`` this is the squared distance from the hip, eqs. (8), (9) of
        [Wang2020]. Convex in ``x, y`` for a foot below the hip.
        """
        return self._square(*self._in_leg_frame(x, y, z))

    def _square(self, x: Any, y: Any, z: Any) -> Any:
        """:meth:`straightness` of a place in the leg frame."""
        height = height_in_plane(y, z, self.lateral) if self.has_roll else z
        down = height + self.drop
        return x * x + down * down

    def length(self, point: Any) -> FloatArray:
        """Distance from the first pitch axis to places of the foot ``(..., 3)``: ``(...)`` [m]."""
        place = check_shape("point", point, 3)
        return np.asarray(np.sqrt(self.straightness(*np.moveaxis(place, -1, 0))))

    @property
    def reach(self) -> float:
        """Greatest distance from first pitch axis to foot that the knee's limits allow [m]."""
        return self._extent[1]

    @property
    def levers(self) -> FloatArray:
        """Bounds on the foot's distance from the axis of each joint ``(nj,)`` [m]."""
        straight = self.upper + self.lower
        pitch = [straight, self.lower]
        return np.array([np.hypot(self.lateral, self.drop + straight)][: self.has_roll] + pitch)

    @property
    def least_reach(self) -> float:
        """Least distance from first pitch axis to foot that the knee's limits allow [m]."""
        return self._extent[0]

    def shortfall(self, point: Any) -> FloatArray:
        """How far ``point`` ``(..., 3)`` lies outside the leg's reach ``(...)`` [m]; 0 inside.

        Counts length (knee limits), and for a pitch-pitch leg the sideways distance to its plane.
        """
        point = check_shape("point", point, 3)
        px, py, pz = self._in_leg_frame(point[..., 0], point[..., 1], point[..., 2])
        distance = np.sqrt(self._square(px, py, pz))
        low, high = self._extent
        out = np.maximum(np.maximum(distance - high, low - distance), 0.0)
        if not self.has_roll:
            return np.asarray(np.hypot(out, py - self.lateral))
        if self.lateral == 0.0:
            return np.asarray(out)
        inside = np.maximum(abs(self.lateral) - np.hypot(py, pz), 0.0)
        return np.asarray(np.maximum(out, inside))

    def gap_in_words(self, point: FloatArray) -> str:
        """What is wrong with a place ``(3,)`` in the body frame that the leg does not reach."""
        point = check_shape("point", point, 3)
        if point.ndim != 1:
            raise InputError(f"point must be (3,), got {point.shape}")
        distance = float(np.sqrt(self.straightness(*point)))
        aside = float((point - self.hip) @ self.axes[:, 1])
        what = f"{distance:.4g} m from the hip's pitch axis, and the knee allows "
        what += f"{self.least_reach:.4g} to {self.reach:.4g} m"
        if not self.has_roll and abs(aside - self.lateral) > REACH_TOLERANCE:
            what += (
                f", and {abs(aside - self.lateral):.4g} m beside the plane of a leg without roll"
            )
        elif self.has_roll and self.least_reach <= distance <= self.reach:
            what = f"nearer to its roll axis than its sideways offset of {abs(self.lateral):.4g} m"
        return what

    @cached_property
    def _extent(self) -> tuple[float, float]:
        """Least and greatest distance from first pitch axis to foot that the knee allows [m]."""
        low, high = self.position_limits[:, -1]
        centre = self.centres[-1]
        ends = self.signs[-1] * np.array([max(low, centre - np.pi), min(high, centre + np.pi)])
        angles = np.sort(ends + self.zeros[1])
        side = np.clip(angles if self.knee > 0 else -angles, 0.0, np.pi)
        if np.ptp(angles) > FULL_TURN:  # wherever its zero is
            side = np.array([0.0, np.pi])
        square = self.upper**2 + self.lower**2 + 2.0 * self.upper * self.lower * np.cos(side)
        # Links of one length fold to nothing, and rounding may make that negative.
        lengths = np.sqrt(np.maximum(square, 0.0))
        return float(lengths.min()), float(lengths.max())

    @cached_property
    def centres(self) -> tuple[float, ...]:
        """Middle of each joint's limits [rad]; 0 for joints without."""
        low, high = self.position_limits
        bounded = np.isfinite(low) & np.isfinite(high)
        middle = (np.where(bounded, low, 0.0) + np.where(bounded, high, 0.0)) / 2.0
        return tuple(float(m) for m in middle)

    @cached_property
    def _is_upright(self) -> bool:
        """Whether the leg frame's axes are those of the body, as most robots have them."""
        return bool((self.axes == np.eye(3)).all())

    def _geometric(self, *q: Any) -> tuple[Any, Any, Any]:
        """Angles of roll, thigh and knee of the leg's geometry, from joint angles [rad]."""
        angles = [sign * angle for sign, angle in zip(self.signs, q, strict=True)]
        roll = angles[0] if self.has_roll else angles[0] * 0.0
        return roll, angles[-2] + self.zeros[0], angles[-1] + self.zeros[1]

    def _in_leg_frame(self, x: Any, y: Any, z: Any) -> tuple[Any, Any, Any]:
        """A point of the body frame in the leg frame [m]."""
        dx, dy, dz = x - self.hip[0], y - self.hip[1], z - self.hip[2]
        if self._is_upright:
            return dx, dy, dz
        a = self.axes
        return (
            dx * a[0, 0] + dy * a[1, 0] + dz * a[2, 0],
            dx * a[0, 1] + dy * a[1, 1] + dz * a[2, 1],
            dx * a[0, 2] + dy * a[1, 2] + dz * a[2, 2],
        )

    def _row(self, i: int, px: Any, py: Any, pz: Any) -> Any:
        """Component ``i`` in the body frame of a vector of the leg frame."""
        return self.axes[i, 0] * px + self.axes[i, 1] * py + self.axes[i, 2] * pz
