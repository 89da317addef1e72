"""The time-optimal crawl: all steps of a walk in one optimisation.

Footholds, leg order, stability margin and joint limits are those of the walk that is planned phase
by phase (000_6dacb41600db6a3c.txt); what is free beyond the body's targets is chosen by name.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import fields, replace
from time import process_time
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from gaitopt.conventions import FloatArray
from gaitopt.errors import GaitoptError, InfeasibleStepError, InputError, SolverError
from gaitopt.gait.crawl import CRAWL_SEQUENCES, WANG_SEQUENCE, check_order
from gaitopt.optimize.route_solver import Answer, solve_route
from gaitopt.planning import crawl
from gaitopt.planning.free_gait import find_order, plan_touches
from gaitopt.planning.path import MotionPath
from gaitopt.planning.plan import Plan
from gaitopt.planning.route_assembly import densify, motion_path, route_phases
from gaitopt.planning.route_balance import raised, shortfall
from gaitopt.planning.route_collision import kept_apart, touching
from gaitopt.planning.route_knots import RouteKnots, build_route, feet_clearance
from gaitopt.planning.route_settings import RouteSettings, check_free
from gaitopt.planning.route_smooth import smooth_plan
from gaitopt.planning.route_steps import Route, failed, knots_of, prepared, problem_of
from gaitopt.planning.route_stops import StoppingMotion, stopping_path
from gaitopt.planning.settings import CrawlSettings
from gaitopt.robots.quadruped import Quadruped
from gaitopt.terrain.footholds import Footholds

if TYPE_CHECKING:
    from gaitopt.optimize.route_com import ComRows
    from gaitopt.optimize.route_problem import RouteProblem

DIRECT_STEPS = 1024
"""Longer routes are first planned in overlapping windows, and then as a whole."""
WINDOW = 16
"""Steps of such a window."""
NEAR = 1e-2
"""First barrier parameter from a good guess, as a share of that from a poor one."""
ROUNDS = 6
"""Most rounds of moving legs apart."""
BALANCE_ROUNDS = 8
"""Most rounds of keeping the true centre of mass in its margin between knots, too."""
RAMP = 0.05
"""Time in which the slowest joint reaches its velocity limit, by default [s]."""


def plan_route(
    robot: Quadruped,
    footholds: Footholds,
    free: str | Iterable[str] = "swing",
    stability_margin: float = 0.02,
    body_height: float = 0.40,
    swing_height: float = 0.07,
    sequence: Iterable[str] | Literal["free"] = WANG_SEQUENCE,
    *,
    com: Literal["body", "model"] = "body",
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
        robot: as for :func:`gaitopt.plan_crawl`, and likewise ``footholds``, ``stability_margin``,
            ``swing_height``, ``sequence``, ``reach_fraction``, ``heading``, ``follow_terrain`` and
            ``cog_start``. A ``body_height`` that is free begins at this one. The sequence
            ``"free"`` plans each of the six cycles and the order that is searched for, and takes
            the fastest plan.
        free: what is free beyond the body's targets: the name of a row (``"route"``: nothing;
            ``"overlap"``: the body moves during swings; ``"swing"``: the swing curve, too;
            ``"height"``: the body's height, too; ``"posture"``: its roll, pitch and yaw, too;
            ``"dynamic"``: the ZMP of a point mass at the body centre keeps the stability margin
            at every instant, in place of the body centre itself, and joint accelerations are
            bounded), or any of these things by name.
        com: what keeps the stability margin: ``"body"``, the body's centre, as in the paper;
            ``"model"``, the true centre of mass of the whole robot with its legs. With
            ``"model"`` neither a dynamic walk nor an acceleration limit is planned.
        clearance: a foot that flies on a free curve is this much higher than the higher of its
            two footholds wherever it is not within the columns' radius of one of their axes [m].
        acceleration_limit: of every joint [rad/s^2]; for a dynamic walk by default what takes
            the slowest joint to its velocity limit in :data:`RAMP`. Where the swing curve is free
            the motion is a spline; a box is flown with a stop at each corner, and wherever else
            body or foot change direction.
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
    if isinstance(sequence, str) and sequence == "free":
        options = dict(
            free=free, stability_margin=stability_margin, body_height=body_height,
            swing_height=swing_height, clearance=clearance, reach_fraction=reach_fraction,
            heading=heading, follow_terrain=follow_terrain, cog_start=cog_start, com=com,
            acceleration_limit=acceleration_limit, horizon=horizon, stance_knots=stance_knots,
            swing_knots=swing_knots, iterations=iterations,
        )  # fmt: skip
        return _fastest_order(robot, footholds, options)
    named = check_free(free)
    limited = acceleration_limit is not None or "dynamic" in named
    smooth, stops = limited and "swing" in named, limited and "swing" not in named
    stance = 1 if stops else 3 if smooth else 4 if "posture" in named else 2
    settings = RouteSettings(
        free=named, stability_margin=stability_margin, body_height=body_height,
        swing_height=swing_height, sequence=check_order(sequence), clearance=clearance,
        reach_fraction=reach_fraction, heading=heading, follow_terrain=follow_terrain,
        acceleration_limit=_acceleration(robot, named, acceleration_limit),
        stance_knots=stance_knots or stance,
        swing_knots=swing_knots or (8 if "swing" in named else 6 if stops else 12), com=com,
    )  # fmt: skip
    if settings.true_com and settings.smooth:
        raise InputError(
            "com='model' keeps static stability at the joints' velocity limits only: leave "
            "'dynamic' and acceleration_limit out, or take com='body'"
        )
    if horizon is not None and (isinstance(horizon, bool) or not 2 <= horizon <= 10_000):
        raise InputError(f"horizon must be a whole number of steps from 2, got {horizon!r}")
    route = prepared(robot, footholds, settings, cog_start)
    if not route.steps.legs:
        return Plan(robot, footholds, settings, (), _standing(route), {})
    began = process_time()
    if settings.acceleration_limit is not None and "swing" in settings.free:
        return smooth_plan(route, iterations, None if horizon is None else int(horizon))
    if horizon is not None:
        poses, answers = _in_windows(route, int(horizon), max(int(horizon) // 2, 1), iterations)
    else:
        poses, answers = _whole(route, iterations)
    return _assembled(route, poses, answers, process_time() - began)


def _fastest_order(robot: Quadruped, footholds: Footholds, options: dict[str, Any]) -> Plan:
    """The fastest of the plans with each of the six cycles, and with the order that is searched.

    Raises:
        InfeasibleStepError, SolverError: of the first order, when none is feasible.
    """
    plans: list[Plan] = []
    errors: list[GaitoptError] = []
    for order in _orders(robot, footholds, options):
        try:
            plans.append(plan_route(robot, footholds, sequence=order, **options))
        except (InfeasibleStepError, SolverError) as error:
            errors.append(error)
    if not plans:
        raise errors[0]
    best = min(plans, key=lambda plan: (plan_touches(plan), plan.duration))
    info = {**best.info, "orders_feasible": float(len(plans))}
    return replace(best, info=info)


def _orders(
    robot: Quadruped, footholds: Footholds, options: dict[str, Any]
) -> list[tuple[str, ...]]:
    """The six cycles of legs, the paper's first; last the fastest order phase by phase."""
    crawl.check_robot(robot)
    known = {f.name for f in fields(CrawlSettings)} - {"acceleration_limit"}
    settings = CrawlSettings(**{k: v for k, v in options.items() if k in known})
    cycles = [WANG_SEQUENCE, *(order for order in CRAWL_SEQUENCES if order != WANG_SEQUENCE)]
    found = find_order(robot, footholds, settings, options["cog_start"])
    return [*cycles, found.legs] if found.complete and found.legs else cycles


