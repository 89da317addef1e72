"""Walks with box swings and bounded joint accelerations: straight lines from rest to rest.

A box has corners, and with bounded accelerations a foot can turn at a corner only if it stops
there. So the walk is cut wherever body or foot change direction, and each straight line is followed
as fast as the joints' limits of velocity and acceleration allow, by
:func:`gaitopt.motion.retiming.time_optimal_parametrisation` (the method of TOPP-RA [Pham2018]).
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
from gaitopt.optimize.route.legs import BODY, FOOT, JOINTS, StackedLegs
from gaitopt.planners.time_optimal.dense import DensePath
from gaitopt.planners.time_optimal.foothold_motion import Contacts, FootholdMotion
from gaitopt.planners.time_optimal.knots import RouteKnots
from gaitopt.robots.quadruped import Quadruped

PIECES_PER_LINE = 24
"""Pieces of a line, on each of which the acceleration along the line is constant."""
GRID = (1.0 - np.cos(np.pi * np.arange(PIECES_PER_LINE + 1) / PIECES_PER_LINE)) / 2.0
"""Places along a line at which pieces begin and end, as shares of it: dense at its ends, where the
speed grows as the square root of the distance."""
GRID.setflags(write=False)
SAME_DIRECTION = 1e-6
"""Largest difference of unit directions of two lines that count as one straight line."""
LEAST_MOTION = 1e-9
"""An interval on which poses change by less is left out [m or rad]."""
SHARE_STEP = 1e-3
"""Step of finite differences by the share of a line."""
STOPS_STRETCH_RESERVE = 1e-6
"""Share of time that is added where a motion is stretched, so that rounding exceeds no limit."""


class Lines(NamedTuple):
    """Straight lines of body and flying foot, from rest to rest.

    Attributes:
        begin, end: poses ``(L, 9)``.
        interval: the first interval of the problem that lies on each line ``(L,)``.
        before_knot: how many lines lie before each knot of the problem ``(K,)``.
    """

    begin: FloatArray
    end: FloatArray
    interval: np.ndarray
    before_knot: np.ndarray


def straight_lines(knots: RouteKnots, poses: FloatArray) -> Lines:
    """The lines of a walk: neighbouring intervals of a phase with the same direction are one.

    Args:
        knots: of the walk.
        poses: at all knots ``(K, 9)``.
    """
    feet = knots.feet_at_knots(poses[:, FOOT])
    interval = np.arange(len(knots.leg))
    begin, end = poses[:-1].copy(), poses[1:].copy()
    begin[:, FOOT], end[:, FOOT] = feet[interval, knots.leg], feet[interval + 1, knots.leg]
    # In a stance phase the foot stays. Rounding must not make it move.
    end[~knots.is_swing, FOOT] = begin[~knots.is_swing, FOOT]
    change = end - begin
    length = np.linalg.norm(change, axis=1)
    moves = np.flatnonzero(length > LEAST_MOTION)
    direction = change[moves] / length[moves, None]
    phase = 2 * knots.step[moves] + knots.is_swing[moves]
    turn = np.abs(np.diff(direction, axis=0)).max(axis=1, initial=0.0)
    goes_on = (turn < SAME_DIRECTION) & (np.diff(phase) == 0)
    first = moves[np.concatenate([[True], ~goes_on])]
    last = moves[np.concatenate([~goes_on, [True]])]
    return Lines(begin[first], end[last], first, np.searchsorted(last, np.arange(len(poses))))


@dataclass(frozen=True, eq=False)
class StoppingMotion(FootholdMotion):
    """A walk along straight lines, with a stop at the end of each; its pieces are those of lines.

    Attributes:
        robot, heading, legs, knots: of the walk.
        lines: what is followed.
        squared_speeds: squares of the speed at which the share of every line grows, at the places
            of :data:`GRID` ``(PIECES_PER_LINE + 1, L)`` [1/s^2].
        stretch: factor by which all times are longer.
    """

    lines: Lines
    squared_speeds: FloatArray
    stretch: float = 1.0

    @classmethod
    def of(
        cls, robot: Quadruped, heading: float, legs: StackedLegs, knots: RouteKnots,
        poses: FloatArray, limit: float,
    ) -> StoppingMotion:  # fmt: skip
        """The fastest motion through poses ``(K, 9)``, with limits kept at the places of the grid.

        Args:
            robot, heading, legs, knots: of the walk.
            poses: at all knots ``(K, 9)``.
            limit: of joint accelerations [rad/s^2].
        """
        lines = straight_lines(knots, poses)
        count = len(lines.interval)
        motion = cls(robot, heading, legs, knots, lines, np.zeros((PIECES_PER_LINE + 1, count)))
        line, share = np.tile(np.arange(count), PIECES_PER_LINE + 1), np.repeat(GRID, count)
        first, second = (
            d.reshape(PIECES_PER_LINE + 1, count, JOINTS)
            for d in time_derivatives(lambda s: motion.joints_along(line, s), share, SHARE_STEP)
        )
        squared_speeds = time_optimal_parametrisation(
            first, second, GRID, legs.velocity_limits.ravel(), limit
        )
        return replace(motion, squared_speeds=squared_speeds)

    @cached_property
    def times(self) -> FloatArray:
        """Times at all places of the grid, line by line ``(L PIECES_PER_LINE + 1,)`` [s]."""
        taken = interval_times(self.squared_speeds, GRID)
        return self.stretch * np.concatenate([[0.0], np.cumsum(taken.T.ravel())])

    def poses_at(self, times: FloatArray, piece: np.ndarray) -> FloatArray:
        """Poses ``(N, 9)`` by the formulae of the given pieces."""
        return self._poses_along(piece // PIECES_PER_LINE, self._shares_at(times, piece))

    def contacts(self, piece: np.ndarray) -> Contacts:
        """Which feet stand during the given pieces."""
        return self._contacts_on(piece // PIECES_PER_LINE)

    def joints_along(self, line: np.ndarray, share: FloatArray) -> FloatArray:
        """Joint angles leg by leg ``(N, 12)`` [rad] at shares of lines."""
        return self.joints_of(self._poses_along(line, share), self._contacts_on(line))

    def dense_path(self) -> DensePath:
        """The motion at all places of the grid, for the phases of a plan.

        No single joint sets the time of a piece: ``slowest_joint`` says nothing.
        """
        pieces = np.append(np.arange(len(self.times) - 1), len(self.times) - 2)
        values = self.values_at(self.times, pieces)
        centre = self.poses_at(self.times, pieces)[:, BODY]
        slowest = np.zeros(len(self.times) - 1, dtype=int)
        return DensePath(values[:, :6], centre, values[:, 6:], self.times, slowest,
                         PIECES_PER_LINE * self.lines.before_knot)  # fmt: skip

    def _poses_along(self, line: np.ndarray, share: FloatArray) -> FloatArray:
        """Poses ``(N, 9)`` at shares of lines."""
        s = share[:, None]
        return np.asarray(self.lines.begin[line] * (1.0 - s) + self.lines.end[line] * s)

    def _shares_at(self, times: FloatArray, piece: np.ndarray) -> FloatArray:
        """Share of its line at each time ``(N,)``, with the constant acceleration of its piece."""
        line, i = np.divmod(piece, PIECES_PER_LINE)
        square, length = self.squared_speeds[i, line], np.diff(GRID)[i]
        acceleration = (self.squared_speeds[i + 1, line] - square) / (2.0 * length)
        t = (times - self.times[piece]) / self.stretch
        return np.asarray(GRID[i] + (np.sqrt(square) + acceleration * t / 2.0) * t)

    def _contacts_on(self, line: np.ndarray) -> Contacts:
        """Which feet stand on lines."""
        interval = self.lines.interval[line]
        return Contacts(interval, self.knots.flying_on_intervals.at(interval))


def stopping_path(motion: StoppingMotion, limit: float) -> tuple[StoppingMotion, MotionPath]:
    """The motion and its path, stretched so that joints keep their limits at every instant.

    Args:
        motion: which keeps its limits at the places of its grid.
        limit: of joint accelerations [rad/s^2].

    Raises:
        SolverError: feet that stand leave their footholds.
    """
    path = motion.path()
    velocity_limits = motion.legs.velocity_limits.ravel()
    stretch = legs_needed_stretch(motion.robot, path, 0.0, velocity_limits, limit, 1)
    if stretch > 1.0:
        motion = replace(motion, stretch=stretch * (1.0 + STOPS_STRETCH_RESERVE))
        path = motion.path()
    return motion, path
