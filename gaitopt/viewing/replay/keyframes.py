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
    powers = np.arange(path.degree, -1, -1)
    # Bounds on second and first derivatives over each piece, times its length squared, and once.
    seconds = np.abs(path.coefficients) * (powers * (powers - 1))[:, None, None]
    length_powers = lengths ** np.maximum(powers, 0)[:, None]
    curvature = np.einsum("psc,ps->sc", seconds, length_powers).max(axis=1)
    firsts = np.abs(path.coefficients) * powers[:, None, None]
    slopes = np.einsum("psc,ps->sc", firsts, length_powers)
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
    measure = error or _line_error
    kept, starts, ends = [0, len(times) - 1], np.array([0]), np.array([len(times) - 1])
    # Gaps between neighbours that are kept, as long as a sample in them may be off.
    while len(starts) and ends[0] - starts[0] > 1:
        first = _worst_samples(times, y, starts, ends, measure, tolerance, largest_step)
        bad = first >= 0
        starts, ends, first = starts[bad], ends[bad], first[bad]
        kept += first.tolist()
        starts, ends = np.concatenate([starts, first]), np.concatenate([first, ends])
        wide = ends - starts > 1
        starts, ends = starts[wide], ends[wide]
    return np.unique(np.array(kept))


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
    inner = np.repeat(np.arange(len(gaps)), gaps)
    samples = np.arange(int(gaps.sum())) - firsts[inner] + starts[inner] + 1
    a, b = starts[inner], ends[inner]
    span = np.maximum(times[b] - times[a], np.finfo(np.float64).tiny)
    off = measure(y[samples], y[a], y[b], (times[samples] - times[a]) / span)
    worst = np.maximum.reduceat(off, firsts)
    hits = np.flatnonzero(off == worst[inner])
    found = np.full(len(gaps), len(times))
    np.minimum.at(found, inner[hits], samples[hits])
    found[worst <= tolerance] = -1
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
    return np.asarray(np.linalg.norm(value - start - fraction[:, None] * (end - start), axis=1))
