"""A joint spline: its curve, and how much of each limit it uses.

All properties of a :class:`JointSpline` are computed from its knots and intervals alone. These come
from :func:`uniform_spline`, or from :mod:`gaitopt.optimize.spline.solver`.

Source: [Shao2011], Section III.B.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import CubicSpline

from gaitopt.conventions import FloatArray, TextEnum, frozen
from gaitopt.errors import InputError
from gaitopt.inputs import as_text, check_array, check_count, check_known, check_number
from gaitopt.motion.path import derived, jumps
from gaitopt.optimize.spline.clamped import (
    ROUNDING_RESERVE,
    checked_angles,
    clamped_spline,
    peaks,
    stretch_to_limits,
)
from gaitopt.optimize.spline.limits import JointLimits

KINDS = ("velocity", "acceleration", "jerk")

ACTIVE_SHARE = 0.999
"""Share of a limit from which it counts as active."""


class SplineStatus(TextEnum):
    """Where the intervals of a spline come from."""

    SOLVED = "solved"
    """They are the optimum of eq. (7)."""
    SCALED = "scaled"
    """They were given, and stretched by one factor until all limits are kept."""


class ActiveBound(NamedTuple):
    """A limit that is reached.

    Attributes:
        joint: its column.
        interval: which interval, from 0.
        kind: ``"velocity"``, ``"acceleration"`` or ``"jerk"``.
        share: the largest value there over its limit.
    """

    joint: int
    interval: int
    kind: str
    share: float


@dataclass(frozen=True)
class SolverReport:
    """IPOPT's report of the run that led to a spline, and the residuals of its solution.

    Attributes:
        message: IPOPT's own status.
        iterations: number of its iterations.
        seconds: time in it [s].
        violation: largest share by which its solution exceeded a limit, before it was stretched.
        stationarity: largest entry of the Lagrangian's gradient, the cost being of order one.
        complementarity: largest product of a multiplier and the slack of its constraint.
    """

    message: str
    iterations: int
    seconds: float
    violation: float
    stationarity: float
    complementarity: float


@dataclass(frozen=True, eq=False)
class JointSpline:
    """A cubic spline through joint angles: twice differentiable, at rest at both ends.

    Attributes:
        angles: knots ``(n, nj)`` [rad].
        intervals: times between them ``(n - 1,)`` [s].
        limits: that it is meant to keep on the whole curve.
        status: where the intervals come from.
        report: the solver's report; ``None`` when none was asked.
    """

    angles: FloatArray
    intervals: FloatArray
    limits: JointLimits
    status: SplineStatus = SplineStatus.SCALED
    report: SolverReport | None = None

    def __post_init__(self) -> None:
        angles, intervals = (
            checked_angles(self.angles, self.limits),
            frozen(check_array("intervals", self.intervals)),
        )
        good = intervals.shape == (len(angles) - 1,) and np.isfinite(intervals).all()
        if not good or not (intervals > 0.0).all():
            raise InputError(
                f"a spline through {len(angles)} knots needs {len(angles) - 1} positive intervals, "
                f"got {as_text(self.intervals)}"
            )
        object.__setattr__(self, "angles", angles)
        object.__setattr__(self, "intervals", intervals)

    @cached_property
    def times(self) -> FloatArray:
        """Times of the knots ``(n,)`` from 0 [s]."""
        return frozen(np.concatenate([[0.0], np.cumsum(self.intervals)]))

    @property
    def duration(self) -> float:
        """Total time [s]."""
        return float(self.times[-1])

    @cached_property
    def polynomial(self) -> CubicSpline:
        """The spline as scipy's."""
        return clamped_spline(self.angles, self.intervals)

    @cached_property
    def coefficients(self) -> FloatArray:
        """``(4, n - 1, nj)``, highest power first, in the time since each interval's start.

        The layout of :class:`gaitopt.motion.path.MotionPath`, for the joints alone.
        """
        return frozen(self.polynomial.c)

    def evaluate(self, times: ArrayLike, derivative: int = 0) -> FloatArray:
        """Angles, or their ``derivative``-th time derivative, at ``times (N,)``: ``(N, nj)``.

        Times outside are moved to the ends; at a knot the later interval counts.
        """
        inside = np.clip(check_known("times", times), 0.0, self.duration)
        return np.asarray(self.polynomial(inside, check_count("derivative", derivative, 0, 10)))

    @cached_property
    def largest_velocities(self) -> FloatArray:
        """Largest joint velocities on each interval ``(n - 1, nj)`` [rad/s], exact."""
        return frozen(peaks(self.polynomial)[0])

    @cached_property
    def shares(self) -> FloatArray:
        """Largest velocity, acceleration, jerk on each interval over its limit ``(3, n - 1, nj)``.

        Exact for the whole curve: the extremes of a cubic's derivatives have a closed form.
        """
        limits = np.stack([getattr(self.limits, kind) for kind in KINDS])
        return frozen(peaks(self.polynomial) / limits[:, None])

    @property
    def violation(self) -> float:
        """Largest share by which a limit is exceeded anywhere; 0 when all are kept."""
        return max(float(self.shares.max()) - 1.0, 0.0)

    @property
    def jumps(self) -> FloatArray:
        """Largest jumps at inner knots of angle, velocity and acceleration, and final velocity.

        ``(4,)`` [rad, rad/s, rad/s^2, rad/s]; of the size of rounding errors.
        """
        inner = [
            jumps(derived(self.coefficients, k), self.intervals).max(initial=0.0) for k in range(3)
        ]
        final = np.abs(self.polynomial(self.duration, 1)).max()
        return np.array([*inner, final])

    def active(self, share: float = ACTIVE_SHARE) -> tuple[ActiveBound, ...]:
        """The limits of which at least ``share`` is used, interval by interval."""
        least = check_number("share", share, 0.0, 1e6)
        kinds, intervals, joints = np.nonzero(self.shares >= least)
        found = [
            ActiveBound(int(j), int(i), KINDS[k], float(self.shares[k, i, j]))
            for k, i, j in zip(kinds, intervals, joints, strict=True)
        ]
        return tuple(sorted(found, key=lambda bound: (bound.interval, bound.joint)))

    def cost(self, time_weight: float, acceleration_weight: float) -> float:
        """The objective of eq. (7): weighted sum of time and squared accelerations at all knots."""
        for name, weight in (
            ("time_weight", time_weight),
            ("acceleration_weight", acceleration_weight),
        ):
            check_number(name, weight, 0.0, 1e12)
        accelerations = self.evaluate(self.times, 2)
        return time_weight * self.duration + acceleration_weight * float((accelerations**2).sum())

    def position_range(self) -> tuple[FloatArray, FloatArray]:
        """Least and greatest angle of each joint on the whole curve ``(nj,)`` [rad], exact."""
        cubic, square, slope, _ = self.coefficients
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            root = np.sqrt(np.maximum(square**2 - 3.0 * cubic * slope, 0.0))
            big = -(square + np.copysign(root, square))
            # Zeros of the velocity, by the form of the quadratic formula without cancellation.
            zeros = np.nan_to_num(
                np.stack([big / (3.0 * cubic), slope / big]), posinf=0.0, neginf=0.0
            )
        local = np.clip(zeros, 0.0, self.intervals[:, None])
        curve = self.coefficients
        values = ((curve[0] * local + curve[1]) * local + curve[2]) * local + curve[3]
        every = np.concatenate([values.reshape(-1, self.angles.shape[1]), self.angles])
        return every.min(axis=0), every.max(axis=0)

    def stretched(self, factor: float) -> JointSpline:
        """The same curve in ``factor`` times the time; the result is scaled.

        Raises:
            InputError: the factor is no positive number.
        """
        check_number("factor", factor, 1e-9, 1e9)
        return replace(
            self, intervals=self.intervals * factor, status=SplineStatus.SCALED, report=None
        )


def uniform_spline(
    angles: ArrayLike, limits: JointLimits, intervals: ArrayLike | None = None
) -> JointSpline:
    """The spline with given proportions of intervals, as fast as the limits allow.

    Args:
        angles: knots ``(n, nj)`` [rad].
        limits: of the same joints.
        intervals: proportions ``(n - 1,)``; all equal by default.

    Raises:
        InputError: shapes do not fit, or a number has no sensible value.
    """
    q = checked_angles(angles, limits)
    shares = np.ones(len(q) - 1) if intervals is None else np.asarray(intervals, dtype=np.float64)
    spline = JointSpline(q, shares, limits)
    return spline.stretched(stretch_to_limits(spline.polynomial, limits) * ROUNDING_RESERVE)
