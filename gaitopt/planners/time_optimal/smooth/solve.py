"""Plans with bounded joint accelerations: all steps at once, or in windows that move along."""

from __future__ import annotations

from dataclasses import dataclass, replace
from time import process_time

import numpy as np

from gaitopt.conventions import FloatArray, Progress
from gaitopt.errors import RouteError
from gaitopt.interior_point.solver import Solution, minimise
from gaitopt.optimize.route.dynamic_layout import Entry
from gaitopt.optimize.route.dynamic_problem import DynamicRouteProblem
from gaitopt.optimize.route.legs import JOINTS
from gaitopt.plan.plan import Plan
from gaitopt.plan.record import RouteRecord
from gaitopt.planners.time_optimal.build import build_route, problem_of
from gaitopt.planners.time_optimal.failure import Reason, failed
from gaitopt.planners.time_optimal.flights import height_rows
from gaitopt.planners.time_optimal.knots import RouteKnots, part_of
from gaitopt.planners.time_optimal.smooth import clearance as clearance
from gaitopt.planners.time_optimal.smooth.build import build_dynamic, dynamic_phases
from gaitopt.planners.time_optimal.smooth.motion import RouteMotion
from gaitopt.planners.time_optimal.smooth.rounds import (
    Found,
    Part,
    asked_margins,
    best_motion,
    kept_motion,
)
from gaitopt.planners.time_optimal.walk import Route

ROUGH = 0.1
"""Tolerance of the walk without acceleration limits that is the first guess."""
WINDOW = 16
"""Steps of the windows in which a route is planned that was not solved as a whole."""
BEFORE = 2
"""Knots before a window that its motion depends on."""


def smooth_plan(route: Route, progress: Progress | None = None) -> Plan:
    """A plan with bounded joint accelerations.

    Args:
        route: what is walked.
        progress: called with (steps done, steps in all) before every window but the first.

    Raises:
        RouteError: no convergence, or no motion through a solution keeps its margin.
    """
    began = process_time()
    settings = route.settings
    horizon, iterations = settings.horizon, settings.iterations
    knots, base = build_route(
        route.robot, route.steps, settings, route.cogs, route.footholds.landing_radius
    )
    problem = build_dynamic(base, knots, settings, base.poses, route.robot.foot_radius)
    shares: list[float] = []
    if horizon is None:
        try:
            found, solutions = _whole(route, knots, problem, iterations)
        except RouteError:
            if len(route.steps.legs) <= WINDOW:
                raise
            horizon = WINDOW
    if horizon is not None:
        found, solutions, shares = _in_windows(route, knots, problem, horizon, iterations, progress)
    phases = dynamic_phases(settings, route.steps, found.motion)
    record = replace(
        _record(route, found, solutions),
        solver_seconds=process_time() - began,
        windows=len(shares) or None,
        window_share=max(shares, default=None),
    )
    return Plan(route.robot, route.footholds, settings, phases, found.path, record)


def _record(
    route: Route, found: Found, solutions: list[Solution[DynamicRouteProblem]]
) -> RouteRecord:
    """What the plan tells of itself; residuals are the worst of the solutions it is made of."""
    unit = found.solutions[-1].problem.time_unit
    static, motion = route.settings.static, found.motion
    return RouteRecord(
        stability="static margin of the body centre, on the horizontal projection"
        if static
        else "ZMP of a point mass at the body centre",
        # Less than was asked for where the robot stands with less at first.
        zmp_margin=None if static else float(asked_margins(route, motion, 0).min()),
        knot_time=float(motion.times[-1]),
        solver_iterations=sum(a.iterations for a in solutions),
        stationarity=max(s.stationarity() for s in found.solutions),
        violation=max(s.violation() for s in found.solutions),
        complementarity=sum(s.complementarity() for s in found.solutions) * unit,
        clearance=float(clearance.heights(motion, 0, route.footholds.landing_radius).min()),
    )


def _whole(
    route: Route, knots: RouteKnots, problem: DynamicRouteProblem, iterations: int
) -> tuple[Found, list[Solution[DynamicRouteProblem]]]:
    """All steps at once."""
    poses, guess = _guess(route, 0, len(route.steps.legs), None, problem.time_unit)
    part = Part(replace(problem, poses=poses), knots, np.zeros((0, 9)), np.zeros(0), guess)
    return best_motion(route, part, 0, iterations)


def _guess(
    route: Route, first: int, last: int, here: FloatArray | None, unit: float
) -> tuple[FloatArray, FloatArray]:
    """Poses ``(K, 9)`` and spans ``(K - 1,)``: the walk without acceleration limits, roughly."""
    free = replace(route.settings.free, dynamic=False)
    calm = replace(route, settings=replace(route.settings, free=free, acceleration_limit=None))
    problem = problem_of(calm, first, last)
    if here is not None:
        problem = problem.with_start(here)
    solution = minimise(problem, problem.first_guess(), tolerance=ROUGH,
                        barrier=problem.first_barrier)  # fmt: skip
    poses = problem.unpack(solution.x)[0] if solution.solved else problem.poses
    return poses, 2.0 * problem.least_times(poses) + 0.1 * unit


