"""How long replays take to make, and how large they are, for longer and longer walks.

``python -m benchmarks.speed.replays [--columns 17,65,129,257]`` prints processor times and sizes
for walks of wang2020 over so many columns, timed by joint velocities; the last one also by forces.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

import gaitopt
from benchmarks.measuring import use_one_core, workload


def line(columns: int, timing: str) -> str:
    """A line of the table."""
    footholds = gaitopt.s_columns(0, columns=columns)
    plan = gaitopt.plan_crawl(gaitopt.load_robot("wang2020"), footholds, timing=timing)
    with TemporaryDirectory() as folder:
        page = Path(folder) / "page.html"
        start = time.process_time()
        gaitopt.replay(plan, page)
        took = time.process_time() - start
        size = page.stat().st_size / 1e6
    return f"| {len(plan.swings)} | {timing} | {took:.2f} | {size:.1f} |"


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the table."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.speed.replays", description=__doc__)
    parser.add_argument("--columns", default="17,65,129,257", help="joined by commas")
    sizes = [int(n) for n in parser.parse_args(arguments).columns.split(",")]
    use_one_core()
    print(f"Fixed workload: {1e3 * workload():.1f} ms of processor time.\n")
    print("| steps | timing | CPU [s] | page [MB] |\n|---|---|---|---|")
    line(2, "velocity")
    for columns in sizes:
        print(line(columns, "velocity"), flush=True)
    print(line(sizes[-1], "forces"))
    return 0


if __name__ == "__main__":
    sys.exit(main())
