"""Margins of the whole robot's ZMP in the phases of a plan."""

from __future__ import annotations

import numpy as np

from gaitopt.dynamics.whole_body import motion_of_path
from gaitopt.dynamics.zero_moment import zero_moment_points
from gaitopt.plan.com_margin import margins_over, times_of_margins, with_margins
from gaitopt.plan.plan import Plan


def with_zmp_margins(plan: Plan) -> Plan:
    """The plan with the margins of the ZMP of all links in its phases.

    The ZMP is taken on the mean height of the ground below the standing feet. See
    :func:`gaitopt.plan.com_margin.with_margins`.

    Args:
        plan: any plan.
    """
    # Accelerations may jump at knots, and the ZMP with them: both sides count.
    before = np.nextafter(plan.path.times[1:], 0.0)
    times = np.union1d(times_of_margins(plan), before)
    motion = plan.at(times)
    moved = motion_of_path(plan.robot, *(plan.path.evaluate(times, k) for k in range(3)))
    count = np.maximum(motion.contacts.sum(axis=1), 1)
    heights = np.where(motion.contacts, motion.feet[..., 2], 0.0).sum(axis=1) / count
    ground = heights - plan.robot.foot_radius
    points = np.nan_to_num(zero_moment_points(plan.robot, moved, ground), nan=np.inf)
    return with_margins(plan, times, margins_over(motion, points))
