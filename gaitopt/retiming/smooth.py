"""The course of a smooth path: the path itself."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gaitopt.conventions import BoolArray, FloatArray
from gaitopt.motion.path import BASE_COLUMNS, MotionPath
from gaitopt.motion.pieces import States, cut, cut_at, piece_values
from gaitopt.plan.plan import Plan
from gaitopt.retiming.course import AT_REST, Course, Grid
from gaitopt.robots.abilities import has_quick_joints
from gaitopt.robots.quadruped import Quadruped
from gaitopt.robots.whole_body import feet_from_joints

SMOOTH_JUMP = 1e-4
"""Share of a joint's or the base's largest velocity by which velocities may jump at a knot of a
path that counts as smooth. Rounding is below 1e-9."""
INTERVALS_PER_PHASE = 48
"""Into how many intervals a phase is cut at least where joints are quick. With 16 a walk of
wang2020 with a free swing curve takes 38.1 s, with 48 it takes 33.8 s, and the planner had it at
32.8 s."""
SLOW_INTERVALS_PER_PHASE, SHORTEST = 64, 0.004
"""Where joints are slow and set the pace: the same, and the length from which on no segment is cut,
so that short phases have fewer intervals [s]. Half of these phases take 10 to 20 ms. Over 64 steps
of wang2020 there are 5 % more places than with 48 alone, and walks take 0.04 % less time."""
KINK, LEAST_PART = 1e-3, 0.05
"""Where another joint becomes the slowest one within a segment, the path may be followed faster
than the mean of both ends says. Where it is by this share or more, the segment is cut there, into
parts that are no smaller share of it. ``height`` of wang2020 takes 0.09 % less time, ``swing``
0.02 %."""


@dataclass(frozen=True, eq=False)
class SmoothCourse(Course):
    """A smooth path, with its own time as the parameter; its pieces are the segments.

    Attributes:
        robot: the robot.
        path: whose velocities jump at stops only.
        standing: which feet stand on each segment ``(P, 4)``.
        moments: the middle of each segment ``(P,)`` [s].
        stops: knots at which the motion stops: velocities jump there, or are zero.
        continuous: segments at whose begin accelerations do not jump ``(P,)``.
    """

    robot: Quadruped
    path: MotionPath
    standing: BoolArray
    moments: FloatArray
    stops: np.ndarray
    continuous: BoolArray

    def states(self, s: FloatArray, piece: np.ndarray) -> States:
        since = s - self.path.times[piece]
        value, first, second = (
            piece_values(self.path.coefficients, since, piece, order) for order in range(3)
        )
        return value, first, second

    def feet(self, s: FloatArray, piece: np.ndarray) -> FloatArray:
        values = piece_values(self.path.coefficients, s - self.path.times[piece], piece)
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


def smooth_course(plan: Plan) -> SmoothCourse:
    """The path of a plan, cut so that every phase has enough intervals."""
    path, slow = plan.path, not has_quick_joints(plan.robot)
    lasting = [p for p in plan.phases if p.duration > 0.0]
    starts = np.array([p.start for p in lasting])
    phases = np.array([p.duration for p in lasting])
    longest = phases / INTERVALS_PER_PHASE
    if slow:
        longest = np.minimum(np.maximum(phases / SLOW_INTERVALS_PER_PHASE, SHORTEST), phases)
    middles = (path.times[1:] + path.times[:-1]) / 2.0
    phase = np.clip(np.searchsorted(starts, middles, side="right") - 1, 0, len(lasting) - 1)
    fine = cut(path, longest[phase])
    if slow:
        fine = _with_kinks(fine, plan.robot)
    largest = np.abs(path.evaluate(path.times, 1)).max(axis=0)
    jumps = np.abs(fine.jumps(1)) > SMOOTH_JUMP * largest + AT_REST
    still = np.abs(fine.evaluate(fine.times[1:-1], 1)).max(axis=1) <= AT_REST
    stops = np.flatnonzero(jumps.any(axis=1) | still) + 1
    bends = np.abs(path.evaluate(path.times, 2)).max(axis=0)
    bent = (np.abs(fine.jumps(2)) > SMOOTH_JUMP * bends + AT_REST).any(axis=1)
    bent[stops - 1] = False
    moments = (fine.times[1:] + fine.times[:-1]) / 2.0
    standing = np.array(plan.at(moments).contacts)
    continuous = np.ones(len(moments), dtype=np.bool_)
    if bent.any():
        # Where segments were cut nothing jumps. Elsewhere a jump may be a small one.
        continuous = ~np.isin(fine.times[:-1], path.times)
        continuous[1:] &= (standing[1:] == standing[:-1]).all(axis=1)
    return SmoothCourse(plan.robot, fine, standing, moments, stops, continuous)


def _with_kinks(path: MotionPath, robot: Quadruped) -> MotionPath:
    """The path with a knot wherever another joint becomes the slowest one within a segment.

    How fast a path may be followed is known at knots, and taken as linear between them. Where the
    slowest joint changes it has a corner, and is above.
    """
    every = np.arange(len(path.times) - 1)
    lengths = np.diff(path.times)
    begin, end = (
        np.abs(piece_values(path.coefficients, since, every, 1))[:, BASE_COLUMNS:]
        / robot.velocity_limits
        for since in (np.zeros(len(every)), lengths)
    )
    first, last = begin.argmax(axis=1), end.argmax(axis=1)
    # By how much the first joint is slower than the last one, at both ends.
    ahead = begin[every, first] - begin[every, last]
    behind = end[every, last] - end[every, first]
    share = ahead / np.maximum(ahead + behind, np.finfo(np.float64).tiny)
    mean = (1.0 - share) * begin[every, first] + share * end[every, last]
    kink = (1.0 - share) * begin[every, first] + share * end[every, first]
    inside = (share > LEAST_PART) & (share < 1.0 - LEAST_PART)
    own = np.flatnonzero((mean - kink > KINK * mean) & inside)
    return cut_at(path, path.times[own] + share[own] * lengths[own])
