"""Processor time of the search for footholds, for each metre, by robot and ground.

``python -m benchmarks.speed.terrain --robots go2,anymal_c --grounds rubble,stairs --seeds 5``

Times of one machine say little about another. So each is also given as a multiple of a fixed
workload in the same run: planning the walk of the paper, 64 steps, without forces.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from time import process_time
from typing import NamedTuple

import numpy as np

import gaitopt
from benchmarks import walks
from benchmarks.measuring import timed, use_one_core

ROBOTS = ("go2", "anymal_c", "wang2020", "hyq")
GROUNDS = ("rubble", "stepping_stones", "stairs", "ramp", "gaps", "hills")
ROUNDS = 10
"""How often the fixed workload is timed, before the searches and after them."""


class Searched(NamedTuple):
    """A search.

    Attributes:
        found: whether it reached the goal.
        rate: processor time for each metre of the way [s/m].
    """

    found: bool
    rate: float


def searched(
    robot: gaitopt.Quadruped, name: str, seed: int, difficulty: float, length: float
) -> Searched:
    """Search over one ground."""
    ground = gaitopt.make_ground(
        name, seed=seed, difficulty=difficulty, length=length, robot=robot
    )  # fmt: skip
    began = process_time()
    search = gaitopt.search_terrain(robot, ground, (length, 0.0), start=(0.0, 0.0, 0.0))
    return Searched(search.complete, (process_time() - began) / search.metres)


def workload() -> float:
    """Processor time of the fixed workload [s]."""
    robot, footholds = walks.robot(), walks.terrain()
    return timed(lambda: gaitopt.plan_crawl(robot, footholds, timing="velocity"), ROUNDS).median


def row(robot: str, ground: str, searches: Sequence[Searched], unit: float) -> str:
    """A row of the table.

    Args:
        robot, ground: their names.
        searches: over grounds of this kind.
        unit: time of the fixed workload [s].
    """
    rates = np.array([s.rate for s in searches if s.found])
    cells = [robot, ground, f"{len(rates)} of {len(searches)}"]
    for value in np.percentile(rates, [50, 95]) if rates.size else ():
        cells += [f"{value:.2f}", f"{value / unit:.0f}"]
    cells += [""] * (7 - len(cells))
    return f"| {' | '.join(cells)} |"


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the table."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.speed.terrain", description=__doc__)
    parser.add_argument("--seeds", type=int, default=5, help="grounds of each kind")
    parser.add_argument("--difficulty", type=float, default=0.5, help="of the grounds, 0 to 1")
    parser.add_argument("--length", type=float, default=3.0, help="from start to goal [m]")
    parser.add_argument("--robots", default=",".join(ROBOTS), help="names, joined by commas")
    parser.add_argument("--grounds", default=",".join(GROUNDS), help="names, joined by commas")
    options = parser.parse_args(arguments)
    use_one_core()
    before = workload()
    table: list[tuple[str, str, list[Searched]]] = []
    for name in options.robots.split(","):
        robot = gaitopt.load_robot(name)
        searched(robot, "flat", 0, 0.0, 2.0)  # modules are loaded, and tables of limbs made
        for ground in options.grounds.split(","):
            found = [searched(robot, ground, seed, options.difficulty, options.length)
                     for seed in range(options.seeds)]  # fmt: skip
            table.append((name, ground, found))
            print(f"{name}, {ground}: done", file=sys.stderr)
    unit = (before + workload()) / 2.0
    print(f"Fixed workload: {1e3 * unit:.1f} ms of processor time.\n")
    print("| robot | ground | found | median [s/m] | as workloads | 95 % [s/m] | as workloads |")
    print("|---|---|---|---|---|---|---|")
    for name, ground, found in table:
        print(row(name, ground, found, unit))
    return 0


if __name__ == "__main__":
    sys.exit(main())
