"""The path of body and joints over time: a piecewise polynomial, kept exactly as planned.

Each segment is a polynomial in the time since its start, for the base's position, its roll, pitch
and yaw (R = Rz Ry Rx), and every joint. Degree one is a polyline in joint space, whose joint
velocities are constant between knots; planners of splines use higher degrees.

Values and derivatives are those of scipy's :class:`scipy.interpolate.PPoly`, bit by bit: the powers
are added from the lowest to the highest. They are computed here, in as much time, because a program
that walks would need nothing else of ``scipy.interpolate``, whose import takes longer than a plan.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import perm

import numpy as np
from numpy.typing import ArrayLike

from gaitopt.conventions import ByValue, FloatArray, frozen, made
from gaitopt.errors import InputError
from gaitopt.inputs import check_array, check_count, check_known, check_number

BASE_COLUMNS = 6
"""Columns of a path that belong to the base; the joints' columns follow."""
MOST_DERIVATIVES = 10
"""Highest derivative of a path. Chosen: paths are of degree five at most."""
IN_CACHE = 1024
"""Instants at which a path is evaluated together. Measured: the processor's caches hold them."""
FARTHEST = 1e9
"""Largest value that a path may reach [m, rad], by a coarse bound. Anything above is a mistake."""


@dataclass(frozen=True, eq=False)
class MotionPath(ByValue):
    """Body and joints over time.

    Attributes:
        times: knots ``(K,)``, strictly increasing from 0 [s].
        coefficients: ``(degree + 1, K - 1, 6 + nj)``, highest power first, in the time since the
            segment's start; columns are the base's x, y, z [m], roll, pitch, yaw [rad] and the
            joints [rad]. A path of one knot (``K = 1``) has one segment, its constant.

    Raises:
        InputError: shapes do not fit, a number is not finite, times do not increase from 0, or
            values are beyond :data:`FARTHEST`.
    """

    times: FloatArray
    coefficients: FloatArray

    def __repr__(self) -> str:
        degree, columns = len(self.coefficients) - 1, self.coefficients.shape[2]
        return (
            f"MotionPath({len(self.times)} knots, degree {degree}, {columns} columns, "
            f"{self.times[-1]:.3f} s)"
        )

    def __post_init__(self) -> None:
        times = frozen(check_array("times", self.times))
        coefficients = frozen(check_array("coefficients", self.coefficients))
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
        farthest = float(np.polyval(np.abs(coefficients).max(axis=2), lengths).max())
        if not farthest < FARTHEST:
            raise InputError(
                f"a path leads {farthest:.3g} m or rad away; at most {FARTHEST:g} is taken"
            )
        if times[0] != 0.0 or (np.diff(times) <= 0.0).any():
            raise InputError("a path's times must start at 0 and increase")
        object.__setattr__(self, "times", times)
        object.__setattr__(self, "coefficients", coefficients)

    @classmethod
    def polyline(cls, times: ArrayLike, values: ArrayLike) -> MotionPath:
        """The path that joins ``values (K, 6 + nj)`` at ``times (K,)`` by straight lines."""
        t, y = check_array("times", times), check_array("values", values)
        if t.ndim != 1 or y.ndim != 2 or len(t) != len(y) or not len(t):
            raise InputError(f"a path needs times (K,) and values (K, n), got {t.shape}, {y.shape}")
        if t[0] != 0.0 or (np.diff(t) <= 0.0).any():
            raise InputError("a path's times must start at 0 and increase")
        if len(t) == 1:
            return cls(t, y[None])
        coefficients = np.empty((2, len(t) - 1, y.shape[1]))
        np.divide(np.diff(y, axis=0), np.diff(t)[:, None], out=coefficients[0])
        coefficients[1] = y[:-1]
        # What nobody can change need not be copied.
        coefficients.setflags(write=False)
        # Between two knots no straight line is farther away than at one of them.
        farthest = max(float(y.max()), -float(y.min())) if y.size else 0.0
        if farthest < FARTHEST and np.isfinite(coefficients[0]).all() and np.isfinite(t[-1]):
            return made(cls, times=frozen(t), coefficients=coefficients)
        return cls(t, coefficients)

    @property
    def duration(self) -> float:
        """Time of the last knot [s]."""
        return float(self.times[-1])

    @property
    def degree(self) -> int:
        """Degree of the polynomials."""
        return len(self.coefficients) - 1

    @property
    def lengths(self) -> FloatArray:
        """Durations of all segments ``(K - 1,)`` [s]; 1 s for that of a single knot."""
        return np.asarray(np.diff(self.times)) if len(self.times) > 1 else np.ones(1)

    def segment(self, times: ArrayLike) -> np.ndarray:
        """Index of the segment that holds each time, the later one at a knot."""
        found = np.searchsorted(self.times, check_known("times", times), side="right") - 1
        return np.clip(found, 0, self.coefficients.shape[1] - 1)

    def evaluate(self, times: ArrayLike, derivative: int = 0) -> FloatArray:
        """Values, or their ``derivative``-th time derivative, at ``times (N,)``: ``(N, 6 + nj)``.

        Times outside the path are moved to its ends. At a knot a derivative is the later
        segment's, and the last segment's at the end.
        """
        if type(derivative) is not int or derivative:
            check_count("derivative", derivative, 0, MOST_DERIVATIVES)
        inside = np.clip(check_known("times", times), 0.0, self.duration)
        segments = self.segment(inside)
        since = inside - self.times[segments]
        found = _values(self.coefficients, segments.ravel(), since.ravel(), int(derivative))
        return found.reshape(*inside.shape, self.coefficients.shape[2])

    def slowed(self, factor: float) -> MotionPath:
        """The same values at ``factor`` times the times.

        Raises:
            InputError: the factor is no positive number.
        """
        factor = check_number("factor", factor, 1e-6, 1e6)
        powers = np.arange(self.degree, -1, -1)[:, None, None]
        return MotionPath(self.times * factor, self.coefficients / factor**powers)

    def knots(self) -> FloatArray:
        """Values at all knots ``(K, 6 + nj)``."""
        return self.evaluate(self.times)

    def jumps(self, derivative: int = 0) -> FloatArray:
        """Jumps of a derivative at the knots between segments ``(K - 2, 6 + nj)``."""
        check_count("derivative", derivative, 0, MOST_DERIVATIVES)
        return jumps(derived(self.coefficients, derivative), self.lengths)