@dataclass
class _Planned:
    """What windows have planned so far: it grows.

    Attributes:
        knots, problem: of the whole route.
        poses, spans: control points ``(K, 9)``, and spans ``(K,)`` [s].
    """

    knots: RouteKnots
    problem: DynamicRouteProblem
    poses: FloatArray
    spans: FloatArray

    def entry(self, at: int) -> Entry:
        """How the motion comes in at a knot."""
        p, near = self.problem, slice(at - 1, at + 1)
        joints = p.legs.joints(self.poses[near], p.feet[near], p.swing[near]).reshape(-1, JOINTS)
        moves = np.concatenate([joints, self.poses[near, :3]], axis=1)
        return Entry(np.diff(moves, axis=0)[0] / self.spans[near].mean(), float(self.spans[at]))

    def window(self, route: Route, first: int, end: int, last: int) -> Part:
        """The window from the first step to, not including, the last; it goes on from the motion.

        Up to step ``end`` it will be kept.
        """
        each = _each(route)
        a, b = first * each, last * each
        guess, times = _guess(
            route, first, last, self.poses[a] if a else None, self.problem.time_unit
        )
        before = slice(a - BEFORE if a else 0, a)
        return Part(
            self.problem.window(a, b, guess, self.entry(a) if a else None),
            part_of(self.knots, before.start, b), self.poses[before], self.spans[before], times,
            (end - first) * each if end < last else None,
        )  # fmt: skip

    def keep(self, found: Found, first: int, last: int, window: int) -> None:
        """Takes a found motion between two knots, and what was learned of limits to the third."""
        part = found.solutions[0]
        new, times = part.problem.unpack(part.x)
        self.poses[first : last + 1] = new[: last + 1 - first]
        self.spans[first : last + 1] = np.append(times, times[-1])[: last + 1 - first]
        self.problem = _with_limits_of(self.problem, part.problem, first, window)


def _with_limits_of(
    whole: DynamicRouteProblem, part: DynamicRouteProblem, first: int, last: int
) -> DynamicRouteProblem:
    """The whole route's problem with the limits of a window's between two knots.

    Those are the limits of joint velocities and accelerations, and the offsets of rows of the ZMP
    and of flying feet's heights.
    """
    accelerations = whole.acceleration_limits.copy()
    accelerations[:, first : last + 1] = part.acceleration_limits
    velocities = whole.interval_velocity_limits.copy()
    velocities[:, first:last] = part.interval_velocity_limits
    zmp, rows = whole.zmp.offset.copy(), whole.rows.offset.copy()
    zmp[(whole.zmp.knot >= first) & (whole.zmp.knot <= last)] = part.zmp.offset
    heights = height_rows(whole.rows)
    at = whole.rows.knot[heights]
    rows[heights[(at > first) & (at <= last)]] = part.rows.offset[height_rows(part.rows)]
    return replace(
        whole, acceleration_limits=accelerations, interval_velocity_limits=velocities,
        zmp=whole.zmp._replace(offset=zmp), rows=whole.rows._replace(offset=rows),
    )  # fmt: skip


def _each(route: Route) -> int:
    """Knots of a step."""
    return route.settings.stance_knots + route.settings.swing_knots


def _in_windows(
    route: Route,
    knots: RouteKnots,
    full: DynamicRouteProblem,
    length: int,
    iterations: int,
    progress: Progress | None,
) -> tuple[Found, list[Solution[DynamicRouteProblem]], list[float]]:
    """Windows of ``length`` steps, the first half of each of which is kept.

    Every window ends at rest, so there is a way on from whatever is kept.

    Returns:
        The motion, all solutions, and the processor time of each window as a share of the time
        that the robot walks on what is kept of it.
    """
    count, each = len(route.steps.legs), _each(route)
    done = _Planned(knots, full, np.zeros((full.knots, 9)), np.zeros(full.knots))
    solutions: list[Solution[DynamicRouteProblem]] = []
    used: dict[int, Found] = {}
    shares: list[float] = []
    first = before = 0
    while first < count:
        if first and progress is not None:
            progress(first, count)
        began = process_time()
        last = min(first + length, count)
        end = last if last == count else first + max(length // 2, 1)
        try:
            part = done.window(route, first, end, last)
            found, some = best_motion(route, part, first, iterations)
        except RouteError:
            if first == 0 or first + 1 > before + length:
                raise
            # The window before it knows a way on: go along it by another step.
            end, some = first + 1, []
            done.keep(used[before], before * each, end * each, min(before + length, count) * each)
        else:
            done.keep(found, first * each, end * each, last * each)
            used[first], before = found, first
        solutions += some
        walked = done.spans[first * each : end * each].sum()
        shares.append((process_time() - began) / float(walked))
        first = end
    motion = RouteMotion(route.robot, route.settings.heading, full.legs, knots, done.poses,
                         done.spans)  # fmt: skip
    part = Part(done.problem, knots, done.poses[:0], done.spans[:0], done.spans[:-1])
    kept, _ = kept_motion(route, part, motion)
    if kept is None:
        raise failed(route, used[before].solutions[0], before, Reason.LIMITS_BETWEEN_WINDOWS)
    used_solutions = tuple(f.solutions[0] for f in used.values())
    return Found(*kept, used_solutions), solutions, shares
