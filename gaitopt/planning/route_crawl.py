"""The time-optimal crawl: all steps of a walk in one optimisation.

Footholds, leg order, stability margin and joint limits are those of the walk that is planned phase
by phase (000_6dacb41600db6a3c.txt); what is free beyond the body's targets is chosen by name.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from time import process_time
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from gaitopt.conventions import FloatArray
from gaitopt.errors import GaitoptError, InputError, SolverError
from gaitopt.gait.crawl import WANG_SEQUENCE, check_sequence
from gaitopt.optimize.route_solver import Answer, solve_route
from gaitopt.planning import crawl, diagnosis
from gaitopt.planning.plan import Plan
from gaitopt.planning.route_assembly import densify, motion_path, route_phases
from gaitopt.planning.route_collision import Shapes, kept_apart, touching
from gaitopt.planning.route_dynamic import (
    MOST_STRETCH,
    build_dynamic,
    dynamic_phases,
    exact_path,
    new_motion,
    stretch_needed,
    tightened,
)
from gaitopt.planning.route_knots import build_route, feet_clearance
from gaitopt.planning.route_settings import RouteSettings, check_free
from gaitopt.planning.settings import CrawlSettings
from gaitopt.robots.quadruped import Quadruped
from gaitopt.terrain.footholds import Footholds

if TYPE_CHECKING:
    from gaitopt.optimize.route_problem import RouteProblem
    from gaitopt.planning.crawl import CrawlSteps

DIRECT_STEPS = 96
"""Longer routes are first planned in overlapping windows, and then as a whole."""
WINDOW = 16
"""Steps of such a window."""
NEAR = 1e-4
"""First barrier parameter from a good guess."""
ROUNDS = 4
"""Most rounds of moving legs apart."""
DYNAMIC_ROUNDS = 10
"""Most rounds of tightening what a smooth motion asks for between knots."""
RAMP = 0.05
"""Time in which the slowest joint reaches its velocity limit, by default [s]."""


class RouteError(SolverError):
    """The time-optimal route did not converge.

    Attributes:
        steps: the steps at which the residuals are largest.
        plan: the walk planned phase by phase, which is feasible.
        report: the solver's iterations, a line each.
    """

    def __init__(self, message: str, steps: tuple[int, ...], plan: Plan | None, report: str):
        super().__init__(message)
        self.steps, self.plan, self.report = steps, plan, report

    def __reduce__(self) -> tuple[object, ...]:
        return (RouteError, (str(self), self.steps, self.plan, self.report))


def plan_route(
    robot: Quadruped,
    footholds: Footholds,
    free: str | Iterable[str] = "swing",
    stability_margin: float = 0.02,
    body_height: float = 0.40,
    swing_height: float = 0.07,
    sequence: Iterable[str] = WANG_SEQUENCE,
    *,
    clearance: float = 0.02,
    reach_fraction: float = 1.0,
    heading: float = 0.0,
    follow_terrain: bool = False,
    cog_start: ArrayLike | None = None,
    acceleration_limit: float | None = None,
    horizon: int | None = None,
    stance_knots: int | None = None,
    swing_knots: int | None = None,
    iterations: int = 300,
) -> Plan:
    """Plan the fastest statically stable walk over given footholds, all steps at once.

    Args:
        robot, footholds, stability_margin, body_height, swing_height, sequence, reach_fraction,
            heading, follow_terrain, cog_start: as for :func:`gaitopt.plan_crawl`. A body height
            that is free begins at ``body_height``.
        free: what is free beyond the body's targets: the name of a row (``"route"``: nothing;
            ``"overlap"``: the body moves during swings; ``"swing"``: the swing curve, too;
            ``"height"``: the body's height, too; ``"posture"``: its roll, pitch and yaw, too;
            ``"dynamic"``: the ZMP of a point mass at the body centre keeps the stability margin
            at every instant, in place of the body centre itself, and joint accelerations are
            bounded), or any of these things by name.
        clearance: a foot that flies on a free curve is this much higher than the higher of its
            two footholds wherever it is not within the columns' radius of one of their axes [m].
        acceleration_limit: of every joint [rad/s^2]; for a dynamic walk by default what takes
            the slowest joint to its velocity limit in :data:`RAMP`. Needs ``"overlap"`` and
            ``"swing"`` to be free.
        horizon: plan in windows of this many steps, as a robot would that knows no more of its
            way, and keep the first half of each; ``None`` for all steps at once.
        stance_knots, swing_knots: intervals of the problem in each phase.
        iterations: most Newton steps of a solution.

    Returns:
        The plan. ``plan.info`` holds the solver's residuals, worked out anew at the end.

    Raises:
        InputError: a setting is out of range, or the robot's legs cannot move sideways.
        InfeasibleStepError: a step is impossible even for the walk that is planned phase by phase.
        RouteError: no convergence; holds the per-phase plan and the solver's report.
    """
    if not isinstance(robot, Quadruped) or not isinstance(footholds, Footholds):
        raise InputError(
            f"plan_route takes a Quadruped (from load_robot) and Footholds, got "
            f"{type(robot).__name__} and {type(footholds).__name__}"
        )
    named = check_free(free)
    smooth = acceleration_limit is not None or "dynamic" in named
    settings = RouteSettings(
        free=named, stability_margin=stability_margin, body_height=body_height,
        swing_height=swing_height, sequence=check_sequence(sequence), clearance=clearance,
        reach_fraction=reach_fraction, heading=heading, follow_terrain=follow_terrain,
        acceleration_limit=_acceleration(robot, named, acceleration_limit),
        stance_knots=stance_knots or (3 if smooth else 4 if "posture" in named else 2),
        swing_knots=swing_knots or (8 if "swing" in named else 12),
    )  # fmt: skip
    if horizon is not None and (isinstance(horizon, bool) or not 2 <= horizon <= 10_000):
        raise InputError(f"horizon must be a whole number of steps from 2, got {horizon!r}")
    route = _prepared(robot, footholds, settings, cog_start)
    if not route.steps.legs:
        return Plan(robot, footholds, settings, (), _standing(route), {})
    began = process_time()
    if settings.acceleration_limit is not None:
        if horizon is not None:
            raise InputError(
                "horizon plans without acceleration limits only; leave one of them out"
            )
        return _with_accelerations(route, iterations)
    if horizon is not None:
        poses, answers = _in_windows(route, int(horizon), max(int(horizon) // 2, 1), iterations)
    else:
        poses, answers = _whole(route, iterations)
    return _assembled(route, poses, answers, process_time() - began)


def _acceleration(robot: Quadruped, free: tuple[str, ...], asked: float | None) -> float | None:
    """The acceleration limit of every joint [rad/s^2], where there is one."""
    if asked is not None and not {"overlap", "swing"} <= set(free):
        raise InputError(
            "acceleration_limit needs 'overlap' and 'swing' to be free: a body that stands still "
            "and the corners of a box ask for more than any limit"
        )
    if asked is None and "dynamic" in free:
        return round(float(min(leg.velocity_limits.min() for leg in robot.legs.values())) / RAMP, 6)
    return asked


@dataclass(frozen=True, eq=False)
class Route:
    """What is to be walked, and the per-phase walk that shows the way.

    Attributes:
        robot, footholds, settings: of the walk.
        steps: its steps, in the heading frame.
        cogs: body centre before and after each stance phase of the per-phase walk ``(S + 1, 3)``.
        cog_start: what was asked for.
        shapes: of the legs, to be kept apart; ``None`` where they are meshes.
    """

    robot: Quadruped
    footholds: Footholds
    settings: RouteSettings
    steps: CrawlSteps
    cogs: FloatArray
    cog_start: ArrayLike | None
    shapes: Shapes | None

    def part(self, first: int, last: int) -> CrawlSteps:
        """The steps from ``first`` up to, not including, ``last``."""
        s = self.steps
        return crawl.CrawlSteps(
            s.legs[first:last], s.feet[first:last], s.targets[first:last], s.heights[first:last],
            s.start_height,
        )  # fmt: skip

    def phase_by_phase(self) -> Plan | None:
        """The paper's plan over the same footholds; ``None`` where there is none."""
        s = self.settings
        try:
            return crawl.plan_crawl(
                self.robot, self.footholds, stability_margin=s.stability_margin,
                body_height=s.body_height, swing_height=s.swing_height, sequence=s.sequence,
                reach_fraction=s.reach_fraction, heading=s.heading,
                follow_terrain=s.follow_terrain, cog_start=self.cog_start,
            )  # fmt: skip
        except GaitoptError:
            return None


