"""Routes with bounded joint accelerations, and with the ZMP inside the shrunken support polygon.

The ZMP is that of a point mass at the body centre. Without it (acceleration limits alone) the body
centre itself keeps its margin. The problem sees knots; what the motion asks for between them is
:mod:`gaitopt.planners.time_optimal.smooth.between`'s.
"""

from __future__ import annotations

from dataclasses import fields
from typing import TYPE_CHECKING

import numpy as np

from gaitopt.conventions import GRAVITY, LEGS, OTHER_LEGS, FloatArray, rotation_z
from gaitopt.optimize.route.dynamic_layout import ZmpRows
from gaitopt.optimize.route.dynamic_problem import DynamicRouteProblem
from gaitopt.optimize.route.layout import TIME_UNIT_ROTATION, Rows
from gaitopt.optimize.route.legs import JOINTS, POSE
from gaitopt.optimize.route.problem import RouteProblem
from gaitopt.plan.phase import Phase
from gaitopt.plan.settings.time_optimal import RouteSettings
from gaitopt.planners.time_optimal.knots import RouteKnots
from gaitopt.planners.time_optimal.smooth.motion import RouteMotion
from gaitopt.stability.support import pair_lines, triangle_half_planes

if TYPE_CHECKING:
    from gaitopt.planners.phase_by_phase.steps import CrawlSteps

ACCELERATION_SHARE, VELOCITY_SHARE = 0.85, 0.97
"""Shares of the limits that knots use to begin with: more is asked between them."""
ZMP_RESERVE = 2e-3
"""Added to the margin that knots keep, to begin with [m]."""
STATIC_RESERVE = 2e-5
"""The same for the body centre itself, whose spline never leaves its control points [m]."""
FIRST_SHARE = 0.5
"""Share of its own margin that a robot keeps before the first lift-off, where it stands with less
than is asked for: to move in, its ZMP first has to move out."""
LEAST_LOAD = 0.2
"""Share of the weight that the ground bears at least, where legs are quick enough for less."""
QUADRATIC_WEIGHT = 3.0
"""How much more alike a dynamic walk's spans are kept than the static problem's times."""


def build_dynamic(
    base: RouteProblem,
    knots: RouteKnots,
    settings: RouteSettings,
    poses: FloatArray,
    foot_radius: float = 0.0,
) -> DynamicRouteProblem:
    """The problem with accelerations over the knots of one without.

    Args:
        base: the static problem; for a dynamic walk its rows of margins are left out.
        knots, settings: of the walk.
        poses: first guess ``(K, 9)``.
        foot_radius: how far the ground lies below the feet's frames [m].
    """
    dynamic = settings.free.dynamic
    margins = np.abs(base.rows.linear[:, :2]).sum(axis=1) > 0
    rows = base.rows.chosen(~margins)
    zmp = _zmp_rows(knots, settings, len(poses))
    zmp = _eased(zmp._replace(ground=zmp.ground - foot_radius), knots, settings, poses[0, :2])
    assert settings.acceleration_limit is not None
    if not dynamic:
        rows = _with_margins(rows, zmp)
        zmp = zmp.chosen(np.zeros(0, dtype=int))
    elif settings.acceleration_limit * base.legs.reach.max() > (1.0 - LEAST_LOAD) * GRAVITY:
        zmp = _with_load(zmp, len(poses))
    shared = {f.name: getattr(base, f.name) for f in fields(RouteProblem)}
    quadratic_weight = (QUADRATIC_WEIGHT if dynamic else 1.0) * base.quadratic_weight
    unit = base.time_unit
    if dynamic:
        # From rest to rest a joint takes so long for the turn that is a unit's at full speed.
        unit = max(unit, 2.0 * float(np.sqrt(TIME_UNIT_ROTATION / settings.acceleration_limit)))
    shared |= {
        "rows": rows,
        "poses": poses,
        "quadratic_weight": quadratic_weight,
        "time_unit": unit,
    }
    return DynamicRouteProblem(
        **shared,
        acceleration_limits=np.full(
            (2, base.knots, JOINTS), ACCELERATION_SHARE * settings.acceleration_limit
        ),
        interval_velocity_limits=np.tile(
            VELOCITY_SHARE * base.velocity_limits, (2, base.knots - 1, 1)
        ),
        zmp=zmp,
    )


