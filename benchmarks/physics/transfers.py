"""What slow transfers of loads cost, and what they buy in physics.

``python -m benchmarks.physics.transfers --seeds 2 [--robots go2,a1] [--rows default,swing] [--times
0,0.05]`` prints a table: for each robot and row, and for each ``ForceLimits.transfer_time``, the
duration of the plan, that of the walk in physics with what it waits, the largest joint velocity as
a share of its limit, the largest landing error, and how many walks pass. Medians over the terrains
for durations, and the largest over them for what should be small.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

import gaitopt

ROBOTS = ("a1", "go2", "anymal_c", "wang2020")
ROWS = ("default", "swing", "dynamic")
TIMES = (0.0, 0.03, 0.05, 0.1)
COLUMNS = 5
"""Columns a leg: 16 steps."""


class Walked(NamedTuple):
    """A walk in physics.

    Attributes:
        duration: of the plan [s].
        taken: until the walk has ended in physics [s].
        velocity: largest joint velocity as a share of its limit.
        landing: largest landing error [m].
        passed: whether it passes.
    """

    duration: float
    taken: float
    velocity: float
    landing: float
    passed: bool


def walked(robot: gaitopt.Quadruped, seed: int, row: str, time: float) -> Walked:
    """The walk of a row over a terrain."""
    footholds = gaitopt.s_columns(seed, columns=COLUMNS, robot=robot)
    limits = gaitopt.ForceLimits(transfer_time=time)
    if row == "default":
        plan = gaitopt.plan_crawl(robot, footholds, forces=limits)
    else:
        plan = gaitopt.plan_route(robot, footholds, free=row, forces=limits)
    found = gaitopt.simulate(plan)
    return Walked(plan.duration, found.end, found.rate_use, found.landing_error,
                  found.passed)  # fmt: skip


def line(name: str, row: str, time: float, walks: list[Walked], terrains: int) -> str:
    """A line of the table."""
    columns = [f"{np.median([w.duration for w in walks]):.2f}",
               f"{np.median([w.taken for w in walks]):.2f}",
               f"{100.0 * max(w.velocity for w in walks):.0f} %",
               f"{1e3 * max(w.landing for w in walks):.1f}"] if walks else [""] * 4  # fmt: skip
    passed = f"{sum(w.passed for w in walks)} of {terrains}"
    return f"| {' | '.join([name, row, f'{1e3 * time:.0f} ms', *columns, passed])} |"


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the table."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.physics.transfers", description=__doc__
    )
    parser.add_argument("--seeds", type=int, default=2, help="terrains of each robot")
    parser.add_argument("--robots", default=",".join(ROBOTS), help="names, joined by commas")
    parser.add_argument("--rows", default=",".join(ROWS), help="variants of plan_route, or default")
    parser.add_argument("--times", default=",".join(map(str, TIMES)), help="transfer times [s]")
    options = parser.parse_args(arguments)
    print("| robot | row | transfer time | plan [s] | in physics [s] | joint velocity | "
          "landing error [mm] | passed |\n|---|---|---|---|---|---|---|---|")  # fmt: skip
    for name in options.robots.split(","):
        robot = gaitopt.load_robot(name)
        for row in options.rows.split(","):
            for time in map(float, options.times.split(",")):
                walks = []
                for seed in range(options.seeds):
                    try:
                        walks.append(walked(robot, seed, row, time))
                    except gaitopt.GaitoptError as error:
                        print(f"{name}, {row}, seed {seed}: {error}", file=sys.stderr)
                print(line(name, row, time, walks, options.seeds), flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
