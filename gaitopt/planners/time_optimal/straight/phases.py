"""The phases of a straight walk."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from gaitopt.conventions import OTHER_LEGS, rotation_z
from gaitopt.plan.phase import Phase
from gaitopt.planners.phase_by_phase.phases import speed_limits, step_phases
from gaitopt.planners.time_optimal.balance import dense_com
from gaitopt.planners.time_optimal.dense import DensePath
from gaitopt.planners.time_optimal.knots import RouteKnots
from gaitopt.planners.time_optimal.walk import Route
from gaitopt.stability.margins import static_stability_margin


def straight_phases(route: Route, knots: RouteKnots, dense: DensePath) -> tuple[Phase, ...]:
    """A stance phase and a swing for every step.

    Their margins are those of the true centre of mass where the settings say so, and of the body
    centre else.
    """
    settings, steps = route.settings, route.steps
    ends = dense.at_knots[knots.phase_ends]
    point = dense_com(route.robot, settings, dense) if settings.true_com else dense.body_centre
    margins = np.empty(len(ends) - 1)
    for phase, (a, b) in enumerate(pairwise(ends.tolist())):
        step, is_swing = divmod(phase, 2)
        feet = steps.feet[step]
        if is_swing:
            feet = feet[OTHER_LEGS[steps.indices[step]]]
        margins[phase] = static_stability_margin(feet, point[a : b + 1]).min()
    limits = speed_limits(route.robot, dense.times, ends, dense.slowest_joint)
    centres = dense.body_centre @ rotation_z(settings.heading).T
    return step_phases(steps, settings.heading, dense.times[ends], centres[ends], margins, limits)
