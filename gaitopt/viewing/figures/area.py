"""Where the COG may go before a step: Areas A and B of [Wang2020], as outlines to draw.

All regions are convex seen from a point inside, so that an outline is found by walking out from
there along rays until a constraint stops each one; corners lie on the constraints to rounding,
with no grid in between.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from gaitopt.conventions import LEGS, FloatArray, leg_index
from gaitopt.errors import InputError
from gaitopt.plan.phase import Phase
from gaitopt.plan.plan import Plan
from gaitopt.robots.rotations import rpy_to_matrix
from gaitopt.stability.support import shrunken_polygon, support_half_planes
from gaitopt.viewing.figures.common import step_phases

Slack = Callable[[FloatArray], FloatArray]
"""Slack [m] of constraints at COG places ``(n, 2)``, as ``(n,)`` or ``(n, m)``."""

RAYS = 720
TOLERANCE = 2e-9
"""Violation at which a place still counts as inside: what the COG optimiser leaves [m]."""
NOTHING = np.empty((0, 2))


@dataclass(frozen=True, eq=False)
class FeasibleArea:
    """The COG problem of one step, as places in the horizontal plane [m].

    Attributes:
        step, leg: which step, and the leg that takes it.
        start, target: ``O`` and ``O'``, the COG before and after the stance phase ``(2,)``.
        feet: where the four feet stand ``(4, 2)``, legs in the order of ``LEGS``.
        foothold: where the leg touches down ``(2,)``; ``None`` when no swing follows.
        support: the legs that stand during the swing.
        triangle: corners of the support polygon ``(m, 2)``; empty when fewer than three stand.
        shrunken: Area A ``(k, 2)``; empty where the margin leaves nothing.
        reach: outline ``(n, 2)`` of the COG places from which a foot is within reach, for
            each leg and for ``"<leg> foothold"``: Area B is their intersection.
        common: outline ``(n, 2)`` of the places that meet all constraints; empty if there are none.
        active: names of the constraints that hold the target where it is.
        margin: ``S0`` [m].
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
    reach: dict[str, FloatArray]
    common: FloatArray
    active: tuple[str, ...]
    margin: float


def feasible_area(plan: Plan, step: int) -> FeasibleArea:
    """Areas A and B of one step, with the body turned and raised as it is after the stance phase.

    Source: [Wang2020], eqs. (1)-(10), Figs. 6 and 7.

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
    farthest = 4.0 * max(leg.reach for leg in plan.robot.legs.values())
    reach = {
        name: outline(slack, _below_hip(plan, name, places[name], rotation)[None], farthest)
        for name, slack in slacks.items()
    }
    margin = plan.settings.stability_margin
    support = swing.support if swing is not None else phase.support
    triangle = np.array([feet[leg_index(leg), :2] for leg in support]).reshape(-1, 2)
    sides = polygon_slack(triangle, margin)

    def slack(p: FloatArray) -> FloatArray:
        every = [s(p)[:, None] for s in slacks.values()] + ([sides(p)] if sides else [])
        return np.asarray(np.concatenate(every, axis=1).min(axis=1))

    shrunken = shrunken_polygon(triangle, margin) if sides else NOTHING
    ends = np.array([phase.cog_end[:2], phase.cog_start[:2]])
    return FeasibleArea(
        step=int(step),
        leg=phase.leg,
        start=phase.cog_start[:2],
        target=phase.cog_end[:2],
        feet=feet[:, :2],
        foothold=None if swing is None else swing.foot_end[:2],
        support=support,
        triangle=triangle if sides else NOTHING,
        shrunken=shrunken,
        reach=reach,
        common=outline(
            slack, np.vstack([ends, _grid(feet)]), farthest, np.vstack([ends, shrunken])
        ),
        active=_active(phase),
        margin=margin,
    )


def reach_slack(
    plan: Plan, name: str, foot: FloatArray, rotation: FloatArray, height: float
) -> Slack:
    """By how much a leg is shorter than it may be, for each COG place: eqs. (8), (9).

    Args:
        plan: for the robot and the share of the reach that may be used.
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


def polygon_slack(corners: FloatArray, margin: float) -> Slack | None:
    """Distances inside the sides of the support polygon less ``margin`` ``(n, m)``: eq. (1).

    ``None`` for feet that support no area.
    """
    if len(corners) < 3:
        return None
    try:
        planes = support_half_planes(corners)
    except InputError:
        return None
    return lambda places: np.asarray(places @ planes.normals.T - planes.offsets - margin)


def outline(
    slack: Slack, tries: FloatArray, farthest: float, through: FloatArray = NOTHING
) -> FloatArray:
    """Outline of the region where ``slack`` is not negative.

    Args:
        slack: from places ``(n, 2)`` to ``(n,)`` [m], concave.
        tries: places to look for one inside ``(k, 2)`` [m].
        farthest: distance at which an unbounded region is cut off [m].
        through: places where corners may be, which get rays of their own ``(m, 2)`` [m].

    Returns:
        ``(n, 2)`` counter-clockwise [m]; empty when no try is inside.
    """
    values = slack(tries)
    if not values.max() >= -TOLERANCE:
        return NOTHING
    angles = np.linspace(-np.pi, np.pi, RAYS, endpoint=False)
    # Seen from a point on the edge the region is half hidden; seen from its middle it is not.
    middle = _cast(slack, tries[np.argmax(values)], angles, farthest).mean(axis=0)
    towards = np.arctan2(*(through - middle).T[::-1])
    return _cast(slack, middle, np.union1d(angles, towards), farthest)


def _cast(slack: Slack, origin: FloatArray, angles: FloatArray, farthest: float) -> FloatArray:
    """Where rays from ``origin`` leave the region, by bisection ``(n, 2)``."""
    rays = np.column_stack([np.cos(angles), np.sin(angles)])
    low, high = np.zeros(len(rays)), np.full(len(rays), farthest)
    for _ in range(40):
        middle = (low + high) / 2.0
        inside = slack(origin + middle[:, None] * rays) >= -TOLERANCE
        low, high = np.where(inside, middle, low), np.where(inside, high, middle)
    return np.asarray(origin + low[:, None] * rays)


def _below_hip(plan: Plan, name: str, foot: FloatArray, rotation: FloatArray) -> FloatArray:
    """The COG place ``(2,)`` that hangs a leg straight down onto ``foot``."""
    leg = plan.robot.legs[name.split()[0]]
    hip = leg.hip + leg.lateral * leg.axes[:, 1] - plan.robot.centre
    return np.asarray((foot - rotation @ hip)[:2])


def _grid(feet: FloatArray) -> FloatArray:
    """Places all over the feet's bounding box ``(n, 2)``."""
    low, high = feet[:, :2].min(axis=0), feet[:, :2].max(axis=0)
    share = (np.arange(24) + 0.5) / 24
    x, y = np.meshgrid(*(low[i] + (high[i] - low[i]) * share for i in range(2)))
    return np.column_stack([x.ravel(), y.ravel()])


def _active(phase: Phase) -> tuple[str, ...]:
    kinds = ("margin", "reach")
    return tuple(f"{m.kind} {m.name}" for m in phase.limited_by if m.kind in kinds)
