"""The nominal route of a body at a commanded velocity: from rest to full speed, and to rest."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.swing.curve import smooth_step


@dataclass(frozen=True)
class BodyRoute:
    """The route of a body that follows one commanded twist, with smooth ramps at both ends.

    Over a ramp the share of full speed is ``10 u^3 - 15 u^4 + 6 u^5``, so velocity and acceleration
    are continuous everywhere. A constant twist gives an arc of a circle, whatever the ramp.

    Attributes:
        velocity: forward and sideways velocity in the body's own axes, at full speed [m/s].
        yaw_rate: at full speed, positive to the left [rad/s].
        heading: yaw at the start [rad].
        start: time at which the body begins to move [s].
        ramp: duration of the ramp to full speed, and of the one to rest [s].
        plateau: time at full speed [s].
    """

    velocity: tuple[float, float]
    yaw_rate: float
    heading: float
    start: float
    ramp: float
    plateau: float

    @property
    def end(self) -> float:
        """Time at which the body is at rest again [s]."""
        return self.start + 2.0 * self.ramp + self.plateau

    @property
    def breaks(self) -> tuple[float, ...]:
        """Times between which the motion is analytic [s]."""
        return (self.start, self.start + self.ramp, self.end - self.ramp, self.end)

    def progress(self, times: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Time at full speed that would lead as far, and two derivatives ``(N,)`` [s].

        The derivatives are the share of full speed, and its rate of change [1/s].
        """
        t = np.asarray(times, dtype=np.float64) - self.start
        total = 2.0 * self.ramp + self.plateau
        # The last ramp is the first one backward in time.
        up, down = np.clip(t, 0.0, self.ramp), np.clip(total - t, 0.0, self.ramp)
        middle = np.clip(t - self.ramp, 0.0, self.plateau)
        way = self._ramped(up) + middle
        way = np.where(t > total - self.ramp, way + 0.5 * self.ramp - self._ramped(down), way)
        u, d = up / self.ramp, down / self.ramp
        # Outside its own ramp each step is 1, and its slope is 0.
        speed = smooth_step(u) * smooth_step(d)
        change = (smooth_step(u, 1) - smooth_step(d, 1)) / self.ramp
        return np.asarray(way), np.asarray(speed), np.asarray(change)

    def _ramped(self, t: FloatArray) -> FloatArray:
        """Integral of the share of full speed over the first ramp, up to ``t`` after its start."""
        u = t / self.ramp
        return np.asarray(self.ramp * u**4 * (2.5 + u * (u - 3.0)))

    def position(self, times: FloatArray) -> FloatArray:
        """Positions relative to the start ``(N, 2)`` [m], in the world's axes."""
        return self._along(self.progress(times)[0])

    def yaw(self, times: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Yaw and two derivatives ``(N,)`` [rad], [rad/s], [rad/s^2]."""
        way, speed, change = self.progress(times)
        turned = self.heading + self.yaw_rate * way
        return turned, self.yaw_rate * speed, self.yaw_rate * change

    def motion(self, times: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Positions, velocities and accelerations ``(N, 2)`` in the world's axes."""
        way, speed, change = self.progress(times)
        angle = self.heading + self.yaw_rate * way
        c, s = np.cos(angle), np.sin(angle)
        vx, vy = self.velocity
        ahead = np.stack([c * vx - s * vy, s * vx + c * vy], axis=-1)
        inward = self.yaw_rate * np.stack([-ahead[..., 1], ahead[..., 0]], axis=-1)
        return (
            self._along(way),
            ahead * speed[..., None],
            inward * (speed**2)[..., None] + ahead * change[..., None],
        )

    def _along(self, way: FloatArray) -> FloatArray:
        """Positions after ``way`` seconds at full speed ``(..., 2)`` [m]."""
        turn = self.yaw_rate * way
        # sin(turn)/turn and (1 - cos(turn))/turn, exact for small angles, too.
        sine = np.sinc(turn / np.pi)
        cosine = 0.5 * turn * np.sinc(turn / (2.0 * np.pi)) ** 2
        vx, vy = self.velocity
        x, y = way * (vx * sine - vy * cosine), way * (vx * cosine + vy * sine)
        c, s = np.cos(self.heading), np.sin(self.heading)
        return np.stack([c * x - s * y, s * x + c * y], axis=-1)
