"""How fast a course is followed: as fast as forces, torques and joints allow, at every instant.

The timing keeps all limits at the places of its grid. Between them a joint may turn faster: the
places around are then slowed down, and the timing is found anew. The little that is left is removed
by stretching the whole motion in time.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from gaitopt.conventions import BoolArray, FloatArray
from gaitopt.dynamics.contacts import ForceLimits
from gaitopt.dynamics.force_timing import fastest_with_forces
from gaitopt.dynamics.forces import build_force_problem, solve_forces
from gaitopt.dynamics.path_programs import PathIntervals, TimingLimits
from gaitopt.dynamics.whole_body import PathDynamics, motion_of_path, path_dynamics
from gaitopt.errors import InfeasibleStepError
from gaitopt.motion.bounds import largest_sizes
from gaitopt.motion.path import BASE_COLUMNS, MotionPath
from gaitopt.motion.pieces import stretched
from gaitopt.motion.retiming import legs_needed_stretch
from gaitopt.plan.plan import Plan
from gaitopt.retiming.course import AT_REST, Course, Grid, course_of
from gaitopt.retiming.paced import PacedCourse

STRETCH_RESERVE = 1e-6
"""Share of time that is added where a motion is stretched, so that rounding exceeds no limit."""
ENOUGH = 1.002
"""A motion that needs no more stretch than this is not timed anew."""
MOST_ROUNDS = 4
"""Most times that a motion is timed. Each round takes at least a quarter off what is too much."""


@dataclass(frozen=True)
class OtherLimits:
    """What bounds the speed besides forces, torques and joint velocities.

    Attributes:
        acceleration: of all joints [rad/s^2]; infinite for none.
        speed: of body and feet on straight lines [m/s].
        faster: how many times as fast as the plan a smooth motion becomes at most; a straight line
            takes at least this part of a second. Only waiting, where nothing moves, has no other
            limit.
    """

    acceleration: float = np.inf
    speed: float = np.inf
    faster: float = 100.0


@dataclass(frozen=True, eq=False)
class Pacing:
    """What the timing of a course is found from.

    Attributes:
        plan: whose course it is.
        course, grid: where the motion goes, and its intervals.
        dynamics: at both ends of all intervals, one after another.
        limits: on forces and torques.
        timing: other limits, at the same samples.
        even: intervals that are followed at constant speed, as the course begins or ends at rest
            there ``(K,)``.
    """

    plan: Plan
    course: Course
    grid: Grid
    dynamics: PathDynamics
    limits: ForceLimits
    timing: TimingLimits
    even: BoolArray

    @classmethod
    def of(cls, plan: Plan, limits: ForceLimits, others: OtherLimits) -> Pacing:
        """Of a plan that moves.

        Args:
            plan: the plan.
            limits: on forces and torques.
            others: what bounds the speed besides.
        """
        course = course_of(plan)
        robot, grid = course.robot, course.grid()
        s, piece = np.stack([grid.begin, grid.end], axis=1).ravel(), np.repeat(grid.piece, 2)
        values, first, second = course.states(s, piece)
        joints, bend = first[:, BASE_COLUMNS:], second[:, BASE_COLUMNS:]
        with np.errstate(divide="ignore"):
            squares = ((robot.velocity_limits / np.abs(joints)) ** 2).min(axis=1)
            # A line on which nothing moves is no line, so no 0 is divided by 0.
            given = (others.speed / course.way(piece)) ** 2
        squares = np.minimum(np.minimum(squares, given), others.faster**2)
        ends = np.concatenate([2 * grid.first[:-1], 2 * grid.first[1:] - 1])
        rests = np.abs(first[ends]).max(axis=1) <= AT_REST
        squares[ends[~rests]] = 0.0
        even = np.zeros(len(grid.piece), dtype=np.bool_)
        even[ends[rests] // 2] = True
        timing = TimingLimits(squares, joints, bend, others.acceleration)
        dynamics = path_dynamics(robot, values, first, second)
        return cls(plan, course, grid, dynamics, limits, timing, even)

    def fastest(self) -> PacedCourse:
        """The course with its fastest timing.

        Raises:
            InfeasibleStepError: somewhere there is no speed at which forces exist.
        """
        grid, count = self.grid, len(self.grid.piece)
        intervals = PathIntervals(
            begin=2 * np.arange(count), end=2 * np.arange(count) + 1,
            lengths=grid.end - grid.begin, standing=self.course.standing[grid.piece],
            first=grid.first, even=self.even,
        )  # fmt: skip
        found = fastest_with_forces(
            self.course.robot, self.dynamics, intervals, self.limits, self.timing
        )
        if found.stuck.any():
            raise self._impossible(int(found.places[int(np.argmax(found.stuck))]))
        return PacedCourse(self.course, grid, found.begin, found.end)

    def slowed(self, share: FloatArray) -> Pacing:
        """The same with lower speeds about intervals on which joints turn too fast.

        Args:
            share: largest joint velocity on each interval, as a share of its limit ``(K,)``.
        """
        most = np.maximum(share, 1.0)
        around = np.maximum(np.append(most[1:], 1.0), np.append(1.0, most[:-1]))
        factor = np.repeat(np.maximum(most, around), 2) ** 2
        return replace(self, timing=replace(self.timing, squares=self.timing.squares / factor))

    def _impossible(self, interval: int) -> InfeasibleStepError:
        """The error of an interval on which no motion was found."""
        course, grid = self.course, self.grid
        piece = grid.piece[[interval]]
        value = course.states(grid.begin[[interval]], piece)[0]
        rest = motion_of_path(course.robot, value, np.zeros_like(value), np.zeros_like(value))
        problem = build_force_problem(course.robot, rest, course.standing[piece], self.limits)
        conflicts = solve_forces(problem).conflicts(0)
        phase = self.plan.phase_at(float(np.interp(grid.begin[interval], *course.marks[::-1])))
        how = (
            f"not even at rest: {'; '.join(conflicts)}" if conflicts else
            "in motion: the robot could rest here, but cannot go on along its path at any speed"
        )  # fmt: skip
        return InfeasibleStepError(
            f"step {phase.step} ({phase.leg}): no contact forces hold the robot here, {how}; take "
            "another stability_margin or body_height, or allow more friction or torque",
            step=phase.step, leg=phase.leg, conflicts=conflicts,
        )  # fmt: skip


def paced(plan: Plan, limits: ForceLimits, others: OtherLimits) -> tuple[PacedCourse, MotionPath]:
    """A plan's course at the highest speed that forces, torques and joints allow, and its path.

    Args:
        plan, limits, others: as in :meth:`Pacing.of`.

    Raises:
        InfeasibleStepError: somewhere there is no speed at which forces exist.
        SolverError: feet leave their course however short the intervals are.
    """
    pacing = Pacing.of(plan, limits, others)
    robot, rounds = plan.robot, 0
    columns = robot.leg_joint_columns
    velocities = robot.velocity_limits[columns]
    while True:
        motion = pacing.fastest()
        path, rounds = motion.path(), rounds + 1
        needed = legs_needed_stretch(robot, path, 0.0, velocities, others.acceleration, 1)
        if needed <= ENOUGH or rounds == MOST_ROUNDS:
            break
        sizes = largest_sizes(path, 1)[:, BASE_COLUMNS + columns]
        owner = motion.interval_at((path.times[1:] + path.times[:-1]) / 2.0)
        share = np.zeros(len(motion.begin))
        np.maximum.at(share, owner, (sizes / velocities).max(axis=1))
        pacing = pacing.slowed(share)
    if needed <= 1.0:
        return motion, path
    factor = needed * (1.0 + STRETCH_RESERVE)
    return replace(motion, stretch=factor), stretched(path, factor)
