"""The free gait over hard random terrains: what it rescues, and what it saves.

``python -m benchmarks.planning.orders [--count 300]`` plans each terrain phase by phase with the
paper's order of legs, with each of the other five cycles, and with the order that is searched for.
Strides are up to three times the paper's and columns scattered up to 10 cm, so that many terrains
are too hard for a fixed order. Only certified plans count: an order on which legs touch is of no
use. Exit code 1 when the search loses a terrain on which a fixed order is certified.
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from collections.abc import Sequence

import numpy as np
from rich.console import Console
from rich.progress import track
from rich.table import Table

import gaitopt
from gaitopt import Footholds, InfeasibleStepError, Plan, Quadruped
from gaitopt.gait.crawl import CRAWL_SEQUENCES, WANG_SEQUENCE

COLUMNS = 6


def hard_terrain(seed: int) -> Footholds:
    """Columns with long strides, scattered widely."""
    rng = np.random.default_rng([seed, 3])
    return gaitopt.s_columns(
        seed, columns=COLUMNS, forward=(COLUMNS - 1) * rng.uniform(0.1, 0.28),
        jitter=rng.uniform(0.0, 0.1), amplitude=rng.uniform(0.0, 0.15),
    )  # fmt: skip


def certified(robot: Quadruped, terrain: Footholds, sequence: Sequence[str] | str) -> Plan | str:
    """The plan, or why there is none that is certified."""
    try:
        plan = gaitopt.plan_crawl(robot, terrain, sequence=sequence, timing="velocity")
    except InfeasibleStepError:
        return "impossible"
    violations = gaitopt.verify(plan).violations
    return violations[0].name if violations else plan


def case(robot: Quadruped, seed: int) -> tuple[str, float | None]:
    """What became of one terrain, and the share of time that the free gait saves."""
    try:
        terrain = hard_terrain(seed)
    except gaitopt.GaitoptError:
        return "no such terrain: columns would stand in one another", None
    fixed, free = certified(robot, terrain, WANG_SEQUENCE), certified(robot, terrain, "free")
    if isinstance(fixed, Plan):
        if not isinstance(free, Plan):
            return f"FREE GAIT LOSES: {free}", None
        return "the paper's order", 1.0 - free.duration / fixed.duration
    cycles = (o for o in CRAWL_SEQUENCES if o != WANG_SEQUENCE)
    another = any(isinstance(certified(robot, terrain, order), Plan) for order in cycles)
    rescue = {(True, True): "rescued by another cycle, and by the search",
              (False, True): "rescued by the search alone",
              (True, False): "RESCUED BY ANOTHER CYCLE ALONE",
              (False, False): "no order"}[another, isinstance(free, Plan)]  # fmt: skip
    return f"{rescue} (the paper's order: {fixed})", None


def main(arguments: Sequence[str] | None = None) -> int:
    """Plan all terrains and print what became of them."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.planning.orders", description=__doc__
    )
    parser.add_argument("--count", type=int, default=300, help="terrains")
    parser.add_argument("--first", type=int, default=0, help="first seed")
    options = parser.parse_args(arguments)
    robot = gaitopt.load_robot("wang2020")
    found: Counter[str] = Counter()
    saved: list[float] = []
    for seed in track(range(options.first, options.first + options.count), "planning",
                      transient=True):  # fmt: skip
        outcome, share = case(robot, seed)
        found[outcome] += 1
        if share is not None:
            saved.append(share)
    table = Table(title=f"{options.count} hard terrains of {4 * (COLUMNS - 1)} steps")
    table.add_column("possible with")
    table.add_column("terrains", justify="right")
    for outcome, number in found.most_common():
        table.add_row(outcome, str(number))
    console = Console()
    console.print(table)
    if saved:
        low, middle, high = 100.0 * np.percentile(saved, [0, 50, 100])
        console.print(
            f"where the paper's order is possible, the free one saves {middle:.1f} % of the time "
            f"(median; {low:.1f} to {high:.1f} %)"
        )
    return int(any(outcome[:4].isupper() for outcome in found))


if __name__ == "__main__":
    sys.exit(main())
