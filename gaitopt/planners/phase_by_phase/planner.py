"""The walk of [Wang2020], planned one phase after the other in a given order of legs.

It is planned in the heading frame: the world turned so that the walk's heading is along x.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from dataclasses import replace
from math import pi, remainder

import numpy as np

from gaitopt.conventions import LEGS, Progress
from gaitopt.errors import GaitoptError, InfeasibleStepError, InputError
from gaitopt.gait.crawl import FREE_ORDER
from gaitopt.plan.com_margin import with_com_margins
from gaitopt.plan.plan import Plan
from gaitopt.plan.settings.crawl import CrawlSettings
from gaitopt.plan.settings.over_footholds import Kind
from gaitopt.planners.phase_by_phase.diagnosis import check_heights
from gaitopt.planners.phase_by_phase.steps import check_stance, crawl_steps
from gaitopt.planners.phase_by_phase.targets import optimise_cogs, start_place
from gaitopt.planners.phase_by_phase.timing import assemble_plan
from gaitopt.robots.collision_shapes import path_touches
from gaitopt.robots.quadruped import Quadruped
from gaitopt.robots.whole_body_rates import SINGULAR_LEG
from gaitopt.swing.catalogue import PATTERNS
from gaitopt.terrain.footholds import Footholds

ROUNDING = 0.4
"""Rounding of the corners of swings where forces set the timing (:func:`gaitopt.retimed`). So
the foot does not stop at them: 16 steps of anymal_c take 6.3 s with it and 7.4 s without, of go2
3.8 and 4.3 s (seed 0)."""
FORCES_LIMIT = "forces"
"""Kind of the limits of phases whose target is set by where forces hold the robot."""
HEIGHTS = (14, 15, 16, 17, 13, 12, 11)
"""Body heights that are tried one after the other, in fourteenths of the height in the settings.

That height is 0.7 of the reach by default, so these are 0.7 to 0.85 of the reach, then 0.65 to
0.55. Higher ones come first, because straighter legs use less of their joints' ranges. Chosen here:
with them every robot that ships, or that example-robot-data has, walks ``s_columns(robot=robot)``.
"""
BENT = (0.97, 0.99)
"""Shares of the legs' reach that are used, where that is enough, in walks that forces time. Joint
velocities have no bound where a leg is straight, and little keeps a nearly straight one in its
place: over footholds so far apart that reach counts (0.9 times the standing height a step) hyq and
b1 fell or missed footholds in physics with all of their reach, and pass with 0.97. Chosen here."""
REACH_LIMIT = "reach"
"""Kind of the limits of phases whose target is set by what legs reach."""
LOWER = (0.7, 0.5)
"""Shares of the swing height that are tried where the walk is possible at no body height. Feet that
rise less need less of their joints' ranges: hyq walks far over uneven ground with them."""
LEAST_HEIGHT = 1e-3
"""Least body height that settings name [m]; what postures ask for is what counts."""


def plan_in_order(
    robot: Quadruped,
    footholds: Footholds,
    settings: CrawlSettings,
    *,
    progress: Progress | None = None,
    rounding: float = ROUNDING,
) -> Plan:
    """Plan the walk in the settings' order of legs, at the settings' body height.

    Where forces set the timing and reach counts, a little less of it is used if that is possible
    (:data:`BENT`).

    Args:
        robot: the robot.
        footholds: in the world; of legs without roll joint in their planes.
        settings: complete; ``sequence`` is not ``"free"``.
        progress: called with (steps done, steps in all).
        rounding: of the corners of box swings where forces set the timing, as in
            :func:`gaitopt.retimed`.

    Raises:
        InputError: legs cross in the first stance.
        InfeasibleStepError: a step is impossible.
        SolverError: a solution failed the check of its residuals.
    """
    found: Plan | None = None
    try:
        found = _plan_with_reach(robot, footholds, settings, progress, rounding)
        if not _has_straight_legs(found):
            return found
    except InfeasibleStepError as error:
        if not any(conflict.startswith(SINGULAR_LEG) for conflict in error.conflicts):
            raise
        singular = error
    for share in BENT:
        if share < settings.reach_fraction:
            bent = replace(settings, reach_fraction=share)
            with suppress(GaitoptError):
                return _plan_with_reach(robot, footholds, bent, progress, rounding)
    if found is None:
        raise singular
    return found


def _has_straight_legs(plan: Plan) -> bool:
    """Whether forces time the plan, and legs reach farther than they should (:data:`BENT`)."""
    settings = plan.settings
    assert isinstance(settings, CrawlSettings)
    far = settings.forces is not None and settings.reach_fraction > BENT[0]
    return far and _limited_by(plan, REACH_LIMIT)


def _limited_by(plan: Plan, kind: str) -> bool:
    """Whether a limit of this kind sets a target of the body centre."""
    return any(limit.kind == kind for phase in plan.phases for limit in phase.limited_by)


def _plan_with_reach(
    robot: Quadruped, footholds: Footholds, settings: CrawlSettings, progress: Progress | None,
    rounding: float,
) -> Plan:  # fmt: skip
    """:func:`plan_in_order` with the reach of the settings."""
    settings = replace(settings, sequence=settings.order_over(footholds))
    if footholds.postures is not None:
        settings = with_first_posture(settings, footholds)
    steps = crawl_steps(footholds, settings)
    check_stance(steps)
    check_heights(robot, steps, settings)
    start = start_place(robot, steps, settings)
    solutions = optimise_cogs(robot, steps, settings, start, progress)
    plan = assemble_plan(robot, footholds, settings, steps, start, solutions)
    if settings.forces is not None:
        from gaitopt.retiming.retimed import retimed  # late: walks by velocity do without

        # Ways over an obstacle keep their corners, and with them their distance from it.
        plan = retimed(plan, rounding=0.0 if settings.swing in PATTERNS else rounding)
    return with_com_margins(plan) if settings.true_com else plan


