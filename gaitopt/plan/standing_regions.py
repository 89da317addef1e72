"""Where the true centre of mass of a plan's robot may be during its swings, so that it can rest."""

from __future__ import annotations

import numpy as np

from gaitopt.dynamics.feasible_region import feasible_region
from gaitopt.dynamics.region.result import FeasibleRegion
from gaitopt.errors import InputError
from gaitopt.plan.contact_ground import ground_below
from gaitopt.plan.phase import Phase
from gaitopt.plan.plan import Plan


def swing_region(plan: Plan, swing: Phase) -> FeasibleRegion | None:
    """Where contact forces hold the robot at rest, in the posture of the middle of a swing.

    In a walk phase by phase body and standing legs rest during swings, so the region holds for all
    of the swing.

    Args:
        plan: any plan.
        swing: one of its phases.

    Returns:
        ``None`` where the plan promises no forces or lets the body rely on its momentum, fewer than
        three feet stand, the swing lasts no time, or joints are beyond their limits.
    """
    limits = plan.settings.promised_forces
    if limits is None or not plan.settings.static:
        return None
    if len(swing.support) < 3 or swing.duration <= 0.0:
        return None
    middle = np.array([min(swing.start + swing.duration / 2.0, plan.duration)])
    feet, posture = plan.at(middle).feet[0], plan.path.evaluate(middle)[0, :6]
    ground = ground_below(plan, middle, limits.friction).at(np.array(0))
    try:
        return feasible_region(
            plan.robot, feet, ground.normals, limits, swing.support, posture, grip=ground.grip
        )
    except InputError:
        # A standing leg beyond its joint limits: the certificate tells of it.
        return None