def jumps(coefficients: FloatArray, lengths: FloatArray) -> FloatArray:
    """Size of the jumps of a piecewise polynomial between its segments ``(S - 1, n)``.

    Args:
        coefficients: ``(degree + 1, S, n)``, highest power first, in the time since a segment's
            start.
        lengths: of the segments ``(S,)``.
    """
    ends = np.polyval(coefficients, lengths[:, None])
    return np.asarray(np.abs(coefficients[-1, 1:] - ends[:-1]))


def derived(coefficients: FloatArray, derivative: int) -> FloatArray:
    """Coefficients of a derivative of a piecewise polynomial, highest power first."""
    degree = len(coefficients) - 1
    if derivative > degree:
        return np.zeros((1, *coefficients.shape[1:]))
    factors = np.array([perm(power, derivative) for power in range(degree, derivative - 1, -1)])
    return np.asarray(coefficients[: len(factors)] * factors[:, None, None].astype(float))


def _values(
    coefficients: FloatArray, segments: np.ndarray, since: FloatArray, derivative: int
) -> FloatArray:
    """A derivative at instants ``since (N,)`` the starts of their ``segments (N,)``: ``(N, n)``."""
    degree = len(coefficients) - 1
    out = np.zeros((len(since), coefficients.shape[2]))
    for first in range(0, len(since), IN_CACHE):
        part = slice(first, first + IN_CACHE)
        time, total = since[part, None], out[part]
        term, power_of_time = np.empty_like(total), None
        for power in range(derivative, degree + 1):
            row = coefficients[degree - power]
            np.take(row, segments[part], axis=0, out=term, mode="clip")
            if power_of_time is not None:
                term *= power_of_time
            if derivative:
                term *= float(perm(power, derivative))
            total += term
            power_of_time = time if power_of_time is None else power_of_time * time
    return out
