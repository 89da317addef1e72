"""From a course and its fastest timing to a path in time."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.motion.body_and_feet import foot_errors
from gaitopt.motion.path import MotionPath
from gaitopt.motion.pieces import States, quintic_hermite
from gaitopt.motion.retiming import interval_times
from gaitopt.motion.smooth_path import smooth_path
from gaitopt.retiming.course import Course, Grid

FOOT_TOLERANCE = 1e-5
"""Largest distance of a foot from its course in the middle of an interval [m]: a hundredth of a
millimetre is far below what a real foot slips."""


@dataclass(frozen=True, eq=False)
class PacedCourse:
    """A course with a timing.

    Attributes:
        course: where the motion goes.
        grid: its intervals.
        begin, end: squared speeds along the course at both ends of every interval ``(K,)``.
        edges: the course's states there, at begins and at ends ``(K, 6 + nj)``.
        stretch: factor by which all times are longer.
    """

    course: Course
    grid: Grid
    begin: FloatArray
    end: FloatArray
    edges: tuple[States, States]
    stretch: float = 1.0

    @cached_property
    def times(self) -> FloatArray:
        """When each interval begins, and when the last one ends ``(K + 1,)`` [s]."""
        taken = interval_times(self.begin, self.end, self.grid.end - self.grid.begin)
        return self.stretch * np.concatenate([[0.0], np.cumsum(taken)])

    @cached_property
    def acceleration(self) -> FloatArray:
        """``d2s/dt2`` on every interval, before it is stretched ``(K,)``."""
        lengths = self.grid.end - self.grid.begin
        return np.asarray((self.end - self.begin) / (2.0 * lengths))

    def place(self, times: FloatArray, interval: np.ndarray) -> FloatArray:
        """The course's parameter at times ``(N,)`` on given intervals."""
        t = (times - self.times[interval]) / self.stretch
        speed = np.sqrt(self.begin[interval]) + self.acceleration[interval] * t / 2.0
        return np.asarray(self.grid.begin[interval] + speed * t)

    def interval_at(self, times: FloatArray) -> np.ndarray:
        """The interval that each time lies in ``(N,)``."""
        found = np.searchsorted(self.times, times, side="right") - 1
        return np.clip(found, 0, len(self.times) - 2)

    def states(self, times: FloatArray, interval: np.ndarray) -> States:
        """Columns of a path, velocities and accelerations at times ``(N,)``."""
        value, first, second = self.course.states(
            self.place(times, interval), self.grid.piece[interval]
        )
        t = (times - self.times[interval]) / self.stretch
        u = self.acceleration[interval]
        speed = (np.sqrt(self.begin[interval]) + u * t)[:, None]
        velocity = first * speed / self.stretch
        acceleration = (first * u[:, None] + second * speed**2) / self.stretch**2
        return value, velocity, acceleration

    def path(self) -> MotionPath:
        """The motion as a piecewise quintic path.

        Raises:
            SolverError: feet leave their course however short the intervals are.
        """

        def state(times: FloatArray, inside: FloatArray) -> States:
            interval = self.interval_at(inside)
            return (self.states(times, interval)[0], *self.states(inside, interval)[1:])

        def error(times: FloatArray, values: FloatArray) -> FloatArray:
            interval = self.interval_at(times)
            feet = self.course.feet(self.place(times, interval), self.grid.piece[interval])
            return np.asarray(foot_errors(self.course.robot, values, feet).max(axis=1))

        return smooth_path(self.times, state, error, FOOT_TOLERANCE, self._first_path())

    def _first_path(self) -> MotionPath:
        """The quintics with the motion's states at both ends of every interval."""
        moving = []
        for (value, first, second), square in zip(self.edges, (self.begin, self.end), strict=True):
            speed = np.sqrt(square)[:, None]
            acceleration = first * self.acceleration[:, None] + second * square[:, None]
            moving.append((value, first * speed / self.stretch, acceleration / self.stretch**2))
        return MotionPath(self.times, quintic_hermite(np.diff(self.times), *moving))

    def new_times(self, old: FloatArray) -> FloatArray:
        """When the motion is where the plan was at times ``(N,)`` of its own [s]."""
        place = np.interp(old, *self.course.marks)
        edges = np.append(self.grid.begin, self.grid.end[-1])
        return np.asarray(self._time_of(place, edges))

    def _time_of(self, place: FloatArray, edges: FloatArray) -> FloatArray:
        """When the motion is at given places of the course ``(N,)`` [s]."""
        interval = np.clip(np.searchsorted(edges, place, side="right") - 1, 0, len(edges) - 2)
        way = np.clip(place - edges[interval], 0.0, None)
        square = self.begin[interval] + 2.0 * self.acceleration[interval] * way
        speeds = np.sqrt(self.begin[interval]) + np.sqrt(np.maximum(square, 0.0))
        # At the begin of an interval no time has passed, whatever the speed.
        taken = np.where(way > 0.0, 2.0 * way / np.where(speeds > 0.0, speeds, 1.0), 0.0)
        return np.asarray(self.times[interval] + self.stretch * taken)
