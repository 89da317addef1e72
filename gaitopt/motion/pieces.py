"""Pieces of paths: in another time, cut, one after another, and quintics between given states."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.motion.path import MotionPath

States = tuple[FloatArray, FloatArray, FloatArray]
"""Values, velocities and accelerations ``(N, n)`` each."""

QUINTIC = 5
"""Degree of the polynomial that six conditions determine: three at each end."""
LONGEST = 30.0
"""Longest segment of a joined path over its shortest; chosen here, see :func:`joined`."""
ROUNDING = 1e-9
"""Share of the longest length by which a segment may be longer uncut: lengths are rounded."""


def stretched(path: MotionPath, factor: float) -> MotionPath:
    """The same curve in ``factor`` times the time."""
    powers = np.arange(path.degree, -1, -1)[:, None, None]
    return MotionPath(path.times * factor, path.coefficients / factor**powers)


def piece_values(
    coefficients: FloatArray, since: FloatArray, piece: np.ndarray, order: int = 0
) -> FloatArray:
    """Values of piecewise polynomials, or of a derivative, by the polynomials of given pieces.

    ``scipy.interpolate.PPoly`` chooses the piece by the place; at a border it is the later one.

    Args:
        coefficients: of ``P`` pieces, highest power first ``(degree + 1, P, n)``.
        since: places, since the begin of their pieces ``(N,)``.
        piece: the piece of each place ``(N,)``.
        order: of the derivative; 0 for the values.

    Returns:
        ``(N, n)``.
    """
    for _ in range(order):
        powers = np.arange(len(coefficients) - 1, 0, -1)
        coefficients = coefficients[:-1] * powers[:, None, None]
    out = np.zeros((len(since), coefficients.shape[2]))
    for power in coefficients:
        out = out * since[:, None] + power[piece]
    return out


def quintic_hermite(lengths: FloatArray, begin: States, end: States) -> FloatArray:
    """Coefficients of the quintics with given states at both ends of intervals.

    ``scipy.interpolate.BPoly.from_derivatives`` gives the same polynomials (a test holds them
    together), but one interval at a time in Python, and only for states that do not jump at knots.

    Args:
        lengths: of the intervals ``(K,)`` [s].
        begin, end: values, velocities and accelerations at their ends ``(K, n)`` each.

    Returns:
        ``(6, K, n)``, highest power first, in the time since each interval's begin.
    """
    t = lengths[:, None]
    value, velocity, acceleration = begin
    # What the end state has beyond the motion with constant acceleration from the begin state.
    value_gap = end[0] - value - t * (velocity + t * acceleration / 2.0)
    velocity_gap = end[1] - velocity - t * acceleration
    acceleration_gap = end[2] - acceleration
    return np.stack([
        (6.0 * value_gap - 3.0 * t * velocity_gap + 0.5 * t**2 * acceleration_gap) / t**5,
        (-15.0 * value_gap + 7.0 * t * velocity_gap - t**2 * acceleration_gap) / t**4,
        (10.0 * value_gap - 4.0 * t * velocity_gap + 0.5 * t**2 * acceleration_gap) / t**3,
        acceleration / 2.0, velocity, value,
    ])  # fmt: skip


def joined(pieces: Sequence[MotionPath]) -> MotionPath:
    """Paths one after another, as one of degree five or more.

    Segments much longer than the shortest are cut: :class:`MotionPath` bounds how far a path leads
    by the largest coefficient of each power and the longest segment.
    """
    degree = max([QUINTIC, *(piece.degree for piece in pieces)])
    shortest = min(float(np.diff(piece.times).min()) for piece in pieces)
    times, coefficients, start = [np.zeros(1)], [], 0.0
    for piece in (cut(whole, LONGEST * shortest) for whole in pieces):
        times.append(start + piece.times[1:])
        start = float(times[-1][-1])
        missing = degree - piece.degree
        coefficients.append(np.pad(piece.coefficients, ((missing, 0), (0, 0), (0, 0))))
    return MotionPath(np.concatenate(times), np.concatenate(coefficients, axis=1))


def cut(path: MotionPath, longest: float | FloatArray) -> MotionPath:
    """The same path with no segment longer than ``longest`` [s], one for all or for each."""
    lengths = np.diff(path.times)
    counts = np.maximum(np.ceil(lengths / longest - ROUNDING).astype(int), 1)
    owner = np.repeat(np.arange(len(counts)), counts)
    share = (np.arange(len(owner)) - np.repeat(np.cumsum(counts) - counts, counts)) / counts[owner]
    shift = share * lengths[owner]
    return _of_segments(path, owner, shift)


def cut_at(path: MotionPath, places: FloatArray) -> MotionPath:
    """The same path with knots at ``places`` as well [s], which lie between its own."""
    begins = np.sort(np.append(path.times[:-1], places))
    owner = np.searchsorted(path.times, begins, side="right") - 1
    return _of_segments(path, owner, begins - path.times[owner])


def _of_segments(path: MotionPath, owner: np.ndarray, shift: FloatArray) -> MotionPath:
    """The same path in segments that begin ``shift (N,)`` [s] after those of the path do.

    Args:
        path: the path.
        owner: the segment of the path that each of them is part of, in order ``(N,)``.
        shift: where in it they begin ``(N,)`` [s].
    """
    since = shift[:, None]
    shifted = [c[owner].copy() for c in path.coefficients]
    # Taylor shift by repeated synthetic division: p(t + shift) in powers of t. scipy has none.
    for top in range(len(shifted) - 1, 0, -1):
        for k in range(1, top + 1):
            shifted[k] = shifted[k] + since * shifted[k - 1]
    return MotionPath(np.append(path.times[owner] + shift, path.times[-1]), np.array(shifted))
