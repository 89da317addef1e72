"""The phases of a smooth walk."""

from __future__ import annotations

import numpy as np

from gaitopt.conventions import rotation_z
from gaitopt.optimize.route.legs import BODY
from gaitopt.plan.phase import Phase
from gaitopt.planners.phase_by_phase.phases import step_phases
from gaitopt.planners.time_optimal.smooth.motion import SplineMotion
from gaitopt.planners.time_optimal.walk import Route


def smooth_phases(route: Route, motion: SplineMotion) -> tuple[Phase, ...]:
    """A stance phase and a swing for every step.

    Margins are those of the ZMP in a dynamic walk, and of the body centre else. Phases end where
    spans do: a swing begins with the span of its lift-off, and ends with that of its touchdown.
    """
    settings = route.settings
    ends = motion.knots.phase_ends.copy()
    ends[2::2] += 1
    times, spans = motion.times[ends], len(motion.spans)
    centres = motion.poses_at(times, np.minimum(ends, spans - 1))[:, BODY]
    of_spans = motion.margins(settings.free.dynamic)
    margins = np.minimum.reduceat(of_spans, ends[:-1])
    return step_phases(
        route.steps, settings.heading, times, centres @ rotation_z(settings.heading).T, margins
    )
