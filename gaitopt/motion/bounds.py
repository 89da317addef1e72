"""Bounds of a path's polynomials on whole segments, by their Bernstein coefficients.

On an interval a polynomial lies within the range of its Bernstein coefficients [Farouki2012], so
bounds from them hold at every instant. The conversion is that of scipy's
``BPoly.from_power_basis``, bit by bit; its import takes longer than a plan.

The certificate has a conversion of its own (:mod:`gaitopt.certificate.enclosure`): what checks the
planners must not share their code.
"""

from __future__ import annotations

from math import comb

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.inputs import check_count
from gaitopt.motion.path import MOST_DERIVATIVES, MotionPath, derived


def derivative_range(path: MotionPath, derivative: int = 0) -> tuple[FloatArray, FloatArray]:
    """Lower and upper bounds of a derivative on each segment ``(K - 1, 6 + nj)``.

    Args:
        path: the path; the polynomial of a single knot gives one row.
        derivative: which one; 0 for the values.
    """
    check_count("derivative", derivative, 0, MOST_DERIVATIVES)
    coefficients = _bernstein(derived(path.coefficients, derivative), path.lengths)
    return coefficients.min(axis=0), coefficients.max(axis=0)


def _bernstein(coefficients: FloatArray, lengths: FloatArray) -> FloatArray:
    """Bernstein coefficients ``(degree + 1, S, n)`` of polynomials with the highest power first."""
    degree = len(coefficients) - 1
    out = np.zeros_like(coefficients)
    for power in range(degree, -1, -1):
        part = coefficients[degree - power] / comb(degree, power) * lengths[:, None] ** power
        for each in range(power, degree + 1):
            out[each] += part * comb(each, power)
    return out


def largest_sizes(path: MotionPath, derivative: int = 1) -> FloatArray:
    """Bound on the absolute value of a derivative on each segment ``(K - 1, 6 + nj)``.

    Args:
        path: the path.
        derivative: which one; 0 for the values.
    """
    low, high = derivative_range(path, derivative)
    return np.asarray(np.maximum(-low, high))
