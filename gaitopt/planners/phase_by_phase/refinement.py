"""Knots along the moves of a walk: as many as a tolerance asks for, and the time between them.

A *move* is one straight shift of the body, or the swing of one foot along the edges of a polyline.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from gaitopt.conventions import BoolArray, FloatArray
from gaitopt.optimize.speed import knot_times
from gaitopt.plan.settings.crawl import CrawlSettings
from gaitopt.planners.phase_by_phase.joint_checks import (
    check_no_full_turns,
    check_position_limits,
    check_precision,
)
from gaitopt.planners.phase_by_phase.steps import CrawlSteps
from gaitopt.robots.quadruped import Quadruped

FIRST_INTERVALS = {"stance": 8, "swing": 42}
"""Intervals of each move in the first try, shared out over its edges. Measured over
``s_columns(0)``: every swing of wang2020 and half of its stance moves need no more."""
MOST_INTERVALS = 4096
"""Most intervals on one edge. Measured: ten robots over ``s_columns(0)`` need 39 at most. This is
100 times as many, so that only a leg that is straight within rounding needs more."""
ERROR_RESERVE = 1.1
"""Factor on a measured error from which the next number of intervals is computed. Chosen here:
the error falls a little more slowly than with the square of the number."""


class TimedMove(NamedTuple):
    """The knots of one move after its first.

    Attributes:
        body: body centre ``(n, 3)`` [m], in the heading frame; of a body that turns, x, y, z, roll,
            pitch, yaw of the base in the world ``(n, 6)`` [m, rad].
        joints: joint angles ``(n, nj)`` [rad].
        durations: time since the knot before ``(n,)`` [s].
        slowest: joint that sets this time, -1 for the speed that was asked for ``(n,)``.
    """

    body: FloatArray
    joints: FloatArray
    durations: FloatArray
    slowest: np.ndarray


class Knots(NamedTuple):
    """Knots of many moves, one move after another.

    Attributes:
        step: the step that each knot belongs to ``(M,)``.
        edge: the straight edge of the move that it lies on ``(M,)``.
        share: how far along the edge, from 0 to 1 ``(M,)``.
    """

    step: np.ndarray
    edge: np.ndarray
    share: FloatArray


PoseAt = Callable[[Knots], tuple[FloatArray, FloatArray, FloatArray]]
"""Gives at knots the moving points ``(M, 3)`` [m] (of a base that turns, with roll, pitch, yaw
``(M, 6)``), all joints ``(M, nj)`` [rad], and how far feet depart from their paths in the middle of
each interval ``(M - 1,)`` [m]."""


def refined_moves(
    robot: Quadruped,
    settings: CrawlSettings,
    steps: CrawlSteps,
    pose: PoseAt,
    edges: int,
    tolerance: float,
    kind: str,
    still: BoolArray | None = None,
) -> list[TimedMove]:
    """The moves of all steps, with as many knots each as the tolerance asks for.

    All steps are computed together. Those whose error is too large are computed again with more
    knots.

    Args:
        robot, settings, steps: the walk.
        pose: see :data:`PoseAt`.
        edges: number of straight edges of each move.
        tolerance: largest error between two knots [m].
        kind: ``"stance"`` or ``"swing"``.
        still: moves along which nothing moves ``(S,)``; they have one interval.

    Raises:
        InfeasibleStepError: a joint would leave its position limits, or jump.
        SolverError: :data:`MOST_INTERVALS` are too few.
    """
    speed = None if settings.speed == "max" else float(settings.speed)
    found: list[TimedMove | None] = [None] * len(steps.legs)
    open_steps = np.arange(len(steps.legs))
    intervals = np.full(len(open_steps), -(-FIRST_INTERVALS[kind] // edges))
    if still is not None:
        intervals[still] = 1
    while open_steps.size:
        at, firsts = _knots(open_steps, intervals, edges)
        points, joints, errors = pose(at)
        check_position_limits(robot, joints, at.step, steps, kind)
        ways = None if speed is None else np.diff(points[:, :3], axis=0)
        lengths = None if ways is None else np.linalg.norm(ways, axis=1)
        durations, slowest = knot_times(joints, robot.velocity_limits, lengths, speed)
        # Between the last knot of one step and the first knot of the next there is no interval.
        errors[firsts[1:] - 1] = 0.0
        check_no_full_turns(robot, joints, firsts, at.step, steps, kind)
        largest = np.maximum.reduceat(errors, firsts)
        done = largest <= tolerance
        check_precision(
            open_steps, largest, ~done & (intervals >= MOST_INTERVALS), MOST_INTERVALS, steps, kind
        )
        for i in np.flatnonzero(done).tolist():
            a, b = firsts[i], firsts[i] + edges * intervals[i]
            found[open_steps[i]] = TimedMove(
                points[a + 1 : b + 1], joints[a + 1 : b + 1], durations[a:b], slowest[a:b]
            )
        # The error of a chord is proportional to the square of its length.
        more = np.ceil(intervals * np.sqrt(ERROR_RESERVE * largest / tolerance)).astype(int)
        open_steps, intervals = open_steps[~done], np.minimum(more[~done], MOST_INTERVALS)
    return [move for move in found if move is not None]


def _knots(steps: np.ndarray, intervals: np.ndarray, edges: int) -> tuple[Knots, np.ndarray]:
    """Knots of some steps, and the index of each step's first knot.

    Knots are dense at the ends of an edge. A leg is straightest there, and near a straight leg the
    joint angles change like the square root of the distance. This spacing makes a smooth function
    of them.

    Args:
        steps: indices of the steps ``(n,)``.
        intervals: number of intervals on each edge of these steps ``(n,)``.
        edges: number of edges of each move.
    """
    counts = edges * intervals + 1
    firsts = np.cumsum(counts) - counts
    owner = np.repeat(np.arange(len(steps)), counts)
    number, n = np.arange(len(owner)) - firsts[owner], intervals[owner]
    edge = np.minimum(number // n, edges - 1)
    share = (1.0 - np.cos(np.pi * (number - edge * n) / n)) / 2.0
    return Knots(steps[owner], edge, share), firsts
