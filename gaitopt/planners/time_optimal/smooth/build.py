"""The problem of a smooth walk: bounded joint accelerations, and balance on every span.

A dynamic walk keeps its zero moment point inside the support polygon; any other smooth walk keeps
the body centre or the true centre of mass inside. Where forces set the timing the walk keeps its
ZMP inside as well, which then is that of all links; else it is that of a point mass at the body
centre. The problem looks at knots; :mod:`gaitopt.planners.time_optimal.smooth.between` looks at the
motion between them.
"""

from __future__ import annotations

from dataclasses import fields

import numpy as np

from gaitopt.conventions import GRAVITY, LEGS, FloatArray
from gaitopt.optimize.route.centre_of_mass import ComRows, MassDistribution
from gaitopt.optimize.route.dynamic_layout import LEAST_SPAN, ZmpRows
from gaitopt.optimize.route.dynamic_problem import DynamicRouteProblem
from gaitopt.optimize.route.layout import TIME_UNIT_ROTATION, Rows
from gaitopt.optimize.route.legs import JOINTS, POSE
from gaitopt.optimize.route.problem import RouteProblem
from gaitopt.plan.settings.time_optimal import RouteSettings
from gaitopt.planners.time_optimal.flights import Flights
from gaitopt.planners.time_optimal.knots import RouteKnots
from gaitopt.planners.time_optimal.support import support_on_spans
from gaitopt.planners.time_optimal.walk import Route
from gaitopt.robots.abilities import FORCE_TIME_SHARE
from gaitopt.robots.quadruped import Quadruped

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
FORCE_ZMP_SHARE = 0.4
"""Share of the stability margin that the ZMP of all links keeps where forces set the timing. It
leaves the least normal forces that a plan promises, and something for friction."""
COM_RESERVE = 2e-5
"""Length that is added to the margin of the centre of mass where forces set the timing [m]. Between
control points it leaves the polygon of theirs by a little, as it depends on angles."""
LEAST_LOAD_SHARE = 0.2
"""Share of the weight that the ground bears at least, where joints are fast enough for less."""
DYNAMIC_QUADRATIC_WEIGHT = 3.0
"""Factor by which the quadratic term in the times has more weight in a dynamic walk, and in windows
of a walk whose timing forces set."""
STATIC_QUADRATIC_WEIGHT = 0.3
"""The same factor of other walks whose timing forces set."""


LEVEL_LEAST_SPAN, RISING_LEAST_SPAN = 0.003, 0.004
"""Shortest spans of walks with a body that is level and at one height, and of those with a level
body at any height, whose timing forces set, in time units. Half of their stances take no time
without forces: with 0.01 they take 30 ms, and walks of wang2020 0.7 % longer. In ``height`` 0.003
makes 64 steps 0.1 % faster than 0.004, and a knee reached 162 % of its velocity limit in physics: a
foot that was 8 ms late was missing as another left 6 ms after its touch-down. ``posture`` comes out
3 % slower."""


def build_smooth(base: RouteProblem, knots: RouteKnots, route: Route) -> DynamicRouteProblem:
    """The problem with bounded joint accelerations, on the knots of one without.

    Args:
        base: the problem without acceleration limits; its rows of the support polygon are replaced
            by others.
        knots: its knots.
        route: the walk.
    """
    settings, limit = route.settings, route.acceleration_limit
    dynamic = settings.free.dynamic
    rows = base.rows
    if not settings.true_com:
        rows = rows.chosen(np.abs(rows.linear[:, :2]).sum(axis=1) == 0)
    zmp, com = _balance_rows(base, knots, settings, route.robot), None
    least_unit = 0.0
    if settings.forces:
        # Forces, and not the joints, set the times of robots with fast joints.
        least_unit = FORCE_TIME_SHARE * float(np.sqrt(base.legs.reach.max() / GRAVITY))
        if not dynamic:
            rows, com = _static_rows(rows, base, knots, route)
    elif dynamic:
        # The time that a joint takes from rest to rest for the rotation of a unit of time.
        least_unit = 2.0 * float(np.sqrt(TIME_UNIT_ROTATION / limit))
    time_unit, quadratic_weight = max(base.time_unit, least_unit), base.quadratic_weight
    if dynamic or settings.forces:
        whole = not dynamic and settings.horizon is None
        quadratic_weight *= STATIC_QUADRATIC_WEIGHT if whole else DYNAMIC_QUADRATIC_WEIGHT
        rises = settings.free.height or settings.free.posture
        if rises and limit * base.legs.reach.max() > (1.0 - LEAST_LOAD_SHARE) * GRAVITY:
            zmp = ZmpRows.joined([zmp, _load_rows(base.knots)])
    elif not settings.true_com:
        rows = _with_centre_rows(rows, zmp)
        zmp = zmp.chosen(np.zeros(0, dtype=int))
    shared = {f.name: getattr(base, f.name) for f in fields(RouteProblem)}
    shared |= {"rows": rows, "time_unit": time_unit, "quadratic_weight": quadratic_weight}
    # Where there are none here, they are among those of the ZMP, with infinite gravity.
    shared["com"] = com
    # Where forces set the timing joints may be too fast here: only the path is used.
    shares = (1.0, 1.0) if settings.forces else (FIRST_ACCELERATION_SHARE, FIRST_VELOCITY_SHARE)
    return DynamicRouteProblem(
        **shared,
        acceleration_limits=np.tile(shares[0] * turn_limits(route, knots)[:, None], (2, 1, JOINTS)),
        interval_velocity_limits=np.tile(shares[1] * base.velocity_limits, (2, base.knots - 1, 1)),
        zmp=zmp,
        least_span=_least_span(settings),
    )


