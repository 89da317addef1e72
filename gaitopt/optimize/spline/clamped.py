"""The clamped cubic spline through given knots, and how much of each limit it uses.

"Clamped" means: twice continuously differentiable, with velocities zero at both ends.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import CubicSpline

from gaitopt.conventions import FloatArray, frozen
from gaitopt.errors import InputError
from gaitopt.inputs import check_array, check_kind
from gaitopt.motion.retiming import needed_stretch
from gaitopt.optimize.spline.limits import JointLimits

MOST_KNOTS = 1000
"""Most knots of a spline: the formulation's size grows with them."""
ROUNDING_RESERVE = 1.0 + 1e-13
"""Factor on stretched intervals, so that rounding breaks no limit.

Intervals are differences of times: with 1000 of them each is rounded by 1e-13 of itself.
"""


def checked_angles(angles: ArrayLike, limits: JointLimits) -> FloatArray:
    """``angles`` as read-only knots ``(n, nj)`` [rad], when a spline can pass through them.

    Raises:
        InputError: the shape is wrong, a number is not finite, or two successive knots are equal.
    """
    check_kind("limits", limits, JointLimits)
    try:
        q = frozen(check_array("angles", angles))
    except (TypeError, ValueError) as error:
        raise InputError(f"angles are no array of numbers: {error}") from error
    if q.ndim != 2 or not 2 <= len(q) <= MOST_KNOTS or q.shape[1] != len(limits.velocity):
        raise InputError(
            f"angles must have the shape (n, {len(limits.velocity)}), one column for each joint "
            f"with limits and 2 to {MOST_KNOTS} rows; got {q.shape}"
        )
    if not np.isfinite(q).all():
        raise InputError(f"angles of knot {np.argwhere(~np.isfinite(q))[0][0]} are not finite")
    same = np.flatnonzero(~np.diff(q, axis=0).any(axis=1))
    if same.size:
        raise InputError(f"knots {same[0]} and {same[0] + 1} are the same; leave one of them out")
    return q


def clamped_spline(angles: FloatArray, intervals: FloatArray) -> CubicSpline:
    """The clamped cubic spline through ``angles (n, nj)`` with ``intervals (n - 1,)`` [s].

    scipy's; its coefficients are ``(4, n - 1, nj)``, highest power first, in the time since each
    interval's start.
    """
    times = np.concatenate([[0.0], np.cumsum(intervals)])
    return CubicSpline(times, angles, bc_type="clamped")


def peaks(spline: CubicSpline) -> FloatArray:
    """Largest velocity, acceleration and jerk on each interval ``(3, n - 1, nj)``, exact.

    A cubic's velocity is a parabola, whose vertex may lie between the knots; its acceleration is
    largest at a knot, and its jerk is constant.
    """
    cubic, square, slope, _ = spline.c
    h = np.diff(spline.x)[:, None]
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        when = -square / (3.0 * cubic)
        between = np.where((when > 0.0) & (when < h), slope + square * when, 0.0)
    end = slope + (2.0 * square + 3.0 * cubic * h) * h
    return np.stack([
        np.abs([slope, end, between]).max(axis=0),
        np.abs([2.0 * square, 2.0 * square + 6.0 * cubic * h]).max(axis=0),
        np.abs(6.0 * cubic),
    ])  # fmt: skip


def stretch_to_limits(spline: CubicSpline, limits: JointLimits) -> float:
    """Factor on all intervals with which the tightest limit is just kept."""
    velocity, acceleration, jerk = peaks(spline)
    return needed_stretch(
        (velocity / limits.velocity).max(),
        (acceleration / limits.acceleration).max(),
        (jerk / limits.jerk).max(),
    )
