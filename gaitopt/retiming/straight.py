"""The course of a polyline: straight lines of base and feet, with corners of flights rounded.

Its pieces are made in :mod:`gaitopt.retiming.corners`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from gaitopt.conventions import LEGS, BoolArray, FloatArray
from gaitopt.errors import InputError
from gaitopt.motion.body_and_feet import path_states
from gaitopt.motion.path import BASE_COLUMNS
from gaitopt.motion.pieces import States, piece_values
from gaitopt.plan.phase import Phase
from gaitopt.plan.plan import Plan
from gaitopt.plan.settings.crawl import CrawlSettings
from gaitopt.retiming.corners import LEAST_MOTION, Piece, rounded
from gaitopt.retiming.course import Course, Grid
from gaitopt.retiming.refusal import not_reached
from gaitopt.robots.quadruped import Quadruped
from gaitopt.robots.whole_body import feet_from_joints
from gaitopt.swing.catalogue import SWING_CURVES

SAME_DIRECTION = 1e-6
"""Largest difference of unit directions of two lines that count as one straight line. Knots of a
plan lie on their line to 1e-12 m, and are at least 1e-5 m apart."""
TURNS_BACK = float(np.cos(np.radians(120.0)))
"""Cosine of the angle from which on a foot stops at a corner: that of a step on the spot, which
goes straight up and down again. Rounded, it would rise by less than was asked for."""


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
        phases: the phase of the plan that each chain is part of, ``C`` of them.
        continuous: all pieces ``(P,)``: lines and corners meet without curvature, and a spline's
            curvature does not jump.
    """

    robot: Quadruped
    coefficients: FloatArray
    edges: FloatArray
    standing: BoolArray
    intervals: np.ndarray
    chains: np.ndarray
    old: FloatArray
    moments: FloatArray
    phases: tuple[Phase, ...]
    continuous: BoolArray

    def states(self, s: FloatArray, piece: np.ndarray) -> States:
        """Columns of the path ``(N, 6 + nj)`` and two derivatives by ``s``.

        Raises:
            InfeasibleStepError: a leg is straight or folded, or does not reach; names the step.
        """
        value, first, second = (self._at(s, piece, order) for order in range(3))
        base = (value[:, :BASE_COLUMNS], first[:, :BASE_COLUMNS], second[:, :BASE_COLUMNS])
        feet = tuple(x[:, BASE_COLUMNS:].reshape(-1, len(LEGS), 3) for x in (value, first, second))
        try:
            return path_states(self.robot, base, (feet[0], feet[1], feet[2]))
        except InputError as error:
            if len(s) > 1:
                # Which of the places it is: the error of that place has its step.
                half = len(s) // 2
                self.states(s[:half], piece[:half])
                self.states(s[half:], piece[half:])
            chain = int(np.searchsorted(self.chains, piece[0], side="right")) - 1
            raise not_reached(self.phases[chain], error) from error

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
    pieces: list[Piece] = []
    chains, old = [0], []
    for group in _groups(lines) if rounding > 0.0 else [[i] for i in range(len(lines.begin))]:
        first, last = group[0], group[-1]
        old.append([lines.old[first, 0], lines.old[last, 1]])
        corners = np.concatenate([lines.begin[group[:1]], lines.end[group]])
        pieces += rounded(corners, lines.standing[first], rounding, _is_curved(plan))
        chains.append(len(pieces))
    edges = np.concatenate([[0.0], np.cumsum([piece.length for piece in pieces])])
    return StraightCourse(
        plan.robot, np.stack([piece.coefficients for piece in pieces], axis=1), edges,
        np.array([piece.standing for piece in pieces]),
        np.array([piece.intervals for piece in pieces]), np.array(chains), np.array(old),
        np.repeat(np.mean(old, axis=1), np.diff(chains)),
        tuple(plan.phase_at(float(time)) for time in np.mean(old, axis=1)),
        np.ones(len(pieces), dtype=np.bool_),
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
    # Motions that are left out must not become jumps: the next one begins where the last one ended.
    begin[1:, :BASE_COLUMNS] = end[:-1, :BASE_COLUMNS]
    old = np.stack([path.times[first], path.times[last + 1]], axis=1)
    return _Lines(begin, end, standing[first], phase[first], old)


def _is_curved(plan: Plan) -> bool:
    """Whether feet fly along swing curves, of which the lines are samples, and not along boxes."""
    swing = plan.settings.swing if isinstance(plan.settings, CrawlSettings) else "box"
    return swing in SWING_CURVES and swing != "box"


def _groups(lines: _Lines) -> list[list[int]]:
    """Lines that are followed without a stop: those of one foot's flight while the body rests."""
    groups = [[0]]
    change = lines.end - lines.begin
    still = np.linalg.norm(change[:, :BASE_COLUMNS], axis=1) <= LEAST_MOTION
    direction = change / np.linalg.norm(change, axis=1, keepdims=True)
    for line in range(1, len(still)):
        before = line - 1
        goes_on = lines.phase[line] == lines.phase[before] and still[line] and still[before]
        goes_on &= bool(direction[line] @ direction[before] > TURNS_BACK)
        if goes_on and (~lines.standing[line]).sum() == 1:
            groups[-1].append(line)
        else:
            groups.append([line])
    return groups


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
