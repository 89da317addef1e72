"""Pieces of paths: stretched, joined, cut."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.motion.path import MotionPath

DEGREE = 5
LONGEST = 30.0
"""Longest segment of a path over its shortest."""


def stretched(path: MotionPath, factor: float) -> MotionPath:
    """The same curve in ``factor`` times the time."""
    powers = np.arange(path.degree, -1, -1)[:, None, None]
    return MotionPath(path.times * factor, path.coefficients / factor**powers)


def hermite(length: float, place: FloatArray, slope: FloatArray, bend: FloatArray) -> FloatArray:
    """Coefficients ``(6, n)`` of the quintic with given states ``(2, n)`` at both ends."""
    t = length
    gap = place[1] - place[0] - t * (slope[0] + t * bend[0] / 2.0)
    lean, turn = slope[1] - slope[0] - t * bend[0], bend[1] - bend[0]
    return np.stack([
        (6.0 * gap - 3.0 * t * lean + 0.5 * t**2 * turn) / t**5,
        (-15.0 * gap + 7.0 * t * lean - t**2 * turn) / t**4,
        (10.0 * gap - 4.0 * t * lean + 0.5 * t**2 * turn) / t**3,
        bend[0] / 2.0, slope[0], place[0],
    ])  # fmt: skip


def joined(pieces: Sequence[MotionPath]) -> MotionPath:
    """Paths one after another, as one of degree five or more.

    Segments much longer than the shortest are cut: :class:`MotionPath` bounds how far a path leads
    by the largest coefficient of each power and the longest segment.
    """
    degree = max([DEGREE, *(piece.degree for piece in pieces)])
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
    counts = np.maximum(np.ceil(lengths / longest - 1e-9).astype(int), 1)
    owner = np.repeat(np.arange(len(counts)), counts)
    share = (np.arange(len(owner)) - np.repeat(np.cumsum(counts) - counts, counts)) / counts[owner]
    shift = (share * lengths[owner])[:, None]
    shifted = [c[owner].copy() for c in path.coefficients]
    # Taylor shift by repeated synthetic division: p(t + shift) in powers of t.
    for top in range(len(shifted) - 1, 0, -1):
        for k in range(1, top + 1):
            shifted[k] = shifted[k] + shift * shifted[k - 1]
    times = np.append(path.times[owner] + shift[:, 0], path.times[-1])
    return MotionPath(times, np.array(shifted))
