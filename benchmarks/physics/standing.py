"""Walks with weak joints and large reserves: what regions in which forces hold the robot are for.

``python -m benchmarks.physics.standing --seeds 2 [--robots go2,a1] [--rooms 0.5]`` prints a table:
how many walks are found without and with the regions, and how long they take. ``--rooms`` are
distances from a region's sides that are tried, as shares of the stability margin. ``--times``
prints instead how much processor time a region takes, beside that of a fixed workload, and what
planning walks spends on regions.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from time import process_time
from typing import Any
from unittest.mock import patch

import numpy as np

import gaitopt
from benchmarks.measuring import workload
from benchmarks.physics.force_rows import COLUMNS, ROBOTS
from gaitopt.dynamics.feasible_region import feasible_regions
from gaitopt.planners.phase_by_phase import demands, standing_places

LIMITS = {
    "default": gaitopt.ForceLimits(),
    "reserve 5 %": gaitopt.ForceLimits(reserve=0.05),
    "reserve 10 %": gaitopt.ForceLimits(reserve=0.1),
    "torque 50 %": gaitopt.ForceLimits(torque_share=0.5),
    "torque 40 %": gaitopt.ForceLimits(torque_share=0.4),
    "torque 30 %": gaitopt.ForceLimits(torque_share=0.3),
}
"""What is asked of forces, by name."""

LOOKED_UP = "half_planes_by_forces"
"""The function by which the planner finds where forces hold the robot."""


def walks(
    robot: gaitopt.Quadruped, limits: gaitopt.ForceLimits, seeds: int
) -> tuple[list[float], int]:
    """Durations of the walks that are found [s], and how many of their steps regions set."""
    times, steps = [], 0
    for seed in range(seeds):
        footholds = gaitopt.s_columns(seed, columns=COLUMNS, robot=robot)
        try:
            plan = gaitopt.plan_crawl(robot, footholds, forces=limits)
        except gaitopt.GaitoptError:
            continue
        times.append(plan.duration)
        steps += sum(any(x.kind == "forces" for x in p.limited_by) for p in plan.phases)
    return times, steps


def without_regions() -> AbstractContextManager[object]:
    """While it is entered, plans are made without regions."""
    return patch.object(standing_places, LOOKED_UP, lambda *_: {})


def told(times: list[float], seeds: int) -> str:
    """How many walks, and their median, as a cell."""
    found = f"{len(times)} of {seeds}"
    return f"{found}, {np.median(times):.2f} s" if times else found


def of_regions(robot: gaitopt.Quadruped) -> tuple[float, float]:
    """Processor time of a region among those of 28 swings, and alone [s].

    Every foot keeps 5 % of the weight, and joints use 60 % of their torques.
    """
    limits = gaitopt.ForceLimits(reserve=0.05, torque_share=0.6)
    ground = gaitopt.s_columns(0, columns=8, robot=robot)
    plan = gaitopt.plan_crawl(robot, ground, timing="velocity", com="model")
    middles = np.array([p.start + p.duration / 2.0 for p in plan.phases if p.kind == "swing"])
    motion, postures = plan.at(middles), plan.path.evaluate(middles)[:, :6]
    standing = np.array(motion.contacts)

    def together() -> object:
        return feasible_regions(
            robot, motion.feet, limits=limits, standing=standing, postures=postures
        )

    def alone() -> object:
        support = [leg for leg, stands in zip(gaitopt.LEGS, standing[0], strict=True) if stands]
        return gaitopt.feasible_region(
            robot, motion.feet[0], limits=limits, support=support, posture=postures[0]
        )

    return least_time(together, 5) / len(middles), least_time(alone, 20)


def least_time(work: Callable[[], object], repetitions: int) -> float:
    """The least processor time that ``work`` takes [s]."""
    times = []
    for _ in range(repetitions):
        began = process_time()
        work()
        times.append(process_time() - began)
    return min(times)


def of_planning(robot: gaitopt.Quadruped) -> tuple[float, float]:
    """Processor time of a default walk of 64 steps [s], and the part that regions take."""
    spent = [0.0]
    look = getattr(standing_places, LOOKED_UP)

    def timed(*given: Any) -> Any:
        began = process_time()
        try:
            return look(*given)
        finally:
            spent[0] += process_time() - began

    ground = gaitopt.s_columns(0, robot=robot)
    with patch.object(standing_places, LOOKED_UP, timed):
        gaitopt.plan_crawl(robot, ground)
        spent[0], began = 0.0, process_time()
        gaitopt.plan_crawl(robot, ground)
        return process_time() - began, spent[0]


def print_times(names: Sequence[str]) -> None:
    """Print the table of ``--times``."""
    print("| robot | a region among many [ms] | alone [ms] | fixed workload [ms] | 64 steps [s] "
          "| of it regions [s] |\n|---|---|---|---|---|---|")  # fmt: skip
    for name in names:
        robot = gaitopt.load_robot(name)
        many, alone = of_regions(robot)
        pace = workload()
        whole, part = of_planning(robot)
        print(f"| {name} | {1e3 * many:.2f} | {1e3 * alone:.2f} | {1e3 * pace:.1f} | {whole:.2f} "
              f"| {part:.3f} |", flush=True)  # fmt: skip


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the table."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.physics.standing", description=__doc__
    )
    parser.add_argument("--seeds", type=int, default=2, help="terrains of each robot")
    parser.add_argument("--robots", default=",".join(ROBOTS), help="names, joined by commas")
    parser.add_argument("--rooms", default=str(demands.ROOM), help="shares, joined by commas")
    parser.add_argument("--times", action="store_true", help="how long regions take")
    options = parser.parse_args(arguments)
    if options.times:
        print_times(options.robots.split(","))
        return 0
    rooms = [float(room) for room in options.rooms.split(",")]
    heads = " | ".join(f"with {room:g} of the margin" for room in rooms)
    print(f"| robot | limits | without regions | {heads} | steps set by regions |")
    print("|---" * (4 + len(rooms)) + "|")
    for name in options.robots.split(","):
        robot = gaitopt.load_robot(name)
        for limit, limits in LIMITS.items():
            with without_regions():
                cells = [told(walks(robot, limits, options.seeds)[0], options.seeds)]
            for room in rooms:
                with patch.object(demands, "ROOM", room):
                    times, steps = walks(robot, limits, options.seeds)
                cells.append(told(times, options.seeds))
            print(f"| {name} | {limit} | {' | '.join(cells)} | {steps} |", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
