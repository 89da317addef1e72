"""The nominal way of a body that is told a velocity: from rest, at speed, and to rest again."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gaitopt.conventions import FloatArray


@dataclass(frozen=True)
class BodyRoute:
    """A body that follows one commanded twist, ramped up and down smoothly.

    The speed goes like ``10 u^3 - 15 u^4 + 6 u^5`` over each ramp, so velocity and acceleration
    are continuous everywhere. A constant twist makes an arc of a circle, whatever the ramp.

    Attributes:
        velocity: forward and sideways velocity in the body's own axes [m/s].
        yaw_rate: turning left is positive [rad/s].
        heading: yaw at the start [rad].
        start: when the body begins to move [s].
        ramp: how long it takes to get to speed, and to come to rest [s].
        plateau: how long it is at speed [s].
    """

    velocity: tuple[float, float]
    yaw_rate: float
    heading: float
    start: float
    ramp: float
    plateau: float

    @property
    def end(self) -> float:
        """When the body is at rest again [s]."""
        return self.start + 2.0 * self.ramp + self.plateau

    @property
    def breaks(self) -> tuple[float, ...]:
        """Times at which the law of motion changes [s]."""
        return (self.start, self.start + self.ramp, self.end - self.ramp, self.end)

    def progress(self, times: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Seconds at full speed that the way so far amounts to, and two derivatives ``(N,)``."""
        t = np.asarray(times, dtype=np.float64) - self.start
        total = 2.0 * self.ramp + self.plateau
        # The end is the beginning run backward.
        up, down = np.clip(t, 0.0, self.ramp), np.clip(total - t, 0.0, self.ramp)
        middle = np.clip(t - self.ramp, 0.0, self.plateau)
        half = 0.5 * self.ramp
        way = self._ramped(up) + middle + np.where(t > total - self.ramp, half, 0.0)
        way = way - np.where(t > total - self.ramp, self._ramped(down), 0.0)
        u, d = up / self.ramp, down / self.ramp
        speed = np.where(t <= self.ramp, _smooth(u), np.where(t < total - self.ramp, 1.0,
                                                              _smooth(d)))  # fmt: skip
        change = np.where(t < self.ramp, _slope(u), np.where(t > total - self.ramp, -_slope(d),
                                                             0.0)) / self.ramp  # fmt: skip
        return np.asarray(way), np.asarray(speed), np.asarray(change)

    def _ramped(self, t: FloatArray) -> FloatArray:
        u = t / self.ramp
        return np.asarray(self.ramp * u**4 * (2.5 + u * (u - 3.0)))

    def position(self, times: FloatArray) -> FloatArray:
        """Place relative to the start ``(N, 2)`` [m], in the world's axes."""
        return self._along(self.progress(times)[0])

    def yaw(self, times: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Yaw and two derivatives ``(N,)`` [rad], [rad/s], [rad/s^2]."""
        way, speed, change = self.progress(times)
        turned = self.heading + self.yaw_rate * way
        return turned, self.yaw_rate * speed, self.yaw_rate * change

    def motion(self, times: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Place, velocity and acceleration ``(N, 2)`` in the world's axes."""
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
        """Place after ``way`` seconds at full speed ``(..., 2)``."""
        turn = self.yaw_rate * way
        # sin(t)/t and (1 - cos(t))/t, exact for small turns as well.
        sine = np.sinc(turn / np.pi)
        cosine = 0.5 * turn * np.sinc(turn / (2.0 * np.pi)) ** 2
        vx, vy = self.velocity
        x, y = way * (vx * sine - vy * cosine), way * (vx * cosine + vy * sine)
        c, s = np.cos(self.heading), np.sin(self.heading)
        return np.stack([c * x - s * y, s * x + c * y], axis=-1)


def _smooth(u: FloatArray) -> FloatArray:
    return np.asarray(u**3 * (10.0 + u * (6.0 * u - 15.0)))


def _slope(u: FloatArray) -> FloatArray:
    return np.asarray(30.0 * u**2 * (1.0 - u) ** 2)
