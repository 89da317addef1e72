"""Paths with a short smooth bump that none of their knots show."""

from __future__ import annotations

import numpy as np

from gaitopt.motion.path import MotionPath


def shaken(path: MotionPath, start: float, length: float, column: int, size: float) -> MotionPath:
    """The path with a smooth bump of one column, ``size`` high, that lasts for ``length``."""
    from numpy.polynomial import polynomial as P

    edges = np.unique(np.concatenate([path.times, [start, start + length]]))
    degree = max(path.degree, 6)
    out = np.zeros((degree + 1, len(edges) - 1, path.coefficients.shape[2]))
    for i, t in enumerate(edges[:-1]):
        k = int(path.segment(t + 1e-12))
        for c in range(out.shape[2]):
            powers = path.coefficients[::-1, k, c]
            moved = np.zeros(1)
            for power in powers[::-1]:
                moved = P.polyadd(P.polymul(moved, [t - path.times[k], 1.0]), [power])
            if c == column and start - 1e-12 <= t < start + length - 1e-12:
                share = [0.0, 1.0 / length]
                bump = P.polymul(P.polypow(share, 3), P.polypow([1.0, -1.0 / length], 3))
                moved = P.polyadd(moved, 64.0 * size * bump)
            out[degree - len(moved) + 1 :, i, c] = moved[::-1]
    return MotionPath(edges, out)
