"""How fast a course is followed: as fast as forces, torques and joints allow, at every instant.

The timing keeps all limits at the places of its grid. Between them a joint may turn faster, or
forces may be missing: the places around are then slowed down, and the timing is found anew. The
little by which joints still exceed their limits is removed by stretching the whole motion in time.
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
from gaitopt.errors import InfeasibleStepError, SolverError
from gaitopt.motion.bounds import largest_sizes
from gaitopt.motion.path import BASE_COLUMNS, MotionPath
from gaitopt.motion.pieces import stretched
from gaitopt.motion.retiming import legs_needed_stretch, time_optimal_parametrisation
from gaitopt.plan.phase import Phase
from gaitopt.plan.plan import Plan
from gaitopt.retiming.course import AT_REST, Course, Grid
from gaitopt.retiming.paced import PacedCourse
from gaitopt.retiming.smooth import smooth_course
from gaitopt.retiming.straight import straight_course

FRICTION_SLACK = 0.004
"""What every side of a friction pyramid keeps on the grid, as a share of the weight, for what
happens between its places: a share of the friction of a foot that carries little is next to
nothing."""
STRETCH_RESERVE = 1e-6
"""Share of time that is added where a motion is stretched, so that rounding exceeds no limit."""
PLANNED_SHARE = 0.02
"""Share by which forces are planned within tighter limits than are promised at places of the grid,
for what happens between them. The certificate judges every plan anew."""
MIDDLE_SHARE = 0.005
"""The same in the middle between two places: what exceeds that is timed anew."""
LESS = 0.9
"""Share of a squared speed that is allowed where it had no forces."""
ENOUGH = 1.002
"""A motion whose joint velocities exceed their limits by less is not timed anew."""
MOST_ROUNDS = 5
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
        promised: limits on forces and torques; ``None`` where nothing is promised of them.
        dynamics: at both ends of all intervals, one after another; ``None`` without forces.
        timing: other limits, at the same samples.
        even: intervals that are followed at constant speed, as the course begins or ends at rest
            there ``(K,)``.
    """

    plan: Plan
    course: Course
    grid: Grid
    promised: ForceLimits | None
    dynamics: PathDynamics | None
    timing: TimingLimits
    even: BoolArray

    @classmethod
    def of(
        cls, plan: Plan, promised: ForceLimits | None, others: OtherLimits, rounding: float
    ) -> Pacing:
        """Of a plan that moves.

        Args:
            plan: the plan.
            promised: limits on forces and torques, if any.
            others: what bounds the speed besides.
            rounding: of corners of flights along straight lines (:func:`straight_course`).
        """
        lines = plan.path.degree <= 1
        course: Course = straight_course(plan, rounding) if lines else smooth_course(plan)
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
        timing = TimingLimits(squares, joints, bend, others.acceleration, FRICTION_SLACK)
        dynamics = None if promised is None else path_dynamics(robot, values, first, second)
        return cls(plan, course, grid, promised, dynamics, timing, even)

    def fastest(self) -> PacedCourse:
        """The course with its fastest timing.

        Raises:
            InfeasibleStepError: somewhere there is no speed at which forces exist.
        """
        if self.promised is None or self.dynamics is None:
            return self._fastest_of_joints()
        grid, count = self.grid, len(self.grid.piece)
        intervals = PathIntervals(
            begin=2 * np.arange(count), end=2 * np.arange(count) + 1,
            lengths=grid.end - grid.begin, standing=self.course.standing[grid.piece],
            first=grid.first, even=self.even,
        )  # fmt: skip
        limits = tightened(self.promised, PLANNED_SHARE)
        found = fastest_with_forces(
            self.course.robot, self.dynamics, intervals, limits, self.timing
        )
        if found.stuck.any():
            raise self._impossible(limits, int(found.places[int(np.argmax(found.stuck))]))
        return PacedCourse(self.course, grid, found.begin, found.end)

    def _fastest_of_joints(self) -> PacedCourse:
        """The same within limits of the joints alone, for chains that all have the same grid."""
        grid, chains = self.grid, len(self.grid.first) - 1
        first, second = (
            np.concatenate([d[::2].reshape(chains, -1, d.shape[1]),
                            d[1::2].reshape(chains, -1, d.shape[1])[:, -1:]], axis=1)
            for d in (self.timing.first, self.timing.second)
        )  # fmt: skip
        edges = np.append(grid.begin[: grid.first[1]], grid.end[grid.first[1] - 1])
        squares = time_optimal_parametrisation(
            np.swapaxes(first, 0, 1), np.swapaxes(second, 0, 1), edges,
            self.course.robot.velocity_limits, self.timing.acceleration,
        )  # fmt: skip
        return PacedCourse(self.course, grid, squares[:-1].T.ravel(), squares[1:].T.ravel())

    def slowed(self, motion: PacedCourse, path: MotionPath) -> Pacing | None:
        """The same with lower speeds where a motion exceeds limits between places of the grid.

        Args:
            motion, path: the fastest motion, and its path.

        Returns:
            ``None`` where no limit is exceeded by more than a little, or no forces are promised.
        """
        if self.promised is None:
            return None
        velocity = self._velocity_use(motion, path)
        forced = self._without_forces(motion, path, tightened(self.promised, MIDDLE_SHARE))
        if velocity.max() <= ENOUGH and not forced.any():
            return None
        share = _and_neighbours(np.where(velocity > ENOUGH, velocity, 1.0))
        squares = self.timing.squares / np.repeat(share, 2) ** 2
        found = np.stack([motion.begin, motion.end], axis=1).ravel()
        held = np.repeat(_and_neighbours(forced.astype(np.float64)) > 0.0, 2)
        # Places at which the robot stops are 0 already.
        squares = np.where(held, np.minimum(squares, LESS * found), squares)
        return replace(self, timing=replace(self.timing, squares=squares))

    def check(self, motion: PacedCourse, path: MotionPath) -> None:
        """Refuse a motion that has no forces in the middle of an interval.

        Raises:
            SolverError: it has none; names the step and the time.
        """
        if self.promised is None:
            return
        missing = np.flatnonzero(self._without_forces(motion, path, self.promised))
        if missing.size:
            phase, time = self._phase(int(missing[0])), float(motion.times[missing[0]])
            raise SolverError(
                f"step {phase.step} ({phase.leg}): no timing was found whose contact forces exist "
                f"between the places at which they were looked for, near {time:.3f} s; take "
                "another stability_margin or swing_height, or allow more friction or torque"
            )

    def _velocity_use(self, motion: PacedCourse, path: MotionPath) -> FloatArray:
        """Largest joint velocity on each interval, as a share of its limit ``(K,)``."""
        robot = self.course.robot
        columns = robot.leg_joint_columns
        sizes = largest_sizes(path, 1)[:, BASE_COLUMNS + columns]
        owner = motion.interval_at((path.times[1:] + path.times[:-1]) / 2.0)
        share = np.zeros(len(motion.begin))
        np.maximum.at(share, owner, (sizes / robot.velocity_limits[columns]).max(axis=1))
        return share

    def _without_forces(
        self, motion: PacedCourse, path: MotionPath, limits: ForceLimits
    ) -> BoolArray:
        """Intervals in whose middle no forces keep the limits ``(K,)``."""
        robot, middles = self.course.robot, (motion.times[1:] + motion.times[:-1]) / 2.0
        moved = motion_of_path(robot, *(path.evaluate(middles, k) for k in range(3)))
        standing = self.course.standing[self.grid.piece]
        return ~solve_forces(build_force_problem(robot, moved, standing, limits)).feasible

    def _phase(self, interval: int) -> Phase:
        """The phase of the plan that an interval is part of."""
        middle = (self.grid.begin[interval] + self.grid.end[interval]) / 2.0
        return self.plan.phase_at(float(np.interp(middle, *self.course.marks[::-1])))

    def _impossible(self, limits: ForceLimits, interval: int) -> InfeasibleStepError:
        """The error of an interval on which no motion was found."""
        course, piece = self.course, self.grid.piece[[interval]]
        value = course.states(self.grid.begin[[interval]], piece)[0]
        rest = motion_of_path(course.robot, value, np.zeros_like(value), np.zeros_like(value))
        problem = build_force_problem(course.robot, rest, course.standing[piece], limits)
        conflicts, phase = solve_forces(problem).conflicts(0), self._phase(interval)
        how = (
            f"not even at rest: {'; '.join(conflicts)}" if conflicts else
            "in motion: the robot could rest here, but cannot go on along its path at any speed"
        )  # fmt: skip
        return InfeasibleStepError(
            f"step {phase.step} ({phase.leg}): no contact forces hold the robot here, {how}; take "
            "another stability_margin or body_height, or allow more friction or torque",
            step=phase.step, leg=phase.leg, conflicts=conflicts,
        )  # fmt: skip


