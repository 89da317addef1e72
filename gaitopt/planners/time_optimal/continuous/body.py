"""Where the body of a continuous walk goes: rows of balance and reach at given spans of time."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from gaitopt.conventions import GRAVITY, LEGS, FloatArray
from gaitopt.interior_point.solver import Solution, minimise
from gaitopt.motion.quadratic_spline import neighbours, parabola_weights
from gaitopt.optimize.body_path import (
    FIRST_BARRIER,
    LEAST_BARRIER,
    BodyPathProblem,
    DiscRows,
    LineRows,
)
from gaitopt.optimize.paced_path import PacedPathProblem
from gaitopt.optimize.route.legs import FOOT, ORIENTATION
from gaitopt.planners.time_optimal.continuous.refusal import refused
from gaitopt.planners.time_optimal.smooth.build import FORCE_ZMP_SHARE, start_margin
from gaitopt.planners.time_optimal.smooth.motion import SAMPLES, SplineMotion
from gaitopt.planners.time_optimal.support import support_on_spans
from gaitopt.planners.time_optimal.walk import Route
from gaitopt.robots.rotations import rpy_to_matrix

ROUNDS = 2
"""Rounds in which the body's path is found. In each the centre of mass and the ZMP of all links are
measured anew, along the path of the round before."""
LEAST_UNIT = 0.01
"""Least unit of lengths, as a share of the standing height: a stability margin may be zero."""
MOST_ROUNDS = 8
"""Most rounds of a static walk, which ends when the centre of mass keeps its margin."""
OVERCORRECTION = 1.5
"""Factor by which rows are made stricter where the margin was missed."""
LOOKED_AT = np.array([0, SAMPLES // 2, SAMPLES - 1])
"""Samples of a span at which rows look: its begin, middle and end."""
MARGIN_KEPT = 0.5
"""Share of the reserve of the static margin that is left at samples."""
REACH_RESERVE = 1e-3
"""Share of a leg's reach that is left."""


class BalancedMotion(NamedTuple):
    """A motion whose body keeps balance, and the solutions that it comes from.

    Attributes:
        motion: the motion.
        solutions: of all rounds.
    """

    motion: SplineMotion
    solutions: tuple[Solution[BodyPathProblem] | Solution[PacedPathProblem], ...]


def balanced(route: Route, motion: SplineMotion) -> BalancedMotion:
    """The motion with the smoothest path of the body that keeps balance, at the same times.

    A solution is judged by its motion, whatever the solver's status is: here by the margin of a
    static walk, later by clearance, joint limits and contact forces.

    Args:
        route: the walk.
        motion: its spans and flights count, and its body's height.

    Raises:
        SolverError: the margin of a static walk is not kept, or a foot is out of reach; names the
            step.
    """
    solutions: list[Solution[BodyPathProblem]] = []
    stricter = np.zeros(len(motion.spans))
    for n in range(MOST_ROUNDS if route.settings.static else ROUNDS):
        problem = build_body_path(route, motion, stricter, measured=n > 0)
        start = problem.pack(motion.poses[:, :2])
        solutions.append(
            minimise(problem, start, barrier=FIRST_BARRIER, least_barrier=LEAST_BARRIER)
        )
        poses = motion.poses.copy()
        poses[:, :2] = problem.points(solutions[-1].x)
        motion = replace(motion, poses=poses)
        check_reach(route, motion)
        missing = missing_margins(route, motion)
        if n >= ROUNDS - 1 and not missing.any():
            return BalancedMotion(motion, tuple(solutions))
        stricter += OVERCORRECTION * missing
    margin = route.settings.stability_margin
    what = f"the margin of {margin:g} m is missed by {missing.max():.2g} m at this pace"
    raise refused(route, motion, int(missing.argmax()), what)


def length_unit(route: Route) -> float:
    """Unit of lengths of the problems of a walk [m]: the stability margin where that is enough."""
    return max(route.settings.stability_margin, LEAST_UNIT * route.robot.standing_height)


def check_reach(route: Route, motion: SplineMotion) -> None:
    """Refuse a motion with a foot that is out of reach.

    Raises:
        SolverError: it has one; names the step.
    """
    span = out_of_reach(motion)
    if span is not None:
        raise refused(route, motion, span, "a foot would be out of reach")


def out_of_reach(motion: SplineMotion) -> int | None:
    """The first span of a motion on which a foot is out of reach; ``None`` for none."""
    times, span = motion.samples
    reached = np.isfinite(motion.joints_at(times, span)).all(axis=1)
    return None if reached.all() else int(span[np.argmin(reached)])


def promised_centre(route: Route, motion: SplineMotion) -> SplineMotion:
    """The motion with the centre that promises its static margin: the true one, or the body's."""
    return replace(motion, whole_body=route.settings.true_com)


