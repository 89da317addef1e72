"""Quadratic B-splines in time that begin and end at rest, as parabolas on the spans of their knots.

Every knot has a control point and a span of time. On a span the spline is a parabola of the control
points before, of and after it; velocities are continuous, and each span has one acceleration. The
spline begins at rest in its first control point, and ends at rest in its last one.
"""

from __future__ import annotations

import numpy as np

from gaitopt.conventions import FloatArray


def parabola_weights(spans: FloatArray) -> FloatArray:
    """Weights of three control points in the coefficients of every span's parabola ``(3, K, 3)``.

    Args:
        spans: length of each span ``(K,)`` [s].

    Returns:
        By coefficient of the time since the span's begin, highest power first; span; control point
        before, of and after it. The first span has none before it and the last one none after it:
        their weights there are zero.
    """
    between = 2.0 / (spans[1:] + spans[:-1])
    before, after = np.append(0.0, between), np.append(between, 0.0)
    # Velocities at the begin and at the end of a span.
    begin = np.stack([-before, before, np.zeros_like(before)], axis=1)
    end = np.stack([np.zeros_like(after), -after, after], axis=1)
    length = spans[:, None]
    middle = np.array([0.0, 1.0, 0.0])
    return np.stack([(end - begin) / (2.0 * length), begin, middle - begin * length / 2.0])


def neighbours(points: FloatArray) -> FloatArray:
    """Control points before, of and after every span ``(K, 3, ...)``; zeros where there is none.

    Args:
        points: control points ``(K, ...)``.
    """
    none = np.zeros_like(points[:1])
    padded = np.concatenate([none, points, none])
    return np.stack([padded[:-2], padded[1:-1], padded[2:]], axis=1)


def spline_parabolas(points: FloatArray, spans: FloatArray) -> FloatArray:
    """The spline as parabolas in the time since the begin of each span ``(3, K, ...)``.

    Args:
        points: control points ``(K, ...)``.
        spans: the span of each ``(K,)`` [s].

    Returns:
        Coefficients, highest power first.
    """
    return np.asarray(np.einsum("cki,ki...->ck...", parabola_weights(spans), neighbours(points)))
