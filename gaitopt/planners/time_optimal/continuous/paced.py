"""The body's path and its pace at once: rows of contact forces along a continuous walk.

What a motion asks of the ground is measured along it, as in its timing: a wrench that is linear in
the acceleration along the motion and in the squared speed. A path of the body a little beside it
asks for another one, to first order: a share of the mass is moved and accelerated with the body.
Rows keep normal forces, friction of all feet together, joint velocities, and the margin of a static
walk. What one foot alone can do, and torques, come with the timing. In a dynamic walk the robot
need not be able to rest everywhere, but it stays near to where it could: momentum that carries it
over is known to first order only.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from gaitopt.conventions import GRAVITY, LEGS, FloatArray, rotation_z
from gaitopt.dynamics.contacts import ForceLimits, pyramid_rows
from gaitopt.dynamics.speed_sweeps import SweptIntervals, swept
from gaitopt.interior_point.band import RowGroups
from gaitopt.interior_point.solver import Solution, minimise
from gaitopt.motion.quadratic_spline import parabola_weights
from gaitopt.optimize.paced_path import PacedPathProblem, PacedRows
from gaitopt.plan.contact_ground import ground_on
from gaitopt.planners.time_optimal.continuous.asked import Asked
from gaitopt.planners.time_optimal.continuous.body import (
    LOOKED_AT,
    length_unit,
    out_of_reach,
    promised_centre,
    reach_discs,
)
from gaitopt.planners.time_optimal.smooth.build import FORCE_ZMP_SHARE, start_margin
from gaitopt.planners.time_optimal.smooth.motion import SAMPLES, SplineMotion
from gaitopt.planners.time_optimal.support import support_on_spans
from gaitopt.planners.time_optimal.walk import Route
from gaitopt.retiming.reserves import FRICTION_SLACK, PLANNED_SHARE, tightened

TRUST = 0.2
"""Largest change of the body's acceleration, in units of gravity: what a path asks of the ground is
known to first order near the given one."""
ROUNDS = 2
"""Rounds, each near the motion of the one before. 16 steps of go2 take 2.39 s with none, 2.15 s
with one, 2.11 s with two and 2.10 s with three (``swing``, seed 0)."""
BARRIER = 1e-2
"""Barrier parameter, from the first to the last step: the time is then known to a percent or two,
and the motion keeps away from its limits a little."""
STEPS = 40
"""Most Newton steps of a round; 7 to 40 are usual."""
OUTSIDE = 0.25
"""How far from where it could rest a dynamic walk may be, as a share of the stability margin. With
0 walks of a1 and go2 take 4 % longer; with 0.5 one of hyq has no forces."""
BEGIN_SHARE = 0.95
"""Share of the fastest squared speeds along the given path with which the method begins."""
LEAST_ROOM = 0.1
"""Where rows leave less room at rest than this, in units of length, they are taken to leave so much
when those speeds are looked for."""
LEAST_BEGIN = 0.05
"""Least squared speed to begin with."""
SWEPT_SHARE = 0.999
"""Share of largest squared speeds that the sweeps use."""


class PacedMotion(NamedTuple):
    """A motion, and the solution that it comes from."""

    motion: SplineMotion
    solution: Solution[PacedPathProblem]


def faster(route: Route, motion: SplineMotion) -> PacedMotion | None:
    """A motion with a path of the body along which it can be followed faster.

    Margin, reach and forces are kept to first order. ``None`` where no such motion is found.

    Args:
        route: the walk.
        motion: a motion that keeps balance, with all feet within reach.
    """
    asked = Asked.of(route, motion)
    if asked is None:
        return None
    problem, squares = build_paced_path(route, motion, asked)
    start = problem.start(squares)
    solution = minimise(problem, start, barrier=BARRIER, least_barrier=BARRIER,
                        iteration_limit=STEPS)  # fmt: skip
    if not problem.duration(solution.x) < problem.duration(start):
        return None
    poses = motion.poses.copy()
    poses[:, :2] = problem.moved(solution.x)
    found = replace(motion, poses=poses)
    return PacedMotion(found, solution) if out_of_reach(found) is None else None


def build_paced_path(
    route: Route, motion: SplineMotion, asked: Asked
) -> tuple[PacedPathProblem, FloatArray]:
    """The problem near a motion, and squared speeds where spans begin, to begin with ``(K,)``.

    Rows that the motion does not keep at these speeds may be missed as much as it misses them.

    Args:
        route: the walk.
        motion: with all feet within reach.
        asked: what it asks of the ground.
    """
    unit, margin = length_unit(route), route.settings.stability_margin
    both = (_normal_rows, _friction_rows)
    forces = PacedRows.joined([of(route, motion, asked, end) for of in both for end in (0, 1)])
    squares = _fastest(motion, forces, asked.tops, LEAST_ROOM * unit)
    begin = np.maximum(BEGIN_SHARE * squares, LEAST_BEGIN)
    ends = np.stack([begin, np.append(begin[1:], begin[-1])], axis=1)
    missed = np.minimum(forces.values(np.diff(ends)[:, 0] / (2.0 * motion.spans), ends), 0.0)
    forces = forces._replace(rest=forces.rest - missed)
    static = _margin_rows(route, motion) if route.settings.static else _near_rest(forces, margin)
    rows = [forces, _trust_rows(motion, ends.max(axis=1), unit), static]
    tops = np.append(asked.tops[:1, 0], np.minimum(asked.tops[:-1, 1], asked.tops[1:, 0]))
    problem = PacedPathProblem(
        points=motion.poses[:, :2], spans=motion.spans, rows=PacedRows.joined(rows),
        discs=reach_discs(route, motion), tops=np.maximum(tops, begin), unit=unit,
    )  # fmt: skip
    return problem, begin


def _fastest(
    motion: SplineMotion, rows: PacedRows, tops: FloatArray, least_room: float
) -> FloatArray:
    """Squared speeds where spans begin of the fastest timing along a motion, within rows ``(K,)``.

    Args:
        motion: the motion.
        rows: of forces; of those that leave less room at rest, ``least_room`` [m] is left.
        tops: largest squared speeds at both ends of spans ``(K, 2)``.
        least_room: [m].
    """
    count, sides = len(motion.spans), []
    planes = -np.stack([rows.by_u, rows.by_x], axis=1) / np.maximum(rows.rest, least_room)[:, None]
    for end in (0, 1):
        own = rows.end == end
        sides.append(RowGroups.of(rows.span[own], count).padded(planes[own]))
    steps = 2.0 * motion.spans
    steps[[0, -1]] = 0.0
    intervals = SweptIntervals(
        sides[0], sides[1], steps, tops[:, 0], tops[:, 1], np.array([0, count])
    )
    found = swept(intervals, SWEPT_SHARE)[0]
    return np.append(found[1:2], found[1:])


def _weights(motion: SplineMotion, end: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Weights of control points in the place and its derivatives, at an end of spans ``(K, 3)``."""
    square, linear, fixed = parabola_weights(motion.spans)
    t = end * motion.spans[:, None]
    return (square * t + linear) * t + fixed, 2.0 * square * t + linear, 2.0 * square