def first_margin(room: FloatArray, asked: float) -> FloatArray:
    """The margin that is asked for before the first lift-off [m].

    Args:
        room: what the robot has where it stands at first [m].
        asked: of all that follows [m].
    """
    return np.asarray(np.where(room < asked, FIRST_SHARE * room, asked))


def _eased(rows: ZmpRows, knots: RouteKnots, settings: RouteSettings, start: FloatArray) -> ZmpRows:
    """Rows that ask no more of the first stance phase than the robot can do from its ``start``."""
    asked, first = settings.stability_margin, rows.knot < knots.ends[1]
    room = rows.normal @ start - (rows.least - asked)
    less = np.where(first, asked - first_margin(room, asked), 0.0)
    spare = np.where(less > 0.0, 0.0, rows.offset - rows.least)
    return rows._replace(least=rows.least - less, offset=rows.least - less + spare)


def _with_margins(rows: Rows, spans: ZmpRows) -> Rows:
    """Rows that keep the body centre itself inside the polygon of every span.

    A quadratic B-spline lies, on each span, within the triangle of three control points; all of
    them keep the span's rows.
    """
    at = np.concatenate([spans.knot + step for step in (-1, 0, 1)])
    linear = np.zeros((len(at), POSE))
    linear[:, :2] = np.tile(spans.normal, (3, 1))
    added = Rows(at, linear, np.zeros_like(linear), np.tile(-STATIC_RESERVE - spans.least, 3))
    inside = (at > 0) & (at <= int(spans.knot.max(initial=0)))
    return Rows.joined([rows, added.chosen(inside)])


def _zmp_rows(knots: RouteKnots, settings: RouteSettings, count: int) -> ZmpRows:
    """The support polygon of every knot's span."""
    flies = np.zeros(count, dtype=bool)
    leg = np.zeros(count, dtype=int)
    for a, b in zip(knots.ends[1::2].tolist(), knots.ends[2::2].tolist(), strict=True):
        flies[a : b + 1], leg[a : b + 1] = True, knots.leg[a]
    at = np.flatnonzero(flies)
    others = OTHER_LEGS[leg[at]]
    corners = np.take_along_axis(knots.feet[at], others[..., None], axis=1)[..., :2]
    normals, offsets = triangle_half_planes(corners)
    standing = np.flatnonzero(~flies)
    lines, heights, sides = pair_lines(knots.feet[standing][:, :, :2])
    which, side = np.nonzero(sides)
    knot = np.concatenate([np.repeat(at, 3), standing[which]])
    normal = np.concatenate([normals.reshape(-1, 2), lines[which, side]])
    least = np.concatenate([offsets.ravel(), heights[which, side]]) + settings.stability_margin
    stands = np.where(flies[:, None] & (np.arange(4) == leg[:, None]), np.nan, 1.0)
    ground = np.nanmean(knots.feet[..., 2] * stands, axis=1)
    rows = ZmpRows(knot, normal, least + ZMP_RESERVE, ground[knot], least,
                   np.full(len(knot), GRAVITY))  # fmt: skip
    return ZmpRows.joined([rows])


def _with_load(rows: ZmpRows, count: int) -> ZmpRows:
    """Rows by which the body never falls so fast that its feet bear less than their share.

    With no normal and the offset -1 a row says that the load is not negative, and with less
    gravity that some of it is left.
    """
    one, none = -np.ones(count), np.zeros(count)
    load = ZmpRows(np.arange(count), np.zeros((count, 2)), one, none, one,
                   np.full(count, (1.0 - LEAST_LOAD) * GRAVITY))  # fmt: skip
    return ZmpRows.joined([rows, load])


def dynamic_phases(
    settings: RouteSettings, steps: CrawlSteps, motion: RouteMotion
) -> tuple[Phase, ...]:
    """A stance and a swing phase for every step; a dynamic walk's margins are its ZMP's."""
    to_world = rotation_z(settings.heading).T
    margins = motion.margins(settings.free.dynamic)
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
