"""Plans of continuous walks, timed by contact forces."""

from __future__ import annotations

from dataclasses import replace
from time import process_time

import numpy as np

from gaitopt.conventions import GRAVITY, FloatArray
from gaitopt.errors import InfeasibleStepError, SolverError
from gaitopt.optimize.route.legs import StackedLegs
from gaitopt.plan.plan import Plan
from gaitopt.plan.record import RouteRecord
from gaitopt.planners.time_optimal.build import with_reach_limits
from gaitopt.planners.time_optimal.collision import ACCEPTED_SHARE, LEAST_DISTANCE
from gaitopt.planners.time_optimal.continuous.body import BalancedMotion, balanced, missing_margins
from gaitopt.planners.time_optimal.continuous.paced import ROUNDS, faster
from gaitopt.planners.time_optimal.continuous.refusal import refused
from gaitopt.planners.time_optimal.continuous.swings import with_flights
from gaitopt.planners.time_optimal.guess import first_guess
from gaitopt.planners.time_optimal.knots import RouteKnots, route_knots
from gaitopt.planners.time_optimal.smooth.clearance import lowest_heights
from gaitopt.planners.time_optimal.smooth.motion import SplineMotion
from gaitopt.planners.time_optimal.smooth.phases import smooth_phases
from gaitopt.planners.time_optimal.walk import Route
from gaitopt.retiming.retimed import retimed
from gaitopt.robots.collisions.along_paths import close_pairs

PACES = (1.0, 1.5, 2.5)
"""Factors of the first guess's times, tried one after the other until there is a walk. The timing
is found anew, so the walk's own time depends little on it: 16 dynamic steps of go2 take 1.49, 1.54
and 1.66 s from 0.7, 1 and 1.5 (seed 0)."""
STANCE_SHARE, SWING_SHARE = 0.25, 1.0
"""Times of the phases of a dynamic walk in the first guess, in the time in which a pendulum as long
as a leg turns by one radian."""
SHIFT_SHARE, STATIC_SWING_SHARE = 2.8, 0.6
"""The same of a static walk. Its body has to move from triangle to triangle in stance phases: over
a leg's length in the first of these times, and over shorter distances in a time that falls with
their square root, as accelerations are bounded. In walks phase by phase of six robots the medians
are 2.6 to 3.7, and 0.57 to 1.07."""
LEAST_SHARE = 0.12
"""Least time of a stance phase of a static walk in the first guess: some bodies need not move."""
ANGLE_ROUNDING = 1e-9
"""Largest angle by which a joint may exceed its position limits [rad], for rounding."""


def continuous_plan(route: Route) -> Plan:
    """The continuous walk, timed by forces.

    Args:
        route: the walk.

    Raises:
        InfeasibleStepError: the body cannot go on at any speed; names the step.
        SolverError: no motion keeps all limits.
    """
    failures: list[InfeasibleStepError | SolverError] = []
    for pace in PACES:
        try:
            return _plan_at(route, pace)
        except (InfeasibleStepError, SolverError) as failure:
            failures.append(failure)
    raise failures[0]


def _plan_at(route: Route, pace: float) -> Plan:
    """The walk that begins with times at a pace."""
    began = process_time()
    found = [balanced(route, _first_motion(route, pace))]
    for _ in range(ROUNDS):
        quicker = faster(route, found[-1].motion)
        if quicker is None:
            break
        found.append(BalancedMotion(quicker.motion, (*found[-1].solutions, quicker.solution)))
    seconds = process_time() - began
    failures: list[InfeasibleStepError | SolverError] = []
    for one in reversed(found):
        try:
            return _timed(route, one, seconds)
        except (InfeasibleStepError, SolverError) as failure:
            failures.append(failure)
    raise failures[-1]


def _first_motion(route: Route, pace: float) -> SplineMotion:
    """Feet that fly, and a body that is not balanced yet, with times at a pace."""
    settings = route.settings
    knots = route_knots(route.steps, settings.stance_knots, settings.swing_knots)
    legs = with_reach_limits(StackedLegs.of(route.robot), settings.reach_fraction)
    spans = pace * _spans(route, knots, legs)
    motion = SplineMotion(
        route.robot, settings.heading, legs, knots, first_guess(route, knots), spans,
        whole_body=True,
    )  # fmt: skip
    footholds = route.footholds
    return with_flights(motion, settings, route.steps.lifts, footholds.landing_radius,
                        upright=footholds.ground is not None)  # fmt: skip


