"""Margins of the whole robot's ZMP in the phases of a plan."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from gaitopt.dynamics.whole_body import motion_of_path
from gaitopt.plan.com_margin import margins_over, times_of_margins
from gaitopt.plan.plan import Plan
from gaitopt.stability.zmp import whole_body_zmp


def with_zmp_margins(plan: Plan) -> Plan:
    """The plan with the margins of the ZMP of all links in its phases.

    The ZMP is taken on the mean height of the ground below the standing feet. Phases in which
    fewer than three feet stand, or that last no time, keep the margin that they have.

    Args:
        plan: any plan.
    """
    times = times_of_margins(plan)
    motion = plan.at(times)
    moved = motion_of_path(plan.robot, *(plan.path.evaluate(times, k) for k in range(3)))
    count = np.maximum(motion.contacts.sum(axis=1), 1)
    heights = np.where(motion.contacts, motion.feet[..., 2], 0.0).sum(axis=1) / count
    ground = heights - plan.robot.foot_radius
    points = np.nan_to_num(whole_body_zmp(plan.robot.model, *moved, ground), nan=np.inf)
    margins = margins_over(motion, points)
    phases = list(plan.phases)
    for i, phase in enumerate(phases):
        first, last = np.searchsorted(times, [phase.start, phase.end])
        if last > first and np.isfinite(margins[first:last]).all():
            phases[i] = replace(phase, margin=float(margins[first:last].min()))
    return replace(plan, phases=tuple(phases))
