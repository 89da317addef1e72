"""Routes with bounded joint accelerations, and with the ZMP inside the shrunken support polygon.

The ZMP is that of a point mass at the body centre. Without it (acceleration limits alone) the body
centre itself keeps its margin. The problem sees knots; the smooth motion
through them is measured, and where it asks for more than it may between knots the problem's rows
are tightened. A last small stretch of time takes what is left.
"""

from __future__ import annotations

from dataclasses import fields, replace
from math import comb, perm
from typing import TYPE_CHECKING

import numpy as np

from gaitopt.conventions import LEGS, FloatArray, rotation_z
from gaitopt.optimize.route_dynamics import RouteDynamics, ZmpRows
from gaitopt.optimize.route_legs import POSE
from gaitopt.optimize.route_problem import JOINTS, RouteProblem, Rows
from gaitopt.planning.path import MotionPath
from gaitopt.planning.phase import Phase
from gaitopt.planning.route_knots import RouteKnots
from gaitopt.planning.route_motion import RouteMotion
from gaitopt.planning.route_settings import RouteSettings
from gaitopt.robots.quadruped import Quadruped
from gaitopt.stability.support import pair_lines, triangle_half_planes
from gaitopt.stability.zmp import GRAVITY, point_mass_zmp

if TYPE_CHECKING:
    from gaitopt.planning.crawl import CrawlSteps

ACCELERATION_SHARE, VELOCITY_SHARE = 0.8, 0.95
"""Shares of the limits that knots use to begin with: more is asked between them."""
ZMP_RESERVE = 3e-3
"""Added to the margin that knots keep [m]."""
STATIC_RESERVE = 2e-5
"""The same for the body centre itself, whose spline never leaves its control points [m]."""
EVENNESS = 3.0
"""Weight of the term that keeps spans alike [1/s]."""
MOST_STRETCH = 1.02
"""Most that time is stretched in the end."""
LEAST_TIGHTENING = 1e-4
"""Least by which the margin of a span is raised [m]."""
HASTE = 1.2
"""Exponent by which rows are tightened more than was seen to be needed."""
_LEAST_SHARE = 0.25


def build_dynamic(
    base: RouteProblem,
    knots: RouteKnots,
    settings: RouteSettings,
    poses: FloatArray,
    foot_radius: float = 0.0,
) -> RouteDynamics:
    """The problem with accelerations over the knots of one without.

    Args:
        base: the static problem; for a dynamic walk its rows of margins are left out.
        knots, settings: of the walk.
        poses: first guess ``(K, 9)``.
        foot_radius: how far the ground lies below the feet's frames [m].
    """
    dynamic = "dynamic" in settings.free
    margins = np.abs(base.rows.linear[:, :2]).sum(axis=1) > 0
    rows = Rows(*(part[~margins] for part in base.rows))
    zmp = _zmp_rows(knots, settings, len(poses))
    zmp = zmp._replace(ground=zmp.ground - foot_radius)
    if not dynamic:
        rows = _with_margins(rows, zmp)
        zmp = ZmpRows(zmp.knot[:0], zmp.normal[:0], zmp.offset[:0], zmp.ground[:0], zmp.gravity)
    shared = {f.name: getattr(base, f.name) for f in fields(RouteProblem)}
    shared |= {"rows": rows, "poses": poses, "evenness": EVENNESS}
    assert settings.acceleration_limit is not None
    return RouteDynamics(
        **shared,
        accelerations=np.full(
            (base.knots, JOINTS), ACCELERATION_SHARE * settings.acceleration_limit
        ),
        hurry=np.tile(VELOCITY_SHARE * base.rates, (base.knots - 1, 1)),
        zmp=zmp,
    )


