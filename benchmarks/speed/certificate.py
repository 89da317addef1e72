"""How long a certificate takes: walks of 64 steps, without and with self-collisions.

``python -m benchmarks.speed.certificate [--rows crawl,swing] [--robots go2] [--columns 17]`` prints
a table of processor times, the best of five, and of their multiples of a fixed workload in the same
run (:func:`benchmarks.measuring.workload`). Rows are the paper's crawl and the variants of
``plan_route`` of wang2020, timed by joint velocities where they can be; then the default walks of
some robots, which are timed by contact forces, as ``dynamic`` is.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence

import gaitopt
from benchmarks.measuring import least_time, use_one_core, workload

ROWS = "crawl,swing,height,posture,dynamic"
ROBOTS = "wang2020,go2,anymal_c"


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


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the table."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.speed.certificate", description=__doc__
    )
    parser.add_argument("--rows", default=ROWS, help="of wang2020, joined by commas")
    parser.add_argument("--robots", default=ROBOTS, help="for default walks, joined by commas")
    parser.add_argument("--columns", type=int, default=17, help="columns of each leg")
    options = parser.parse_args(arguments)
    use_one_core()
    unit = workload()
    print(f"Fixed workload: {1e3 * unit:.1f} ms of processor time.\n")
    print("| walk | steps | without self-collisions [s] | as workloads | with [s] | as workloads "
          "| outcome |\n|---|---|---|---|---|---|---|")  # fmt: skip
    for row in filter(None, options.rows.split(",")):
        print(line(row, row_of_wang2020(row, options.columns), unit), flush=True)
    for name in filter(None, options.robots.split(",")):
        print(line(f"{name}, default", default_walk(name, options.columns), unit), flush=True)
    print(f"\nFixed workload at the end: {1e3 * workload():.1f} ms.")
    return 0


if __name__ == "__main__":
    sys.exit(main())
