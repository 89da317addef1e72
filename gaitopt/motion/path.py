"""The path of body and joints over time: a piecewise polynomial, kept exactly as planned.

Each segment is a polynomial in the time since its start, for the base's position, its roll, pitch
and yaw (R = Rz Ry Rx), and every joint. Degree one is a polyline in joint space, whose joint
velocities are constant between knots; planners of splines use higher degrees.

Values and derivatives are computed by scipy's :class:`scipy.interpolate.PPoly`. It adds the powers
from the lowest to the highest, so that the last bits differ from those of Horner's method.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from gaitopt.conventions import ByValue, FloatArray, frozen
from gaitopt.errors import InputError
from gaitopt.inputs import check_array, check_count, check_known, check_number

if TYPE_CHECKING:
    from scipy.interpolate import PPoly

BASE_COLUMNS = 6
"""Columns of a path that belong to the base; the joints' columns follow."""
MOST_DERIVATIVES = 10
"""Highest derivative of a path. Chosen: paths are of degree five at most."""
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
        if (np.diff(t) <= 0.0).any():
            raise InputError("a path's times must start at 0 and increase")
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

    @cached_property
    def polynomial(self) -> PPoly:
        """The path as scipy's piecewise polynomial; that of a single knot lasts for 1 s."""
        from scipy.interpolate import PPoly  # late: it takes as long to import as a plan

        return PPoly(self.coefficients, self.times if len(self.times) > 1 else np.array([0.0, 1.0]))

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
        return np.asarray(self.polynomial(inside, derivative))

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
        return jumps(self.polynomial, derivative)


def jumps(polynomial: PPoly, derivative: int = 0) -> FloatArray:
    """Size of the jumps of a derivative at the inner breakpoints ``(K - 2, n)``.

    Args:
        polynomial: piecewise, with ``K`` breakpoints and ``n`` columns.
        derivative: which one; 0 for the values.
    """
    check_count("derivative", derivative, 0, MOST_DERIVATIVES)
    coefficients = polynomial.derivative(derivative).c
    ends = np.polyval(coefficients, np.diff(polynomial.x)[:, None])
    return np.asarray(np.abs(coefficients[-1, 1:] - ends[:-1]))
