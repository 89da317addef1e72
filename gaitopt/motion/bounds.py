"""Bounds of polynomials between their knots."""

from __future__ import annotations

from math import comb, perm

import numpy as np

from gaitopt.conventions import LEGS, FloatArray
from gaitopt.motion.path import MotionPath
from gaitopt.robots.quadruped import Quadruped


def polynomial_range(path: MotionPath, order: int) -> tuple[FloatArray, FloatArray]:
    """Bounds on a derivative over each segment ``(K, n)``: its Bernstein coefficients' range."""
    lengths = np.diff(path.times)[:, None]
    degree = path.degree - order
    scaled = []
    for k in range(degree + 1):
        factor = float(np.prod(np.arange(k + 1, k + order + 1)))
        scaled.append(factor * path.coefficients[path.degree - k - order] * lengths**k)
    control = [
        sum(comb(i, k) / comb(degree, k) * scaled[k] for k in range(i + 1))
        for i in range(degree + 1)
    ]
    return np.min(control, axis=0), np.max(control, axis=0)


PARTS = 8
"""Parts into which a path's pieces are cut for bounds on them."""


def path_stretch(
    robot: Quadruped,
    path: MotionPath,
    since: float,
    rates: FloatArray,
    limit: float,
    parts: int = PARTS,
) -> float:
    """The same of a path, at every instant from a time on.

    Args:
        robot, path: the robot and the path.
        since: pieces that end before are not looked at [s].
        rates, limit: of joint velocities ``(12,)`` [rad/s] and accelerations [rad/s^2].
        parts: into which each piece is cut, as its bounds are closer on short ones.
    """
    columns = 6 + np.array([c for leg in LEGS for c in robot.leg_columns[leg]])
    late = path.times[1:] > since
    powers, lengths = path.coefficients[::-1][:, late][..., columns], np.diff(path.times)[late]
    fastest, hardest = (_largest(powers, lengths, k, parts) for k in (1, 2))
    return max(float((fastest / rates).max()), float(np.sqrt(hardest.max() / limit)))


def _largest(powers: FloatArray, lengths: FloatArray, order: int, parts: int = PARTS) -> FloatArray:
    """Bound on the size of a derivative on every piece ``(P, n)``: its Bernstein coefficients.

    Args:
        powers: coefficients ``(d + 1, P, n)``, lowest power first.
        lengths: of the pieces ``(P,)`` [s].
        order: of the derivative.
        parts: into which each piece is cut; on them the coefficients lie close to the derivative.
    """
    short = lengths[:, None] / parts
    slopes = [perm(k, order) * powers[k] for k in range(order, len(powers))]
    d = len(slopes) - 1
    most = np.zeros(powers.shape[1:])
    for part in range(parts):
        begin = part * short
        # In powers of the share of the part, by Taylor's series about where it begins.
        scaled = [
            short**k * sum(comb(j, k) * slopes[j] * begin ** (j - k) for j in range(k, d + 1))
            for k in range(d + 1)
        ]
        for i in range(d + 1):
            row = sum(comb(i, k) / comb(d, k) * scaled[k] for k in range(i + 1))
            np.maximum(most, np.abs(row), out=most)
    return most


def largest_rates(path: MotionPath, derivative: int = 1) -> FloatArray:
    """Bound on the size of a derivative of every column on each piece ``(K - 1, 6 + nj)``.

    The largest Bernstein coefficient, so it holds on the whole piece.
    """
    from math import comb

    lengths = np.diff(path.times)[:, None]
    powers = path.coefficients[::-1]
    degree = len(powers) - 1 - derivative
    if degree < 0:
        return np.zeros_like(powers[0])
    scaled = [
        float(np.prod(np.arange(k + 1, k + derivative + 1))) * powers[k + derivative] * lengths**k
        for k in range(degree + 1)
    ]
    bernstein = [
        sum(comb(i, k) / comb(degree, k) * scaled[k] for k in range(i + 1))
        for i in range(degree + 1)
    ]
    return np.asarray(np.abs(bernstein).max(axis=0))