def paced(
    plan: Plan, promised: ForceLimits | None, others: OtherLimits, rounding: float
) -> tuple[PacedCourse, MotionPath]:
    """A plan's course at the highest speed that forces, torques and joints allow, and its path.

    Args:
        plan, promised, others, rounding: as in :meth:`Pacing.of`.

    Raises:
        InfeasibleStepError: somewhere there is no speed at which forces exist.
        SolverError: feet leave their course however short the intervals are, or between the places
            of the grid there are no forces.
    """
    pacing = Pacing.of(plan, promised, others, rounding)
    for _ in range(MOST_ROUNDS):
        motion = pacing.fastest()
        path = motion.path()
        slower = pacing.slowed(motion, path)
        if slower is None:
            break
        pacing = slower
    else:
        pacing.check(motion, path)
    robot = plan.robot
    velocities = robot.velocity_limits[robot.leg_joint_columns]
    needed = legs_needed_stretch(robot, path, 0.0, velocities, others.acceleration, 1)
    if needed <= 1.0:
        return motion, path
    factor = needed * (1.0 + STRETCH_RESERVE)
    return replace(motion, stretch=factor), stretched(path, factor)


def _and_neighbours(values: FloatArray) -> FloatArray:
    """The largest of each value and its two neighbours ``(K,)``."""
    wide = np.pad(values, 1, mode="edge")
    return np.asarray(np.max([wide[:-2], wide[1:-1], wide[2:]], axis=0))


def tightened(limits: ForceLimits, share: float) -> ForceLimits:
    """Limits that leave a reserve.

    Args:
        limits: that are promised.
        share: of friction and torques, and a tenth of it of the weight.
    """
    on_four = limits.reserve / 2.0 if limits.reserve_on_four is None else limits.reserve_on_four
    return replace(
        limits,
        friction=(1.0 - share) * limits.friction,
        reserve=limits.reserve + 0.1 * share,
        reserve_on_four=on_four + 0.1 * share,
        torque_share=(1.0 - share) * limits.torque_share,
    )
