"""Walks over columns of different heights: which of them are violated, and whether that is told.

``python -m benchmarks.planning.columns [--walks velocity,default,swing] [--seeds 6]`` plans walks
over ``s_columns(columns=6)`` and judges them. Exit code 1 when a plan is violated without a warning
of the planner.
"""

from __future__ import annotations

import argparse
import sys
import warnings
from collections import Counter
from collections.abc import Sequence

from rich.console import Console
from rich.table import Table

import gaitopt
from gaitopt import Footholds, FootholdsWarning, GaitoptError, Plan, Quadruped
from gaitopt.studies.terrain_study import study_robot

ROBOTS = "go2,a1,anymal_c,hyq,solo12,wang2020"
JITTERS = "0.02,0.05,0.08"
COLUMNS = 6
KINDS = ("refused", "kept", "violated", "without a warning", "warned of and kept")


def planned(walk: str, robot: Quadruped, terrain: Footholds) -> Plan:
    """A walk by its name: velocity, default, or what is free in ``plan_route``."""
    if walk == "velocity":
        return gaitopt.plan_crawl(robot, terrain, timing="velocity")
    if walk == "default":
        return gaitopt.plan_crawl(robot, terrain)
    return gaitopt.plan_route(robot, terrain, free=walk)


def kinds(walk: str, robot: Quadruped, terrain: Footholds) -> tuple[str, ...]:
    """What becomes of a walk over one terrain."""
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        try:
            plan = planned(walk, robot, terrain)
        except GaitoptError:
            return (KINDS[0],)
    warned = any(issubclass(each.category, FootholdsWarning) for each in told)
    if gaitopt.verify(plan).ok:
        return (KINDS[1], KINDS[4]) if warned else (KINDS[1],)
    return (KINDS[2],) if warned else KINDS[2:4]


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the table."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.planning.columns", description=__doc__
    )
    parser.add_argument("--robots", default=ROBOTS)
    parser.add_argument("--walks", default="velocity")
    parser.add_argument("--jitters", default=JITTERS, help="of the columns' heights [m]")
    parser.add_argument("--seeds", type=int, default=6)
    given = parser.parse_args(arguments)
    table = Table("robot", "walk", "walks", *KINDS)
    silent = 0
    for name in given.robots.split(","):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            robot = study_robot(name)
        for walk in given.walks.split(","):
            found: Counter[str] = Counter()
            for jitter in map(float, given.jitters.split(",")):
                for seed in range(given.seeds):
                    terrain = gaitopt.s_columns(
                        seed, columns=COLUMNS, height_jitter=jitter, robot=robot
                    )
                    found.update(kinds(walk, robot, terrain))
            silent += found[KINDS[3]]
            count = len(given.jitters.split(",")) * given.seeds
            table.add_row(name, walk, str(count), *(str(found[kind]) for kind in KINDS))
    Console().print(table)
    return int(silent > 0)


if __name__ == "__main__":
    sys.exit(main())
