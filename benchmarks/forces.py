"""Walks with forces on all robots: how fast, certified or not, and what physics makes of them.

``python -m benchmarks.forces --seeds 3 [--robots go2,a1] [--sweep]`` prints a table. With
``--sweep`` it also looks for the fastest walk of a fixed speed, planned phase by phase without
forces, that passes in physics: what could be had before.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence

import numpy as np

import gaitopt

ROBOTS = ("wang2020", "wang2020-fast", "a1", "go1", "go2", "b1", "laikago", "anymal", "anymal_c",
          "hyq", "solo12")  # fmt: skip
COLUMNS = 5
"""Columns a leg: 16 steps."""
SPEEDS = np.arange(0.1, 1.25, 0.1)
"""Speeds of body and feet that the sweep tries [m/s]."""


def walked(robot: gaitopt.Quadruped, seed: int) -> tuple[str, float, bool]:
    """The certificate's outcome, the walk's duration [s], and whether it passes in physics."""
    footholds = gaitopt.s_columns(seed, columns=COLUMNS, robot=robot)
    plan = gaitopt.plan_crawl(robot, footholds)
    outcome = "kept" if gaitopt.verify(plan, collisions=False).ok else "violated"
    return outcome, plan.duration, gaitopt.simulate(plan).passed


def fastest_by_speed(robot: gaitopt.Quadruped, seed: int) -> float:
    """Duration of the fastest walk of a fixed speed that passes in physics [s]; NaN for none."""
    footholds = gaitopt.s_columns(seed, columns=COLUMNS, robot=robot)
    times = []
    for speed in SPEEDS.tolist():
        plan = gaitopt.plan_crawl(robot, footholds, speed=speed, timing="velocity")
        if gaitopt.simulate(plan).passed:
            times.append(plan.duration)
    return min(times, default=float("nan"))


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the table."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.forces", description=__doc__)
    parser.add_argument("--seeds", type=int, default=3, help="terrains of each robot")
    parser.add_argument("--robots", default=",".join(ROBOTS), help="names, joined by commas")
    parser.add_argument("--sweep", action="store_true", help="also walks of a fixed speed")
    options = parser.parse_args(arguments)
    print("| robot | promises kept | passed in physics | 16 steps [s] | by speed alone [s] |")
    print("|---|---|---|---|---|")
    for name in options.robots.split(","):
        robot = gaitopt.load_robot(name)
        kept = passed = 0
        times, before = [], []
        for seed in range(options.seeds):
            try:
                outcome, duration, good = walked(robot, seed)
            except gaitopt.GaitoptError as error:
                print(f"{name}, seed {seed}: {error}", file=sys.stderr)
                continue
            kept, passed = kept + (outcome == "kept"), passed + good
            times.append(duration)
            if options.sweep:
                before.append(fastest_by_speed(robot, seed))
        count = options.seeds
        told = f"{np.median(times):.2f}" if times else ""
        swept = f"{np.nanmedian(before):.2f}" if np.isfinite(before).any() else ""
        print(
            f"| {name} | {kept} of {count} | {passed} of {count} | {told} | {swept} |", flush=True
        )
    return 0


if __name__ == "__main__":
    sys.exit(main())
