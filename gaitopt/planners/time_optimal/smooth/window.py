"""A stretch of a smooth walk that is planned as one problem: a window, or the whole walk."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.optimize.route.dynamic_problem import DynamicRouteProblem
from gaitopt.optimize.route.legs import POSE
from gaitopt.planners.time_optimal.knots import RouteKnots
from gaitopt.planners.time_optimal.smooth.build import start_margin, turn_limits
from gaitopt.planners.time_optimal.smooth.motion import SplineMotion
from gaitopt.planners.time_optimal.walk import Route
from gaitopt.stability.margins import static_stability_margin

RESERVES_AT_NEXT = 8.0
"""How many reserves of the limits are kept about the knot at which the next window begins, so that
its first spans, which depend on this window, leave it a choice."""


@dataclass(frozen=True, eq=False)
class SmoothWindow:
    """What is planned as one problem.

    Attributes:
        route: the window's steps.
        problem: their problem.
        knots: those of the problem, after those before it on which its motion depends.
        poses_before, spans_before: control points ``(n, 9)`` and spans ``(n,)`` [s] of the latter;
            none at the beginning of a walk.
        guessed_spans: spans of the first guess ``(K - 1,)`` [s]; its poses are the problem's.
        next_begins: the problem's knot at which the next window will begin; ``None`` for the last
            window.
    """

    route: Route
    problem: DynamicRouteProblem
    knots: RouteKnots
    poses_before: FloatArray
    spans_before: FloatArray
    guessed_spans: FloatArray
    next_begins: int | None = None

    @classmethod
    def whole(
        cls, route: Route, problem: DynamicRouteProblem, knots: RouteKnots, spans: FloatArray
    ) -> SmoothWindow:
        """All steps of a walk, with spans ``(K - 1,)`` [s] as first guess."""
        return cls(route, problem, knots, np.zeros((0, POSE)), np.zeros(0), spans)

    @property
    def first_knot(self) -> int:
        """Number of the problem's first knot among the window's."""
        return len(self.spans_before)

    @property
    def is_whole(self) -> bool:
        """Whether it begins at rest, and no other window goes on from it."""
        return self.first_knot == 0 and self.next_begins is None

    @property
    def acceleration_limit(self) -> float:
        """Limit of all joint accelerations [rad/s^2]."""
        return self.route.acceleration_limit

    @cached_property
    def turn_limits(self) -> FloatArray:
        """Limit of joint accelerations on the span of each knot of the problem ``(K,)`` [rad/s^2].

        Without forces it is :attr:`acceleration_limit` everywhere.
        """
        return turn_limits(self.route, self.knots)[self.first_knot :]

    @cached_property
    def reserves(self) -> FloatArray:
        """How many reserves of the limits to keep at each knot of the problem ``(K,)``."""
        out = np.ones(self.problem.knots)
        if self.next_begins is not None:
            out[self.next_begins - 1 : self.next_begins + 2] = RESERVES_AT_NEXT
        return out

    def motion(self, x: FloatArray) -> SplineMotion:
        """The motion of a solution ``x`` of the problem, from the knots before it on."""
        poses, spans = self.problem.unpack(x)
        return SplineMotion(
            self.route.robot, self.route.settings.heading, self.problem.legs, self.knots,
            np.concatenate([self.poses_before, poses]),
            np.concatenate([self.spans_before, spans, spans[-1:]]),
            self.route.settings.true_com,
        )  # fmt: skip

    def wanted_margins(self, motion: SplineMotion) -> FloatArray:
        """The stability margin that is asked for on each span of the problem ``(K,)`` [m].

        Args:
            motion: one of the window's motions; all begin where the robot stands.
        """
        margin = self.route.settings.stability_margin
        out = np.full(len(motion.spans) - self.first_knot, margin)
        if self.first_knot == 0:
            standing = static_stability_margin(motion.knots.feet[:1], motion.centres_of_mass[0, :1])
            out[: motion.knots.phase_ends[1]] = start_margin(standing, margin)
        return out
