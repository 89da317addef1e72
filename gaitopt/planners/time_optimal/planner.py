"""The time-optimal crawl: all steps of a walk in one optimisation.

Footholds, leg order, stability margin and joint limits are those of the walk that is planned phase
by phase ([Wang2020]); what is free beyond the body's targets is chosen by name.
"""

from __future__ import annotations

from dataclasses import replace
from time import process_time
from typing import Any

import numpy as np

from gaitopt.conventions import FloatArray, Progress
from gaitopt.errors import GaitoptError, InfeasibleStepError, SolverError
from gaitopt.gait.crawl import CRAWL_SEQUENCES, FREE_ORDER, WANG_SEQUENCE
from gaitopt.interior_point.solver import Solution
from gaitopt.optimize.route.problem import RouteProblem
from gaitopt.plan.plan import Plan
from gaitopt.plan.record import RouteRecord
from gaitopt.plan.settings.keywords import chosen_settings, takes_settings
from gaitopt.plan.settings.time_optimal import RouteSettings
from gaitopt.planners.free_order.planner import plan_touches
from gaitopt.planners.free_order.search import find_order
from gaitopt.planners.phase_by_phase.planner import plan_in_order, with_fitting_height
from gaitopt.planners.phase_by_phase.steps import check_robot, check_walk
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


@takes_settings(RouteSettings)
def plan_route(
    robot: Quadruped,
    footholds: Footholds,
    settings: RouteSettings | None = None,
    *,
    progress: Progress | None = None,
    **options: Any,
) -> Plan:
    """Plan the fastest statically stable walk over given footholds, all steps at once.

    Args:
        robot: from :func:`gaitopt.load_robot`; its legs need a roll joint.
        footholds: where the feet go; the first of each leg is where it stands at the start.
        settings: all settings as one object. By default they fit the robot: margins and heights
            are to its size, and of a few body heights the first is taken at which the walk is
            possible phase by phase.
        progress: called with (done, in all), from (0, all) on: of steps, which are done window by
            window or all at once; with the sequence ``"free"`` of orders.
        options: single settings by name: the fields of :class:`gaitopt.RouteSettings`.

    Returns:
        The plan. Its record holds the solver's residuals, worked out anew at the end.

    Raises:
        InputError: a setting is unknown or out of range, or the robot's legs cannot move sideways.
        InfeasibleStepError: a step is impossible even for the walk that is planned phase by phase.
        RouteError: no convergence; holds the walk planned phase by phase, and the solver's report.
    """
    check_walk("plan_route", robot, footholds)
    check_robot(robot)
    open_height = settings is None and options.get("body_height") is None
    chosen = chosen_settings(RouteSettings, robot, settings, options)
    if open_height:
        fitting = with_fitting_height(robot, footholds, crawl_settings(chosen))
        chosen = replace(chosen, body_height=fitting.body_height)
    if chosen.sequence == FREE_ORDER:
        return _fastest_order(robot, footholds, chosen, progress)
    return _in_order(robot, footholds, chosen, progress)


def _in_order(
    robot: Quadruped, footholds: Footholds, settings: RouteSettings, progress: Progress | None
) -> Plan:
    """The plan with the settings' order of legs."""
    route = prepared(robot, footholds, settings)
    if not route.steps.legs:
        # The body stands where it starts.
        path = plan_in_order(robot, footholds, crawl_settings(settings)).path
        return Plan(robot, footholds, settings, (), path, RouteRecord())
    return _planned(route, progress)


def _planned(route: Route, progress: Progress | None) -> Plan:
    """The plan of a walk that has steps."""
    steps, settings = len(route.steps.legs), route.settings
    began = process_time()
    if progress is not None:
        progress(0, steps)
    if settings.smooth and settings.free.swing:
        plan = smooth_plan(route, progress)
    else:
        if settings.horizon is None:
            poses, solutions = planned_whole(route, settings.iterations, progress)
        else:
            kept = max(settings.horizon // 2, 1)
            poses, solutions = planned_in_windows(
                route, settings.horizon, kept, settings.iterations, progress
            )
        plan = _assembled(route, poses, solutions, process_time() - began)
    if progress is not None:
        progress(steps, steps)
    return plan


def _fastest_order(
    robot: Quadruped, footholds: Footholds, settings: RouteSettings, progress: Progress | None
) -> Plan:
    """The fastest of the plans with each of the six cycles, and with the order that is searched.

    Raises:
        InfeasibleStepError, SolverError: of the first order, when none is feasible.
    """
    plans: list[Plan] = []
    errors: list[GaitoptError] = []
    orders = _orders(robot, footholds, settings)
    for done, order in enumerate(orders):
        if progress is not None:
            progress(done, len(orders))
        try:
            plans.append(_in_order(robot, footholds, replace(settings, sequence=order), None))
        except (InfeasibleStepError, SolverError) as error:
            errors.append(error)
    if progress is not None:
        progress(len(orders), len(orders))
    if not plans:
        raise errors[0]
    best = min(plans, key=lambda plan: (plan_touches(plan), plan.duration))
    assert isinstance(best.record, RouteRecord)
    return replace(best, record=replace(best.record, orders_feasible=len(plans)))


def _orders(
    robot: Quadruped, footholds: Footholds, settings: RouteSettings
) -> list[tuple[str, ...]]:
    """The six cycles of legs, the paper's first; last the fastest order phase by phase."""
    cycles = [WANG_SEQUENCE, *(order for order in CRAWL_SEQUENCES if order != WANG_SEQUENCE)]
    found = find_order(robot, footholds, crawl_settings(settings))
    return [*cycles, found.legs] if found.complete and found.legs else cycles


def _assembled(
    route: Route, poses: FloatArray, solutions: list[Solution[RouteProblem]], seconds: float
) -> Plan:
    """The dense plan through the poses."""
    settings, steps = route.settings, route.steps
    knots, problem = build_route(
        route.robot, steps, settings, route.cogs, route.footholds.landing_radius
    )
    dense = densify(route.robot, settings, knots, problem.legs, poses)
    centre = "body centre"
    if settings.true_com:
        centre = "true centre of mass"
        short = shortfall(route.robot, settings, knots, dense)
        if short.max() > settings.margin_reserve / 2.0:
            worst = np.argsort(-short.max(axis=1))[:3] + 1
            raise failed(route, solutions[-1], 0, Reason.COM_MARGIN, worst)
    clearance = None
    if settings.free.swing:
        low = dense_heights(route, knots, dense).low
        if low.min() < settings.clearance:
            raise failed(route, solutions[-1], 0, Reason.CLEARANCE, np.argsort(low)[:3] + 1)
        clearance = float(low.min())
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
    record = RouteRecord(
        stability=f"static margin of the {centre}, on the horizontal projection",
        knot_time=float(problem.least_times(poses).sum()),
        solver_seconds=seconds,
        solver_iterations=sum(a.iterations for a in solutions),
        stationarity=solutions[-1].stationarity(),
        violation=solutions[-1].violation(),
        complementarity=solutions[-1].complementarity() * problem.time_unit,
        clearance=clearance,
    )
    return Plan(route.robot, route.footholds, settings, phases, path, record)
