"""The error of a continuous motion that is not taken."""

from __future__ import annotations

import numpy as np

from gaitopt.errors import SolverError
from gaitopt.planners.time_optimal.smooth.motion import SplineMotion
from gaitopt.planners.time_optimal.walk import Route


def refused(route: Route, motion: SplineMotion, span: int, reason: str) -> SolverError:
    """The error.

    Args:
        route: the walk.
        motion: that is not taken.
        span: on which of its spans it is wrong.
        reason: what is wrong there.
    """
    step = int(np.append(motion.knots.step, motion.knots.step[-1])[span])
    return SolverError(
        f"step {route.first_step + step} ({route.steps.legs[step]}): {reason} on a continuous "
        "walk; take another body_height, swing_height or stability_margin, or a walk phase by "
        "phase",
        step=route.first_step + step,
    )
