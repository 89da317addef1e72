"""Choose keyframes: few of many samples, between which interpolation has a bounded error."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.motion.path import MotionPath

POSITION_TOLERANCE = 1e-4
"""Largest distance between a place on the path and the one that keyframes show [m]. Chosen here: a
tenth of a millimetre cannot be seen."""

ANGLE_TOLERANCE = 1e-4
"""Largest difference of an angle, of joints and of the body [rad]. Chosen here: with it the foot
of a leg 1 m long is wrong by a few tenths of a millimetre at most."""

LARGEST_TURN = np.pi / 2
"""Largest turn between two keys [rad]. Slerp takes the shorter way, so it is below half a turn;
chosen here: half of that."""

IN_CACHE = 2048
"""Segments of a path that are looked at together. Measured: the processor's caches hold them."""

MOST_SAMPLES = 2_000_000
"""Most instants at which a path is evaluated: about 300 MB for a robot of twelve joints."""

InterpolationError = Callable[[FloatArray, FloatArray, FloatArray, FloatArray], FloatArray]
"""Distances ``(n,)`` of values ``(n, c)`` from the values that are interpolated between a start and
an end ``(n, c)`` at fractions ``(n,)``."""


def sample_times(path: MotionPath, tolerance: float = 0.5 * ANGLE_TOLERANCE) -> FloatArray:
    """Instants ``(N,)`` [s] between which straight lines stay within ``tolerance`` of the path.

    These are the knots, and on curved pieces as many more as the bound h^2 max|y''| / 8 on the
    distance of a chord of duration h asks for. Where roll, pitch and yaw change together, the
    orientation of the body differs from a straight line by at most the square of their rates. No
    joint turns by more than :data:`LARGEST_TURN` between two instants.
    """
    lengths = np.diff(path.times)
    if not len(lengths):
        return path.times
    needed = np.concatenate([
        _needed_pieces(path.coefficients[:, part], lengths[part], tolerance)
        for part in (slice(k, k + IN_CACHE) for k in range(0, len(lengths), IN_CACHE))
    ])  # fmt: skip
    share = MOST_SAMPLES / len(lengths)
    pieces = np.clip(np.ceil(needed), 1, max(share, 1)).astype(np.int64)
    first = np.repeat(np.cumsum(pieces) - pieces, pieces)
    inside = (np.arange(len(first)) - first) / np.repeat(pieces, pieces)
    times = np.repeat(path.times[:-1], pieces) + inside * np.repeat(lengths, pieces)
    return np.append(times, path.times[-1])


def _needed_pieces(coefficients: FloatArray, lengths: FloatArray, tolerance: float) -> FloatArray:
    """Into how many pieces each segment has to be cut at least ``(s,)``."""
    # Bounds on second and first derivatives over each piece, times its length squared, and once.
    seconds, slopes = np.zeros((2, *coefficients.shape[1:]))
    for power, row in enumerate(coefficients[::-1]):
        if power:
            size = np.abs(row) * (power * lengths**power)[:, None]
            slopes += size
            seconds += (power - 1) * size
    needed: FloatArray = np.maximum.reduce([
        np.sqrt(seconds.max(axis=1) / (8.0 * tolerance)),
        slopes[:, 3:6].sum(axis=1) / np.sqrt(8.0 * tolerance),
        slopes[:, 6:].max(axis=1, initial=0.0) / LARGEST_TURN,
    ])  # fmt: skip
    return needed


def kept_samples(
    times: FloatArray,
    values: FloatArray,
    tolerance: float,
    *,
    error: InterpolationError | None = None,
    largest_step: float = np.inf,
) -> np.ndarray:
    """Indices of samples from which all others can be interpolated within ``tolerance``.

    The method is that of [Douglas1973], with time as the parameter.

    Args:
        times: of the samples ``(n,)``, not decreasing.
        values: of the samples ``(n, c)`` or ``(n,)``.
        tolerance: largest error of a sample that is not kept, in the units of ``values``.
        error: of the interpolation; that of straight lines by default.
        largest_step: largest change of a value between two kept samples.

    Returns:
        Sorted indices; only the first one where all values are equal.
    """
    y = values.reshape(len(values), -1)
    if len(times) < 2 or (np.abs(y - y[0]) <= 0.0).all():
        return np.array([0])
    whole = np.array([0]), np.array([len(times) - 1])
    return kept_between(times, y, tolerance, *whole, error=error, largest_step=largest_step)


