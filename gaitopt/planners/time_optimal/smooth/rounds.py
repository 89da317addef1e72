"""Rounds of a smooth motion: solve, look between the knots, correct, and solve again."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.interior_point.solver import VIOLATION, Solution, minimise
from gaitopt.motion.path import MotionPath
from gaitopt.motion.retiming import legs_needed_stretch
from gaitopt.optimize.route.dynamic_problem import DynamicRouteProblem
from gaitopt.planners.time_optimal.collision import kept_apart, touching
from gaitopt.planners.time_optimal.failure import Reason, failed
from gaitopt.planners.time_optimal.knots import RouteKnots
from gaitopt.planners.time_optimal.smooth import clearance as clearance
from gaitopt.planners.time_optimal.smooth.between import (
    HASTE,
    MOST_STRETCH,
    corrected,
    stretch_needed,
    tightened,
)
from gaitopt.planners.time_optimal.smooth.build import first_margin
from gaitopt.planners.time_optimal.smooth.motion import RouteMotion
from gaitopt.planners.time_optimal.walk import Route
from gaitopt.stability.margins import static_stability_margin

ROUNDS = 12
"""Most rounds of correcting what a smooth motion asks for between knots."""
TOLERANCES = (3e-2, 1e-2, 2e-3)
"""Of the solver in the first rounds; the last of them in all others, and for what is kept."""
CORRECTIONS = 3
"""Rounds that correct all rows; those after them only tighten."""
ENOUGH = 1.001
"""Stretch of time below which no further round is worth its time."""
AT_NEXT = 8.0
"""Spares of the limits that are kept where the next window begins, so that it has a choice."""
COLD, WARM = 0.1, 0.01
"""First barrier parameters, as shares of that from a poor guess."""
LAST_STRETCH = 1.5
"""Most that time is stretched where no round gives a motion that needs hardly any."""
NEARLY = 1e-3
"""Gradient with which a solution is good enough where there is no better one."""
_HAIR = 1e-4


@dataclass(frozen=True, eq=False)
class Part:
    """A stretch of the route that is planned in one go.

    Attributes:
        problem: its problem.
        knots: its knots, and those before it that its motion depends on.
        poses, spans: of the latter ``(n, 9)`` and ``(n,)`` [s]; none at the route's beginning.
        guess: spans of the first guess ``(K - 1,)`` [s].
        next: the problem's knot at which another part will begin, if any.
    """

    problem: DynamicRouteProblem
    knots: RouteKnots
    poses: FloatArray
    spans: FloatArray
    guess: FloatArray
    next: int | None = None

    @property
    def reserve(self) -> FloatArray:
        """How many spares of the limits to keep at each of the problem's knots ``(K,)``.

        What comes in from here has no choice but to keep the limits.
        """
        out = np.ones(self.problem.knots)
        if self.next is not None:
            out[self.next - 1 : self.next + 2] = AT_NEXT
        return out

    @property
    def whole(self) -> bool:
        """Whether it is all of the route: nothing comes in, and nothing goes on."""
        return self.skip == 0 and self.next is None

    @property
    def skip(self) -> int:
        """Knots before the problem's first."""
        return len(self.spans)

    def motion(self, route: Route, x: FloatArray) -> RouteMotion:
        """The motion of a solution."""
        poses, times = self.problem.unpack(x)
        return RouteMotion(
            route.robot, route.settings.heading, self.problem.legs, self.knots,
            np.concatenate([self.poses, poses]),
            np.concatenate([self.spans, times, times[-1:]]),
        )  # fmt: skip


@dataclass(frozen=True, eq=False)
class Found:
    """A motion that keeps all limits, with the solutions that it came from, part by part."""

    motion: RouteMotion
    path: MotionPath
    solutions: tuple[Solution[DynamicRouteProblem], ...]


class _Tried(NamedTuple):
    """A motion that needs more time to keep all limits."""

    motion: RouteMotion
    solution: Solution[DynamicRouteProblem]