def _prepared(
    robot: Quadruped, footholds: Footholds, settings: RouteSettings, cog_start: ArrayLike | None
) -> Route:
    """Steps and COG targets of the per-phase walk.

    Raises:
        InfeasibleStepError: a step is impossible.
    """
    paper = CrawlSettings(
        stability_margin=settings.stability_margin, body_height=settings.body_height,
        swing_height=settings.swing_height, sequence=settings.sequence,
        reach_fraction=settings.reach_fraction, heading=settings.heading,
        follow_terrain=settings.follow_terrain,
    )  # fmt: skip
    crawl.check_robot(robot)
    steps = crawl.crawl_steps(footholds, paper)
    crawl.check_stance(steps)
    diagnosis.check_heights(robot, steps, paper)
    start = crawl.start_place(robot, steps, paper, cog_start, footholds)
    solutions = crawl.optimise_cogs(robot, steps, paper, start)
    ends = [np.append(s.position, z) for s, z in zip(solutions, steps.heights, strict=True)]
    return Route(robot, footholds, settings, steps, np.vstack([start, *ends]), cog_start,
                 Shapes.of(robot))  # fmt: skip


def _problem(route: Route, first: int, last: int, all_limits: bool = False) -> RouteProblem:
    return build_route(
        route.robot, route.part(first, last), route.settings, route.cogs[first : last + 1],
        route.footholds.radius, all_limits=all_limits,
    )[1]  # fmt: skip


