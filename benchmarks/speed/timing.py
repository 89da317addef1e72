"""The fastest timing with forces: how long it takes to find it, and what it finds.

``python -m benchmarks.speed.timing [--robots go2,wang2020] [--columns 17]`` prints a table. With 17
columns of each leg a walk has 64 steps. Times are CPU times, the best of three: of the whole plan,
of the timing along its path alone, which is the last part of it (:func:`gaitopt.retimed`), and of
``gaitopt.contact_forces``, which solves a program at each of its samples.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable, Sequence
from functools import partial
from typing import TypeVar
from unittest.mock import patch

import gaitopt
from gaitopt import Footholds, Plan, Quadruped
from gaitopt.retiming import retimed as retiming

ROBOTS = "go2,anymal_c,wang2020"
TIMES = 3


Result = TypeVar("Result")


def measured(work: Callable[[], Result]) -> tuple[float, Result]:
    """Least CPU time of :data:`TIMES` runs [s], and what the last one found."""
    least = float("inf")
    for _ in range(TIMES):
        start = time.process_time()
        found = work()
        least = min(least, time.process_time() - start)
    return least, found


def untimed(robot: Quadruped, footholds: Footholds) -> Callable[[], Plan]:
    """The last part of ``plan_crawl``: the timing of the path that it has planned."""
    given: list[Callable[[], Plan]] = []
    original = retiming.retimed

    def noted(plan: Plan, *, rounding: float = 0.0) -> Plan:
        given.append(partial(original, plan, rounding=rounding))
        return given[-1]()

    # The planner imports it when it needs it.
    with patch.object(retiming, "retimed", noted):
        gaitopt.plan_crawl(robot, footholds)
    return given[-1]


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the table."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.speed.timing", description=__doc__)
    parser.add_argument("--robots", default=ROBOTS, help="names, joined by commas")
    parser.add_argument("--columns", type=int, default=17, help="columns of each leg")
    options = parser.parse_args(arguments)
    print("| robot | steps | walk [s] | whole plan, CPU [s] | its timing, CPU [s] "
          "| contact_forces, CPU [s] | samples |\n|---|---|---|---|---|---|---|")  # fmt: skip
    for name in options.robots.split(","):
        robot = gaitopt.load_robot(name)
        footholds = gaitopt.s_columns(0, columns=options.columns, robot=robot)
        timing, _ = measured(untimed(robot, footholds))
        whole, found = measured(partial(gaitopt.plan_crawl, robot, footholds))
        forces, at = measured(partial(gaitopt.contact_forces, found))
        steps = 4 * (options.columns - 1)
        cells = f"{whole:.2f} | {timing:.2f} | {forces:.2f} | {len(at.times)}"
        print(f"| {name} | {steps} | {found.duration:.2f} | {cells} |", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
