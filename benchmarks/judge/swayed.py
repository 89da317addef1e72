"""A fault that leaves the feet where they are: the body sways, and the legs follow it."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
from scipy.interpolate import CubicHermiteSpline

from benchmarks.judge.motion import Motion
from gaitopt import MotionPath, Plan
from gaitopt.conventions import FloatArray
from gaitopt.errors import InputError
from gaitopt.robots.whole_body import joints_from_feet

FINEST, MOST_KNOTS = 4e-3, 2500
"""Time between the knots of the new path [s], and about the most of them."""
STEP = 1e-6
"""Of the differences that give the joints' rates [s]."""


def swayed(plan: Plan, column: int, by: float, begin: float, end: float) -> Plan:
    """The plan with one of the base's six coordinates moved for a while, and joints that follow.

    Args:
        plan: the plan.
        column: of the path, 0 to 5.
        by: how far in the middle of this time [m, rad].
        begin, end: of the motion [s]; it begins and ends at rest.

    Raises:
        InputError: a leg does not reach its foot.
    """
    times = _knots(plan, begin, end)
    values = _values(plan, times, column, by, begin, end)
    if len(plan.path.coefficients) == 2:
        path = MotionPath.polyline(times, values)
    else:
        before, after = np.maximum(times - STEP, 0.0), np.minimum(times + STEP, times[-1])
        first, second = (_values(plan, t, column, by, begin, end) for t in (before, after))
        rates = (second - first) / (after - before)[:, None]
        path = MotionPath(times, np.asarray(CubicHermiteSpline(times, values, rates).c))
    moved = replace(plan, path=path)
    motion = Motion(moved)
    phases = []
    for phase in plan.phases:
        at = path.evaluate([phase.start, phase.end])
        feet, centre, _ = motion.places(at)
        i = list(plan.robot.legs).index(phase.leg) if phase.kind == "swing" else None
        foot = {} if i is None else {"foot_start": feet[0, i], "foot_end": feet[1, i]}
        phases.append(replace(phase, cog_start=centre[0], cog_end=centre[1], **foot))
    return replace(moved, phases=tuple(phases))


def _knots(plan: Plan, begin: float, end: float) -> FloatArray:
    """The old knots, with others between them."""
    step = max(FINEST, plan.duration / MOST_KNOTS)
    old = np.union1d(plan.path.times, [begin, end])
    parts = [np.linspace(a, b, int(np.ceil((b - a) / step)) + 1)[:-1]
             for a, b in pairwise(old) if b - a > 1e-9]  # fmt: skip
    return np.append(np.concatenate(parts), plan.path.times[-1])


def _values(
    plan: Plan, times: FloatArray, column: int, by: float, begin: float, end: float
) -> FloatArray:
    """The new path at times ``(N, 6 + nj)``."""
    values = plan.path.evaluate(times)
    feet = plan.at(times).feet
    share = np.clip((times - begin) / (end - begin), 0.0, 1.0)
    values[:, column] += by * 64.0 * (share * (1.0 - share)) ** 3  # one in the middle
    if values.shape[1] != 18:
        raise InputError("legs of two joints cannot follow every motion of the body")
    values[:, 6:] = joints_from_feet(plan.robot, values[:, :3], values[:, 3:6], feet)
    return values
