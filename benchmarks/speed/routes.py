"""How the time of time-optimal walks grows with their steps, and how far they are from the best.

``python -m benchmarks.speed.routes [--steps 16,32,64,128,256,512] [--row swing]`` prints a table:
steps, processor time, its multiple of a fixed workload in the same run
(:func:`benchmarks.measuring.workload`), the solver's Newton steps, the time of one of them for each
step of the walk, and the powers of the steps with which time and Newton steps grow.
``--windows 8,16,32`` also prints the lower bounds of windows of so many steps
(:func:`gaitopt.planners.time_optimal.bound.route_bound`) on the walk over 64 steps, and how much
of what is missing to it is the way between knots. With ``--horizon 16`` walks are planned in
windows of so many steps, with ``--swing-knots 16`` with so many knots in a swing.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Sequence

import numpy as np

import gaitopt
from benchmarks import walks
from benchmarks.measuring import use_one_core, workload
from gaitopt.planners.time_optimal.bound import route_bound

STEPS = "16,32,64,128,256,512"
TIMED_BY_FORCES = ("dynamic",)
"""Rows that have no timing by joint velocities."""


def planned(
    row: str, steps: int, horizon: int | None = None, seed: int = 0,
    swing_knots: int | None = None,
) -> gaitopt.Plan:  # fmt: skip
    """The walk of a row over random columns."""
    timing = {} if row in TIMED_BY_FORCES else {"timing": "velocity"}
    return gaitopt.plan_route(
        walks.robot(), walks.terrain(steps, seed), free=row, horizon=horizon,
        swing_knots=swing_knots, **timing,
    )  # fmt: skip


def growth(row: str, sizes: Sequence[int], horizon: int | None, seeds: int) -> None:
    """Print the table of a row: means over terrains, and the range of their Newton steps."""
    print(
        "| row | steps | CPU [s] | workloads | Newton steps | CPU of one, a step [us] | walk [s] |"
    )
    print("|---|---|---|---|---|---|---|")
    times, means = [], []
    for steps in sizes:
        unit, start = workload(), time.process_time()
        plans = [planned(row, steps, horizon, seed) for seed in range(seeds)]
        cpu = (time.process_time() - start) / seeds
        counts = [plan.record.solver_iterations for plan in plans]
        times.append(cpu / unit)
        means.append(np.mean(counts))
        among = f" ({min(counts)} .. {max(counts)})" if seeds > 1 else ""
        each, walk = 1e6 * cpu / means[-1] / steps, np.mean([plan.duration for plan in plans])
        print(f"| {row} | {steps} | {cpu:.2f} | {times[-1]:.1f} | {means[-1]:.0f}{among} | "
              f"{each:.0f} | {walk:.2f} |", flush=True)  # fmt: skip
    if len(sizes) > 1:
        powers = [np.polyfit(np.log(sizes), np.log(values), 1)[0] for values in (times, means)]
        print(f"time ~ steps^{powers[0]:.2f}, Newton steps ~ steps^{powers[1]:.2f}", flush=True)


def bounds(row: str, windows: Sequence[int], swing_knots: int | None) -> None:
    """Print the lower bounds of windows on the walk over 64 steps."""
    plan = planned(row, walks.MAIN_STEPS, swing_knots=swing_knots)
    between = 100.0 * (1.0 - plan.record.knot_time / plan.duration)
    print(f"{row}, {walks.MAIN_STEPS} steps: {plan.duration:.2f} s, {between:.2f} % of it between "
          "knots", flush=True)  # fmt: skip
    for window in windows:
        share = float(route_bound(plan, window).sum()) / plan.duration
        print(f"  at least {100.0 * share:.2f} % of the plan's time by windows of {window} steps",
              flush=True)  # fmt: skip


def main(arguments: Sequence[str] | None = None) -> int:
    """Print what was asked for."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.speed.routes", description=__doc__)
    parser.add_argument("--steps", default=STEPS, help="joined by commas")
    parser.add_argument("--row", default="swing", help="a variant of plan_route")
    parser.add_argument("--windows", default="", help="steps of windows, joined by commas")
    parser.add_argument("--horizon", type=int, help="steps of a window; by default all at once")
    parser.add_argument("--swing-knots", type=int, help="for the bounds; by default the planner's")
    parser.add_argument("--seeds", type=int, default=1, help="how many terrains, from seed 0 on")
    asked = parser.parse_args(arguments)
    use_one_core()
    planned("swing", 4)
    if asked.steps:
        growth(asked.row, [int(n) for n in asked.steps.split(",")], asked.horizon,
               asked.seeds)  # fmt: skip
    if asked.windows:
        bounds(asked.row, [int(n) for n in asked.windows.split(",")], asked.swing_knots)
    return 0


if __name__ == "__main__":
    sys.exit(main())
