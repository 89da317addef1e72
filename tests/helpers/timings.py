"""Walks by joint velocities for the tests of new timings."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import gaitopt
from gaitopt import Plan, Quadruped
from gaitopt.motion.pieces import stretched

ROBOTS = ("a1", "go2", "anymal_c", "wang2020")
MARGIN = 0.07
"""Stability margin, as a share of the standing height."""


class Pair(NamedTuple):
    """A plan by joint velocities, and the same course timed by forces."""

    old: Plan
    new: Plan


def slower(plan: Plan, factor: float) -> Plan:
    """The plan stretched in time."""
    phases = tuple(
        replace(p, start=factor * p.start, duration=factor * p.duration) for p in plan.phases
    )
    return replace(plan, path=stretched(plan.path, factor), phases=phases)


def by_velocity(robot: Quadruped, seed: int = 0, columns: int = 2) -> Plan:
    """A walk phase by phase by joint velocities, whose true centre of mass keeps the margin."""
    footholds = gaitopt.s_columns(seed, columns=columns, robot=robot)
    margin = round(MARGIN * robot.standing_height, 4)
    return gaitopt.plan_crawl(
        robot, footholds, com="model", timing="velocity", stability_margin=margin
    )
