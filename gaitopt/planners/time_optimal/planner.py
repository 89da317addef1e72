"""The time-optimal crawl: all steps of a walk in one optimisation.

Footholds, leg order, stability margin and joint limits are those of the walk that is planned phase
by phase ([Wang2020]); what is free beyond the body's targets is chosen by name.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import fields, replace
from numbers import Real
from time import process_time
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from gaitopt.conventions import FloatArray, Progress
from gaitopt.errors import GaitoptError, InfeasibleStepError, InputError, SolverError
from gaitopt.gait.crawl import CRAWL_SEQUENCES, WANG_SEQUENCE, check_order
from gaitopt.inputs import check_count
from gaitopt.interior_point.solver import Solution
from gaitopt.motion.path import MotionPath
from gaitopt.optimize.route.problem import RouteProblem
from gaitopt.plan.plan import Plan
from gaitopt.plan.settings.crawl import CrawlSettings
from gaitopt.plan.settings.time_optimal import RouteSettings, check_free
from gaitopt.planners.free_order.planner import plan_touches
from gaitopt.planners.free_order.search import find_order
from gaitopt.planners.phase_by_phase.planner import plan_in_order
from gaitopt.planners.phase_by_phase.steps import check_robot
from gaitopt.planners.time_optimal.balance import shortfall
from gaitopt.planners.time_optimal.build import build_route
from gaitopt.planners.time_optimal.dense import motion_path
from gaitopt.planners.time_optimal.failure import Reason, failed
from gaitopt.planners.time_optimal.smooth.solve import smooth_plan
from gaitopt.planners.time_optimal.straight.clearance import dense_heights
from gaitopt.planners.time_optimal.straight.densify import densify
from gaitopt.planners.time_optimal.straight.phases import route_phases
from gaitopt.planners.time_optimal.straight.solve import planned_in_windows, planned_whole
from gaitopt.planners.time_optimal.straight.stops import StoppingMotion, stopping_path
from gaitopt.planners.time_optimal.walk import Route, crawl_settings, prepared
from gaitopt.robots.quadruped import Quadruped
from gaitopt.terrain.footholds import Footholds

SLOWEST_RAMP = 10.0
"""Longest time in which an acceleration limit may take a joint to its velocity limit [s]."""
MOST_STEPS = 10_000
"""Longest horizon."""
MOST_ITERATIONS = 100_000
"""Most Newton steps that may be asked for."""
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
    progress: Progress | None = None,
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
        progress: called with (done, in all), from (0, all) on: of steps, which are done window by
            window or all at once; with the sequence ``"free"`` of orders.

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
    limited = acceleration_limit is not None or "dynamic" in named
    smooth, stops = limited and "swing" in named, limited and "swing" not in named
    stance = 1 if stops else 3 if smooth else 4 if "posture" in named else 2
    free_order = isinstance(sequence, str) and sequence == "free"
    settings = RouteSettings(
        free=named, stability_margin=stability_margin, body_height=body_height,
        swing_height=swing_height, clearance=clearance,
        sequence=WANG_SEQUENCE if free_order else check_order(sequence),
        reach_fraction=reach_fraction, heading=heading, follow_terrain=follow_terrain,
        acceleration_limit=_acceleration(robot, named, acceleration_limit),
        stance_knots=stance if stance_knots is None else stance_knots,
        swing_knots=(8 if "swing" in named else 6 if stops else 12)
        if swing_knots is None else swing_knots, com=com,
    )  # fmt: skip
    iterations = check_count("iterations", iterations, 1, MOST_ITERATIONS)
    if horizon is not None:
        horizon = check_count("horizon", horizon, 2, MOST_STEPS)
    if free_order:
        options = dict(
            free=free, stability_margin=stability_margin, body_height=body_height,
            swing_height=swing_height, clearance=clearance, reach_fraction=reach_fraction,
            heading=heading, follow_terrain=follow_terrain, cog_start=cog_start, com=com,
            acceleration_limit=acceleration_limit, horizon=horizon, stance_knots=stance_knots,
            swing_knots=swing_knots, iterations=iterations,
        )  # fmt: skip
        return _fastest_order(robot, footholds, options, progress)
    route = prepared(robot, footholds, settings, cog_start)
    if not route.steps.legs:
        return Plan(robot, footholds, settings, (), _standing(route), {})
    return _planned(route, horizon, iterations, progress)


def _planned(route: Route, horizon: int | None, iterations: int, progress: Progress | None) -> Plan:
    """The plan of a walk that has steps."""
    steps, settings = len(route.steps.legs), route.settings
    began = process_time()
    if progress is not None:
        progress(0, steps)
    if settings.acceleration_limit is not None and settings.free.swing:
        plan = smooth_plan(route, iterations, horizon, progress)
    else:
        if horizon is None:
            poses, solutions = planned_whole(route, iterations, progress)
        else:
            kept = max(horizon // 2, 1)
            poses, solutions = planned_in_windows(route, horizon, kept, iterations, progress)
        plan = _assembled(route, poses, solutions, process_time() - began)
    if progress is not None:
        progress(steps, steps)
    return plan


def _fastest_order(
    robot: Quadruped, footholds: Footholds, options: dict[str, Any], progress: Progress | None
) -> Plan:
    """The fastest of the plans with each of the six cycles, and with the order that is searched.

    Raises:
        InfeasibleStepError, SolverError: of the first order, when none is feasible.
    """
    plans: list[Plan] = []
    errors: list[GaitoptError] = []
    orders = _orders(robot, footholds, options)
    for done, order in enumerate(orders):
        if progress is not None:
            progress(done, len(orders))
        try:
            plans.append(plan_route(robot, footholds, sequence=order, **options))
        except (InfeasibleStepError, SolverError) as error:
            errors.append(error)
    if progress is not None:
        progress(len(orders), len(orders))
    if not plans:
        raise errors[0]
    best = min(plans, key=lambda plan: (plan_touches(plan), plan.duration))
    info = {**best.info, "orders_feasible": float(len(plans))}
    return replace(best, info=info)


def _orders(
    robot: Quadruped, footholds: Footholds, options: dict[str, Any]
) -> list[tuple[str, ...]]:
    """The six cycles of legs, the paper's first; last the fastest order phase by phase."""
    check_robot(robot)
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
    slowest = float(min(leg.velocity_limits.min() for leg in robot.legs.values()))
    if asked is None and "dynamic" in free:
        return round(slowest / RAMP, 6)
    if isinstance(asked, Real) and 0.0 < asked < slowest / SLOWEST_RAMP:
        raise InputError(
            f"acceleration_limit is {asked:g} rad/s^2, with which a joint needs more than "
            f"{SLOWEST_RAMP:g} s to its velocity limit of {slowest:.3g} rad/s; take at least "
            f"{slowest / SLOWEST_RAMP:.3g}"
        )
    return asked


