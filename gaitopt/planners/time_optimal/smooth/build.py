"""The problem of a smooth walk: bounded joint accelerations, and balance on every span.

A dynamic walk keeps its zero moment point inside the support polygon. It is that of a point mass at
the body centre. Any other smooth walk keeps the body centre itself inside. The problem looks at
knots; :mod:`gaitopt.planners.time_optimal.smooth.between` looks at the motion between them.
"""

from __future__ import annotations

from dataclasses import fields

import numpy as np

from gaitopt.conventions import GRAVITY, FloatArray
from gaitopt.optimize.route.dynamic_layout import ZmpRows
from gaitopt.optimize.route.dynamic_problem import DynamicRouteProblem
from gaitopt.optimize.route.layout import TIME_UNIT_ROTATION, Rows
from gaitopt.optimize.route.legs import JOINTS, POSE
from gaitopt.optimize.route.problem import RouteProblem
from gaitopt.plan.settings.time_optimal import RouteSettings
from gaitopt.planners.time_optimal.knots import RouteKnots
from gaitopt.planners.time_optimal.support import support_on_spans

FIRST_ACCELERATION_SHARE, FIRST_VELOCITY_SHARE = 0.85, 0.97
"""Limits in rows of the first round, as shares of the joints' limits: more is asked for between
knots than at them."""
FIRST_ZMP_RESERVE = 2e-3
"""Length that is added to the margin of the ZMP in rows of the first round [m]."""
STATIC_RESERVE = 2e-5
"""The same for the body centre itself, in all rounds [m]. It may be small: the body centre never
leaves the convex hull of its control points."""
START_SHARE = 0.5
"""Share of the margin with which the robot stands at first that is asked for until the first
lift-off, where this margin is less than what is asked for later.

To move toward the middle its body accelerates, and so its ZMP has to move outward first.
"""
LEAST_LOAD_SHARE = 0.2
"""Share of the weight that the ground bears at least, where joints are fast enough for less."""
DYNAMIC_QUADRATIC_WEIGHT = 3.0
"""Factor by which the quadratic term in the times has more weight in a dynamic walk."""


def build_smooth(
    base: RouteProblem, knots: RouteKnots, settings: RouteSettings, foot_radius: float
) -> DynamicRouteProblem:
    """The problem with bounded joint accelerations, on the knots of one without.

    Args:
        base: the problem without acceleration limits; its rows of the support polygon are replaced
            by others.
        knots: its knots.
        settings: of the walk.
        foot_radius: how far the ground lies below the footholds [m].
    """
    dynamic = settings.free.dynamic
    assert settings.acceleration_limit is not None
    balance = np.abs(base.rows.linear[:, :2]).sum(axis=1) > 0
    rows = base.rows.chosen(~balance)
    zmp = _zmp_rows(knots, settings, base.poses[0, :2], foot_radius)
    time_unit, quadratic_weight = base.time_unit, base.quadratic_weight
    if dynamic:
        # The time that a joint takes from rest to rest for the rotation of a unit of time.
        slowest = 2.0 * float(np.sqrt(TIME_UNIT_ROTATION / settings.acceleration_limit))
        time_unit = max(time_unit, slowest)
        quadratic_weight *= DYNAMIC_QUADRATIC_WEIGHT
        if settings.acceleration_limit * base.legs.reach.max() > (1.0 - LEAST_LOAD_SHARE) * GRAVITY:
            zmp = ZmpRows.joined([zmp, _load_rows(base.knots)])
    else:
        rows = _with_centre_rows(rows, zmp)
        zmp = zmp.chosen(np.zeros(0, dtype=int))
    shared = {f.name: getattr(base, f.name) for f in fields(RouteProblem)}
    shared |= {"rows": rows, "time_unit": time_unit, "quadratic_weight": quadratic_weight}
    return DynamicRouteProblem(
        **shared,
        acceleration_limits=np.full(
            (2, base.knots, JOINTS), FIRST_ACCELERATION_SHARE * settings.acceleration_limit
        ),
        interval_velocity_limits=np.tile(
            FIRST_VELOCITY_SHARE * base.velocity_limits, (2, base.knots - 1, 1)
        ),
        zmp=zmp,
    )


def start_margin(standing: FloatArray, wanted: float) -> FloatArray:
    """The margin that is asked for before the first lift-off [m].

    Args:
        standing: with which the robot stands at first, to one or more sides [m].
        wanted: what is asked for later [m].
    """
    return np.asarray(np.where(standing < wanted, START_SHARE * standing, wanted))


def _zmp_rows(
    knots: RouteKnots, settings: RouteSettings, start: FloatArray, foot_radius: float
) -> ZmpRows:
    """Rows that keep the ZMP inside the support polygon on the span of every knot.

    Args:
        knots, settings: of the walk.
        start: body centre at the start ``(2,)`` [m].
        foot_radius: how far the ground lies below the footholds [m].
    """
    sides, wanted = support_on_spans(knots), settings.stability_margin
    least = sides.offset + wanted
    offset = least + FIRST_ZMP_RESERVE
    ground = knots.ground_on_spans[sides.knot] - foot_radius
    # In the first stance phase no more is asked for than what the robot can do from its start.
    standing = sides.normal @ start - (least - wanted)
    in_first_phase = sides.knot < knots.phase_ends[1]
    less = np.where(in_first_phase, wanted - start_margin(standing, wanted), 0.0)
    reserve = np.where(less > 0.0, 0.0, offset - least)
    return ZmpRows(
        sides.knot, sides.normal, least - less + reserve, ground, least - less,
        np.full(len(sides.knot), GRAVITY),
    )  # fmt: skip


def _load_rows(knots: int) -> ZmpRows:
    """Rows by which the body never falls so fast that its feet bear less than their least load.

    A row without a normal and with the offset -1 says that the vertical acceleration is at least
    minus its gravity. With less gravity than there is some load is left.
    """
    one, none = -np.ones(knots), np.zeros(knots)
    gravity = np.full(knots, (1.0 - LEAST_LOAD_SHARE) * GRAVITY)
    return ZmpRows(np.arange(knots), np.zeros((knots, 2)), one, none, one, gravity)


def _with_centre_rows(rows: Rows, spans: ZmpRows) -> Rows:
    """The rows, with others that keep the body centre itself inside the polygon of every span.

    On each span a quadratic B-spline lies within the triangle of three control points: that of the
    span, the one before and the one after. All three keep the sides of the span's polygon.
    """
    knot = np.concatenate([spans.knot + step for step in (-1, 0, 1)])
    linear = np.zeros((len(knot), POSE))
    linear[:, :2] = np.tile(spans.normal, (3, 1))
    added = Rows(knot, linear, np.zeros_like(linear), np.tile(-STATIC_RESERVE - spans.least, 3))
    exists = (knot > 0) & (knot <= int(spans.knot.max(initial=0)))
    return Rows.joined([rows, added.chosen(exists)])