def with_first_posture(settings: Kind, footholds: Footholds) -> Kind:
    """The settings with the heading and the body height of the first posture of the footholds.

    Args:
        settings: of the walk.
        footholds: with postures. The height counts from the mean of the first footholds.

    Raises:
        InputError: a free order is asked for: postures go with that of the footholds.
    """
    assert footholds.postures is not None
    if settings.sequence == FREE_ORDER:
        raise InputError(
            "postures of the body go with the order of the footholds, and a free order is asked "
            "for; leave sequence out, or postures"
        )
    height, *_, yaw = footholds.postures[0].tolist()
    ground = float(np.mean([footholds[leg][0, 2] for leg in LEGS]))
    # A heading is an angle without whole turns, which yaw may have.
    heading = remainder(yaw, 2.0 * pi)
    return replace(settings, heading=heading, body_height=max(height - ground, LEAST_HEIGHT))


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
    is possible; likewise where legs are nearly straight at all of them (:data:`BENT`).
    Where forces set targets of the body centre there, higher ones are tried as well,
    as long as the walk gets faster: straighter legs need less torque.
    Where the footholds say how high the body is, there is one height.

    Args:
        robot, footholds, settings, progress: as for :func:`plan_in_order`.
        may_touch: whether legs may touch.
        open_swing: whether feet may rise less (:data:`LOWER`) where the walk is possible at no
            height.

    Raises:
        InfeasibleStepError: it is possible at none of them; the error is that of the settings' own
            height, and tells what was tried.
        InputError, SolverError: as for :func:`plan_in_order`.
    """
    if footholds.postures is not None:
        return plan_in_order(robot, footholds, settings, progress=progress)
    lower = LOWER if open_swing and footholds.swing_heights is None else ()
    first: InfeasibleStepError | None = None
    straight: Plan | None = None
    for share in (1.0, *lower):
        asked = replace(settings, swing_height=share * settings.swing_height)
        try:
            plan = _at_fitting_height(robot, footholds, asked, may_touch, progress)
        except InfeasibleStepError as error:
            first = first or error
        except GaitoptError:
            # With lower swings than the settings' own, what fails is told for their own.
            if first is None and straight is None:
                raise
        else:
            if not _has_straight_legs(plan):
                return plan
            straight = straight or plan
    if straight is not None:
        return straight
    assert first is not None
    heights = sorted(_heights(settings.body_height))
    tried = f"body heights from {heights[0]:.4g} to {heights[-1]:.4g} m"
    if lower:
        tried += f" and swing heights down to {lower[-1] * settings.swing_height:.4g} m"
    raise replace(first, message=f"{first}; {tried} were tried")


def _at_fitting_height(
    robot: Quadruped, footholds: Footholds, settings: CrawlSettings, may_touch: bool,
    progress: Progress | None,
) -> Plan:  # fmt: skip
    """:func:`plan_at_fitting_height` with the swing height of the settings."""
    first: InfeasibleStepError | None = None
    touching: Plan | None = None
    straight: Plan | None = None
    for height in _heights(settings.body_height):
        try:
            plan = plan_in_order(
                robot, footholds, replace(settings, body_height=height), progress=progress
            )
        except InfeasibleStepError as error:
            first = first or error
        except GaitoptError:
            # At another height than the settings' own, what fails is told for that height.
            if first is None and touching is None and straight is None:
                raise
        else:
            if not may_touch and plan_touches(plan):
                touching = touching or plan
                continue
            if _has_straight_legs(plan):
                straight = straight or plan
                continue
            higher = [h for h in _heights(settings.body_height) if h > height]
            return _fastest_of_higher(plan, settings, sorted(higher), progress)
    for plan_or_none in (straight, touching):
        if plan_or_none is not None:
            return plan_or_none
    assert first is not None
    raise first


def plan_touches(plan: Plan) -> bool:
    """Whether legs, or a leg and the trunk, touch at a knot of a plan's path."""
    return path_touches(plan.robot, plan.path.coefficients[-1][:, 6:])


def _fastest_of_higher(
    plan: Plan, settings: CrawlSettings, heights: list[float], progress: Progress | None
) -> Plan:
    """The plan, or a faster one at one of ``heights`` [m] above its own, from the lowest on."""
    for height in heights:
        if not _limited_by(plan, FORCES_LIMIT):
            break
        try:
            other = plan_in_order(
                plan.robot, plan.footholds, replace(settings, body_height=height), progress=progress
            )
        except GaitoptError:
            # There is a plan already: what is tried beside it may fail for any reason.
            break
        if other.duration >= plan.duration or plan_touches(other):
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
    """The settings with the body and swing height that :func:`plan_at_fitting_height` finds.

    They are unchanged where the walk is possible at none of the heights.
    """
    try:
        plan = plan_at_fitting_height(
            robot, footholds, settings, may_touch=may_touch, open_swing=open_swing
        )
    except InfeasibleStepError:
        return settings
    found = plan.settings
    assert isinstance(found, CrawlSettings)
    return replace(settings, body_height=found.body_height, swing_height=found.swing_height)


def _heights(first: float) -> Iterator[float]:
    """The body heights to try [m]: ``first`` itself, then others in whole centimetres."""
    yield first
    for share in HEIGHTS[1:]:
        yield max(round(first * share / HEIGHTS[0], 2), 0.01)
