"""The course of a polyline: straight lines of base and feet, with corners of flights rounded.

A motion that turns at a corner stops there. A foot that flies along a box need not follow its
corners exactly, and so needs no stop: each corner is replaced by a quintic curve between two points
on the lines beside it, with the directions of the lines and no curvature at its ends.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from gaitopt.conventions import LEGS, BoolArray, FloatArray
from gaitopt.motion.body_and_feet import path_states
from gaitopt.motion.path import BASE_COLUMNS
from gaitopt.motion.pieces import QUINTIC, States, quintic_hermite
from gaitopt.plan.plan import Plan
from gaitopt.retiming.course import Course, Grid
from gaitopt.robots.quadruped import Quadruped
from gaitopt.robots.whole_body import feet_from_joints

SAME_DIRECTION = 1e-6
"""Largest difference of unit directions of two lines that count as one straight line. Knots of a
plan lie on their line to 1e-12 m, and are at least 1e-5 m apart."""
LEAST_MOTION = 1e-9
"""An interval on which base and feet change by less is left out [m or rad]."""
INTERVALS = 24
"""Intervals of a chain of one line, and of each line in a chain of several: the acceleration along
the course is constant on each."""
BLEND_LENGTH = 1.6
"""Length of a rounded corner's curve over its distance from the corner: near that of a quarter of
a circle, 1.57, so that the foot's speed changes little along it."""
CORNER_INTERVALS = 32
"""Intervals of a rounded corner, along which accelerations change most."""
COSINES = (1.0 - np.cos(np.pi * np.arange(INTERVALS + 1) / INTERVALS)) / 2.0
"""Places along a line from rest to rest."""
QUARTER = np.sin(np.pi / 2.0 * np.arange(INTERVALS // 2 + 1) / (INTERVALS // 2))
"""Places along a line that ends at rest."""


@dataclass(frozen=True, eq=False)
class StraightCourse(Course):
    """Base and feet by polynomials; chains of pieces from rest to rest.

    Attributes:
        robot: the robot.
        coefficients: of base and feet on each piece, highest power first, in ``s`` since the
            piece's begin ``(6, P, 18)``.
        edges: ``s`` where the pieces begin, and where the last one ends ``(P + 1,)``.
        standing: which feet stand on each piece ``(P, 4)``.
        chains: first piece of each chain, and ``P`` ``(C + 1,)``.
        old: times at the begin and the end of each chain in the plan ``(C, 2)`` [s].
    """

    robot: Quadruped
    coefficients: FloatArray
    edges: FloatArray
    standing: BoolArray
    chains: np.ndarray
    old: FloatArray

    def states(self, s: FloatArray, piece: np.ndarray) -> States:
        value, first, second = (self._at(s, piece, order) for order in range(3))
        base = (value[:, :BASE_COLUMNS], first[:, :BASE_COLUMNS], second[:, :BASE_COLUMNS])
        feet = tuple(x[:, BASE_COLUMNS:].reshape(-1, len(LEGS), 3) for x in (value, first, second))
        return path_states(self.robot, base, (feet[0], feet[1], feet[2]))

    def feet(self, s: FloatArray, piece: np.ndarray) -> FloatArray:
        return self._at(s, piece, 0)[:, BASE_COLUMNS:].reshape(-1, len(LEGS), 3)

    def way(self, piece: np.ndarray) -> FloatArray:
        slope = self.coefficients[-2, piece]
        feet = np.linalg.norm(slope[:, BASE_COLUMNS:].reshape(-1, len(LEGS), 3), axis=2)
        return np.asarray(np.maximum(feet.max(axis=1), np.linalg.norm(slope[:, :3], axis=1)))

    def grid(self) -> Grid:
        begins, ends, pieces, first = [], [], [], [0]
        for a, b in zip(self.chains[:-1].tolist(), self.chains[1:].tolist(), strict=True):
            places = _chain_places(self.edges[a : b + 1])
            begins.append(places[:-1])
            ends.append(places[1:])
            middles = (places[1:] + places[:-1]) / 2.0
            pieces.append(np.searchsorted(self.edges, middles, side="right") - 1)
            first.append(first[-1] + len(middles))
        return Grid(np.concatenate(begins), np.concatenate(ends), np.concatenate(pieces),
                    np.array(first))  # fmt: skip

    @property
    def marks(self) -> tuple[FloatArray, FloatArray]:
        places = np.stack([self.edges[self.chains[:-1]], self.edges[self.chains[1:]]], axis=1)
        return self.old.ravel(), places.ravel()

    def _at(self, s: FloatArray, piece: np.ndarray, order: int) -> FloatArray:
        """A derivative of base and feet ``(N, 18)``."""
        local = (s - self.edges[piece])[:, None]
        coefficients = self.coefficients
        for _ in range(order):
            powers = np.arange(len(coefficients) - 1, 0, -1)
            coefficients = coefficients[:-1] * powers[:, None, None]
        out = np.zeros((len(local), coefficients.shape[2]))
        for power in coefficients:
            out = out * local + power[piece]
        return out


def straight_course(plan: Plan, rounding: float) -> StraightCourse:
    """The lines of a polyline: neighbouring intervals in one direction, in one phase, are one.

    Args:
        plan: whose path is of degree one.
        rounding: how far from a corner of a flight its rounding begins and ends, as a share of the
            shorter one of its two lines; 0 for none, 0.5 at the most.
    """
    lines = _lines(plan)
    pieces: list[_Piece] = []
    chains, old = [0], []
    for group in _groups(lines, rounding > 0.0):
        first, last = group[0], group[-1]
        old.append([lines.old[first, 0], lines.old[last, 1]])
        corners = np.concatenate([lines.begin[group[:1]], lines.end[group]])
        pieces += _rounded(corners, lines.standing[first], rounding)
        chains.append(len(pieces))
    edges = np.concatenate([[0.0], np.cumsum([piece.length for piece in pieces])])
    return StraightCourse(
        plan.robot, np.stack([piece.coefficients for piece in pieces], axis=1), edges,
        np.array([piece.standing for piece in pieces]), np.array(chains), np.array(old),
    )  # fmt: skip


class _Lines(NamedTuple):
    """Straight lines of base and feet ``L``, each within a phase.

    Attributes:
        begin, end: base, then all feet ``(L, 18)``.
        standing: which feet stand ``(L, 4)``.
        phase: number of the phase ``(L,)``.
        old: times at both ends in the plan ``(L, 2)`` [s].
    """

    begin: FloatArray
    end: FloatArray
    standing: BoolArray
    phase: np.ndarray
    old: FloatArray


class _Piece(NamedTuple):
    """A polynomial piece of the length ``length``, with coefficients ``(6, 18)``."""

    coefficients: FloatArray
    length: float
    standing: BoolArray


def _lines(plan: Plan) -> _Lines:
    """The straight lines of a plan."""
    path, robot = plan.path, plan.robot
    values = path.knots()
    base, joints = values[:, :BASE_COLUMNS], values[:, BASE_COLUMNS:]
    feet = feet_from_joints(robot, base[:, :3], base[:, 3:], joints)
    middles = (path.times[1:] + path.times[:-1]) / 2.0
    standing = np.array(plan.at(middles).contacts)
    phase = np.searchsorted(plan.phase_starts, middles, side="right")
    # What stands stays. Rounding must not make it move.
    moved = np.where(standing[:, :, None], 0.0, np.diff(feet, axis=0))
    change = np.concatenate([np.diff(base, axis=0), moved.reshape(len(moved), -1)], axis=1)
    length = np.linalg.norm(change, axis=1)
    moves = np.flatnonzero(length > LEAST_MOTION)
    direction = change[moves] / length[moves, None]
    turn = np.abs(np.diff(direction, axis=0)).max(axis=1, initial=0.0)
    goes_on = (turn < SAME_DIRECTION) & (np.diff(phase[moves]) == 0)
    first = moves[np.concatenate([[True], ~goes_on])]
    last = moves[np.concatenate([~goes_on, [True]])]
    stands = standing[first][:, :, None]
    ends = np.where(stands, feet[first], feet[last + 1])
    begin = np.concatenate([base[first], feet[first].reshape(len(first), -1)], axis=1)
    end = np.concatenate([base[last + 1], ends.reshape(len(first), -1)], axis=1)
    old = np.stack([path.times[first], path.times[last + 1]], axis=1)
    return _Lines(begin, end, standing[first], phase[first], old)


def _groups(lines: _Lines, together: bool) -> list[list[int]]:
    """Lines that are followed without a stop.

    Args:
        lines: all lines.
        together: whether the lines of one foot's flight, while the body rests, are one group.
    """
    groups = [[0]]
    still = np.linalg.norm((lines.end - lines.begin)[:, :BASE_COLUMNS], axis=1) <= LEAST_MOTION
    for line in range(1, len(lines.begin)):
        before = line - 1
        goes_on = lines.phase[line] == lines.phase[before] and still[line] and still[before]
        if together and goes_on and (~lines.standing[line]).sum() == 1:
            groups[-1].append(line)
        else:
            groups.append([line])
    return groups


def _rounded(corners: FloatArray, standing: BoolArray, rounding: float) -> list[_Piece]:
    """The pieces of one chain through ``corners (m + 1, 18)``.

    A chain of one line has the length one, others that of the foot's way.
    """
    change = np.diff(corners, axis=0)
    lengths = np.linalg.norm(change, axis=1)
    if len(change) == 1:
        coefficients = np.zeros((QUINTIC + 1, corners.shape[1]))
        coefficients[-2:] = change[0], corners[0]
        return [_Piece(coefficients, 1.0, standing)]
    directions = change / lengths[:, None]
    radii = np.zeros(len(corners))
    radii[1:-1] = rounding * np.minimum(lengths[1:], lengths[:-1])
    pieces = []
    for i, direction in enumerate(directions):
        rest = float(lengths[i] - radii[i] - radii[i + 1])
        if rest > LEAST_MOTION:
            coefficients = np.zeros((QUINTIC + 1, corners.shape[1]))
            coefficients[-2:] = direction, corners[i] + radii[i] * direction
            pieces.append(_Piece(coefficients, rest, standing))
        if i + 1 < len(directions):
            radius, turned = radii[i + 1], directions[i + 1]
            ends = [corners[i + 1] - radius * direction, corners[i + 1] + radius * turned]
            length, none = BLEND_LENGTH * float(radius), np.zeros((1, corners.shape[1]))
            blend = quintic_hermite(
                np.array([length]), (ends[0][None], direction[None], none),
                (ends[1][None], turned[None], none),
            )  # fmt: skip
            pieces.append(_Piece(blend[:, 0], length, standing))
    return pieces


def _chain_places(edges: Sequence[float] | FloatArray) -> FloatArray:
    """Places of a chain's grid: dense at its ends, where the speed grows as the square root.

    Args:
        edges: of its pieces.
    """
    at = np.asarray(edges, dtype=np.float64)
    if len(at) == 2:
        return np.asarray(at[0] + (at[1] - at[0]) * COSINES)
    # Dense toward the stops at both ends; every second piece is a rounded corner.
    found = [at[0] + (at[1] - at[0]) * (1.0 - QUARTER[::-1]), at[-2] + (at[-1] - at[-2]) * QUARTER]
    for i in range(1, len(at) - 2):
        count = CORNER_INTERVALS if i % 2 else INTERVALS // 2
        found.append(np.linspace(at[i], at[i + 1], count + 1))
    return np.unique(np.concatenate(found))
