"""How fast a given path may be followed: by one factor for all of it, or at its own best speed.

Along a path ``q(s)`` whose course is given, only the timing ``s(t)`` is free. With the squared path
speed ``x = (ds/dt)**2`` and the path acceleration ``u = d2s/dt2`` joint velocities are
``q' sqrt(x)`` and joint accelerations ``q' u + q'' x``: limits on both are linear in ``u`` and
``x``. So the fastest timing needs no general optimisation. :func:`time_optimal_parametrisation`
finds it by reachability analysis, the method of TOPP-RA [Pham2018]: one sweep backward finds the
largest speeds from which the path can still be followed to its end, one sweep forward accelerates
as much as these allow. A test holds it against the package ``toppra``.
"""

from __future__ import annotations

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.motion.bounds import largest_sizes
from gaitopt.motion.path import BASE_COLUMNS, MotionPath
from gaitopt.motion.pieces import cut
from gaitopt.robots.quadruped import Quadruped

BOUND_PARTS = 8
"""Parts into which segments are cut for bounds on them.

The excess of a bound over the largest value falls with the square of the number of parts: 8 leave
a 64th of it.
"""
HALVINGS = 50
"""Bisections for each largest speed: 2**-50 is 1e-15 of the interval, the rounding of doubles."""
NO_MOTION = 1e-12
"""A joint's ``|q'|`` from which it counts as at rest along the path, and bounds no acceleration."""


def needed_stretch(*shares: float) -> float:
    """Factor by which a motion's time must grow so that every derivative just keeps its limit.

    In ``k`` times the time the n-th derivative is ``k**-n`` times as large. A factor below 1 means
    that the motion may be faster.

    Args:
        shares: largest velocity over its limit; then the same of acceleration, jerk and so on.
    """
    return float(max(share ** (1.0 / order) for order, share in enumerate(shares, start=1)))


def legs_needed_stretch(
    robot: Quadruped,
    path: MotionPath,
    since: float,
    velocity_limits: FloatArray,
    acceleration_limit: FloatArray | float,
    parts: int = BOUND_PARTS,
) -> float:
    """Factor by which a path's time must grow so that all legs' joints keep their limits always.

    By bounds on whole segments, so at every instant.

    Args:
        robot, path: the robot and its path.
        since: segments that end before this time are left out [s].
        velocity_limits: of the legs' joints ``(12,)``, in the order of
            :attr:`Quadruped.leg_joint_columns` [rad/s].
        acceleration_limit: of all these joints, or of each ``(12,)`` [rad/s^2].
        parts: into which each segment is cut, as bounds are closer on shorter ones.
    """
    first = int(np.searchsorted(path.times[1:], since, side="right"))
    late = MotionPath(path.times[first:] - path.times[first], path.coefficients[:, first:])
    fine = cut(late, np.diff(late.times) / parts) if parts > 1 else late
    columns = BASE_COLUMNS + robot.leg_joint_columns
    velocity, acceleration = (largest_sizes(fine, k)[:, columns].max(axis=0) for k in (1, 2))
    return needed_stretch(
        (velocity / velocity_limits).max(), (acceleration / acceleration_limit).max()
    )


def time_optimal_parametrisation(
    first: FloatArray,
    second: FloatArray,
    grid: FloatArray,
    velocity_limits: FloatArray,
    acceleration_limit: float,
) -> FloatArray:
    """Squared path speeds of the fastest timing from rest to rest, for many paths at a time.

    Between grid points the path acceleration is constant. Acceleration limits are kept at both ends
    of every interval with that same acceleration (the interpolation scheme of [Pham2018]), velocity
    limits at grid points.

    Args:
        first, second: derivatives ``q'`` and ``q''`` of the joints by the path's parameter at all
            grid points, for ``L`` paths of ``n`` joints ``(N + 1, L, n)``.
        grid: the parameter at grid points ``(N + 1,)``, increasing.
        velocity_limits: ``(n,)`` [rad/s].
        acceleration_limit: of all joints [rad/s^2].

    Returns:
        ``(ds/dt)**2`` at grid points ``(N + 1, L)`` [1/s^2].
    """
    steps = np.diff(grid)
    with np.errstate(divide="ignore"):
        top = ((velocity_limits / np.abs(first)) ** 2).min(axis=2)
    top[[0, -1]] = 0.0
    controllable = top.copy()
    for i in reversed(range(len(steps))):
        low, high = np.zeros_like(top[i]), top[i]
        # The speeds from which the path can be followed to its end are an interval from 0 on.
        for _ in range(HALVINGS):
            x = (low + high) / 2.0
            least, most = _accelerations(first, second, steps, i, x, acceleration_limit)
            least = np.maximum(least, -x / (2.0 * steps[i]))
            most = np.minimum(most, (controllable[i + 1] - x) / (2.0 * steps[i]))
            good = least <= most
            low, high = np.where(good, x, low), np.where(good, high, x)
        controllable[i] = low
    squares = np.zeros_like(top)
    for i in range(len(steps)):
        _, most = _accelerations(first, second, steps, i, squares[i], acceleration_limit)
        squares[i + 1] = np.clip(squares[i] + 2.0 * steps[i] * most, 0.0, controllable[i + 1])
    return np.asarray(squares)


def _accelerations(
    first: FloatArray,
    second: FloatArray,
    steps: FloatArray,
    i: int,
    squares: FloatArray,
    limit: float,
) -> tuple[FloatArray, FloatArray]:
    """Least and greatest path accelerations ``(L,)`` that joints allow on an interval.

    Args:
        first, second, steps, limit: of the paths, as in :func:`time_optimal_parametrisation`.
        i: the interval.
        squares: squared path speeds where it begins ``(L,)``.
    """
    low, high = np.full(squares.shape, -np.inf), np.full(squares.shape, np.inf)
    # At the interval's end the squared speed is larger by 2 u ds: that is linear in u, too.
    at_end = first[i + 1] + 2.0 * steps[i] * second[i + 1]
    for gain, rest in (
        (first[i], second[i] * squares[:, None]),
        (at_end, second[i + 1] * squares[:, None]),
    ):
        with np.errstate(divide="ignore", invalid="ignore"):
            ends = np.stack([(-limit - rest) / gain, (limit - rest) / gain])
        rests = np.abs(gain) <= NO_MOTION
        ends = np.where(rests, np.array([-np.inf, np.inf])[:, None, None], ends)
        low = np.maximum(low, ends.min(axis=0).max(axis=1))
        high = np.minimum(high, ends.max(axis=0).min(axis=1))
        # No path acceleration changes what such a joint does: this speed itself is too high.
        low = np.where((rests & (np.abs(rest) > limit)).any(axis=1), np.inf, low)
    return low, high


def interval_times(begin: FloatArray, end: FloatArray, lengths: FloatArray) -> FloatArray:
    """Times of intervals with a constant path acceleration ``(...)`` [s].

    Args:
        begin, end: squared path speeds at their ends ``(...)``.
        lengths: of the intervals, in the path's parameter, broadcast to them.
    """
    return np.asarray(2.0 * lengths / (np.sqrt(begin) + np.sqrt(end)))