def _timed(route: Route, found: BalancedMotion, seconds: float) -> Plan:
    """The plan of a motion, timed by forces.

    Args:
        route: the walk.
        found: its motion.
        seconds: processor time that it took.

    Raises:
        InfeasibleStepError, SolverError: as for :func:`continuous_plan`.
    """
    settings = route.settings
    _check(route, found.motion)
    record = _record(route, found, seconds)
    # Margins of a static walk's phases are those of the centre that promises them.
    told = replace(found.motion, whole_body=settings.true_com or not settings.static)
    phases = smooth_phases(route, told)
    path = found.motion.path()
    return retimed(Plan(route.robot, route.footholds, settings, phases, path, record))


def _spans(route: Route, knots: RouteKnots, legs: StackedLegs) -> FloatArray:
    """Spans of the first guess ``(K,)`` [s]."""
    reach = float(legs.reach.max())
    if route.settings.static:
        shifts = np.linalg.norm(np.diff(route.cogs[:, :2], axis=0), axis=1)
        stances = np.maximum(SHIFT_SHARE * np.sqrt(shifts / reach), LEAST_SHARE)
        swings = np.full(route.count, STATIC_SWING_SHARE)
    else:
        stances, swings = np.full((2, route.count), [[STANCE_SHARE], [SWING_SHARE]])
    times = np.sqrt(reach / GRAVITY) * np.stack([stances, swings], axis=1).ravel()
    # A swing begins with the span of its lift-off, and ends with that of its touchdown.
    ends = knots.phase_ends.copy()
    ends[2::2] += 1
    counts = np.diff(ends)
    return np.asarray(np.repeat(times / counts, counts))


def _check(route: Route, motion: SplineMotion) -> None:
    """Refuse a motion that leaves its margin, joint limits or clearance, or whose legs touch.

    Raises:
        SolverError: names the step.
    """
    missing = missing_margins(route, motion)
    if missing.any():
        raise refused(route, motion, int(missing.argmax()), "the margin would be missed")
    times, span = motion.samples
    joints = motion.joints_at(times, span)
    low, high = motion.legs.low.ravel(), motion.legs.high.ravel()
    # So written, an angle counts that is not a number: its foot is out of reach.
    outside = ~((joints >= low - ANGLE_ROUNDING) & (joints <= high + ANGLE_ROUNDING)).all(axis=1)
    if outside.any():
        raise refused(
            route, motion, int(span[np.argmax(outside)]), "a joint would leave its limits"
        )
    lowest = lowest_heights(motion, route.footholds.landing_radius)
    if lowest.min() < route.settings.clearance:
        raise refused(route, motion, int(lowest.argmin()), "a foot would lose its clearance")
    if route.shapes is None:
        return
    pairs = close_pairs(route.shapes, joints)
    if not pairs:
        return
    distances = route.shapes.distances(joints, pairs).min(axis=1)
    if distances.min() < ACCEPTED_SHARE * LEAST_DISTANCE:
        nearest = int(span[int(distances.argmin())])
        raise refused(route, motion, nearest, "legs would touch each other")


def _record(route: Route, found: BalancedMotion, seconds: float) -> RouteRecord:
    """What the plan tells of itself."""
    stability = "contact forces of the whole robot"
    if route.settings.static:
        centre = "true centre of mass" if route.settings.true_com else "body centre"
        stability = f"static margin of the {centre}, on the horizontal projection"
    solution = found.solutions[-1]
    radius = route.footholds.landing_radius
    return RouteRecord(
        stability=stability,
        knot_time=float(found.motion.times[-1]),
        solver_seconds=seconds,
        solver_iterations=sum(s.iterations for s in found.solutions),
        stationarity=solution.stationarity(),
        violation=solution.violation(),
        clearance=float(lowest_heights(found.motion, radius).min()),
    )
