"""The course of a smooth path: the path itself."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gaitopt.conventions import BoolArray, FloatArray
from gaitopt.motion.path import BASE_COLUMNS, MotionPath
from gaitopt.motion.pieces import States, cut, piece_values
from gaitopt.plan.plan import Plan
from gaitopt.retiming.course import AT_REST, Course, Grid
from gaitopt.robots.quadruped import Quadruped
from gaitopt.robots.whole_body import feet_from_joints

SMOOTH_JUMP = 1e-4
"""Share of a joint's or the base's largest velocity by which velocities may jump at a knot of a
path that counts as smooth. Rounding is below 1e-9."""
INTERVALS_PER_PHASE = 48
"""Least number of intervals of a phase. With 16 a walk of wang2020 with a free swing curve takes
38.1 s, with 48 it takes 33.8 s, and the planner had it at 32.8 s."""


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
    path = plan.path
    lasting = [p for p in plan.phases if p.duration > 0.0]
    starts = np.array([p.start for p in lasting])
    longest = np.array([p.duration for p in lasting]) / INTERVALS_PER_PHASE
    middles = (path.times[1:] + path.times[:-1]) / 2.0
    phase = np.clip(np.searchsorted(starts, middles, side="right") - 1, 0, len(lasting) - 1)
    fine = cut(path, longest[phase])
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
