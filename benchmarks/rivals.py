"""Ours beside the obvious way, in the same run and with the same answers."""

from __future__ import annotations

import numpy as np

import gaitopt
from benchmarks import obvious, walks
from benchmarks.measuring import Result, timed
from benchmarks.planner import plan_time
from gaitopt import Plan
from gaitopt.conventions import FloatArray
from gaitopt.optimize.cog import CogWorkspace

COG_AGREEMENT = 1e-5
"""Largest distance allowed between COG targets of the two ways [m]."""
TIME_AGREEMENT = 1.0
"""Largest difference allowed between the walks' durations [%]."""


def measure_obvious(quick: bool) -> list[Result]:
    """IPOPT for every COG and a linear program for every sample, beside ours."""
    count = 8 if quick else walks.MAIN_STEPS
    robot, walk = walks.robot(), walks.plan(count)
    steps = obvious.steps_of(walk.footholds)
    parametric = obvious.parametric_cog()
    anew_cogs = obvious.walk_cogs(robot, steps, obvious.cog_anew)
    once_cogs = obvious.walk_cogs(robot, steps, parametric)
    samples = intervals(walk)
    seconds: list[float] = []

    ours_cog = timed(lambda: our_cogs(walk), 5 if quick else 20)
    ours = plan_time(count, 5 if quick else 20)
    anew = timed(lambda: obvious.walk_cogs(robot, steps, obvious.cog_anew), 1 if quick else 5)
    once = timed(lambda: obvious.walk_cogs(robot, steps, parametric), 2 if quick else 10)
    speeds = timed(
        lambda: seconds.append(obvious.walk_time(robot, steps, anew_cogs, samples)),
        1 if quick else 3,
        warm_up=0,
    )
    programs = sum(4 * stance + swing for stance, swing in samples)
    whole = anew.median + speeds.median
    ...
