"""Where the COG may be before a step: Areas A and B of [Wang2020], as outlines.

Every region is the set of places at which some constraints are satisfied, and it is convex. So its
outline is found from a point inside: along each of many rays, bisection finds the place at which
the first constraint is violated.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from gaitopt.conventions import LEGS, FloatArray, leg_index
from gaitopt.errors import InputError
from gaitopt.plan.com_margin import true_com
from gaitopt.plan.phase import Phase
from gaitopt.plan.plan import Plan
from gaitopt.plan.standing_regions import swing_region
from gaitopt.robots.rotations import rpy_to_matrix
from gaitopt.stability.support import shrunken_polygon, support_half_planes
from gaitopt.viewing.figures.common import step_phases

Slack = Callable[[FloatArray], FloatArray]
"""Slack [m] of constraints at COG places ``(n, 2)``, as ``(n,)`` or ``(n, m)``."""

RAYS = 720
"""Rays around a point. Chosen here: half a degree apart, so that outlines look smooth."""
BISECTIONS = 40
"""Bisections on each ray: they find its end to 2^-40 of a few metres."""
TOLERANCE = 2e-9
"""Violation at which a place still counts as inside [m]: twice what the COG optimiser accepts."""
CUT_OFF = 4.0
"""Distance at which outlines are cut off, as a multiple of the longest leg. Chosen here: no place
from which a leg reaches its foot is so far away."""
SWING_SAMPLES = 41
"""Instants of a swing at which the true centre of mass is looked at. Chosen here: a fortieth of a
swing apart."""
GRID = 24
"""Places that are tried in each direction to find one inside. Chosen here: a region that is missed
would be smaller than a 24th of the stance, which cannot be seen."""
EMPTY = np.empty((0, 2))
"""Outline of an empty region."""


@dataclass(frozen=True, eq=False)
class FeasibleArea:
    """The COG problem of one step as regions of the horizontal plane [m].

    Attributes:
        step, leg: index of the step, and the leg that swings.
        start, target: ``O`` and ``O'``, the COG before and after the stance phase ``(2,)``.
        feet: where the four feet stand ``(4, 2)``, in the order of ``LEGS``.
        foothold: where the leg touches down ``(2,)``; ``None`` where no swing follows.
        support: the legs that stand during the swing.
        triangle: corners of the support polygon ``(m, 2)``; empty where fewer than three stand.
        shrunken: corners of Area A ``(k, 2)``; empty where the margin is too large for the polygon.
        held: corners of where contact forces hold the robot ``(k, 2)``, for the body centre; empty
            where the plan promises no forces.
        reach: outlines ``(n, 2)`` of the COG places from which a leg reaches its foot, for each leg
            and for ``"<leg> foothold"``. Area B is their intersection.
        common: outline ``(n, 2)`` of the places that satisfy all constraints; empty if none does.
        active: names of the constraints that are active at the target.
        margin: ``S0`` [m].
        margin_of: what keeps it.
    """

    step: int
    leg: str
    start: FloatArray
    target: FloatArray
    feet: FloatArray
    foothold: FloatArray | None
    support: tuple[str, ...]
    triangle: FloatArray
    shrunken: FloatArray
    held: FloatArray
    reach: dict[str, FloatArray]
    common: FloatArray
    active: tuple[str, ...]
    margin: float
    margin_of: str


def feasible_area(plan: Plan, step: int) -> FeasibleArea:
    """Areas A and B of one step, for the posture and height of the body after the stance phase.

    Source: [Wang2020], eqs. (1)-(10), Figs. 6 and 7.

    Args:
        plan: any plan.
        step: index of the step, from 0.

    Raises:
        InputError: there is no such step.
    """
    stance, swing = step_phases(plan, step)
    phase = stance or swing
    if phase is None:
        raise InputError(f"step {step} has no phases; the plan's phases skip it")
    time = min(phase.end if stance else phase.start, plan.duration)
    feet = plan.at([time]).feet[0]
    places = {leg: feet[leg_index(leg)] for leg in LEGS}
    if swing is not None:
        places[f"{swing.leg} foothold"] = swing.foot_end
    rotation = rpy_to_matrix(plan.path.evaluate(np.array([time]))[0, 3:6]) @ plan.robot.body_axes
    height = float(phase.cog_end[2])
    slacks = {name: reach_slack(plan, name, foot, rotation, height)
              for name, foot in places.items()}  # fmt: skip
    farthest = CUT_OFF * max(leg.reach for leg in plan.robot.legs.values())
    reach = {
        name: outline(slack, _below_hip(plan, name, places[name], rotation)[None], farthest)
        for name, slack in slacks.items()
    }
    margin = plan.settings.stability_margin
    support = swing.support if swing is not None else phase.support
    triangle = np.array([feet[leg_index(leg), :2] for leg in support]).reshape(-1, 2)
    wanted: FloatArray = np.array(margin)
    sides = polygon_slack(triangle, wanted)
    if sides and swing is not None and plan.settings.true_com:
        wanted = margin + _shifts(plan, swing, triangle)
        sides = polygon_slack(triangle, wanted)
    held = EMPTY if swing is None else _held(plan, swing)
    bounds = [b for b in (sides, polygon_slack(held, 0.0)) if b]

    def slack(p: FloatArray) -> FloatArray:
        every = [s(p)[:, None] for s in slacks.values()] + [b(p) for b in bounds]
        return np.asarray(np.concatenate(every, axis=1).min(axis=1))

    shrunken = shrunken_polygon(triangle, wanted) if sides else EMPTY
    ends = np.array([phase.cog_end[:2], phase.cog_start[:2]])
    return FeasibleArea(
        step=int(step),
        leg=phase.leg,
        start=phase.cog_start[:2],
        target=phase.cog_end[:2],
        feet=feet[:, :2],
        foothold=None if swing is None else swing.foot_end[:2],
        support=support,
        triangle=triangle if sides else EMPTY,
        shrunken=shrunken,
        held=held,
        reach=reach,
        common=outline(
            slack, np.vstack([ends, _grid(feet)]), farthest, np.vstack([ends, shrunken, held])
        ),
        active=_active(phase),
        margin=margin,
        margin_of="true centre of mass" if plan.settings.true_com else "body centre",
    )


def _held(plan: Plan, swing: Phase) -> FloatArray:
    """Where contact forces hold the robot during a swing, for the body centre: corners ``(k, 2)``.

    Empty where the plan promises no forces, or lets the body rely on its momentum.
    """
    region = swing_region(plan, swing)
    if region is None or len(region.vertices) < 3:
        return EMPTY
    return shrunken_polygon(region.vertices, _shifts(plan, swing, region.vertices))


def _shifts(plan: Plan, swing: Phase, triangle: FloatArray) -> FloatArray:
    """How much nearer to each side than the body centre the true centre of mass comes ``(k,)`` [m].

    Args:
        plan: the plan.
        swing: during which it comes there.
        triangle: corners of a convex polygon, such as the feet that stand ``(k, 2)`` [m].
    """
    times = np.linspace(swing.start, np.nextafter(swing.end, 0.0), SWING_SAMPLES)
    motion = plan.at(times)
    beside = (true_com(plan.robot, motion.q) - motion.cog)[:, :2]
    return np.asarray(-(beside @ support_half_planes(triangle).normals.T).min(axis=0))


def reach_slack(
    plan: Plan, name: str, foot: FloatArray, rotation: FloatArray, height: float
) -> Slack:
    """The slack of a leg's reach as a function of the COG's place: eqs. (8), (9).

    Args:
        plan: gives the robot and the reach fraction.
        name: the leg, or ``"<leg> foothold"``.
        foot: where the foot stands ``(3,)`` [m].
        rotation: body axes in the world ``(3, 3)``.
        height: of the body centre [m].
    """
    leg = plan.robot.legs[name.split()[0]]
    most = plan.settings.reach_fraction * leg.reach

    def slack(places: FloatArray) -> FloatArray:
        centres = np.column_stack([places, np.full(len(places), height)])
        point = (foot - centres) @ rotation + plan.robot.centre
        return np.asarray(most - np.sqrt(leg.straightness(*point.T)))

    return slack


def polygon_slack(corners: FloatArray, margin: ArrayLike) -> Slack | None:
    """The slack of the margin as a function of the COG's place, ``(n, m)`` [m]: eq. (1).

    Args:
        corners: of the support polygon ``(m, 2)`` [m].
        margin: distance from its sides that is asked for [m], one for all or one for each.

    Returns:
        The function; ``None`` for feet that support no area.
    """
    if len(corners) < 3:
        return None
    try:
        planes = support_half_planes(corners)
    except InputError:
        return None
    wanted = np.asarray(margin)
    return lambda places: np.asarray(places @ planes.normals.T - planes.offsets - wanted)


def outline(
    slack: Slack, candidates: FloatArray, farthest: float, corners: FloatArray = EMPTY
) -> FloatArray:
    """Outline of the region where ``slack`` is not negative.

    Args:
        slack: from places ``(n, 2)`` to ``(n,)`` [m], concave.
        candidates: places one of which may be inside ``(k, 2)`` [m].
        farthest: distance at which an unbounded region is cut off [m].
        corners: places of possible corners ``(m, 2)`` [m]; rays go through them, too.

    Returns:
        ``(n, 2)`` counter-clockwise [m]; empty where no candidate is inside.
    """
    values = slack(candidates)
    if not values.max() >= -TOLERANCE:
        return EMPTY
    angles = np.linspace(-np.pi, np.pi, RAYS, endpoint=False)
    # The best candidate may lie on the border, where half of the rays have no length. So rays begin
    # in the middle of the outline that is seen from there.
    middle = _ray_ends(slack, candidates[np.argmax(values)], angles, farthest).mean(axis=0)
    to_corners = np.arctan2(*(corners - middle).T[::-1])
    return _ray_ends(slack, middle, np.union1d(angles, to_corners), farthest)


def _ray_ends(slack: Slack, origin: FloatArray, angles: FloatArray, farthest: float) -> FloatArray:
    """Where rays from ``origin (2,)`` at ``angles (n,)`` [rad] leave the region ``(n, 2)`` [m]."""
    rays = np.column_stack([np.cos(angles), np.sin(angles)])
    low, high = np.zeros(len(rays)), np.full(len(rays), farthest)
    for _ in range(BISECTIONS):
        middle = (low + high) / 2.0
        inside = slack(origin + middle[:, None] * rays) >= -TOLERANCE
        low, high = np.where(inside, middle, low), np.where(inside, high, middle)
    return np.asarray(origin + low[:, None] * rays)


def _below_hip(plan: Plan, name: str, foot: FloatArray, rotation: FloatArray) -> FloatArray:
    """The COG's place ``(2,)`` at which a leg's pitch axis is above ``foot (3,)``."""
    leg = plan.robot.legs[name.split()[0]]
    hip = leg.hip + leg.lateral * leg.axes[:, 1] - plan.robot.centre
    return np.asarray((foot - rotation @ hip)[:2])


def _grid(feet: FloatArray) -> FloatArray:
    """A grid of places in the bounding box of the feet ``(n, 2)``."""
    low, high = feet[:, :2].min(axis=0), feet[:, :2].max(axis=0)
    share = (np.arange(GRID) + 0.5) / GRID
    x, y = np.meshgrid(*(low[i] + (high[i] - low[i]) * share for i in range(2)))
    return np.column_stack([x.ravel(), y.ravel()])


def _active(phase: Phase) -> tuple[str, ...]:
    """Names of the constraints that are active at a phase's COG target."""
    kinds = ("margin", "forces", "reach")
    return tuple(f"{m.kind} {m.name}" for m in phase.limited_by if m.kind in kinds)