def kept_between(
    times: FloatArray,
    values: FloatArray,
    tolerance: float,
    starts: np.ndarray,
    ends: np.ndarray,
    *,
    error: InterpolationError | None = None,
    largest_step: float = np.inf,
) -> np.ndarray:
    """The same for several pieces at once, the samples ``starts (p,)`` to ``ends (p,)``.

    First and last samples of all pieces are kept. ``values`` are ``(n, c)``.
    """
    measure, kept = error or _line_error, [starts, ends]
    # Gaps between neighbours that are kept, as long as a sample in them may be off.
    while True:
        wide = ends - starts > 1
        starts, ends = starts[wide], ends[wide]
        if not len(starts):
            return np.unique(np.concatenate(kept))
        first = _worst_samples(times, values, starts, ends, measure, tolerance, largest_step)
        bad = first >= 0
        starts, ends, first = starts[bad], ends[bad], first[bad]
        kept.append(first)
        starts, ends = np.concatenate([starts, first]), np.concatenate([first, ends])


def _worst_samples(
    times: FloatArray,
    y: FloatArray,
    starts: np.ndarray,
    ends: np.ndarray,
    measure: InterpolationError,
    tolerance: float,
    largest_step: float,
) -> np.ndarray:
    """Of each gap the sample that must be kept ``(g,)``, -1 where all are near enough.

    It is the one that is farthest off; where the step over the gap is too large, the middle one.
    """
    gaps = ends - starts - 1
    firsts = np.cumsum(gaps) - gaps
    samples = np.arange(int(gaps.sum())) + np.repeat(starts + 1 - firsts, gaps)
    span = np.maximum(times[ends] - times[starts], np.finfo(np.float64).tiny)
    fraction = (times[samples] - np.repeat(times[starts], gaps)) / np.repeat(span, gaps)
    a, b = (np.repeat(y[some], gaps, axis=0) for some in (starts, ends))
    off = measure(y[samples], a, b, fraction)
    worst = np.maximum.reduceat(off, firsts)
    # The first one in each gap that is as far off as any, where that is too far.
    sought = np.where(worst <= tolerance, np.inf, worst)
    hits = np.flatnonzero(off == np.repeat(sought, gaps))
    inner = np.searchsorted(firsts, hits, side="right") - 1
    inner, at = np.unique(inner, return_index=True)
    found = np.full(len(gaps), -1)
    found[inner] = samples[hits[at]]
    wide = np.abs(y[ends] - y[starts]).max(axis=1) > largest_step
    return np.where(wide, (starts + ends) // 2, found)


def turn_error(
    value: FloatArray, start: FloatArray, end: FloatArray, fraction: FloatArray
) -> FloatArray:
    """Angles ``(n,)`` [rad] between orientations and those of slerp from ``start`` to ``end``.

    All are unit quaternions ``(n, 4)``; ``fraction`` is ``(n,)``. An :data:`InterpolationError`.
    """
    shown = slerp(start, end, fraction)
    flip = np.where(np.einsum("ni,ni->n", shown, value) < 0, -1.0, 1.0)[:, None]
    return np.asarray(2.0 * np.linalg.norm(value - flip * shown, axis=1))


def slerp(start: FloatArray, end: FloatArray, fraction: FloatArray) -> FloatArray:
    """Unit quaternions ``(n, 4)`` at ``fraction (n,)`` of the shorter turn from start to end.

    It is spherical linear interpolation, as in three.js.
    """
    cosine = np.einsum("ni,ni->n", start, end)
    end = np.where(cosine[:, None] < 0, -end, end)
    # From the sine the angle is precise where quaternions are almost equal; from the cosine not.
    half = 2.0 * np.arcsin(np.clip(np.linalg.norm(end - start, axis=1) / 2.0, 0.0, 1.0))
    sine = np.sin(half)
    still = sine < 1e-12
    safe = np.where(still, 1.0, sine)
    a = np.where(still, 1.0 - fraction, np.sin((1.0 - fraction) * half) / safe)
    b = np.where(still, fraction, np.sin(fraction * half) / safe)
    return np.asarray(a[:, None] * start + b[:, None] * end)


def _line_error(
    value: FloatArray, start: FloatArray, end: FloatArray, fraction: FloatArray
) -> FloatArray:
    """Distances ``(n,)`` from straight lines. An :data:`InterpolationError`."""
    off = value - start - fraction[:, None] * (end - start)
    return np.abs(off[:, 0]) if off.shape[1] == 1 else np.asarray(np.linalg.norm(off, axis=1))