def _with_margins(rows: Rows, spans: ZmpRows) -> Rows:
    """Rows that keep the body centre itself inside the polygon of every span.

    A quadratic B-spline lies, on each span, within the triangle of three control points; all of
    them keep the span's rows.
    """
    at = np.concatenate([spans.knot + step for step in (-1, 0, 1)])
    linear = np.zeros((len(at), POSE))
    linear[:, :2] = np.tile(spans.normal, (3, 1))
    reserve = ZMP_RESERVE - STATIC_RESERVE
    added = Rows(at, linear, np.zeros_like(linear), np.tile(reserve - spans.offset, 3))
    inside = (at > 0) & (at <= int(spans.knot.max(initial=0)))
    parts = [np.concatenate([old, new[inside]]) for old, new in zip(rows, added, strict=True)]
    order = np.argsort(parts[0], kind="stable")
    return Rows(*(part[order] for part in parts))


def _zmp_rows(knots: RouteKnots, settings: RouteSettings, count: int) -> ZmpRows:
    """The support polygon of every knot's span."""
    margin = settings.stability_margin + ZMP_RESERVE
    flies = np.zeros(count, dtype=bool)
    leg = np.zeros(count, dtype=int)
    for a, b in zip(knots.ends[1::2].tolist(), knots.ends[2::2].tolist(), strict=True):
        flies[a : b + 1], leg[a : b + 1] = True, knots.leg[a]
    at = np.flatnonzero(flies)
    others = np.array([[i for i in range(4) if i != k] for k in range(4)])[leg[at]]
    corners = np.take_along_axis(knots.feet[at], others[..., None], axis=1)[..., :2]
    normals, offsets = triangle_half_planes(corners)
    standing = np.flatnonzero(~flies)
    lines, heights, sides = pair_lines(knots.feet[standing][:, :, :2])
    which, side = np.nonzero(sides)
    knot = np.concatenate([np.repeat(at, 3), standing[which]])
    normal = np.concatenate([normals.reshape(-1, 2), lines[which, side]])
    offset = np.concatenate([offsets.ravel(), heights[which, side]]) + margin
    order = np.argsort(knot, kind="stable")
    knot = knot[order]
    stands = np.where(flies[:, None] & (np.arange(4) == leg[:, None]), np.nan, 1.0)
    ground = np.nanmean(knots.feet[..., 2] * stands, axis=1)
    return ZmpRows(knot, normal[order], offset[order], ground[knot], GRAVITY)


def measured(problem: RouteDynamics, motion: RouteMotion) -> tuple[FloatArray, FloatArray]:
    """Use of the velocity and acceleration limits on every span, ``(K, 12)`` each; 1 is full."""
    rates, bends = motion.use()
    return rates / problem.rates, bends


def tightened(
    problem: RouteDynamics, motion: RouteMotion, settings: RouteSettings, stretch: float
) -> RouteDynamics:
    """The problem with less room where the motion through its last answer asks for too much.

    Args:
        problem, motion, settings: of the last answer.
        stretch: how much longer it would have to take, which moves its ZMP.
    """
    limit = float(settings.acceleration_limit or np.inf)
    use, bends = measured(problem, motion)
    over = np.maximum(np.maximum(use[:-1], use[1:]), 1.0) ** HASTE
    hurry = np.maximum(problem.hurry / over, _LEAST_SHARE * problem.rates)
    asked = np.maximum(bends / limit, 1.0) ** HASTE
    accelerations = np.maximum(problem.accelerations / asked, _LEAST_SHARE * limit)
    zmp = problem.zmp
    if "dynamic" in settings.free:
        zmp = _safer(zmp, motion, motion.slower(stretch), settings)
    return replace(problem, hurry=hurry, accelerations=accelerations, zmp=zmp)


def _safer(
    zmp: ZmpRows, motion: RouteMotion, slower: RouteMotion, settings: RouteSettings
) -> ZmpRows:
    """Rows with so much more room at their knots as the ZMP wanders within their spans."""
    wanted = _zmp_rows(motion.knots, settings, len(motion.spans)).offset - ZMP_RESERVE
    along = [
        np.einsum("mi,msi->ms", zmp.normal, m.zero_moment_points()[zmp.knot])
        for m in (motion, slower)
    ]
    least = np.minimum(along[0].min(axis=1), along[1].min(axis=1))
    # What the problem sees is the body centre's control point, with the span's acceleration.
    centre, pull = motion.poses[zmp.knot, :3], 2.0 * motion.pieces[0, zmp.knot, :3]
    seen = point_mass_zmp(centre, pull, zmp.ground)
    wander = (zmp.normal * seen).sum(axis=1) - least
    offset = np.maximum(zmp.offset, wanted + wander + LEAST_TIGHTENING)
    return zmp._replace(offset=np.where(least < wanted, offset, zmp.offset))