def _least_span(settings: RouteSettings) -> float:
    """Shortest span in time units."""
    free = settings.free
    whole = settings.forces is not None and settings.horizon is None
    if free.dynamic or free.posture or not whole:
        return LEAST_SPAN
    return RISING_LEAST_SPAN if free.height else LEVEL_LEAST_SPAN


def turn_limits(route: Route, knots: RouteKnots) -> FloatArray:
    """Limit of joint accelerations on the span of each knot ``(K,)`` [rad/s^2].

    Where forces set the timing they are lower about lift-offs and touchdowns: loads go over there
    from leg to leg, and add to what the joints of standing legs do.
    """
    out = np.full(len(knots.feet), route.turn_limit)
    flights = Flights.of(knots)
    near = np.concatenate([flights.lift_off, flights.touchdown])[:, None] + [-1, 0, 1]
    out[np.clip(near, 0, len(out) - 1)] = route.acceleration_limit
    return out


def start_margin(standing: FloatArray, wanted: float) -> FloatArray:
    """The margin that is asked for before the first lift-off [m].

    Args:
        standing: with which the robot stands at first, to one or more sides [m].
        wanted: what is asked for later [m].
    """
    return np.asarray(np.where(standing < wanted, START_SHARE * standing, wanted))


def _balance_rows(
    base: RouteProblem, knots: RouteKnots, settings: RouteSettings, robot: Quadruped
) -> ZmpRows:
    """Rows that keep the ZMP inside the support polygon, and the true centre of mass if asked for.

    Where forces set the timing the ZMP keeps a share of the margin only, and the rows of a centre
    are others (:func:`_static_rows`).
    """
    margin, radius = settings.stability_margin, robot.foot_radius
    if not settings.true_com and settings.forces is None:
        return _zmp_rows(knots, margin, base.poses[0, :2], radius)
    joints = base.legs.joints(base.poses, knots.feet, knots.in_air).reshape(-1, len(LEGS), 3)
    com = MassDistribution.of(robot).com(base.poses, joints)[:, :2]
    if settings.forces:
        rows = _zmp_rows(knots, FORCE_ZMP_SHARE * margin, com[0], radius)
    else:
        rows = _zmp_rows(knots, margin, com[0], radius)
        if not settings.free.dynamic:
            rows = rows._replace(gravity=np.full(len(rows.knot), np.inf))
    # A row sees the body centre. In later rounds this is corrected by what the motion really does.
    beside = (rows.normal * (base.poses[:, :2] - com)[rows.knot]).sum(axis=1)
    return rows._replace(offset=rows.offset + beside)


def _zmp_rows(knots: RouteKnots, wanted: float, start: FloatArray, foot_radius: float) -> ZmpRows:
    """Rows that keep the ZMP inside the support polygon on the span of every knot.

    Args:
        knots: of the walk.
        wanted: the margin [m].
        start: centre of mass at the start ``(2,)`` [m].
        foot_radius: how far the ground lies below the footholds [m].
    """
    sides = support_on_spans(knots)
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


def _static_rows(
    rows: Rows, base: RouteProblem, knots: RouteKnots, route: Route
) -> tuple[Rows, ComRows | None]:
    """Rows that keep the promised centre inside the polygon of every span, for forces.

    Returns:
        The rows, with others for the body centre, or rows for the true centre of mass.
    """
    settings, radius = route.settings, route.robot.foot_radius
    if not settings.true_com:
        spans = _zmp_rows(knots, settings.stability_margin, base.poses[0, :2], radius)
        return _with_centre_rows(rows, spans), None
    masses = MassDistribution.of(route.robot)
    joints = base.legs.joints(base.poses[:1], knots.feet[:1], knots.in_air[:1])
    start = masses.com(base.poses[:1], joints.reshape(1, len(LEGS), 3))[0, :2]
    spans = _zmp_rows(knots, settings.stability_margin, start, radius)
    sides = [spans._replace(knot=spans.knot + step) for step in (-1, 0, 1)]
    joined = ZmpRows.joined(sides)
    joined = joined.chosen((joined.knot > 0) & (joined.knot < base.knots))
    # Knots within a phase have its sides from three spans.
    kinds = np.column_stack([joined.knot, joined.normal, joined.least])
    once = np.sort(np.unique(kinds, axis=0, return_index=True)[1])
    kept = joined.chosen(once)
    return rows, ComRows(masses, kept.knot, kept.normal, kept.least + COM_RESERVE)


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
