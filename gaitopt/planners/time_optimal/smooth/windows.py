"""Plans a smooth walk in windows, each of which goes on from the motion of the ones before it."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from time import process_time
from typing import NamedTuple

import numpy as np

from gaitopt.conventions import FloatArray, Progress
from gaitopt.errors import RouteError
from gaitopt.optimize.route.dynamic_layout import Entry
from gaitopt.optimize.route.dynamic_problem import DynamicRouteProblem
from gaitopt.optimize.route.legs import BODY, JOINTS, POSE
from gaitopt.planners.time_optimal.failure import Reason, route_error
from gaitopt.planners.time_optimal.flights import height_rows
from gaitopt.planners.time_optimal.knots import RouteKnots
from gaitopt.planners.time_optimal.smooth.guess import rough_guess
from gaitopt.planners.time_optimal.smooth.motion import SplineMotion
from gaitopt.planners.time_optimal.smooth.rounds import (
    DynamicSolution,
    FoundMotion,
    best_motion,
    judge,
)
from gaitopt.planners.time_optimal.smooth.window import SmoothWindow
from gaitopt.planners.time_optimal.walk import Route

KNOTS_BEFORE = 2
"""Knots before a window with which its motion begins. A spline begins at rest; with two knots more
the parabolas on the window's first span, and on the one before it, are exact all the same."""


class InWindows(NamedTuple):
    """What windows have found.

    Attributes:
        found: the motion of the whole walk.
        solutions: of all rounds of all windows.
        time_shares: processor time of each window, as a share of the time in which the robot walks
            the part of it that is kept.
    """

    found: FoundMotion
    solutions: list[DynamicSolution]
    time_shares: list[float]