def _acceleration(robot: Quadruped, free: tuple[str, ...], asked: float | None) -> float | None:
    """The acceleration limit of every joint [rad/s^2], where there is one."""
    if asked is not None and "swing" in free and "overlap" not in free:
        raise InputError(
            "acceleration_limit with a free 'swing' needs 'overlap' to be free, too: the swing's "
            "spline moves with the body's"
        )
    if asked is None and "dynamic" in free:
        return round(float(min(leg.velocity_limits.min() for leg in robot.legs.values())) / RAMP, 6)
    return asked


def _whole(route: Route, iterations: int) -> tuple[FloatArray, list[Answer]]:
    """Poses at all knots, all steps at once."""
    count = len(route.steps.legs)
    problem, knots = problem_of(route, 0, count), knots_of(route, 0, count)
    answers: list[Answer] = []
    last = problem
    if count <= DIRECT_STEPS:
        answers, last = _solved(route, problem, knots, None, iterations)
    if not answers or answers[-1].status != "solved":
        poses, windows = _in_windows(route, WINDOW, WINDOW // 2, iterations, partial=True)
        again, last = _solved(route, problem, knots, poses, iterations)
        answers += [*windows, *again]
    if answers[-1].status != "solved":
        raise failed(route, last, answers[-1], 0)
    return problem.unpack(answers[-1].x)[0], answers


def _solved(
    route: Route,
    problem: RouteProblem,
    knots: RouteKnots | None,
    guess: FloatArray | None,
    iterations: int,
) -> tuple[list[Answer], RouteProblem]:
    """Answers to the problem, and the problem that the last one solves.

    In the last answer legs keep apart and the true COM keeps its margin.

    Args:
        route, problem: what is walked, and the steps that are solved.
        knots: of these steps; ``None`` to keep the true COM's margin at knots only.
        guess: poses from which to begin, near the optimum; the problem's own by default.
        iterations: most Newton steps of each solution.
    """

    def again(changed: RouteProblem, poses: FloatArray) -> Answer:
        return solve_route(changed, changed.near(poses), barrier=NEAR * changed.barrier,
                           iterations=iterations)  # fmt: skip

    if guess is None:
        answers = [solve_route(problem, problem.start(), barrier=problem.barrier,
                               iterations=iterations)]  # fmt: skip
    else:
        answers = [again(problem, guess)]
    apart = problem
    for attempt in range(max(ROUNDS, BALANCE_ROUNDS if problem.com is not None else 0)):
        if answers[-1].status != "solved":
            break
        poses = problem.unpack(answers[-1].x)[0]
        found = None
        if route.shapes is not None and attempt < ROUNDS:
            found = touching(route.shapes, problem, poses)
        rows = _safer(route, apart, knots, poses)
        if found is None and rows is None:
            break
        if rows is not None:
            problem, apart = replace(problem, com=rows), replace(apart, com=rows)
        if route.shapes is not None and found is not None:
            apart = kept_apart(route.shapes, problem, poses, *found)
        answers.append(again(apart, poses))
    return answers, apart


def _safer(
    route: Route, problem: RouteProblem, knots: RouteKnots | None, poses: FloatArray
) -> ComRows | None:
    """Rows that ask more of the true COM, where it loses its margin between knots; else none."""
    if problem.com is None or knots is None:
        return None
    dense = densify(route.robot, route.settings, knots, problem.legs, poses)
    short = shortfall(route.robot, route.settings, knots, dense)
    return raised(problem.com, knots, short) if short.max() > 0.0 else None


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
        problem = problem_of(route, first, last)
        if here is not None:
            problem.poses[0] = here
        # A first guess need not hold between knots.
        knots = None if partial else knots_of(route, first, last)
        some, solved = _solved(route, problem, knots, None, iterations)
        answers += some
        answer = answers[-1]
        if answer.status != "solved" and not partial:
            raise failed(route, solved, answer, first)
        found = problem.unpack(answer.x)[0]
        step = last - first if last == count else kept
        poses[first * each : (first + step) * each + 1] = found[: step * each + 1]
        here, first = found[step * each], first + step
    return poses, answers


def _assembled(route: Route, poses: FloatArray, answers: list[Answer], seconds: float) -> Plan:
    """The dense plan through the poses."""
    settings, steps = route.settings, route.steps
    knots, problem = build_route(route.robot, steps, settings, route.cogs, route.footholds.radius)
    dense = densify(route.robot, settings, knots, problem.legs, poses)
    centre = "body centre"
    if settings.true_com:
        centre = "true centre of mass"
        short = shortfall(route.robot, settings, knots, dense)
        if short.max() > settings.margin_reserve / 2.0:
            lost = replace(answers[-1], status="the true COM loses its margin between knots")
            raise failed(route, problem, lost, 0, np.argsort(-short.max(axis=1))[:3] + 1)
    info: dict[str, float | str] = {
        "stability": f"static margin of the {centre}, on the horizontal projection",
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
    path = motion_path(dense)
    if settings.acceleration_limit is not None:
        limit = settings.acceleration_limit
        motion = StoppingMotion.of(route.robot, settings.heading, problem.legs, knots, poses, limit)
        motion, path = stopping_path(motion, limit)
        dense = motion.dense()
    phases = route_phases(route.robot, settings, steps, knots, dense)
    if settings.acceleration_limit is not None:
        # No one joint sets the pace of such a phase.
        phases = tuple(replace(phase, limited_by=()) for phase in phases)
    return Plan(route.robot, route.footholds, settings, phases, path, info)


def _standing(route: Route) -> MotionPath:
    """The path of a walk without steps: the body stands where it starts."""
    settings = route.settings
    plan = crawl.plan_crawl(
        route.robot, route.footholds, body_height=settings.body_height,
        reach_fraction=settings.reach_fraction, heading=settings.heading,
        follow_terrain=settings.follow_terrain, cog_start=route.cog_start,
    )  # fmt: skip
    return plan.path