def _whole(route: Route, iterations: int) -> tuple[FloatArray, list[Answer]]:
    """Poses at all knots, all steps at once."""
    count = len(route.steps.legs)
    problem = _problem(route, 0, count)
    answers: list[Answer] = []
    if count <= DIRECT_STEPS:
        answers += _solved(route, problem, None, iterations)
    if not answers or answers[-1].status != "solved":
        poses, windows = _in_windows(route, WINDOW, WINDOW // 2, iterations, partial=True)
        answers += [*windows, *_solved(route, problem, poses, iterations)]
    if answers[-1].status != "solved":
        raise _failed(route, problem, answers[-1], 0)
    return problem.unpack(answers[-1].x)[0], answers


def _solved(
    route: Route, problem: RouteProblem, guess: FloatArray | None, iterations: int
) -> list[Answer]:
    """Answers to the problem, the last of them with legs that keep apart.

    Args:
        guess: poses from which to begin, near the optimum; the problem's own by default.
    """

    def near(poses: FloatArray) -> FloatArray:
        return problem.pack(poses, 1.1 * problem.needed(poses) + 1e-3)

    if guess is None:
        answers = [solve_route(problem, problem.start(), iterations=iterations)]
    else:
        answers = [solve_route(problem, near(guess), barrier=NEAR, iterations=iterations)]
    for _ in range(ROUNDS if route.shapes else 0):
        assert route.shapes is not None
        poses = problem.unpack(answers[-1].x)[0]
        found = touching(route.shapes, problem, poses)
        if answers[-1].status != "solved" or found is None:
            break
        apart = kept_apart(route.shapes, problem, poses, *found)
        answers.append(solve_route(apart, near(poses), barrier=NEAR, iterations=iterations))
    return answers


def _in_windows(
    route: Route, length: int, kept: int, iterations: int, partial: bool = False
) -> tuple[FloatArray, list[Answer]]:
    """Poses at all knots, planned in windows of ``length`` steps of which ``kept`` are kept.

    Args:
        partial: take what was found even where a window did not converge, as a first guess.
    """
    count, each = len(route.steps.legs), route.settings.stance_knots + route.settings.swing_knots
    poses = np.zeros((count * each + 1, 9))
    answers: list[Answer] = []
    first, here = 0, None
    while first < count:
        last = min(first + length, count)
        problem = _problem(route, first, last)
        if here is not None:
            problem.poses[0] = here
        answers += _solved(route, problem, None, iterations)
        answer = answers[-1]
        if answer.status != "solved" and not partial:
            raise _failed(route, problem, answer, first)
        found = problem.unpack(answer.x)[0]
        step = last - first if last == count else kept
        poses[first * each : (first + step) * each + 1] = found[: step * each + 1]
        here, first = found[step * each], first + step
    return poses, answers


def _with_accelerations(route: Route, iterations: int) -> Plan:
    """A smooth plan with bounded joint accelerations.

    Raises:
        RouteError: no convergence, or the smooth motion does not come to keep its limits.
    """
    began = process_time()
    settings, count = route.settings, len(route.steps.legs)
    knots, base = build_route(
        route.robot, route.steps, settings, route.cogs, route.footholds.radius, all_limits=False
    )
    problem = build_dynamic(base, knots, settings, base.poses)
    start, barrier = problem.pack(base.poses, 2.0 * problem.needed(base.poses) + 0.1), 1e-2
    spent, best = 0, None
    for _ in range(DYNAMIC_ROUNDS):
        answer = solve_route(problem, start, barrier=barrier, iterations=2 * iterations)
        spent += answer.iterations
        if answer.status != "solved":
            break
        motion = new_motion(route.robot, settings, knots, problem, answer.x)
        stretch = stretch_needed(problem, motion, float(settings.acceleration_limit or np.inf))
        # A motion that takes a little longer keeps all limits of its joints.
        slower = motion.slower(stretch)
        if slower.margins("dynamic" in settings.free).min() >= settings.stability_margin and (
            best is None or slower.times[-1] < best[0].times[-1]
        ):
            best = slower, stretch, answer
            if stretch <= MOST_STRETCH:
                break
        problem = tightened(problem, motion, settings, stretch)
        poses, times = problem.unpack(answer.x)
        if route.shapes is not None:
            found = touching(route.shapes, problem, poses)
            if found is not None:
                problem = kept_apart(route.shapes, problem, poses, *found)
        start, barrier = problem.pack(poses, 1.05 * stretch * times), 1e-3
    if best is None:
        status = "limits between knots" if answer.status == "solved" else answer.status
        raise _failed(route, problem, replace(answer, status=status), 0)
    motion, stretch, answer = best
    motion, path = exact_path(motion, problem, float(settings.acceleration_limit or np.inf))
    info: dict[str, float | str] = {
        "stability": "ZMP of a point mass at the body centre"
        if "dynamic" in settings.free
        else "static margin of the body centre, on the horizontal projection",
        "row": settings.row,
        "solver_seconds": process_time() - began,
        "solver_iterations": float(spent),
        "stationarity": answer.stationarity,
        "violation": answer.primal,
        "complementarity": answer.complementarity,
        "stretch": stretch,
        "steps": float(count),
    }
    phases = dynamic_phases(settings, route.steps, motion)
    return Plan(route.robot, route.footholds, settings, phases, path, info)


def _failed(route: Route, problem: RouteProblem, answer: Answer, first: int) -> RouteError:
    """The error for an answer that is none."""
    each = route.settings.stance_knots + route.settings.swing_knots
    worst = problem.worst_knots(answer.x, answer.duals)
    steps = tuple(sorted({first + max(int(k) - 1, 0) // each for k in worst}))
    plan = route.phase_by_phase()
    offer = f" ({plan.duration:.1f} s) is in .plan" if plan else " failed, too"
    report = "\n".join(
        f"{i:4d} barrier {r[0]:.1e} time {r[1]:.4f} s gradient {r[2]:.1e} gap {r[3]:.1e} "
        f"shift {r[4]:.1e}"
        for i, r in enumerate(answer.history)
    )
    return RouteError(
        f"the time-optimal route over steps {first} to {first + (problem.knots - 1) // each - 1} "
        f"did not converge ({answer.status} after {answer.iterations} iterations), worst at "
        f"steps {', '.join(map(str, steps))}: gradient {answer.stationarity:.2g}, violation "
        f"{answer.primal:.2g}; free less, or take the walk planned phase by phase, which" + offer,
        steps, plan, report,
    )  # fmt: skip


def _assembled(route: Route, poses: FloatArray, answers: list[Answer], seconds: float) -> Plan:
    """The dense plan through the poses."""
    settings, steps = route.settings, route.steps
    knots, problem = build_route(route.robot, steps, settings, route.cogs, route.footholds.radius)
    dense = densify(route.robot, settings, knots, problem.legs, poses)
    info: dict[str, float | str] = {
        "stability": "static margin of the body centre, on the horizontal projection",
        "row": settings.row,
        "knot_time": float(problem.needed(poses).sum()),
        "solver_seconds": seconds,
        "solver_iterations": float(sum(a.iterations for a in answers)),
        "stationarity": answers[-1].stationarity,
        "violation": answers[-1].primal,
        "complementarity": answers[-1].complementarity,
    }
    if "swing" in settings.free:
        info["clearance"] = feet_clearance(route.robot, steps, settings, knots, dense,
                                           route.footholds.radius)  # fmt: skip
    phases = route_phases(route.robot, settings, steps, knots, dense)
    return Plan(route.robot, route.footholds, settings, phases, motion_path(dense), info)


def _standing(route: Route):  # type: ignore[no-untyped-def]
    return crawl.plan_crawl(route.robot, route.footholds, body_height=route.settings.body_height,
                            heading=route.settings.heading).path  # fmt: skip
