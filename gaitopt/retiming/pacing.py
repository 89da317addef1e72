"""How fast a course is followed: as fast as forces, torques and joints allow, at every instant.

The timing keeps all limits at the places of its grid. Between them a joint may turn faster, or
forces may be missing: the places around are then slowed down, and the timing is found anew. The
little by which joints still exceed their limits is removed by stretching the whole motion in time.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from gaitopt.conventions import BoolArray, FloatArray
from gaitopt.dynamics.contacts import LEVEL_GROUND, ContactGround, ForceLimits
from gaitopt.dynamics.force_timing import ForceTiming, fastest_with_forces
from gaitopt.dynamics.path_intervals import PathIntervals, TimingLimits
from gaitopt.dynamics.whole_body import PathDynamics, path_dynamics
from gaitopt.motion.bounds import largest_sizes
from gaitopt.motion.path import BASE_COLUMNS, MotionPath
from gaitopt.motion.pieces import States
from gaitopt.motion.retiming import time_optimal_parametrisation
from gaitopt.plan.contact_ground import ground_below
from gaitopt.plan.phase import Phase
from gaitopt.plan.plan import Plan
from gaitopt.retiming.course import AT_REST, Course, Grid, GridPlaces
from gaitopt.retiming.course_clock import CourseClock
from gaitopt.retiming.middles import bent, without_forces
from gaitopt.retiming.other_limits import OtherLimits
from gaitopt.retiming.paced import PacedCourse
from gaitopt.retiming.refusal import no_forces_between, no_motion
from gaitopt.retiming.reserves import FRICTION_SLACK, MIDDLE_SHARE, PLANNED_SHARE, tightened
from gaitopt.retiming.smooth import smooth_course
from gaitopt.retiming.straight import straight_course

LESS = 0.9
"""Share of a squared speed that is allowed where it had no forces."""
ENOUGH = 1.0003
"""A motion whose joint velocities exceed their limits by less is not timed anew: it is stretched as
a whole, by as much. With 1.002 walks of wang2020 came out 0.15 % slower."""


@dataclass(frozen=True, eq=False)
class Pacing:
    """What the timing of a course is found from.

    Attributes:
        plan: whose course it is.
        course, grid: where the motion goes, and its intervals.
        places: both ends of all intervals.
        states: of the course, at the places.
        promised: limits on forces and torques; ``None`` where nothing is promised of them.
        ground: below the feet, on the pieces of the course.
        dynamics: at the places; ``None`` without forces.
        timing: other limits, at the places.
        even: intervals that are followed at constant speed, as the course begins or ends at rest
            there ``(K,)``.
        before: the timing that was slowed down, if there was one.
        good: intervals that it kept, and that have forces in between ``(K,)``.
        seen: squared speeds at both ends of intervals ``(2, K)`` with which they have forces in
            between; NaN where none are known.
        rests: how long the motion rests before each interval ``(K,)`` [s]; the timing itself does
            not count it.
    """

    plan: Plan
    course: Course
    grid: Grid
    places: GridPlaces
    states: States
    promised: ForceLimits | None
    ground: ContactGround
    dynamics: PathDynamics | None
    timing: TimingLimits
    even: BoolArray
    before: ForceTiming | None
    good: BoolArray
    seen: FloatArray
    rests: FloatArray

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
        places = GridPlaces.of(grid, course.continuous[grid.piece])
        begin, end = places.begin, places.end
        values, first, second = states = course.states(places.s, places.piece)
        joints = first[:, BASE_COLUMNS:]
        with np.errstate(divide="ignore"):
            squares = ((robot.velocity_limits / np.abs(joints)) ** 2).min(axis=1)
            # A line on which nothing moves is no line, so no 0 is divided by 0.
            given = (others.speed / course.way(grid.piece)) ** 2
        for at in (begin, end):
            np.minimum.at(squares, at, np.minimum(given, others.faster**2))
        ends = np.stack([begin[grid.first[:-1]], end[grid.first[1:] - 1]])
        # A straight line may be followed in a hundredth of a second, and its speeds are those of s
        # times a hundred then: what counts as rest there is so much less.
        still = AT_REST / others.faster if lines else AT_REST
        rests = np.abs(first[ends]).max(axis=2) <= still
        squares[ends[~rests]] = 0.0
        even = np.zeros(len(grid.piece), dtype=np.bool_)
        even[grid.first[:-1][rests[0]]] = even[grid.first[1:][rests[1]] - 1] = True
        slopes, bends, most, scales = others.bounding(
            first, second, np.interp(places.s, *course.marks[::-1])
        )
        timing = TimingLimits(squares, slopes, bends, most, FRICTION_SLACK, scales=scales)
        ground, dynamics = LEVEL_GROUND, None
        if promised is not None:
            ground = ground_below(plan, course.moments, promised.friction)
            dynamics = path_dynamics(robot, values, first, second, *ground.at(places.piece))
        unknown = np.zeros(len(grid.piece), dtype=np.bool_)
        return cls(plan, course, grid, places, states, promised, ground, dynamics, timing, even,
                   None, unknown, np.full((2, len(unknown)), np.nan),
                   np.zeros(len(unknown)))  # fmt: skip

    def fastest(self) -> tuple[PacedCourse, ForceTiming | None]:
        """The course with its fastest timing, and what was learnt of forces for it.

        Raises:
            InfeasibleStepError: somewhere there is no speed at which forces exist.
        """
        if self.promised is None or self.dynamics is None:
            return self._paced(*self._fastest_of_joints()), None
        grid, intervals = self.grid, self.intervals
        limits = tightened(self.promised, PLANNED_SHARE)
        found = fastest_with_forces(
            self.course.robot, self.dynamics, intervals, limits, self.timing, self.before
        )
        if found.stuck.any():
            place = int(found.places[int(np.argmax(found.stuck))])
            ground = self.ground.at(grid.piece[[place]])
            raise no_motion(self.course, grid, place, self._phase(place), limits, ground)
        return self._paced(found.begin, found.end), found

    @property
    def intervals(self) -> PathIntervals:
        """The intervals, with the feet that stand on them."""
        grid, places = self.grid, self.places
        return PathIntervals(
            begin=places.begin, end=places.end, lengths=grid.end - grid.begin,
            standing=self.course.standing[grid.piece], first=grid.first, even=self.even,
        )  # fmt: skip

    def clock(self, begin: FloatArray, end: FloatArray) -> CourseClock:
        """Times of a timing with these squared speeds at both ends of the intervals ``(K,)``."""
        standing = self.course.standing[self.grid.piece]
        return CourseClock.of(self.grid, standing, (begin, end), self.rests)

    def squares(self, motion: PacedCourse) -> FloatArray:
        """Squared speeds of a motion at all places ``(N,)`` [1/s^2]."""
        out = np.zeros(len(self.places.s))
        out[self.places.begin], out[self.places.end] = motion.begin, motion.end
        return out

    def _paced(self, begin: FloatArray, end: FloatArray) -> PacedCourse:
        """The course with squared speeds at both ends of every interval, each ``(K,)``."""
        here, there = (
            (self.states[0][at], self.states[1][at], self.states[2][at])
            for at in (self.places.begin, self.places.end)
        )
        return PacedCourse(self.course, self.grid, begin, end, (here, there))

    def _fastest_of_joints(self) -> tuple[FloatArray, FloatArray]:
        """Squared speeds within limits of the joints alone, for chains with the same grid."""
        grid, places, chains = self.grid, self.places, len(self.grid.first) - 1
        at = np.concatenate([places.begin.reshape(chains, -1),
                             places.end.reshape(chains, -1)[:, -1:]], axis=1).T  # fmt: skip
        edges = np.append(grid.begin[: grid.first[1]], grid.end[grid.first[1] - 1])
        # The base's height comes after the joints, if its acceleration is limited.
        speeds = np.full(self.timing.first.shape[1], np.inf)
        speeds[: len(self.course.robot.joint_names)] = self.course.robot.velocity_limits
        squares = time_optimal_parametrisation(
            self.timing.first[at], self.timing.second[at], edges,
            speeds * self.timing.scales, self.timing.acceleration,
        )  # fmt: skip
        return squares[:-1].T.ravel(), squares[1:].T.ravel()

    def slowed(
        self, motion: PacedCourse, path: MotionPath, found: ForceTiming | None
    ) -> Pacing | None:
        """The same with lower speeds where a motion exceeds limits between places of the grid.

        Args:
            motion, path, found: the fastest motion, its path, and what was learnt for it.

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
        held = _and_neighbours(forced.astype(np.float64)) > 0.0
        squares = self.timing.squares.copy()
        for at, square in ((self.places.begin, motion.begin), (self.places.end, motion.end)):
            slower = np.minimum(self.timing.squares[at], square) / share**2
            np.minimum.at(squares, at, np.where(share > 1.0, slower, np.inf))
            # Places at which the robot stops are 0 already.
            np.minimum.at(squares, at, np.where(held, LESS * square, np.inf))
        same = (squares == self.timing.squares)[[self.places.begin, self.places.end]].all(axis=0)
        first = self.grid.first
        kept = np.repeat(np.logical_and.reduceat(same, first[:-1]), np.diff(first))
        return replace(self, timing=replace(self.timing, squares=squares), before=found,
                       good=kept & ~forced,
                       seen=np.where(forced, np.nan, [motion.begin, motion.end]))  # fmt: skip

    def check(self, motion: PacedCourse, path: MotionPath) -> None:
        """Refuse a motion that has no forces somewhere between both ends of an interval.

        Raises:
            SolverError: it has none; names the step and the time.
        """
        if self.promised is None:
            return
        missing = np.flatnonzero(self._without_forces(motion, path, self.promised))
        if missing.size:
            first = int(missing[0])
            raise no_forces_between(self._phase(first), float(motion.times[first]))

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
        """Intervals not known to be good that have no forces in between ``(K,)``."""
        out = np.zeros(len(self.good), dtype=np.bool_)
        if self.dynamics is not None:
            looked, most = bent(motion, self.places, self.dynamics), self.timing.most
            if most is not None and limits.transfer_time > 0.0:
                # Between two places a largest force is not the mean of what it is at both.
                looked = looked | (most[self.places.begin] < np.inf).any(axis=1)
            good = self.good
            if limits.transfer_time == 0.0:
                # Nothing in them depends on times elsewhere.
                good = good | (self.seen == [motion.begin, motion.end]).all(axis=0)
            own = np.flatnonzero(~good & looked)
            clock = self.clock(motion.begin, motion.end)
            spans = clock.in_motion(motion.times[:-1] / motion.stretch)
            ground = self.ground.at(self.grid.piece[own])
            out[own] = without_forces(motion, path, own, limits, spans, ground)
        return out

    def _phase(self, interval: int) -> Phase:
        """The phase of the plan that an interval is part of."""
        middle = (self.grid.begin[interval] + self.grid.end[interval]) / 2.0
        return self.plan.phase_at(float(np.interp(middle, *self.course.marks[::-1])))


def _and_neighbours(values: FloatArray) -> FloatArray:
    """The largest of each value and its two neighbours ``(K,)``."""
    wide = np.pad(values, 1, mode="edge")
    return np.asarray(np.max([wide[:-2], wide[1:-1], wide[2:]], axis=0))
