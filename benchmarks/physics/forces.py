"""Walks with forces on all robots: how fast, certified or not, and what physics makes of them.

``python -m benchmarks.physics.forces --seeds 3 [--robots go2,a1] [--walks default,swing]
[--sweep] [--no-physics] [--no-certificate] [--rows rows.csv]`` prints a table. ``default`` is the
default walk, the other walks are the variants of ``plan_route``. *Found* counts the walks that are
not the walk phase by phase in its place. *Certified* is the certificate with its checks of forces
and of self-collisions. With ``--sweep`` it also looks for the fastest walk of a fixed speed,
planned phase by phase without forces, that passes in physics: what could be had before.

Rows are written into the file of ``--rows`` as they come, and made only if they are not there. So
a table can be stopped and continued, and ``--only-print`` prints what there is.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence

import numpy as np

import gaitopt
from benchmarks.physics.force_rows import ROBOTS, SWEEP, Row, RowFile, benchmark_robot, made, wanted

HEAD = (
    "| robot | walk | terrains | found | certified | passed in physics | 16 steps, median [s] | "
    "in physics, median [s] | planning, median [ms a step] |\n|---|---|---|---|---|---|---|---|---|"
)


def line(name: str, walk: str, rows: list[Row]) -> str:
    """A line of the table: the terrains of one robot and one walk."""
    certified = sum(row.outcome == "certified" for row in rows)
    kept = sum(row.kept for row in rows) - certified
    counts = [f"{len(rows)}", f"{sum(row.found for row in rows)}",
              f"{certified}" + (f", {kept} not all checked" if kept else ""),
              f"{sum(row.passed for row in rows)}"]  # fmt: skip
    columns = [_median([row.duration for row in rows], 2), _median([row.walked for row in rows], 2),
               _median([row.planning for row in rows], 0)]  # fmt: skip
    return f"| {' | '.join([name, walk, *counts, *columns])} |"


def _median(numbers: list[float], digits: int) -> str:
    """The median of the numbers that are there, as a cell."""
    there = [number for number in numbers if np.isfinite(number)]
    return f"{np.median(there):.{digits}f}" if there else ""


def ratios(rows: dict[tuple[int, str, str], Row], name: str, walks: list[str]) -> list[str]:
    """How much faster in physics than the fastest walk of a fixed speed that passes, by terrain."""
    swept = {seed: row.walked for (seed, robot, walk), row in rows.items()
             if robot == name and walk == SWEEP and row.planned}  # fmt: skip
    lines = []
    for walk in walks:
        of = [swept[seed] / rows[seed, name, walk].walked for seed in swept
              if (seed, name, walk) in rows and rows[seed, name, walk].passed]  # fmt: skip
        if of and walk != SWEEP:
            lines.append(f"{name}, {walk}: {np.median(of):.2f} times as fast as the fastest fixed "
                         f"speed ({min(of):.2f} to {max(of):.2f}, {len(of)} terrains)")  # fmt: skip
    return lines


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the table."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.physics.forces", description=__doc__
    )
    parser.add_argument("--seeds", type=int, default=3, help="terrains of each robot")
    parser.add_argument("--robots", default=",".join(ROBOTS), help="names, joined by commas")
    parser.add_argument("--walks", default="default", help="default, and variants of plan_route")
    parser.add_argument("--sweep", action="store_true", help="also walks of a fixed speed")
    parser.add_argument("--no-physics", action="store_true", help="without physics")
    parser.add_argument("--no-certificate", action="store_true", help="without certificates")
    parser.add_argument("--rows", help="CSV file of rows, continued if it is there")
    parser.add_argument("--only-print", action="store_true", help="make no further rows")
    options = parser.parse_args(arguments)
    names, walks = options.robots.split(","), options.walks.split(",")
    walks += [SWEEP] if options.sweep else []
    kept = RowFile(options.rows)
    robots: dict[str, gaitopt.Quadruped] = {}
    for row in wanted(options.seeds, names, walks):
        if row in kept or options.only_print:
            continue
        if row.robot not in robots:
            robots[row.robot] = benchmark_robot(row.robot)
        row = made(robots[row.robot], row, not options.no_certificate, not options.no_physics,
                   kept.rows.values())  # fmt: skip
        kept.add(row)
        if (row.told and row.walk != SWEEP) or not row.planned:
            print(f"{row.robot}, {row.walk}, seed {row.seed}: {row.outcome}; {row.told}",
                  file=sys.stderr, flush=True)  # fmt: skip
    print(HEAD)
    for name in names:
        for walk in walks:
            rows = [r for (seed, robot, what), r in kept.rows.items()
                    if robot == name and what == walk and seed < options.seeds]  # fmt: skip
            if rows:
                print(line(name, walk, rows))
    print(*[text for name in names for text in ratios(kept.rows, name, walks)], sep="\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
