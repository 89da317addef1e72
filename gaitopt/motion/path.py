"""The path of body and joints over time: a piecewise polynomial, kept exactly as planned.

Each segment is a polynomial in the time since its start, for the base's position, its roll, pitch
and yaw (R = Rz Ry Rx), and every joint. Degree one is a polyline in joint space, whose joint
velocities are constant between knots; planners of splines use higher degrees.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from gaitopt.conventions import FloatArray, frozen
from gaitopt.errors import InputError

FARTHEST = 1e9
"""How far a path may lead by a coarse bound [m, rad]: beyond lies a mistake."""


@dataclass(frozen=True, eq=False)
class MotionPath:
    """Body and joints over time.

    Attributes:
        times: knots ``(K,)``, strictly increasing from 0 [s].
        coefficients: ``(degree + 1, K - 1, 6 + nj)``, highest power first, in the time since the
            segment's start; columns are the base's x, y, z [m], roll, pitch, yaw [rad] and the
            joints [rad]. A path of one knot (``K = 1``) has one segment, its constant.
    """

    times: FloatArray
    coefficients: FloatArray

    def __post_init__(self) -> None:
        times, coefficients = frozen(self.times), frozen(self.coefficients)
        if times.ndim != 1 or len(times) < 1 or coefficients.ndim != 3:
            raise InputError(
                f"a path needs times (K,) and coefficients (degree + 1, K - 1, n), got "
                f"{times.shape} and {coefficients.shape}"
            )
        if coefficients.shape[1] != max(len(times) - 1, 1) or coefficients.shape[0] < 1:
            raise InputError(
                f"a path of {len(times)} knots needs {max(len(times) - 1, 1)} segments, got "
                f"{coefficients.shape[1]}"
            )
        if not (np.isfinite(times).all() and np.isfinite(coefficients).all()):
            raise InputError("a path's times and coefficients must be finite")
        lengths = np.diff(times) if len(times) > 1 else np.zeros(1)
        sizes = np.abs(coefficients).max(axis=2)[::-1]
        reach = float(sum(size * lengths**k for k, size in enumerate(sizes)).max())
        if not reach < FARTHEST:
            raise InputError(
                f"a path leads {reach:.3g} m or rad away; at most {FARTHEST:g} is taken"
            )
        if times[0] != 0.0 or (np.diff(times) <= 0.0).any():
            raise InputError("a path's times must start at 0 and increase")
        object.__setattr__(self, "times", times)
        object.__setattr__(self, "coefficients", coefficients)

    @classmethod
    def polyline(cls, times: ArrayLike, values: ArrayLike) -> MotionPath:
        """The path that joins ``values (K, 6 + nj)`` at ``times (K,)`` by straight lines."""
        t, y = np.asarray(times, dtype=np.float64), np.asarray(values, dtype=np.float64)
        if len(t) == 1:
            return cls(t, y[None])
        slopes = np.diff(y, axis=0) / np.diff(t)[:, None]
        return cls(t, np.stack([slopes, y[:-1]]))

    @property
    def duration(self) -> float:
        """Time of the last knot [s]."""
        return float(self.times[-1])

    @property
    def degree(self) -> int:
        """Degree of the polynomials."""
        return len(self.coefficients) - 1

    def segment(self, times: ArrayLike) -> np.ndarray:
        """Index of the segment that holds each time, the later one at a knot."""
        found = np.searchsorted(self.times, times, side="right") - 1
        return np.clip(found, 0, self.coefficients.shape[1] - 1)

    def evaluate(self, times: ArrayLike, derivative: int = 0) -> FloatArray:
        """Values, or their ``derivative``-th time derivative, at ``times (N,)``: ``(N, 6 + nj)``.

        Times outside the path are moved to its ends. At a knot a derivative is the later
        segment's, and the last segment's at the end.
        """
        t = np.clip(np.asarray(times, dtype=np.float64), 0.0, self.duration)
        index = self.segment(t)
        local = (t - self.times[index])[..., None]
        out = np.zeros((*t.shape, self.coefficients.shape[2]))
        for power in range(self.degree, derivative - 1, -1):
            factor = float(np.prod(np.arange(power - derivative + 1, power + 1)))
            out = out * local + factor * self.coefficients[self.degree - power][index]
        return out

    def knots(self) -> FloatArray:
        """Values at all knots ``(K, 6 + nj)``."""
        return self.evaluate(self.times)

    def jumps(self, derivative: int = 0) -> FloatArray:
        """Jumps of a derivative at the knots between segments ``(K - 2, 6 + nj)``."""
        if len(self.times) < 3:
            return np.zeros((0, self.coefficients.shape[2]))
        lengths = np.diff(self.times)[:, None]
        ends, starts = np.zeros_like(self.coefficients[0]), np.zeros_like(self.coefficients[0])
        for power in range(self.degree, derivative - 1, -1):
            factor = float(np.prod(np.arange(power - derivative + 1, power + 1)))
            starts = factor * self.coefficients[self.degree - power]
            ends = ends * lengths + starts
        return np.asarray(np.abs(starts[1:] - ends[:-1]))
