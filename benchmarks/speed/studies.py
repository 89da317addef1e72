"""How long a study takes by one process and by two, and whether both write the same rows.

``python -m benchmarks.speed.studies [--terrains 100]`` runs ``gaitopt study`` twice in new
processes. It prints wall clock times and processor times, the load of the machine, by how much two
processes are faster, and the time of 10,000 terrains that follows from these.
"""

from __future__ import annotations

import argparse
import csv
import os
import resource
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

from benchmarks.measuring import workload

MANY = 10_000
_OWN = ("work_time", "real_time_factor")
"""Columns with times that a walk took to compute."""


class Run(NamedTuple):
    """One study.

    Attributes:
        wall: by the wall clock [s].
        cpu: processor time of all its processes [s].
        rows: of its table, without the times that they took.
    """

    wall: float
    cpu: float
    rows: list[dict[str, str]]


def run(terrains: int, jobs: int, folder: Path) -> Run:
    """Run a study in a new process."""

    def used() -> float:
        usage = resource.getrusage(resource.RUSAGE_CHILDREN)
        return usage.ru_utime + usage.ru_stime

    table = folder / f"{jobs}.csv"
    command = [sys.executable, "-m", "gaitopt", "study", str(table), "--seeds", str(terrains),
               "--jobs", str(jobs)]  # fmt: skip
    cpu, wall = used(), time.perf_counter()
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    cpu, wall = used() - cpu, time.perf_counter() - wall
    with table.open(newline="") as stream:
        rows = sorted(csv.DictReader(stream), key=lambda row: int(row["seed"]))
    return Run(wall, cpu, [{k: v for k, v in row.items() if k not in _OWN} for row in rows])


def main(arguments: Sequence[str] | None = None) -> int:
    """Print what was measured; the value is 1 where the rows differ."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.speed.studies", description=__doc__)
    parser.add_argument("--terrains", type=int, default=100)
    count = parser.parse_args(arguments).terrains
    found, unit = {}, workload()
    print(f"Fixed workload: {1e3 * unit:.1f} ms of processor time.", flush=True)
    for jobs in (1, 2):
        load = os.getloadavg()[0]
        with TemporaryDirectory() as folder:
            found[jobs] = run(count, jobs, Path(folder))
        wall, cpu, _ = found[jobs]
        print(f"{count} terrains by {jobs}: {wall:.1f} s, processor time {cpu:.1f} s, that is "
              f"{cpu / count:.3f} s a terrain; load before it {load:.1f}", flush=True)  # fmt: skip
    one, two = found[1], found[2]
    equal = one.rows == two.rows
    faster, own = one.wall / two.wall, 2.0 * one.cpu / two.cpu
    print(f"two processes: {faster:.2f} times as fast; by processor times, if both had a core of "
          f"their own, {own:.2f} times; rows equal: {equal}")  # fmt: skip
    minutes = MANY * two.cpu / count / 2.0 / 60.0
    print(f"{MANY} terrains on two cores of their own: {minutes:.1f} min")
    return 0 if equal else 1


if __name__ == "__main__":
    sys.exit(main())
