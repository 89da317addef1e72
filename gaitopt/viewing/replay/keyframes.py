"""Few keyframes from many samples, to a stated error."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.motion.path import MotionPath

POSITION_TOLERANCE = 1e-4
"""Largest distance between the path and what the keyframes show [m]."""

ANGLE_TOLERANCE = 1e-4
"""Largest angle between the path and what the keyframes show, for each joint and the body [rad]."""

LARGEST_TURN = np.pi / 2
"""Largest turn between two keys [rad]: slerp takes the shorter way round."""

MOST_SAMPLES = 2_000_000
"""Most instants at which a path is looked at."""

Deviation = Callable[[FloatArray, FloatArray, FloatArray, FloatArray], FloatArray]
"""Distances ``(n,)`` of values ``(n, c)`` from points at fractions ``(n,)`` between two ends."""


def sample_times(path: MotionPath, tolerance: float = 0.5 * ANGLE_TOLERANCE) -> FloatArray:
    """Instants ``(N,)`` [s] between which straight lines stay within ``tolerance`` of the path.

    The knots, and for curved segments as many more as the bound h^2 max|y''| / 8 asks for. Roll,
    pitch and yaw that change together bend the turn of the body by their rates' square, and no
    joint may turn by more than a quarter between two instants.
    """
    lengths = np.diff(path.times)
    if not len(lengths):
        return path.times
    powers = np.arange(path.degree, -1, -1)
    bends = np.abs(path.coefficients) * (powers * (powers - 1))[:, None, None]
    grown = lengths ** np.maximum(powers, 0)[:, None]
    curvature = np.einsum("psc,ps->sc", bends, grown).max(axis=1)
    slopes = np.einsum("psc,ps->sc", np.abs(path.coefficients) * powers[:, None, None], grown)
    needed = np.maximum.reduce([
        np.sqrt(curvature / (8.0 * tolerance)),
        slopes[:, 3:6].sum(axis=1) / np.sqrt(8.0 * tolerance),
        slopes[:, 6:].max(axis=1, initial=0.0) / LARGEST_TURN,
    ])  # fmt: skip
    share = MOST_SAMPLES / len(lengths)
    pieces = np.clip(np.ceil(needed), 1, max(share, 1)).astype(np.int64)
    first = np.repeat(np.cumsum(pieces) - pieces, pieces)
    inside = (np.arange(len(first)) - first) / np.repeat(pieces, pieces)
    times = np.repeat(path.times[:-1], pieces) + inside * np.repeat(lengths, pieces)
    return np.append(times, path.times[-1])


def thinned(
    times: FloatArray,
    values: FloatArray,
    tolerance: float,
    *,
    deviation: Deviation | None = None,
    most: float = np.inf,
) -> np.ndarray:
    """Indices of the samples to keep, so that the others lie within ``tolerance`` of the join.

    The method of [Douglas1973] with time as the parameter.

    Args:
        times: ``(n,)``, not decreasing.
        values: ``(n, c)`` or ``(n,)``.
        tolerance: largest deviation of a sample, in the units of ``values``.
        deviation: how far samples are from the join; along straight lines by default.
        most: largest step of a value between two kept samples.

    Returns:
        Sorted indices; only the first when nothing ever moves.
    """
    y = values.reshape(len(values), -1)
    if len(times) < 2 or (np.abs(y - y[0]) <= 0.0).all():
        return np.array([0])
    measure = deviation or _from_line
    keep = np.array([0, len(times) - 1])
    while True:
        gaps = np.diff(keep)
        inner = np.repeat(np.arange(len(gaps)), gaps)
        samples = np.arange(keep[0], keep[-1])
        a, b = keep[inner], keep[inner + 1]
        span = np.maximum(times[b] - times[a], np.finfo(np.float64).tiny)
        off = measure(y[samples], y[a], y[b], (times[samples] - times[a]) / span)
        # The middle of a stretch that turns too far is split off as well.
        wide = np.abs(y[keep[1:]] - y[keep[:-1]]).max(axis=1) > most
        off = np.where(wide[inner] & (samples == (a + b) // 2), np.inf, off)
        off[samples == a] = 0.0
        worst = np.maximum.reduceat(off, keep[:-1])
        bad = np.flatnonzero(worst > tolerance)
        if not len(bad):
            return keep
        first = np.full(len(gaps), len(times))
        hits = np.flatnonzero(off == worst[inner])
        np.minimum.at(first, inner[hits], samples[hits])
        keep = np.union1d(keep, first[bad])


def turn_deviation(
    value: FloatArray, start: FloatArray, end: FloatArray, fraction: FloatArray
) -> FloatArray:
    """Angles ``(n,)`` [rad] between unit quaternions ``(n, 4)`` and the slerp from start to end."""
    shown = slerp(start, end, fraction)
    flip = np.where(np.einsum("ni,ni->n", shown, value) < 0, -1.0, 1.0)[:, None]
    return np.asarray(2.0 * np.linalg.norm(value - flip * shown, axis=1))


def slerp(start: FloatArray, end: FloatArray, fraction: FloatArray) -> FloatArray:
    """Unit quaternions ``(n, 4)`` at ``fraction (n,)`` of the shorter turn from start to end."""
    cosine = np.einsum("ni,ni->n", start, end)
    end = np.where(cosine[:, None] < 0, -end, end)
    # The angle from its sine keeps its precision where quaternions all but agree.
    half = 2.0 * np.arcsin(np.clip(np.linalg.norm(end - start, axis=1) / 2.0, 0.0, 1.0))
    sine = np.sin(half)
    still = sine < 1e-12
    safe = np.where(still, 1.0, sine)
    a = np.where(still, 1.0 - fraction, np.sin((1.0 - fraction) * half) / safe)
    b = np.where(still, fraction, np.sin(fraction * half) / safe)
    return np.asarray(a[:, None] * start + b[:, None] * end)


def _from_line(
    value: FloatArray, start: FloatArray, end: FloatArray, fraction: FloatArray
) -> FloatArray:
    return np.asarray(np.linalg.norm(value - start - fraction[:, None] * (end - start), axis=1))