def _along(weights: FloatArray, normal: FloatArray) -> FloatArray:
    """Of the shifts of control points with weights ``(M, 3)``, along normals ``(M, 2)``."""
    return (weights[:, :, None] * normal[:, None]).reshape(-1, 6)


def _normal_rows(route: Route, motion: SplineMotion, asked: Asked, end: int) -> PacedRows:
    """Rows of normal forces at an end of spans.

    About a side of the support polygon only feet that are not on it make a moment. It is at least
    that of the least normal forces, or what leaves the ZMP a share of the stability margin.
    """
    knots, sides = motion.knots, support_on_spans(motion.knots)
    span, normal = sides.knot, sides.normal
    stands = knots.flying_on_spans.stands
    share = _limits(route).least_normal_shares(stands).max(axis=1)
    away = np.einsum("mki,mi->mk", knots.feet[span][..., :2], normal) - sides.offset[:, None]
    least = share[span] * (away * stands[span]).sum(axis=1)
    least = np.maximum(least, FORCE_ZMP_SHARE * route.settings.stability_margin)
    at = 2 * span + end
    by_u, by_x, rest = (
        np.einsum("mij,mi->mj", asked.moment[at], normal)
        - sides.offset[:, None] * asked.force[at, 2]
    ).T
    place, first, second = (_along(w[span], normal) for w in _weights(motion, end))
    pendulum = (asked.moved * asked.height[at] / GRAVITY)[:, None]
    return PacedRows(span, np.full(len(span), end), by_u, by_x, rest - least,
                     asked.moved * place, -pendulum * first, -pendulum * second)  # fmt: skip


