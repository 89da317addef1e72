"""Box swings with bounded joint accelerations: along every straight line from rest to rest.

A box has corners, and no bounded acceleration turns a corner without a stop. So the walk is cut
where body or foot change direction, and each line is run through as fast as the joints' limits
of velocity and acceleration let it, by :func:`gaitopt.motion.retiming.time_optimal_parametrisation`
(TOPP-RA's method [Pham2018]).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.motion.differences import time_derivatives
from gaitopt.motion.path import MotionPath
from gaitopt.motion.retiming import (
    interval_times,
    legs_needed_stretch,
    time_optimal_parametrisation,
)
from gaitopt.optimize.route.legs import BODY, FOOT, StackedLegs
from gaitopt.planners.time_optimal.dense import Dense
from gaitopt.planners.time_optimal.foothold_motion import Contacts, FootholdMotion
from gaitopt.planners.time_optimal.knots import RouteKnots
from gaitopt.robots.quadruped import Quadruped

PARTS = 24
"""Parts of a line; on each the second derivative of the place along the line is constant."""
_SAME_WAY = 1e-6
_STEP = 1e-3
_HAIR = 1e-6


class Lines(NamedTuple):
    """Straight lines of body and flying foot, from rest to rest.

    Attributes:
        begin, end: poses ``(L, 9)``.
        owner: an interval of the problem that lies on each line ``(L,)``.
        after: lines before each knot of the problem ``(K,)``.
    """

    begin: FloatArray
    end: FloatArray
    owner: np.ndarray
    after: np.ndarray


def straight_lines(knots: RouteKnots, poses: FloatArray) -> Lines:
    """The lines of a route: intervals that go on in the same direction are one."""
    feet = np.where(knots.flying[..., None] > 0, poses[:, None, FOOT], knots.feet)
    rows = np.arange(len(knots.leg))
    begin, end = poses[:-1].copy(), poses[1:].copy()
    begin[:, FOOT], end[:, FOOT] = feet[rows, knots.leg], feet[rows + 1, knots.leg]
    # In stance the foot is the same at both ends, also at the last one, where the leg may change.
    end[~knots.swings, FOOT] = begin[~knots.swings, FOOT]
    way = end - begin
    size = np.linalg.norm(way, axis=1)
    moves = np.flatnonzero(size > 1e-9)
    way = way[moves] / size[moves, None]
    phase = 2 * knots.step[moves] + knots.swings[moves]
    goes_on = (np.abs(np.diff(way, axis=0)).max(axis=1, initial=0.0) < _SAME_WAY) & (
        np.diff(phase) == 0
    )
    first = moves[np.concatenate([[True], ~goes_on])]
    last = moves[np.concatenate([~goes_on, [True]])]
    after = np.searchsorted(last, np.arange(len(poses)))
    return Lines(begin[first], end[last], first, after)


@dataclass(frozen=True, eq=False)
class StoppingMotion(FootholdMotion):
    """A walk along straight lines, with a stop at the end of each.

    Attributes:
        robot, heading, legs, knots: of the walk.
        lines: what is followed.
        squares: squared speeds of the share of every line ``(PARTS + 1, L)`` [1/s^2].
        stretch: how many times as long everything takes.
    """

    lines: Lines
    squares: FloatArray
    stretch: float = 1.0

    @classmethod
    def of(
        cls, robot: Quadruped, heading: float, legs: StackedLegs, knots: RouteKnots,
        poses: FloatArray, limit: float,
    ) -> StoppingMotion:  # fmt: skip
        """The fastest one through given poses ``(K, 9)``, as seen at :data:`PARTS` places."""
        lines = straight_lines(knots, poses)
        motion = cls(robot, heading, legs, knots, lines, np.zeros((PARTS + 1, len(lines.owner))))
        line = np.tile(np.arange(len(lines.owner)), PARTS + 1)
        share = np.repeat(GRID, len(lines.owner))
        first, second = (
            d.reshape(PARTS + 1, -1, 12)
            for d in time_derivatives(lambda s: motion.joints(line, s), share, _STEP)
        )
        squares = time_optimal_parametrisation(
            first, second, GRID, legs.velocity_limits.ravel(), limit
        )
        return replace(motion, squares=squares)

    @cached_property
    def times(self) -> FloatArray:
        """Times of all places, line by line ``(L PARTS + 1,)`` [s]."""
        taken = interval_times(self.squares, GRID)
        return self.stretch * np.concatenate([[0.0], np.cumsum(taken.T.ravel())])

    def pose(self, line: np.ndarray, share: FloatArray) -> FloatArray:
        """Poses at shares of lines ``(N, 9)``."""
        part = share[:, None]
        return np.asarray(self.lines.begin[line] * (1.0 - part) + self.lines.end[line] * part)

    def joints(self, line: np.ndarray, share: FloatArray) -> FloatArray:
        """Joint angles leg by leg ``(N, 12)`` [rad]."""
        return self.angles(self.pose(line, share), self._standing(line))

    def share(self, times: FloatArray, part: np.ndarray) -> FloatArray:
        """Share of the line at times ``(N,)``, by the law of given parts."""
        line, i = np.divmod(part, PARTS)
        x, step = self.squares[i, line], np.diff(GRID)[i]
        acceleration = (self.squares[i + 1, line] - x) / (2.0 * step)
        t = (times - self.times[part]) / self.stretch
        return np.asarray(GRID[i] + (np.sqrt(x) + acceleration * t / 2.0) * t)

    def poses_at(self, times: FloatArray, piece: np.ndarray) -> FloatArray:
        """Poses by the law of given parts ``(N, 9)``."""
        return self.pose(piece // PARTS, self.share(times, piece))

    def contacts(self, piece: np.ndarray) -> Contacts:
        """Which feet stand on given parts."""
        return self._standing(piece // PARTS)

    def _standing(self, line: np.ndarray) -> Contacts:
        owner = self.lines.owner[line]
        return Contacts(owner, self.knots.swings[owner], self.knots.leg[owner])

    def dense(self) -> Dense:
        """The motion at all places, for the phases of a plan."""
        parts = np.append(np.arange(len(self.times) - 1), len(self.times) - 2)
        values = self.values(self.times, parts)
        share = self.share(self.times, parts)
        centre = self.pose(parts // PARTS, share)[:, BODY]
        slowest = np.zeros(len(self.times) - 1, dtype=int)
        return Dense(values[:, :6], centre, values[:, 6:], self.times, slowest,
                     PARTS * self.lines.after)  # fmt: skip


GRID = (1.0 - np.cos(np.pi * np.arange(PARTS + 1) / PARTS)) / 2.0
"""Places along a line, dense at its ends."""


def stopping_path(motion: StoppingMotion, limit: float) -> tuple[StoppingMotion, MotionPath]:
    """The motion's path, in so much more time as its joints need between places.

    Raises:
        SolverError: standing feet do not stay in place.
    """
    path = motion.path()
    limits = motion.legs.velocity_limits.ravel()
    stretch = legs_needed_stretch(motion.robot, path, 0.0, limits, limit, 1)
    if stretch > 1.0:
        motion = replace(motion, stretch=stretch * (1.0 + _HAIR))
        path = motion.path()
    return motion, path
