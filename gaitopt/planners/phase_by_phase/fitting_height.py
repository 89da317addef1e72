"""The walk phase by phase at a body height that fits, found by trying a few of them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple

from gaitopt.conventions import Progress
from gaitopt.errors import FootholdsWarning, GaitoptError, InfeasibleStepError, warn
from gaitopt.plan.limbs_in_columns import LimbInColumn, limb_in_column
from gaitopt.plan.plan import Plan
from gaitopt.plan.settings.crawl import CrawlSettings
from gaitopt.planners.phase_by_phase.planner import (
    has_straight_legs,
    limited_by_any,
    plan_in_order,
)
from gaitopt.robots.collisions.along_paths import path_touches
from gaitopt.robots.quadruped import Quadruped
from gaitopt.terrain.footholds import Footholds

HEIGHTS = (14, 15, 16, 17, 13, 12, 11)
"""Body heights that are tried one after the other, in fourteenths of the height in the settings.

That height is 0.7 of the reach by default, so these are 0.7 to 0.85 of the reach, then 0.65 to
0.55. Higher ones come first, because straighter legs use less of their joints' ranges. Chosen here:
with them every robot that ships, or that example-robot-data has, walks ``s_columns(robot=robot)``.
"""
LOWER = (0.7, 0.5)
"""Shares of the swing height that are tried where the walk is possible at no body height. Feet that
rise less need less of their joints' ranges: hyq walks far over uneven ground with them."""
FORCES_LIMIT = "forces"
"""Kind of the limits of phases whose target is set by where forces hold the robot."""


class FittingPlan(NamedTuple):
    """A walk at a body height that fits.

    Attributes:
        plan: the walk.
        touches: whether legs touch in it, as they do at every height that was tried.
    """

    plan: Plan
    touches: bool = False


def plan_at_fitting_height(
    robot: Quadruped,
    footholds: Footholds,
    settings: CrawlSettings,
    *,
    may_touch: bool = False,
    open_swing: bool = False,
    progress: Progress | None = None,
) -> Plan:
    """Plan the walk at the first of a few body heights at which it is possible and no legs touch.

    Where legs, or a leg and the trunk, touch at all of them, it is the first one at which the walk
    is possible; likewise where legs are nearly straight at all of them (``planner.BENT``). Limbs
    keep clear of columns as well; where they do so at no height, it is that at which they go into
    one least.
    Where forces set targets of the body centre there, higher ones are tried as well,
    as long as the walk gets faster: straighter legs need less torque.
    Where the footholds say how high the body is, there is one height.

    Args:
        robot, footholds, settings, progress: as for :func:`plan_in_order`.
        may_touch: whether legs may touch.
        open_swing: whether feet may rise less (:data:`LOWER`) where the walk is possible at no
            height.

    Warns:
        FootholdsWarning: legs touch at all of them.

    Raises:
        InfeasibleStepError, InputError, SolverError: as for :func:`fitting_plan`.
    """
    found = fitting_plan(
        robot, footholds, settings, may_touch=may_touch, open_swing=open_swing, progress=progress
    )
    if found.touches:
        warn_of_touch(found.plan, settings)
    return found.plan


def warn_of_touch(plan: Plan, settings: CrawlSettings) -> None:
    """Tell that legs touch in a plan, at a body height at which these settings are possible."""
    warn(
        f"{plan.robot.name}: legs touch each other or the trunk at every body height that was "
        f"tried ({_tried(settings)}), as the certificate will find; put the footholds farther "
        "outside: s_columns(body_width=...), or another CSV",
        FootholdsWarning,
    )


def fitting_plan(
    robot: Quadruped,
    footholds: Footholds,
    settings: CrawlSettings,
    *,
    may_touch: bool = False,
    open_swing: bool = False,
    progress: Progress | None = None,
) -> FittingPlan:
    """The plan of :func:`plan_at_fitting_height`, and whether legs touch in it, without a warning.

    Args:
        robot, footholds, settings, may_touch, open_swing, progress: as there.

    Raises:
        InfeasibleStepError: it is possible at none of them; the error is that of the settings' own
            height, and tells what was tried.
        InputError, SolverError: as for :func:`plan_in_order`.
    """
    if footholds.postures is not None:
        return FittingPlan(plan_in_order(robot, footholds, settings, progress=progress))
    lower = LOWER if open_swing and footholds.swing_heights is None else ()
    first: InfeasibleStepError | None = None
    straight: FittingPlan | None = None
    for share in (1.0, *lower):
        asked = replace(settings, swing_height=share * settings.swing_height)
        try:
            found = _at_fitting_height(robot, footholds, asked, may_touch, progress)
        except InfeasibleStepError as error:
            first = first or error
        except GaitoptError:
            # With lower swings than the settings' own, what fails is told for their own.
            if first is None and straight is None:
                raise
        else:
            if not has_straight_legs(found.plan):
                return found
            straight = straight or found
    if straight is not None:
        return straight
    assert first is not None
    tried = f"body heights {_tried(settings)}"
    if lower:
        tried += f" and swing heights down to {lower[-1] * settings.swing_height:.4g} m"
    raise replace(first, message=f"{first}; {tried} were tried")