def _assembled(
    route: Route, poses: FloatArray, solutions: list[Solution[RouteProblem]], seconds: float
) -> Plan:
    """The dense plan through the poses."""
    settings, steps = route.settings, route.steps
    knots, problem = build_route(route.robot, steps, settings, route.cogs, route.footholds.radius)
    dense = densify(route.robot, settings, knots, problem.legs, poses)
    centre = "body centre"
    if settings.true_com:
        centre = "true centre of mass"
        short = shortfall(route.robot, settings, knots, dense)
        if short.max() > settings.margin_reserve / 2.0:
            worst = np.argsort(-short.max(axis=1))[:3] + 1
            raise failed(route, solutions[-1], 0, Reason.COM_MARGIN, worst)
    info: dict[str, float | str] = {
        "stability": f"static margin of the {centre}, on the horizontal projection",
        "row": settings.row,
        "knot_time": float(problem.least_times(poses).sum()),
        "solver_seconds": seconds,
        "solver_iterations": float(sum(a.iterations for a in solutions)),
        "stationarity": solutions[-1].stationarity(),
        "violation": solutions[-1].violation(),
        "complementarity": solutions[-1].complementarity() * problem.time_unit,
    }
    if settings.free.swing:
        low = dense_heights(route, knots, dense).low
        if low.min() < settings.clearance:
            raise failed(route, solutions[-1], 0, Reason.CLEARANCE, np.argsort(low)[:3] + 1)
        info["clearance"] = float(low.min())
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
    settings = crawl_settings(route.settings)
    return plan_in_order(route.robot, route.footholds, settings, route.cog_start).path
