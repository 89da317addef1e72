"""The course of a plan: where base, joints and feet go, whatever the timing.

A course is a curve in pieces, over a parameter ``s``. There are two kinds:

* of a path whose velocities jump (a polyline of joint angles, as walks without acceleration limits
  have): straight lines of base and feet, each a piece of the length one. The joints follow by
  inverse kinematics. At the end of each line the motion stops.
* of a smooth path: the path itself, with its own time as the parameter.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from gaitopt.conventions import LEGS, BoolArray, FloatArray
from gaitopt.motion.body_and_feet import path_states
from gaitopt.motion.path import BASE_COLUMNS, MotionPath
from gaitopt.motion.pieces import States, cut
from gaitopt.plan.plan import Plan
from gaitopt.robots.quadruped import Quadruped
from gaitopt.robots.whole_body import feet_from_joints

SAME_DIRECTION = 1e-6
"""Largest difference of unit directions of two lines that count as one straight line. Knots of a
plan lie on their line to 1e-12 m, and are at least 1e-5 m apart."""
LEAST_MOTION = 1e-9
"""An interval on which base and feet change by less is left out [m or rad]."""
SMOOTH_JUMP = 1e-4
"""Share of a joint's or the base's largest velocity by which velocities may jump at a knot of a
path that counts as smooth. Rounding is below 1e-9."""
AT_REST = 1e-6
"""Largest velocity of base and joints at which a course counts as at rest [m/s, rad/s]."""
PIECES_PER_LINE = 24
"""Intervals of a line, on each of which the acceleration along the line is constant."""
LINE_GRID = (1.0 - np.cos(np.pi * np.arange(PIECES_PER_LINE + 1) / PIECES_PER_LINE)) / 2.0
"""Places along a line at which intervals begin and end: dense at its ends, where the speed grows as
the square root of the distance."""
LINE_GRID.setflags(write=False)
INTERVALS_PER_PHASE = 48
"""Least number of intervals of a phase on a smooth course. With 16 a walk of wang2020 with a free
swing curve takes 38.1 s, with 48 it takes 33.8 s, and the planner had it at 32.8 s."""


@dataclass(frozen=True, eq=False)
class Grid:
    """Places of a course, between which the acceleration along it is constant.

    Attributes:
        begin, end: of the intervals ``(K,)``, in the course's parameter.
        piece: the piece of the course that each interval lies on ``(K,)``.
        first: first interval of each chain, and ``K`` ``(C + 1,)``. Between chains the motion
            stops.
    """

    begin: FloatArray
    end: FloatArray
    piece: np.ndarray
    first: np.ndarray


class Course(ABC):
    """A curve of base, joints and feet in pieces."""

    robot: Quadruped
    standing: BoolArray
    """Which feet stand on each piece ``(P, 4)``."""

    @abstractmethod
    def states(self, s: FloatArray, piece: np.ndarray) -> States:
        """Columns of a path ``(N, 6 + nj)``, and two derivatives by ``s``, on given pieces."""

    @abstractmethod
    def feet(self, s: FloatArray, piece: np.ndarray) -> FloatArray:
        """All feet ``(N, 4, 3)`` [m], in the world."""

    @abstractmethod
    def way(self, piece: np.ndarray) -> FloatArray:
        """How far the body or a foot goes on given pieces ``(N,)`` [m], whichever is farther.

        By a unit of ``s``; 0 where a course does not know.
        """

    @abstractmethod
    def grid(self) -> Grid:
        """The intervals of the timing."""

    @property
    @abstractmethod
    def marks(self) -> tuple[FloatArray, FloatArray]:
        """Times of the old plan that stand for places of the course: times, and ``s``."""


@dataclass(frozen=True, eq=False)
class StraightCourse(Course):
    """Straight lines of base and feet; line ``l`` is the piece from ``s = l`` to ``l + 1``.

    Attributes:
        robot: the robot.
        base: at the begin and the end of each line ``(2, L, 6)``.
        places: all feet there ``(2, L, 4, 3)`` [m].
        standing: which feet stand on each line ``(L, 4)``.
        old: times at the begin and the end of each line in the plan ``(2, L)`` [s].
    """

    robot: Quadruped
    base: FloatArray
    places: FloatArray
    standing: BoolArray
    old: FloatArray

    def states(self, s: FloatArray, piece: np.ndarray) -> States:
        share = s - piece
        base, feet = self.base[:, piece], self.places[:, piece]
        change, moved = base[1] - base[0], feet[1] - feet[0]
        return path_states(
            self.robot,
            (base[0] + share[:, None] * change, change, np.zeros_like(change)),
            (feet[0] + share[:, None, None] * moved, moved, np.zeros_like(moved)),
        )

    def feet(self, s: FloatArray, piece: np.ndarray) -> FloatArray:
        share = (s - piece)[:, None, None]
        return np.asarray((1.0 - share) * self.places[0, piece] + share * self.places[1, piece])

    def way(self, piece: np.ndarray) -> FloatArray:
        moved = np.linalg.norm(np.diff(self.places, axis=0)[0], axis=2).max(axis=1)
        body = np.linalg.norm(np.diff(self.base[:, :, :3], axis=0)[0], axis=1)
        return np.asarray(np.maximum(moved, body)[piece])

    def grid(self) -> Grid:
        line, i = np.divmod(np.arange(len(self.standing) * PIECES_PER_LINE), PIECES_PER_LINE)
        first = PIECES_PER_LINE * np.arange(len(self.standing) + 1)
        return Grid(line + LINE_GRID[i], line + LINE_GRID[i + 1], line, first)

    @property
    def marks(self) -> tuple[FloatArray, FloatArray]:
        line = np.arange(len(self.standing))
        return self.old.T.ravel(), np.stack([line, line + 1.0], axis=1).ravel()


@dataclass(frozen=True, eq=False)
class SmoothCourse(Course):
    """A smooth path, with its own time as the parameter; its pieces are the segments.

    Attributes:
        robot: the robot.
        path: whose velocities jump at stops only.
        standing: which feet stand on each segment ``(P, 4)``.
        stops: knots at which velocities jump, so that the motion stops there.
    """

    robot: Quadruped
    path: MotionPath
    standing: BoolArray
    stops: np.ndarray

    @cached_property
    def _derivatives(self) -> list[FloatArray]:
        """Coefficients of the path and of its two derivatives, highest power first."""
        out = [self.path.coefficients]
        for _ in range(2):
            powers = np.arange(len(out[-1]) - 1, 0, -1)
            out.append(out[-1][:-1] * powers[:, None, None])
        return out

    def states(self, s: FloatArray, piece: np.ndarray) -> States:
        local = (s - self.path.times[piece])[:, None]
        value, first, second = (self._at(c, local, piece) for c in self._derivatives)
        return value, first, second

    def feet(self, s: FloatArray, piece: np.ndarray) -> FloatArray:
        values = self._at(self._derivatives[0], (s - self.path.times[piece])[:, None], piece)
        base, joints = values[:, :BASE_COLUMNS], values[:, BASE_COLUMNS:]
        return feet_from_joints(self.robot, base[:, :3], base[:, 3:], joints)

    def way(self, piece: np.ndarray) -> FloatArray:
        return np.zeros(len(piece))

    def grid(self) -> Grid:
        times = self.path.times
        chains = np.concatenate([[0], self.stops, [len(times) - 1]])
        return Grid(times[:-1], times[1:], np.arange(len(times) - 1), chains)

    @property
    def marks(self) -> tuple[FloatArray, FloatArray]:
        return self.path.times, self.path.times

    @staticmethod
    def _at(coefficients: FloatArray, local: FloatArray, piece: np.ndarray) -> FloatArray:
        out = np.zeros((len(local), coefficients.shape[2]))
        for power in coefficients:
            out = out * local + power[piece]
        return out


def course_of(plan: Plan) -> Course:
    """The course of a plan that lasts for some time."""
    return straight_course(plan) if plan.path.degree <= 1 else smooth_course(plan)


def straight_course(plan: Plan) -> StraightCourse:
    """The lines of a polyline: neighbouring intervals in one direction, in one phase, are one."""
    path, robot = plan.path, plan.robot
    values = path.knots()
    base, joints = values[:, :BASE_COLUMNS], values[:, BASE_COLUMNS:]
    feet = feet_from_joints(robot, base[:, :3], base[:, 3:], joints)
    middles = (path.times[1:] + path.times[:-1]) / 2.0
    standing = np.array(plan.at(middles).contacts)
    phase = np.searchsorted(plan.phase_starts, middles, side="right")
    moved = np.where(standing[:, :, None], 0.0, np.diff(feet, axis=0))
    change = np.concatenate([np.diff(base, axis=0), moved.reshape(len(moved), -1)], axis=1)
    length = np.linalg.norm(change, axis=1)
    moves = np.flatnonzero(length > LEAST_MOTION)
    direction = change[moves] / length[moves, None]
    turn = np.abs(np.diff(direction, axis=0)).max(axis=1, initial=0.0)
    goes_on = (turn < SAME_DIRECTION) & (np.diff(phase[moves]) == 0)
    first = moves[np.concatenate([[True], ~goes_on])]
    last = moves[np.concatenate([~goes_on, [True]])]
    begin, end = feet[first], feet[last + 1].copy()
    end = np.where(standing[first][:, :, None], begin, end)
    return StraightCourse(
        robot, np.stack([base[first], base[last + 1]]), np.stack([begin, end]), standing[first],
        np.stack([path.times[first], path.times[last + 1]]),
    )  # fmt: skip


def smooth_course(plan: Plan) -> SmoothCourse:
    """The path of a plan, cut so that every phase has enough intervals."""
    path = plan.path
    lasting = [p for p in plan.phases if p.duration > 0.0]
    starts = np.array([p.start for p in lasting])
    longest = np.array([p.duration for p in lasting]) / INTERVALS_PER_PHASE
    middles = (path.times[1:] + path.times[:-1]) / 2.0
    phase = np.clip(np.searchsorted(starts, middles, side="right") - 1, 0, len(lasting) - 1)
    fine = cut(path, longest[phase])
    largest = np.abs(path.evaluate(path.times, 1)).max(axis=0)
    jumps = np.abs(fine.jumps(1)) > SMOOTH_JUMP * largest + AT_REST
    stops = np.flatnonzero(jumps.any(axis=1)) + 1
    standing = np.array(plan.at((fine.times[1:] + fine.times[:-1]) / 2.0).contacts)
    return SmoothCourse(plan.robot, fine, standing, stops)


def standing_names(standing: BoolArray) -> str:
    """Names of the feet that stand, for messages."""
    return ", ".join(leg for leg, stands in zip(LEGS, standing, strict=True) if stands) or "no foot"
