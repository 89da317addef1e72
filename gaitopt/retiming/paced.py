"""From a course and its fastest timing to a path in time."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.dynamics.contacts import ForceLimits
from gaitopt.dynamics.force_timing import fastest_with_forces
from gaitopt.dynamics.forces import build_force_problem, solve_forces
from gaitopt.dynamics.path_programs import PathIntervals, TimingLimits
from gaitopt.dynamics.whole_body import motion_of_path, path_dynamics
from gaitopt.errors import InfeasibleStepError
from gaitopt.motion.body_and_feet import foot_errors
from gaitopt.motion.path import BASE_COLUMNS, MotionPath
from gaitopt.motion.pieces import States, stretched
from gaitopt.motion.retiming import legs_needed_stretch
from gaitopt.motion.smooth_path import smooth_path
from gaitopt.plan.plan import Plan
from gaitopt.retiming.course import AT_REST, Course, Grid, course_of

FOOT_TOLERANCE = 1e-5
"""Largest distance of a foot from its course in the middle of an interval [m]: a hundredth of a
millimetre is far below what a real foot slips."""
FASTEST = 1e4
"""Largest squared speed along a smooth course, whose parameter is its old time: a motion becomes at
most a hundred times as fast. Only waiting, where nothing moves, has no other limit."""
STRETCH_RESERVE = 1e-6
"""Share of time that is added where a motion is stretched, so that rounding exceeds no limit."""


@dataclass(frozen=True, eq=False)
class PacedCourse:
    """A course with a timing.

    Attributes:
        course: where the motion goes.
        grid: its intervals.
        begin, end: squared speeds along the course at both ends of every interval ``(K,)``.
        stretch: factor by which all times are longer.
    """

    course: Course
    grid: Grid
    begin: FloatArray
    end: FloatArray
    stretch: float = 1.0

    @cached_property
    def times(self) -> FloatArray:
        """When each interval begins, and when the last one ends ``(K + 1,)`` [s]."""
        lengths = self.grid.end - self.grid.begin
        taken = 2.0 * lengths / (np.sqrt(self.begin) + np.sqrt(self.end))
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

        return smooth_path(self.times, state, error, FOOT_TOLERANCE)

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


def paced(
    plan: Plan, limits: ForceLimits, acceleration_limit: float, speed: float = np.inf
) -> PacedCourse:
    """A plan's course at the highest speed that forces, torques and joints allow on its grid.

    Args:
        plan: which moves.
        limits: on forces and torques.
        acceleration_limit: of all joints [rad/s^2]; infinite for none.
        speed: of body and feet that is not exceeded on straight lines [m/s].

    Raises:
        InfeasibleStepError: somewhere there is no speed at which forces exist.
    """
    course = course_of(plan)
    robot, grid = course.robot, course.grid()
    count = len(grid.piece)
    s, piece = np.stack([grid.begin, grid.end], axis=1).ravel(), np.repeat(grid.piece, 2)
    values, first, second = course.states(s, piece)
    joints, bend = first[:, BASE_COLUMNS:], second[:, BASE_COLUMNS:]
    with np.errstate(divide="ignore"):
        squares = ((robot.velocity_limits / np.abs(joints)) ** 2).min(axis=1)
        given = (speed / course.way(piece)) ** 2
    # A line on which nothing moves is no line, so no 0 is divided by 0.
    squares = np.minimum(np.minimum(squares, given), FASTEST)
    ends = np.concatenate([2 * grid.first[:-1], 2 * grid.first[1:] - 1])
    squares[ends[np.abs(first[ends]).max(axis=1) > AT_REST]] = 0.0
    intervals = PathIntervals(
        begin=2 * np.arange(count), end=2 * np.arange(count) + 1, lengths=grid.end - grid.begin,
        standing=course.standing[grid.piece], first=grid.first,
    )  # fmt: skip
    found = fastest_with_forces(
        robot, path_dynamics(robot, values, first, second), intervals, limits,
        TimingLimits(squares, joints, bend, acceleration_limit),
    )  # fmt: skip
    if found.stuck.any():
        interval = int(found.places[int(np.argmax(found.stuck))])
        raise _impossible(plan, course, grid, limits, interval)
    return PacedCourse(course, grid, found.begin, found.end)


def _impossible(
    plan: Plan, course: Course, grid: Grid, limits: ForceLimits, interval: int
) -> InfeasibleStepError:
    """The error of an interval on which no motion was found."""
    piece = grid.piece[[interval]]
    value = course.states(grid.begin[[interval]], piece)[0]
    rest = motion_of_path(course.robot, value, np.zeros_like(value), np.zeros_like(value))
    found = solve_forces(build_force_problem(course.robot, rest, course.standing[piece], limits))
    phase = plan.phase_at(float(np.interp(grid.begin[interval], *course.marks[::-1])))
    conflicts = found.conflicts(0)
    how = (
        f"not even at rest: {'; '.join(conflicts)}" if conflicts else
        "in motion: the robot could rest here, but cannot go on along its path at any speed"
    )  # fmt: skip
    return InfeasibleStepError(
        f"step {phase.step} ({phase.leg}): no contact forces hold the robot here, {how}; take "
        "another stability_margin or body_height, or allow more friction or torque",
        step=phase.step, leg=phase.leg, conflicts=conflicts,
    )  # fmt: skip


def within_limits(motion: PacedCourse, acceleration_limit: float) -> tuple[PacedCourse, MotionPath]:
    """The motion and its path, stretched so that joints keep their limits at every instant.

    Args:
        motion: which keeps its limits at the places of its grid.
        acceleration_limit: of all joints [rad/s^2]; infinite for none.

    Raises:
        SolverError: feet leave their course however short the intervals are.
    """
    path, robot = motion.path(), motion.course.robot
    limits = robot.velocity_limits[robot.leg_joint_columns]
    needed = legs_needed_stretch(robot, path, 0.0, limits, acceleration_limit, 1)
    if needed <= 1.0:
        return motion, path
    factor = needed * (1.0 + STRETCH_RESERVE)
    return replace(motion, stretch=factor), stretched(path, factor)