def plan_in_windows(
    route: Route,
    knots: RouteKnots,
    problem: DynamicRouteProblem,
    length: int,
    progress: Progress | None,
) -> InWindows:
    """Plan windows of ``length`` steps, of each of which the first half is kept.

    Every window ends at rest, so there is always a way on from the part that is kept: where a
    window is not found, the walk follows the one before it for another step.

    Args:
        route: the walk.
        knots, problem: of the whole walk.
        length: steps of a window.
        progress: called with (steps done, steps in all) before every window but the first.

    Raises:
        RouteError: a window is not found where the one before it is at its end, or the motion of
            all windows together does not keep its limits.
    """
    planned = _Planned(route, knots, problem, length)
    solutions: list[DynamicSolution] = []
    shares: list[float] = []
    while planned.steps < route.count:
        if planned.steps and progress is not None:
            progress(planned.steps, route.count)
        began, first = process_time(), planned.steps
        last = min(first + length, route.count)
        end = last if last == route.count else first + max(length // 2, 1)
        try:
            found, new = best_motion(planned.window(end, last))
        except RouteError:
            if not planned.can_go_on:
                raise
            planned.go_on()
        else:
            planned.keep(found, end)
            solutions += new
        shares.append((process_time() - began) / planned.duration(first))
    return InWindows(planned.whole_motion(), solutions, shares)


@dataclass
class _Planned:
    """The walk as far as it is planned.

    Attributes:
        route: the walk.
        knots: of the whole walk.
        problem: of the whole walk, with the limits in rows that windows have found.
        length: steps of a window.
        steps: steps that are planned.
        poses, spans: control points ``(K, 9)``, and spans ``(K,)`` [s], as far as they are known.
        used: the motion of each window by its first step, in their order.
    """

    route: Route
    knots: RouteKnots
    problem: DynamicRouteProblem
    length: int
    steps: int = 0
    poses: FloatArray = field(init=False)
    spans: FloatArray = field(init=False)
    used: dict[int, FoundMotion] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.poses, self.spans = np.zeros((self.problem.knots, POSE)), np.zeros(self.problem.knots)

    @property
    def last_window(self) -> int:
        """First step of the last window that was found; 0 before the first."""
        return next(reversed(self.used), 0)

    @property
    def can_go_on(self) -> bool:
        """Whether the last window leads on from where the plan is."""
        return bool(self.used) and self.steps + 1 <= self.last_window + self.length

    def duration(self, first: int) -> float:
        """Time from a step to the end of what is planned [s]."""
        each = self.route.intervals
        return float(self.spans[first * each : self.steps * each].sum())

    def window(self, end: int, last: int) -> SmoothWindow:
        """The window from where the plan is.

        Args:
            end: the step before which its kept part ends.
            last: the step before which it ends.
        """
        each = self.route.intervals
        first, final = self.steps * each, last * each
        route, start = self.route.window(self.steps, last), self.poses[first].copy()
        guess, spans = rough_guess(route, self.problem.time_unit, start if first else None)
        before = slice(first - KNOTS_BEFORE if first else 0, first)
        return SmoothWindow(
            route, self.problem.window(first, final, guess, self._entry(first) if first else None),
            self.knots.between(before.start, final), self.poses[before].copy(),
            self.spans[before].copy(), spans, (end - self.steps) * each if end < last else None,
        )  # fmt: skip

    def _entry(self, knot: int) -> Entry:
        """Velocities of joints and body with which the motion comes to a knot, and its span."""
        p, near = self.problem, slice(knot - 1, knot + 1)
        joints = p.legs.joints(self.poses[near], p.feet[near], p.swing[near]).reshape(-1, JOINTS)
        places = np.concatenate([joints, self.poses[near, BODY]], axis=1)
        velocity = np.diff(places, axis=0)[0] / self.spans[near].mean()
        return Entry(velocity, float(self.spans[knot]))

    def keep(self, found: FoundMotion, end: int) -> None:
        """Take the motion of a window up to step ``end``."""
        self.used[self.steps] = found
        self._take(end)

    def go_on(self) -> None:
        """Follow the last window for another step."""
        self._take(self.steps + 1)

    def _take(self, end: int) -> None:
        """Take the motion of the last window up to step ``end``, and all limits that it found."""
        each, window = self.route.intervals, self.last_window
        first, last = window * each, end * each
        (solution,) = self.used[window].solutions
        poses, spans = solution.problem.unpack(solution.x)
        self.poses[first : last + 1] = poses[: last + 1 - first]
        self.spans[first : last + 1] = np.append(spans, spans[-1])[: last + 1 - first]
        final = min(window + self.length, self.route.count) * each
        self.problem = _with_limits_of(self.problem, solution.problem, first, final)
        self.steps = end

    def whole_motion(self) -> FoundMotion:
        """The motion of all windows together.

        Raises:
            RouteError: it does not keep its limits.
        """
        motion = SplineMotion(self.route.robot, self.route.settings.heading, self.problem.legs,
                              self.knots, self.poses, self.spans,
                              self.route.settings.true_com)  # fmt: skip
        whole = SmoothWindow.whole(self.route, self.problem, self.knots, self.spans[:-1])
        kept = judge(whole, motion).kept
        solutions = tuple(found.solutions[0] for found in self.used.values())
        if kept is None:
            window = self.route.window(self.last_window, self.route.count)
            raise route_error(window, solutions[-1], Reason.LIMITS_BETWEEN_WINDOWS)
        return FoundMotion(*kept, solutions)


def _with_limits_of(
    whole: DynamicRouteProblem, window: DynamicRouteProblem, first: int, last: int
) -> DynamicRouteProblem:
    """The problem of a whole walk with the limits that a window found between two knots.

    These are the limits in the rows of joint velocities and accelerations, and the offsets of the
    rows of the ZMP and of the height of flying feet.
    """
    accelerations = whole.acceleration_limits.copy()
    accelerations[:, first : last + 1] = window.acceleration_limits
    velocities = whole.interval_velocity_limits.copy()
    velocities[:, first:last] = window.interval_velocity_limits
    zmp, rows = whole.zmp.offset.copy(), whole.rows.offset.copy()
    zmp[(whole.zmp.knot >= first) & (whole.zmp.knot <= last)] = window.zmp.offset
    heights = height_rows(whole.rows)
    knot = whole.rows.knot[heights]
    rows[heights[(knot > first) & (knot <= last)]] = window.rows.offset[height_rows(window.rows)]
    return replace(
        whole, acceleration_limits=accelerations, interval_velocity_limits=velocities,
        zmp=whole.zmp._replace(offset=zmp), rows=whole.rows._replace(offset=rows),
    )  # fmt: skip
