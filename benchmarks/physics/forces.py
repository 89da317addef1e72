"""Walks with forces on all robots: how fast, certified or not, and what physics makes of them.

``python -m benchmarks.physics.forces --seeds 3 [--robots go2,a1] [--free dynamic] [--physics]
[--sweep]`` prints a table. With ``--free`` it is of the walks of this variant of ``plan_route``, in
place of the default ones. With ``--physics`` certificates are left out, which takes half of the
time. ``found`` counts the walks that are not the walk phase by phase in its place. With ``--sweep``
it also looks for the fastest walk of a fixed speed, planned phase by phase without forces, that
passes in physics: what could be had before.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from time import process_time
from typing import NamedTuple

import numpy as np

import gaitopt

ROBOTS = ("wang2020", "wang2020-fast", "a1", "go1", "go2", "b1", "laikago", "anymal", "anymal_c",
          "hyq", "solo12")  # fmt: skip
COLUMNS = 5
"""Columns a leg: 16 steps."""
SPEEDS = np.arange(0.1, 1.25, 0.1)
"""Speeds of body and feet that the sweep tries [m/s]."""


class Walked(NamedTuple):
    """What became of a walk.

    Attributes:
        kept: whether the certificate finds nothing violated, self-collisions left out.
        found: whether it is the kind of walk that was asked for.
        passed: whether it passes in physics.
        duration: of the plan [s].
        planning: processor time of the planner for each step [ms].
    """

    kept: bool
    found: bool
    passed: bool
    duration: float
    planning: float


def walked(robot: gaitopt.Quadruped, seed: int, free: str | None, judged: bool) -> Walked:
    """The default walk over a terrain, or that of a variant of ``plan_route``.

    Its promises are looked at if it is to be ``judged``.
    """
    footholds = gaitopt.s_columns(seed, columns=COLUMNS, robot=robot)
    began = process_time()
    if free is None:
        plan = gaitopt.plan_crawl(robot, footholds)
    else:
        plan = gaitopt.plan_route(robot, footholds, free=free)
    planning = 1e3 * (process_time() - began) / footholds.steps
    result = gaitopt.simulate(plan)
    if not result.passed:
        told = str(result).splitlines()
        print(f"{robot.name}, seed {seed}: {told[0]}; {told[1]}; {told[-2]}", file=sys.stderr)
    return Walked(
        judged and gaitopt.verify(plan, collisions=False).ok,
        getattr(plan.record, "instead", None) is None, result.passed, plan.duration, planning,
    )  # fmt: skip


def fastest_by_speed(robot: gaitopt.Quadruped, seed: int) -> float:
    """Duration of the fastest walk of a fixed speed that passes in physics [s]; NaN for none."""
    footholds = gaitopt.s_columns(seed, columns=COLUMNS, robot=robot)
    times = []
    for speed in SPEEDS.tolist():
        plan = gaitopt.plan_crawl(robot, footholds, speed=speed, timing="velocity")
        if gaitopt.simulate(plan).passed:
            times.append(plan.duration)
    return min(times, default=float("nan"))


def row(name: str, walks: list[Walked], before: list[float], terrains: int, judged: bool) -> str:
    """A row of the table."""
    counts = [f"{sum(getattr(walk, what) for walk in walks)} of {terrains}"
              for what in ("found", "kept", "passed")]  # fmt: skip
    counts[1] = counts[1] if judged else ""
    times = f"{np.median([w.duration for w in walks]):.2f}" if walks else ""
    planning = f"{np.median([w.planning for w in walks]):.0f}" if walks else ""
    swept = f"{np.nanmedian(before):.2f}" if np.isfinite(before).any() else ""
    return f"| {' | '.join([name, *counts, times, planning, swept])} |"


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the table."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.physics.forces", description=__doc__
    )
    parser.add_argument("--seeds", type=int, default=3, help="terrains of each robot")
    parser.add_argument("--robots", default=",".join(ROBOTS), help="names, joined by commas")
    parser.add_argument("--free", help="a variant of plan_route; by default plan_crawl")
    parser.add_argument("--sweep", action="store_true", help="also walks of a fixed speed")
    parser.add_argument("--physics", action="store_true", help="without certificates")
    options = parser.parse_args(arguments)
    judged = not options.physics
    print("| robot | found | promises kept | passed in physics | 16 steps, median [s] | "
          "planning, median [ms a step] | by speed alone [s] |")  # fmt: skip
    print("|---|---|---|---|---|---|---|")
    for name in options.robots.split(","):
        robot = gaitopt.load_robot(name)
        walks, before = [], []
        for seed in range(options.seeds):
            try:
                walks.append(walked(robot, seed, options.free, judged))
            except gaitopt.GaitoptError as error:
                print(f"{name}, seed {seed}: {error}", file=sys.stderr)
                continue
            if options.sweep:
                before.append(fastest_by_speed(robot, seed))
        print(row(name, walks, before, options.seeds, judged), flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
