"""What bounds the speed along a course besides forces, torques and joint velocities."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.motion.path import BASE_COLUMNS

HEIGHT = 2
"""Column of the base's height."""

BEYOND = 1e6
"""Limit of accelerations of joints that have none, as a multiple of the largest of the others."""


@dataclass(frozen=True)
class OtherLimits:
    """What bounds the speed besides forces, torques and joint velocities.

    Attributes:
        acceleration: of all joints [rad/s^2]; infinite for none.
        scales: this limit over each joint's own ``(nj,)``, where these differ.
        speed: of body and feet on straight lines [m/s].
        faster: how many times as fast as the plan a smooth motion becomes at most; a straight line
            takes at least this part of a second. Only waiting, where nothing moves, has no other
            limit.
        lift: vertical acceleration of the base [m/s^2], where forces are promised.
        gentle: the same where it is to be gentler: until the first and from the second of these
            times of the plan on [m/s^2, s, s].
    """

    acceleration: float = np.inf
    scales: FloatArray | float = 1.0
    speed: float = np.inf
    faster: float = 100.0
    lift: float = np.inf
    gentle: tuple[float, float, float] | None = None

    @classmethod
    def of_joints(cls, accelerations: FloatArray) -> OtherLimits:
        """Limits of the joints' accelerations ``(nj,)`` alone [rad/s^2], infinite for none."""
        bounded = np.isfinite(accelerations)
        if not bounded.any():
            return cls()
        most = float(accelerations[bounded].max())
        # Joints without a limit get one that none of them ever needs.
        return cls(acceleration=most, scales=most / np.minimum(accelerations, BEYOND * most))

    def lifts(self, times: FloatArray) -> FloatArray:
        """Limits on the vertical acceleration at times of the plan ``(S,)`` [m/s^2]."""
        if self.gentle is None:
            return np.full(len(times), self.lift)
        most, until, since = self.gentle
        gentle = (times <= until) | (times >= since)
        return np.where(gentle, min(most, self.lift), self.lift)

    def bounding(
        self, first: FloatArray, second: FloatArray, times: FloatArray
    ) -> tuple[FloatArray, FloatArray, float, FloatArray]:
        """Whose accelerations are limited: the joints, and the base's height if :attr:`lifts` are.

        Args:
            first, second: derivatives of the columns of a path by its parameter ``(S, 6 + nj)``.
            times: of the plan, there ``(S,)`` [s].

        Returns:
            The derivatives ``(S, n)``, the limit of them all, and it over the least limit of each.
        """
        columns = np.arange(BASE_COLUMNS, first.shape[1])
        most = self.acceleration
        scales = np.broadcast_to(np.asarray(self.scales, dtype=np.float64), len(columns))
        lifts = self.lifts(times)
        least = float(lifts.min())
        if not np.isfinite(least):
            return first[:, columns] * scales, second[:, columns] * scales, most, scales
        columns = np.append(columns, HEIGHT)
        # Joints without a limit get one that none of them ever needs.
        most, own = (most, 1.0) if np.isfinite(most) else (least, 1.0 / BEYOND)
        scales = np.append(own * scales, most / least)
        slopes, bends = first[:, columns] * scales, second[:, columns] * scales
        # Where the height may change faster it counts less.
        for each in (slopes, bends):
            each[:, -1] *= least / lifts
        return slopes, bends, most, scales
