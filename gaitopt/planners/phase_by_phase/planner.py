"""The walk of [Wang2020], planned one phase after the other in a given order of legs.

It is planned in the heading frame: the world turned so that the walk's heading is along x.
"""

from __future__ import annotations

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
from gaitopt.robots.quadruped import Quadruped
from gaitopt.robots.whole_body_rates import SINGULAR_LEG
from gaitopt.swing.catalogue import PATTERNS
from gaitopt.terrain.footholds import Footholds

ROUNDING = 0.4
"""Rounding of the corners of swings where forces set the timing (:func:`gaitopt.retimed`). So
the foot does not stop at them: 16 steps of anymal_c take 6.3 s with it and 7.4 s without, of go2
3.8 and 4.3 s (seed 0)."""
BENT = (0.97, 0.99)
"""Shares of the legs' reach that are used, where that is enough, in walks that forces time. Joint
velocities have no bound where a leg is straight, and little keeps a nearly straight one in its
place: over footholds so far apart that reach counts (0.9 times the standing height a step) hyq and
b1 fell or missed footholds in physics with all of their reach, and pass with 0.97. Chosen here."""
REACH_LIMIT = "reach"
"""Kind of the limits of phases whose target is set by what legs reach."""
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
        if not has_straight_legs(found):
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


def has_straight_legs(plan: Plan) -> bool:
    """Whether forces time the plan, and legs reach farther than they should (:data:`BENT`)."""
    settings = plan.settings
    assert isinstance(settings, CrawlSettings)
    far = settings.forces is not None and settings.reach_fraction > BENT[0]
    return far and limited_by_any(plan, REACH_LIMIT)


def limited_by_any(plan: Plan, kind: str) -> bool:
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