def stretch_needed(problem: RouteDynamics, motion: RouteMotion, limit: float) -> float:
    """How much longer the motion must take for all joints to keep their limits, at least 1."""
    use, bends = measured(problem, motion)
    return float(max(1.0, use.max(), np.sqrt(bends.max() / limit)))


def exact_path(
    motion: RouteMotion, problem: RouteDynamics, limit: float
) -> tuple[RouteMotion, MotionPath]:
    """The motion's path, slowed until every piece of it keeps the joints' limits.

    Raises:
        SolverError: standing feet do not stay in place.
    """
    path = motion.path()
    columns = 6 + np.array([c for leg in LEGS for c in motion.robot.leg_columns[leg]])
    for _ in range(3):
        rates, bends = (_largest(path, k)[:, columns] for k in (1, 2))
        use = max(float((rates / problem.rates).max()), float(np.sqrt(bends.max() / limit)))
        if use <= 1.0:
            break
        motion = motion.slower(use * (1.0 + 1e-5))
        path = motion.path()
    return motion, path


def _largest(path: MotionPath, order: int) -> FloatArray:
    """Bound on the size of a derivative on every piece ``(P, n)``: its Bernstein coefficients."""
    powers, lengths = path.coefficients[::-1], np.diff(path.times)[:, None]
    scaled = [
        perm(k, order) * powers[k] * lengths ** (k - order) for k in range(order, len(powers))
    ]
    d = len(scaled) - 1
    rows = [sum(comb(i, k) / comb(d, k) * scaled[k] for k in range(i + 1)) for i in range(d + 1)]
    return np.asarray(np.abs(rows).max(axis=0))


def dynamic_phases(
    settings: RouteSettings, steps: CrawlSteps, motion: RouteMotion
) -> tuple[Phase, ...]:
    """A stance and a swing phase for every step; a dynamic walk's margins are its ZMP's."""
    to_world = rotation_z(settings.heading).T
    margins = motion.margins("dynamic" in settings.free)
    times, ends = motion.times, motion.knots.ends
    count = len(motion.spans)
    at = np.clip(np.arange(count + 1), 0, count - 1)
    centre = motion.pose(times, at)[:, :3] @ to_world
    phases = []
    for s, leg in enumerate(steps.legs):
        i = int(steps.indices[s])
        first = 0 if s == 0 else int(ends[2 * s]) + 1
        lift, land = int(ends[2 * s + 1]), int(ends[2 * s + 2]) + 1
        start, target = steps.feet[s, i] @ to_world, steps.targets[s] @ to_world
        support = tuple(x for x in LEGS if x != leg)
        for a, b, swings in ((first, lift, False), (lift, land, True)):
            phases.append(Phase(
                "swing" if swings else "stance", leg, s, float(times[a]),
                float(times[b] - times[a]), centre[a], centre[b], support if swings else LEGS,
                start, target if swings else start,
                float(margins[a:b].min(initial=np.inf)) if b > a else float(margins[a]),
            ))  # fmt: skip
    return tuple(phases)


def new_motion(
    robot: Quadruped, settings: RouteSettings, knots: RouteKnots, problem: RouteDynamics,
    x: FloatArray, stretch: float = 1.0,
) -> RouteMotion:  # fmt: skip
    """The motion of an answer, taking ``stretch`` times as long."""
    poses, times = problem.unpack(x)
    return RouteMotion(robot, settings.heading, problem.legs, knots, poses,
                       np.append(times, times[-1]) * stretch)  # fmt: skip
