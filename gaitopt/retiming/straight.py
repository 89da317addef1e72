"""The course of a polyline: straight lines of base and feet, with corners of flights rounded.

A motion that turns at a corner stops there. A foot that flies along a box need not follow its
corners exactly, and so needs no stop: each corner is replaced by a quintic curve between two points
on the lines beside it, with the directions of the lines and no curvature at its ends. The chords of
a curved swing have shallow corners only because it was sampled: a cubic spline leads through them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.interpolate import CubicSpline

from gaitopt.conventions import LEGS, BoolArray, FloatArray
from gaitopt.motion.body_and_feet import path_states
from gaitopt.motion.path import BASE_COLUMNS
from gaitopt.motion.pieces import QUINTIC, States, piece_values, quintic_hermite
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
"""Intervals of a chain of one line, and of the lines of a chain of several: the acceleration along
the course is constant on each."""
CORNER_INTERVALS = 32
"""Intervals of a corner of a right angle that is rounded, along which accelerations change most;
others have as many as their angle asks for."""
LEAST_INTERVALS = 2
"""Fewest intervals of a piece."""
SHALLOW = float(np.cos(np.radians(30.0)))
"""Cosine of the angle below which all corners of a flight are those of a sampled curve. Those of
swing curves turn by up to 20 degrees (8 cm long, 6 cm high), those of boxes by up to 90."""
CHORD_INTERVALS = 3
"""Intervals of a chord of a sampled curve."""
SHORTEST_CORNER = 1.0
"""Least length of a rounded corner's curve over its distance from the corner, where a foot turns
back."""


@dataclass(frozen=True, eq=False)
class StraightCourse(Course):
    """Base and feet by polynomials; chains of pieces from rest to rest.

    Attributes:
        robot: the robot.
        coefficients: of base and feet on each piece, highest power first, in ``s`` since the
            piece's begin ``(6, P, 18)``.
        edges: ``s`` where the pieces begin, and where the last one ends ``(P + 1,)``.
        standing: which feet stand on each piece ``(P, 4)``.
        intervals: how many intervals of the timing each piece has ``(P,)``.
        chains: first piece of each chain, and ``P`` ``(C + 1,)``.
        old: times at the begin and the end of each chain in the plan ``(C, 2)`` [s].
        moments: an instant of the plan at which it is on each piece ``(P,)`` [s].
    """

    robot: Quadruped
    coefficients: FloatArray
    edges: FloatArray
    standing: BoolArray
    intervals: np.ndarray
    chains: np.ndarray
    old: FloatArray
    moments: FloatArray
    # Lines and corners meet without curvature, and a spline's curvature does not jump.
    continuous = True

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
            places = _chain_places(self.edges[a : b + 1], self.intervals[a:b])
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
        """Base and feet, or a derivative ``(N, 18)``."""
        return piece_values(self.coefficients, s - self.edges[piece], piece, order)


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
    for group in _groups(lines) if rounding > 0.0 else [[i] for i in range(len(lines.begin))]:
        first, last = group[0], group[-1]
        old.append([lines.old[first, 0], lines.old[last, 1]])
        corners = np.concatenate([lines.begin[group[:1]], lines.end[group]])
        pieces += _rounded(corners, lines.standing[first], rounding)
        chains.append(len(pieces))
    edges = np.concatenate([[0.0], np.cumsum([piece.length for piece in pieces])])
    return StraightCourse(
        plan.robot, np.stack([piece.coefficients for piece in pieces], axis=1), edges,
        np.array([piece.standing for piece in pieces]),
        np.array([piece.intervals for piece in pieces]), np.array(chains), np.array(old),
        np.repeat(np.mean(old, axis=1), np.diff(chains)),
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


def _groups(lines: _Lines) -> list[list[int]]:
    """Lines that are followed without a stop: those of one foot's flight while the body rests."""
    groups = [[0]]
    still = np.linalg.norm((lines.end - lines.begin)[:, :BASE_COLUMNS], axis=1) <= LEAST_MOTION
    for line in range(1, len(still)):
        before = line - 1
        goes_on = lines.phase[line] == lines.phase[before] and still[line] and still[before]
        if goes_on and (~lines.standing[line]).sum() == 1:
            groups[-1].append(line)
        else:
            groups.append([line])
    return groups


def _rounded(corners: FloatArray, standing: BoolArray, rounding: float) -> list[_Piece]:
    """The pieces of one chain through ``corners (m + 1, 18)``.

    A chain of one line has the length one, others that of the foot's way.
    """
    change = np.diff(corners, axis=0)
    if len(change) == 1:
        return [_line(corners[0], change[0], 1.0, standing, INTERVALS)]
    lengths = np.linalg.norm(change, axis=1)
    directions = change / lengths[:, None]
    if (directions[1:] * directions[:-1]).sum(axis=1).min() > SHALLOW:
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


def _curve(corners: FloatArray, lengths: FloatArray, standing: BoolArray) -> list[_Piece]:
    """The cubic spline through ``corners (m + 1, 18)``, with pieces of the ``lengths (m,)``."""
    spline = CubicSpline(np.concatenate([[0.0], np.cumsum(lengths)]), corners)
    coefficients = np.pad(spline.c, ((QUINTIC + 1 - len(spline.c), 0), (0, 0), (0, 0)))
    counts = np.full(len(lengths), CHORD_INTERVALS)
    counts[[0, -1]] = INTERVALS // 2
    return [
        _Piece(coefficients[:, i], float(length), standing, int(counts[i]))
        for i, length in enumerate(lengths)
    ]


def _line(
    begin: FloatArray, direction: FloatArray, length: float, standing: BoolArray, intervals: float
) -> _Piece:
    """A straight piece from ``begin (18,)`` along ``direction (18,)``."""
    coefficients = np.zeros((QUINTIC + 1, len(begin)))
    coefficients[-2:] = direction, begin
    return _Piece(coefficients, length, standing, max(round(intervals), LEAST_INTERVALS))


def _corner(
    corner: FloatArray, before: FloatArray, after: FloatArray, reach: float, standing: BoolArray
) -> _Piece:
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
    return _Piece(curve[:, 0], length, standing, count)


def _chain_places(edges: FloatArray, counts: np.ndarray) -> FloatArray:
    """Places of a chain's grid: dense at its ends, where the speed grows as the square root.

    Args:
        edges: of its pieces ``(P + 1,)``.
        counts: intervals of each ``(P,)``.
    """
    shares = [np.linspace(0.0, 1.0, count + 1) for count in counts.tolist()]
    if len(counts) == 1:
        shares = [(1.0 - np.cos(np.pi * shares[0])) / 2.0]
    else:
        shares[0] = 1.0 - np.cos(np.pi / 2.0 * shares[0])
        shares[-1] = np.sin(np.pi / 2.0 * shares[-1])
    lengths = np.diff(edges)
    inner = [edges[i] + lengths[i] * share[:-1] for i, share in enumerate(shares)]
    return np.append(np.concatenate(inner), edges[-1])
