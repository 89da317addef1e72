"""Pieces of the course of a polyline: straight lines, rounded corners, and sampled curves.

A motion that turns at a corner stops there. A foot that flies along a box need not follow its
corners exactly, and so needs no stop: each corner is replaced by a quintic curve between two points
on the lines beside it, with the directions of the lines and no curvature at its ends. The chords of
a curved swing have corners only because it was sampled: a cubic spline leads through them.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gaitopt.conventions import BoolArray, FloatArray
from gaitopt.motion.pieces import QUINTIC, quintic_hermite

LEAST_MOTION = 1e-9
"""An interval on which base and feet change by less is left out [m or rad]."""
INTERVALS = 24
"""Intervals of a chain of one line, and of the lines of a chain of several: the acceleration along
the course is constant on each."""
CORNER_INTERVALS = 32
"""Intervals of a corner of a right angle that is rounded, along which accelerations change most;
others have as many as their angle asks for."""
LEAST_INTERVALS = 2
"""Fewest intervals of a piece."""
SHALLOW = float(np.cos(np.radians(30.0)))
"""Cosine of the angle below which all corners of a flight are those of a sampled curve. Those of
swing curves turn by up to 20 degrees (8 cm long, 6 cm high) and by more on shorter steps, those of
boxes by up to 90."""
CHORD_INTERVALS = 3
"""Intervals of a chord of a sampled curve. Those beside a corner that turns by
:data:`USUAL_TURN` or more have as many as a corner of a box with this angle."""
USUAL_TURN = float(np.radians(22.0))
"""Angle by which chords of swing curves do not turn on steps of usual lengths [rad]."""
SHORTEST_CORNER = 1.0
"""Least length of a rounded corner's curve over its distance from the corner, where a foot turns
back."""


class Piece(NamedTuple):
    """A polynomial piece.

    Attributes:
        coefficients: highest power first ``(6, 18)``.
        length: in the course's parameter.
        standing: which feet stand ``(4,)``.
        intervals: how many intervals of the timing it has.
    """

    coefficients: FloatArray
    length: float
    standing: BoolArray
    intervals: int


def rounded(corners: FloatArray, standing: BoolArray, rounding: float, curved: bool) -> list[Piece]:
    """The pieces of one chain through ``corners (m + 1, 18)``, which are ``curved`` or rounded.

    A chain of one line has the length one, others that of the foot's way.
    """
    change = np.diff(corners, axis=0)
    if len(change) == 1:
        return [_line(corners[0], change[0], 1.0, standing, INTERVALS)]
    lengths = np.linalg.norm(change, axis=1)
    directions = change / lengths[:, None]
    if curved or (directions[1:] * directions[:-1]).sum(axis=1).min() > SHALLOW:
        return _curve(corners, lengths, standing)
    # How far from each corner its rounding begins and ends; both ends of the chain are no corners.
    reach = np.zeros(len(corners))
    reach[1:-1] = rounding * np.minimum(lengths[1:], lengths[:-1])
    pieces = []
    for i, direction in enumerate(directions):
        length = float(lengths[i] - reach[i] - reach[i + 1])
        if length > LEAST_MOTION:
            at_end = i in (0, len(directions) - 1)
            count = INTERVALS // 2 if at_end else INTERVALS * length / float(lengths.sum())
            begin = corners[i] + reach[i] * direction
            pieces.append(_line(begin, direction, length, standing, count))
        if i + 1 < len(directions):
            turned = directions[i + 1]
            pieces.append(_corner(corners[i + 1], direction, turned, float(reach[i + 1]), standing))
    return pieces


def _curve(corners: FloatArray, lengths: FloatArray, standing: BoolArray) -> list[Piece]:
    """The cubic spline through ``corners (m + 1, 18)``, with pieces of the ``lengths (m,)``."""
    from scipy.interpolate import CubicSpline

    spline = CubicSpline(np.concatenate([[0.0], np.cumsum(lengths)]), corners)
    coefficients = np.pad(spline.c, ((QUINTIC + 1 - len(spline.c), 0), (0, 0), (0, 0)))
    directions = np.diff(corners, axis=0) / lengths[:, None]
    cosines = np.clip((directions[1:] * directions[:-1]).sum(axis=1), -1.0, 1.0)
    turns = np.maximum(np.append(0.0, np.arccos(cosines)), np.append(np.arccos(cosines), 0.0))
    sharp = np.ceil(CORNER_INTERVALS * turns / (np.pi / 2.0))
    counts = np.where(turns < USUAL_TURN, CHORD_INTERVALS, sharp).astype(int)
    counts[[0, -1]] = INTERVALS // 2
    return [
        Piece(coefficients[:, i], float(length), standing, int(counts[i]))
        for i, length in enumerate(lengths)
    ]


def _line(
    begin: FloatArray, direction: FloatArray, length: float, standing: BoolArray, intervals: float
) -> Piece:
    """A straight piece from ``begin (18,)`` along ``direction (18,)``."""
    coefficients = np.zeros((QUINTIC + 1, len(begin)))
    coefficients[-2:] = direction, begin
    return Piece(coefficients, length, standing, max(round(intervals), LEAST_INTERVALS))


def _corner(
    corner: FloatArray, before: FloatArray, after: FloatArray, reach: float, standing: BoolArray
) -> Piece:
    """A rounded ``corner (18,)``, from ``reach`` before it to ``reach`` after it."""
    angle = float(np.arccos(np.clip(before @ after, -1.0, 1.0)))
    # The length of a circle's arc, so that the foot's speed changes little along the curve.
    length = reach * max(angle / np.tan(angle / 2.0) if angle else 2.0, SHORTEST_CORNER)
    none = np.zeros((1, len(corner)))
    curve = quintic_hermite(
        np.array([length]),
        ((corner - reach * before)[None], before[None], none),
        ((corner + reach * after)[None], after[None], none),
    )
    count = max(int(np.ceil(CORNER_INTERVALS * angle / (np.pi / 2.0))), LEAST_INTERVALS)
    return Piece(curve[:, 0], length, standing, count)
