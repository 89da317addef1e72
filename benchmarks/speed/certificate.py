"""How long a certificate takes: walks of 64 steps, without and with self-collisions.

``python -m benchmarks.speed.certificate [--rows crawl,swing] [--robots go2] [--terrain go2]
[--columns 17] [--parts]`` prints a table of processor times, the best of five, and of their
multiples of a fixed workload in the same run (:func:`benchmarks.measuring.workload`). Rows are the
paper's crawl and the variants of ``plan_route`` of wang2020, timed by joint velocities where they
can be; then the default walks of some robots, which are timed by contact forces, as ``dynamic`` is;
then walks of 3 m over rubble, with footholds that are searched for. With ``--parts`` the columns
are the parts of the time with self-collisions.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack
from time import process_time
from typing import Any
from unittest.mock import patch

import gaitopt
from benchmarks.measuring import least_time, use_one_core, workload
from gaitopt.certificate import clearance, verify
from gaitopt.certificate.collisions import self_collision

ROWS = "crawl,swing,height,posture,dynamic"
ROBOTS = "wang2020,go2,anymal_c"
TERRAIN = "go2"
PARTS = {
    "forces": (verify, "contact_forces"),
    "ground": (verify, "ground_checks"),
    "trace": (verify, "trace"),
    "self-collision": (self_collision, "self_collision"),
    "swing clearance": (clearance, "swing_clearance"),
}
"""Functions that take most of the time, and the modules that they are looked up in."""
RUBBLE = 0.3
"""Difficulty of the rubble."""
LENGTH = 3.0
"""Length of the walk over it [m]."""


def row_of_wang2020(row: str, columns: int) -> gaitopt.Plan:
    """The walk of a row."""
    robot, footholds = gaitopt.load_robot("wang2020"), gaitopt.s_columns(0, columns=columns)
    if row == "crawl":
        return gaitopt.plan_crawl(robot, footholds, timing="velocity")
    if row == "dynamic":
        return gaitopt.plan_route(robot, footholds, free=row)
    return gaitopt.plan_route(robot, footholds, free=row, timing="velocity")


def default_walk(name: str, columns: int) -> gaitopt.Plan:
    """The default walk of a robot."""
    robot = gaitopt.load_robot(name)
    return gaitopt.plan_crawl(robot, gaitopt.s_columns(0, columns=columns, robot=robot))


def over_rubble(name: str) -> gaitopt.Plan:
    """A walk over rubble."""
    robot = gaitopt.load_robot(name)
    ground = gaitopt.make_ground("rubble", seed=0, difficulty=RUBBLE, robot=robot, length=LENGTH)
    return gaitopt.plan_terrain(robot, ground, (LENGTH, 0.0), start=(0.0, 0.0, 0.0))


def line(name: str, plan: gaitopt.Plan, unit: float) -> str:
    """A line of the table.

    Args:
        name: of the row.
        plan: of which the certificate is made.
        unit: time of the fixed workload [s].
    """
    times = [least_time(lambda own=own: gaitopt.verify(plan, collisions=own))
             for own in (False, True)]  # fmt: skip
    cells = [f"{time:.3f} | {time / unit:.1f}" for time in times]
    outcome = gaitopt.verify(plan).outcome
    return f"| {name} | {len(plan.swings)} | {' | '.join(cells)} | {outcome} |"


def line_of_parts(name: str, plan: gaitopt.Plan) -> str:
    """A line of the table of parts, by one run."""
    spent = dict.fromkeys(PARTS, 0.0)
    gaitopt.verify(plan)
    with ExitStack() as patches:
        for part, (module, function) in PARTS.items():
            timed = _timed(part, getattr(module, function), spent)
            patches.enter_context(patch.object(module, function, timed))
        began = process_time()
        gaitopt.verify(plan)
        whole = process_time() - began
    rest = whole - sum(spent.values())
    cells = [f"{1e3 * time:.0f}" for time in (whole, *spent.values(), rest)]
    return f"| {name} | {len(plan.swings)} | {' | '.join(cells)} |"


def _timed(part: str, function: Callable[..., Any], spent: dict[str, float]) -> Callable[..., Any]:
    """The same function, whose time is added to that of its part."""

    def run(*arguments: Any, **options: Any) -> Any:
        began = process_time()
        try:
            return function(*arguments, **options)
        finally:
            spent[part] += process_time() - began

    return run


def walks(rows: str, robots: str, terrain: str, columns: int) -> Iterator[tuple[str, gaitopt.Plan]]:
    """Names of walks, and the walks."""
    for row in filter(None, rows.split(",")):
        yield row, row_of_wang2020(row, columns)
    for name in filter(None, robots.split(",")):
        yield f"{name}, default", default_walk(name, columns)
    for name in filter(None, terrain.split(",")):
        yield f"{name}, rubble", over_rubble(name)


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the table."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.speed.certificate", description=__doc__
    )
    parser.add_argument("--rows", default=ROWS, help="of wang2020, joined by commas")
    parser.add_argument("--robots", default=ROBOTS, help="for default walks, joined by commas")
    parser.add_argument("--terrain", default=TERRAIN, help="robots over rubble")
    parser.add_argument("--columns", type=int, default=17, help="columns of each leg")
    parser.add_argument("--parts", action="store_true", help="what takes the time")
    options = parser.parse_args(arguments)
    use_one_core()
    unit = workload()
    print(f"Fixed workload: {1e3 * unit:.1f} ms of processor time.\n")
    if options.parts:
        print(f"| walk | steps | all [ms] | {' | '.join(PARTS)} | rest |")
        print("|---" * (len(PARTS) + 4) + "|")
    else:
        print("| walk | steps | without self-collisions [s] | as workloads | with [s] "
              "| as workloads | outcome |\n|---|---|---|---|---|---|---|")  # fmt: skip
    for name, plan in walks(options.rows, options.robots, options.terrain, options.columns):
        row = line_of_parts(name, plan) if options.parts else line(name, plan, unit)
        print(row, flush=True)
    print(f"\nFixed workload at the end: {1e3 * workload():.1f} ms.")
    return 0


if __name__ == "__main__":
    sys.exit(main())