def _friction_rows(route: Route, motion: SplineMotion, asked: Asked, end: int) -> PacedRows:
    """Rows of the friction of all feet together at an end of spans.

    Each foot has the normal and the friction of its foothold. What is asked is shared among
    standing feet evenly.
    """
    count, stands = len(motion.spans), motion.knots.flying_on_spans.stands
    feet = stands.sum(axis=1)
    pyramids = _pyramids(route, motion)
    pyramid = (pyramids * stands[:, :, None, None]).sum(axis=1) / feet[:, None, None]
    pyramid = pyramid @ rotation_z(motion.heading)
    span = np.repeat(np.arange(count), pyramid.shape[1])
    normal = pyramid.reshape(-1, 3)
    # As lengths: times the height of the centre of mass.
    height = float(asked.height.mean())
    by_u, by_x, rest = height * np.einsum("mij,mi->mj", asked.force[2 * span + end], normal).T
    _, first, second = (_along(w[span], normal[:, :2]) for w in _weights(motion, end))
    pendulum = asked.moved * height / GRAVITY
    return PacedRows(span, np.full(len(span), end), by_u, by_x,
                     rest - height * FRICTION_SLACK * feet[span],
                     np.zeros_like(first), pendulum * first, pendulum * second)  # fmt: skip


def _pyramids(route: Route, motion: SplineMotion) -> FloatArray:
    """Friction pyramids of all feet on each span, in the world ``(K, 4, sides, 3)``.

    Those of feet in the air are those of the footholds that they leave.

    Args:
        route: the whole walk.
        motion: its motion.
    """
    knots = motion.knots
    steps = np.eye(len(LEGS), dtype=int)[route.steps.indices]
    before = np.cumsum(steps, axis=0) - steps
    # The span of the last knot belongs to the last step.
    stands = before[np.append(knots.step, knots.step[-1])]
    below = ground_on(route.footholds, stands, _promised(route).friction)
    up = np.broadcast_to(below.normals, (*stands.shape, 3))
    return pyramid_rows(_limits(route), up, np.broadcast_to(below.grip, stands.shape))


def _limits(route: Route) -> ForceLimits:
    """The limits with which timings are found."""
    return tightened(_promised(route), PLANNED_SHARE)


def _promised(route: Route) -> ForceLimits:
    return ForceLimits.or_default(route.settings.promised_forces)


def _trust_rows(motion: SplineMotion, squares: FloatArray, unit: float) -> PacedRows:
    """Rows that bound the change of the body's acceleration, by x and y, in both directions.

    Args:
        motion: the motion.
        squares: of the speeds on each span ``(K,)``.
        unit: that these rows have as lengths [m].
    """
    count = len(motion.spans)
    change = _weights(motion, 0)[2] * (unit * squares / (TRUST * GRAVITY))[:, None]
    normals = np.concatenate([np.eye(2), -np.eye(2)])
    span, normal = np.repeat(np.arange(count), 4), np.tile(normals, (count, 1))
    by_place, still = _along(change[span], normal), np.zeros(len(span))
    return PacedRows(span, np.zeros(len(span), dtype=int), still, still, np.full(len(span), unit),
                     by_place, np.zeros_like(by_place), np.zeros_like(by_place))  # fmt: skip


def _near_rest(forces: PacedRows, margin: float) -> PacedRows:
    """Rows that keep the robot near to where it could rest, as far as it is.

    Args:
        forces: rows of forces; with places of the body they change as they do at rest.
        margin: the stability margin [m].
    """
    still = np.zeros(len(forces.span))
    none = np.zeros_like(forces.by_place)
    room = np.maximum(forces.rest + OUTSIDE * margin, 0.0)
    return PacedRows(forces.span, forces.end, still, still, room, forces.by_place, none, none)


def _margin_rows(route: Route, motion: SplineMotion) -> PacedRows:
    """Rows of the static margin, at three places of each span."""
    settings, knots = route.settings, motion.knots
    sides = support_on_spans(knots)
    span, normal = sides.knot, sides.normal
    centre = promised_centre(route, motion).centres_of_mass
    standing = np.einsum("mi,i->m", normal, centre[0, 0]) - sides.offset
    wanted = settings.stability_margin + settings.margin_reserve
    in_first = span < knots.phase_ends[1]
    least = np.where(in_first, start_margin(standing, wanted), wanted)
    square, linear, fixed = parabola_weights(motion.spans)
    parts = []
    for sample in LOOKED_AT:
        t = motion.spans[:, None] * (sample / (SAMPLES - 1))
        place = _along(((square * t + linear) * t + fixed)[span], normal)
        rest = np.einsum("mi,mi->m", normal, centre[span, sample]) - sides.offset - least
        none, still = np.zeros_like(place), np.zeros(len(span))
        parts.append(PacedRows(span, np.zeros(len(span), dtype=int), still, still, rest,
                               place, none, none))  # fmt: skip
    return PacedRows.joined(parts)
