"""Walks with weak joints and large reserves: what regions in which forces hold the robot are for.

``python -m benchmarks.standing --seeds 2 [--robots go2,a1] [--rooms 0.5]`` prints a table: how many
walks are found without and with the regions, and how long they take. ``--rooms`` are distances
from a region's sides that are tried, as shares of the stability margin.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import numpy as np

import gaitopt
from benchmarks.forces import COLUMNS, ROBOTS
from gaitopt.planners.phase_by_phase import demands

LIMITS = {
    "default": gaitopt.ForceLimits(),
    "reserve 5 %": gaitopt.ForceLimits(reserve=0.05),
    "reserve 10 %": gaitopt.ForceLimits(reserve=0.1),
    "torque 50 %": gaitopt.ForceLimits(torque_share=0.5),
    "torque 40 %": gaitopt.ForceLimits(torque_share=0.4),
    "torque 30 %": gaitopt.ForceLimits(torque_share=0.3),
}
"""What is asked of forces, by name."""


@contextmanager
def changed(name: str, value: Any) -> Iterator[None]:
    """Another value of a name in the planner's demands, for a while."""
    before = getattr(demands, name)
    setattr(demands, name, value)
    try:
        yield
    finally:
        setattr(demands, name, before)


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


def told(times: list[float], seeds: int) -> str:
    """How many walks, and their median, as a cell."""
    found = f"{len(times)} of {seeds}"
    return f"{found}, {np.median(times):.2f} s" if times else found


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the table."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.standing", description=__doc__)
    parser.add_argument("--seeds", type=int, default=2, help="terrains of each robot")
    parser.add_argument("--robots", default=",".join(ROBOTS), help="names, joined by commas")
    parser.add_argument("--rooms", default=str(demands.ROOM), help="shares, joined by commas")
    options = parser.parse_args(arguments)
    rooms = [float(room) for room in options.rooms.split(",")]
    heads = " | ".join(f"with {room:g} of the margin" for room in rooms)
    print(f"| robot | limits | without regions | {heads} | steps set by regions |")
    print("|---" * (4 + len(rooms)) + "|")
    for name in options.robots.split(","):
        robot = gaitopt.load_robot(name)
        for limit, limits in LIMITS.items():
            with changed("half_planes_by_forces", lambda *_: {}):
                cells = [told(walks(robot, limits, options.seeds)[0], options.seeds)]
            for room in rooms:
                with changed("ROOM", room):
                    times, steps = walks(robot, limits, options.seeds)
                cells.append(told(times, options.seeds))
            print(f"| {name} | {limit} | {' | '.join(cells)} | {steps} |", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