def missing_margins(route: Route, motion: SplineMotion) -> FloatArray:
    """How much of the margin that a static walk promises is missing on each span ``(K,)`` [m]."""
    settings, count = route.settings, len(motion.spans)
    if not settings.static:
        return np.zeros(count)
    # Before the first lift-off nothing is promised but that the centre stays inside.
    first = np.arange(count) < motion.knots.phase_ends[1]
    wanted = np.where(first, 0.0, settings.stability_margin)
    wanted += MARGIN_KEPT * settings.margin_reserve
    return np.maximum(wanted - promised_centre(route, motion).margins(dynamic=False), 0.0)


def build_body_path(
    route: Route, motion: SplineMotion, stricter: FloatArray, *, measured: bool
) -> BodyPathProblem:
    """The problem of the body's path, near that of a motion.

    Rows see the body centre. How far the true centre of mass and the ZMP of all links are from
    those of a point mass there is measured along the given motion.

    Args:
        route: the walk.
        motion: its spans and flights count; its body's path is the first guess.
        stricter: what is added to the static margin on each span ``(K,)`` [m].
        measured: whether the body's accelerations are those of a solution. If not, the ZMP is taken
            to be as far from that of a point mass as the centres of mass are.
    """
    poses, spans = motion.poses, motion.spans
    heights = poses[:, 2] - (motion.knots.ground_on_spans - route.robot.foot_radius)
    return BodyPathProblem(
        start=poses[0, :2], spans=spans, pendulum=heights / GRAVITY,
        lines=_balance_lines(route, motion, heights / GRAVITY, stricter, measured),
        discs=reach_discs(route, motion),
        unit=length_unit(route),
    )  # fmt: skip


def _balance_lines(
    route: Route, motion: SplineMotion, pendulum: FloatArray, stricter: FloatArray, measured: bool
) -> LineRows:
    """Rows that keep the ZMP inside the support polygon, and the centre of mass if promised."""
    knots, settings = motion.knots, route.settings
    sides = support_on_spans(knots)
    square, linear, fixed = parabola_weights(motion.spans)[:, :, None]
    t = motion.spans[:, None, None] * np.linspace(0.0, 1.0, SAMPLES)[:, None]
    places = (square * t + linear) * t + fixed
    zmp_weights = places - 2.0 * pendulum[:, None, None] * square
    points = neighbours(motion.poses[:, :2])
    margin, centre = settings.stability_margin, promised_centre(route, motion).centres_of_mass
    standing = np.einsum("mi,i->m", sides.normal, centre[0, 0]) - sides.offset
    in_first = sides.knot < knots.phase_ends[1]
    of_centre = centre - places @ points
    of_zmp = motion.centres_of_mass - places @ points
    if measured:
        of_zmp = np.nan_to_num(motion.zero_moment_points - zmp_weights @ points)
    kinds = [(zmp_weights, of_zmp, FORCE_ZMP_SHARE * margin, True)]
    if settings.static:
        kinds.append((places, of_centre, margin + settings.margin_reserve, False))
    rows = []
    for weights, beside, wanted, soft in kinds:
        least = np.where(in_first, start_margin(standing, wanted), wanted)
        least = least if soft else least + stricter[sides.knot]
        for sample in LOOKED_AT:
            shift = (sides.normal * beside[sides.knot, sample]).sum(axis=1)
            rows.append((sides.knot, weights[sides.knot, sample], sides.normal,
                         sides.offset + least - shift, np.full(len(shift), soft)))  # fmt: skip
    columns = [np.concatenate(column) for column in zip(*rows, strict=True)]
    order = np.argsort(columns[0], kind="stable")
    return LineRows(*(column[order] for column in columns))


def reach_discs(route: Route, motion: SplineMotion) -> DiscRows:
    """Discs about every foot, less where the hip is, in which the leg reaches the foot.

    A foot at ``(x, y, z)`` from the hip is within reach ``r`` of the pitch axis, which lies ``d``
    below the roll axis, where ``x^2 + (sqrt(y^2 + z^2 - l^2) - d)^2 <= r^2``, with the lateral
    offset ``l``. A disc within this oval has the radius that is used here. It is exact to turns of
    the body where ``d`` is zero; else it holds for a level one, and the joints are checked later.
    """
    poses, fraction = motion.poses, route.settings.reach_fraction
    feet = motion.knots.feet_at_knots(poses[:, FOOT])
    turns = rpy_to_matrix(poses[:, ORIENTATION])
    span, centre, radius = [], [], []
    for i, name in enumerate(LEGS):
        leg = route.robot.legs[name]
        reach = (1.0 - REACH_RESERVE) * min(leg.reach, fraction * (leg.upper + leg.lower))
        hip = turns @ (leg.hip - route.robot.centre)
        down = poses[:, 2] + hip[:, 2] - feet[:, i, 2]
        square = (reach + leg.drop) ** 2 + leg.lateral**2 - down**2
        square /= 1.0 + 2.0 * max(leg.drop, 0.0) / reach
        span.append(np.arange(1, len(poses)))
        centre.append((feet[:, i, :2] - hip[:, :2])[1:])
        radius.append(np.sqrt(np.maximum(square, 0.0))[1:])
    return DiscRows(np.concatenate(span), np.concatenate(centre), np.concatenate(radius))