def _at_fitting_height(
    robot: Quadruped, footholds: Footholds, settings: CrawlSettings, may_touch: bool,
    progress: Progress | None,
) -> FittingPlan:  # fmt: skip
    """:func:`fitting_plan` with the swing height of the settings."""
    first: InfeasibleStepError | None = None
    touching: Plan | None = None
    straight: Plan | None = None
    within: _Within | None = None
    for height in _heights(settings.body_height):
        if within is not None and height < settings.body_height:
            # Lower bodies have flatter legs.
            continue
        try:
            plan = plan_in_order(
                robot, footholds, replace(settings, body_height=height), progress=progress
            )
        except InfeasibleStepError as error:
            first = first or error
        except GaitoptError:
            # At another height than the settings' own, what fails is told for that height.
            if first is None and touching is None and straight is None and within is None:
                raise
        else:
            if not may_touch and plan_touches(plan):
                touching = touching or plan
                continue
            limb = limb_in_column(plan)
            if limb is not None:
                if within is None or limb.gap > within.limb.gap:
                    within = _Within(plan, limb)
                continue
            if has_straight_legs(plan):
                straight = straight or plan
                continue
            return FittingPlan(_fastest_of_higher(plan, settings, progress))
    if straight is not None:
        return FittingPlan(straight)
    if within is not None:
        return FittingPlan(within.plan)
    if touching is not None:
        return FittingPlan(touching, touches=True)
    assert first is not None
    raise first


class _Within(NamedTuple):
    """A plan one of whose limbs is within a column, and this limb."""

    plan: Plan
    limb: LimbInColumn


def plan_touches(plan: Plan) -> bool:
    """Whether legs, or a leg and the trunk, touch at a knot of a plan's path."""
    return path_touches(plan.robot, plan.path.coefficients[-1][:, 6:])


def _fastest_of_higher(plan: Plan, settings: CrawlSettings, progress: Progress | None) -> Plan:
    """The plan, or a faster one at one of the heights above its own, from the lowest on."""
    assert isinstance(plan.settings, CrawlSettings)
    for height in higher_than(plan.settings.body_height, settings.body_height):
        if not limited_by_any(plan, FORCES_LIMIT):
            break
        try:
            other = plan_in_order(
                plan.robot, plan.footholds, replace(settings, body_height=height), progress=progress
            )
        except GaitoptError:
            # There is a plan already: what is tried beside it may fail for any reason.
            break
        if other.duration >= plan.duration or plan_touches(other) or limb_in_column(other):
            break
        plan = other
    return plan


def with_fitting_height(
    robot: Quadruped,
    footholds: Footholds,
    settings: CrawlSettings,
    *,
    may_touch: bool = False,
    open_swing: bool = False,
) -> CrawlSettings:
    """The settings with the body and swing height that :func:`fitting_plan` finds.

    They are unchanged where the walk is possible at none of the heights. Nothing is warned of: what
    is planned with these settings may be another walk.
    """
    try:
        fitting = fitting_plan(
            robot, footholds, settings, may_touch=may_touch, open_swing=open_swing
        )
    except InfeasibleStepError:
        return settings
    found = fitting.plan.settings
    assert isinstance(found, CrawlSettings)
    return replace(settings, body_height=found.body_height, swing_height=found.swing_height)


def _tried(settings: CrawlSettings) -> str:
    """The body heights that are tried, in words."""
    heights = sorted(_heights(settings.body_height))
    return f"from {heights[0]:.4g} to {heights[-1]:.4g} m"


def higher_than(height: float, own: float) -> list[float]:
    """The body heights to try above one of them, from the lowest on [m].

    Args:
        height: this one [m].
        own: the height in the settings, from which they follow [m].
    """
    return sorted(h for h in _heights(own) if h > height)


def _heights(first: float) -> Iterator[float]:
    """The body heights to try [m]: ``first`` itself, then others in whole centimetres."""
    yield first
    for share in HEIGHTS[1:]:
        yield max(round(first * share / HEIGHTS[0], 2), 0.01)