def best_motion(
    route: Route, part: Part, first: int, iterations: int
) -> tuple[Found, list[Solution[DynamicRouteProblem]]]:
    """The fastest motion that keeps all limits, and all solutions on the way there.

    Raises:
        RouteError: there is none.
    """
    problem = part.problem
    cold = problem.pack(problem.poses, part.guess)
    start, multipliers = cold, None
    best: Found | None = None
    spare: tuple[float, _Tried] | None = None
    solutions: list[Solution[DynamicRouteProblem]] = []
    for n in range(ROUNDS):
        tolerance = TOLERANCES[min(n, len(TOLERANCES) - 1)]
        barrier = (COLD if multipliers is None else WARM) * problem.first_barrier
        solution = minimise(problem, start, tolerance=tolerance, barrier=barrier,
                            iteration_limit=iterations, multipliers=multipliers,
                            reduce_curvature=True)  # fmt: skip
        solutions.append(solution)
        if not solution.solved and not (best is None and multipliers is None and _nearly(solution)):
            if start is cold:
                break
            start, multipliers = cold, None
            continue
        motion = part.motion(route, solution.x)
        apart = _moved_apart(route, solution)
        if tolerance == TOLERANCES[-1] and apart is None:
            kept, stretch = kept_motion(route, part, motion)
            usable = part.whole and clearance.kept(
                motion, part.skip, route.settings, route.footholds.landing_radius
            )
            if usable and (spare is None or stretch * motion.times[-1] < spare[0]):
                spare = stretch * float(motion.times[-1]), _Tried(motion, solution)
            if kept is not None and (best is None or kept[0].times[-1] < best.motion.times[-1]):
                best = Found(*kept, (solution,))
            if kept is not None and stretch <= ENOUGH:
                break
        improved = corrected if n < CORRECTIONS else tightened
        problem = improved(apart or problem, motion, part.skip, _limit(route), part.reserve)
        problem = clearance.raised(
            problem, motion, part.skip, route.settings, route.footholds.landing_radius,
            HASTE if improved is tightened else None,
        )  # fmt: skip
        start, multipliers = solution.x, solution.multipliers if apart is None else None
    if best is None and spare is not None:
        kept, _ = kept_motion(route, part, spare[1].motion, LAST_STRETCH)
        best = None if kept is None else Found(*kept, (spare[1].solution,))
    if best is None:
        reason = Reason.LIMITS_BETWEEN_KNOTS if solution.solved else None
        raise failed(route, solution, first, reason)
    return best, solutions


def _nearly(solution: Solution[DynamicRouteProblem]) -> bool:
    """Whether a solution keeps its limits and is the best to within a little, if not enough."""
    return solution.violation() <= VIOLATION and solution.stationarity() <= NEARLY


def _limit(route: Route) -> float:
    """Limit of joint accelerations [rad/s^2]."""
    return float(route.settings.acceleration_limit or np.inf)


def _moved_apart(
    route: Route, solution: Solution[DynamicRouteProblem]
) -> DynamicRouteProblem | None:
    """The problem with rows that keep legs apart where a solution lets them touch; else none."""
    if route.shapes is None:
        return None
    problem = solution.problem
    poses = problem.unpack(solution.x)[0]
    found = touching(route.shapes, problem, poses)
    return None if found is None else kept_apart(route.shapes, problem, poses, *found)


def asked_margins(route: Route, motion: RouteMotion, skip: int) -> FloatArray:
    """The margin that every span of the motion after the first ``skip`` is to keep [m]."""
    out = np.full(len(motion.spans) - skip, route.settings.stability_margin)
    if skip == 0 and len(out):
        room = static_stability_margin(motion.knots.feet[:1], motion.poses[:1, :2])
        out[: motion.knots.ends[1]] = first_margin(room, route.settings.stability_margin)
    return out


def kept_motion(
    route: Route, part: Part, motion: RouteMotion, most: float = MOST_STRETCH
) -> tuple[tuple[RouteMotion, MotionPath] | None, float]:
    """A motion whose path keeps the joints' limits, when it keeps margin and clearance, too.

    Also how much it had to be stretched for the former, ``most`` at the most; it keeps the latter
    even then.
    """
    dynamic, skip = not route.settings.static, part.skip
    asked = asked_margins(route, motion, skip)
    rates, limit = part.problem.velocity_limits, _limit(route)
    stretch = stretch_needed(motion, skip, rates, limit)
    radius = route.footholds.landing_radius
    if stretch > most or not clearance.kept(motion, skip, route.settings, radius):
        return None, stretch
    # Stretching moves the ZMP along a line, and margins are concave: both ends are enough.
    for one in (motion, motion.slower(most)):
        if (one.margins(dynamic)[skip:] < asked).any():
            return None, stretch
    path = motion.path()
    stretch = legs_needed_stretch(route.robot, path, float(motion.times[skip]), rates, limit)
    if stretch > most:
        return None, stretch
    if stretch > 1.0:
        motion = motion.slower(stretch * (1.0 + _HAIR))
        path = motion.path()
    return (motion, path), stretch
