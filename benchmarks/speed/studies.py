"""How long a study takes by one process and by two, and whether both write the same rows.

``python -m benchmarks.speed.studies [--terrains 100]`` runs ``gaitopt study`` by one process and by
two, each over few terrains and over many. It prints wall clock times and processor times, which
part of these does not depend on the number of terrains (imports, and the picture at the end), the
load of the machine, by how much two processes are faster, and the time of 10,000 terrains. A study
whose rows are all there already shows what no second process can share: the start of the program
and the picture at the end. From it follows how much faster two processes could be at most.
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
FEW = 4
"""Terrains of the study that shows how much does not depend on their number."""
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
    count = max(parser.parse_args(arguments).terrains, 2 * FEW)
    found: dict[int, Run] = {}  # 0 for a study with nothing left to do
    starts, rows, unit = {}, {}, workload()
    print(f"Fixed workload: {1e3 * unit:.1f} ms of processor time.", flush=True)
    for jobs in (1, 2):
        load = os.getloadavg()[0]
        with TemporaryDirectory() as folder:
            few = run(FEW, jobs, Path(folder))
        with TemporaryDirectory() as folder:
            found[jobs] = run(count, jobs, Path(folder))
            found[0] = run(count, jobs, Path(folder))
        wall, cpu, _ = found[jobs]
        rows[jobs] = (cpu - few.cpu) / (count - FEW)
        starts[jobs] = few.cpu - FEW * rows[jobs]
        print(f"{count} terrains by {jobs}: {wall:.1f} s, processor time {cpu:.1f} s, of which "
              f"{starts[jobs]:.1f} s do not depend on the number of terrains, and "
              f"{1e3 * rows[jobs]:.0f} ms are for each of them; load before it {load:.1f}",
              flush=True)  # fmt: skip
    one, two = found[1], found[2]
    equal = one.rows == two.rows
    own = 2.0 * one.cpu / two.cpu
    alone = found[0].cpu
    print(f"nothing left to do: {alone:.2f} s of processor time, so that two processes could be "
          f"{2.0 / (1.0 + alone / one.cpu):.2f} times as fast at most")  # fmt: skip
    print(f"two processes: {one.wall / two.wall:.2f} times as fast; by processor times, if both "
          f"had a core of their own, {own:.2f} times; rows equal: {equal}")  # fmt: skip
    many = {jobs: starts[jobs] + MANY * rows[jobs] for jobs in (1, 2)}
    print(f"{MANY} terrains on two cores of their own: {many[2] / 120.0:.1f} min, "
          f"{2.0 * many[1] / many[2]:.2f} times as fast as one")  # fmt: skip
    return 0 if equal else 1


if __name__ == "__main__":
    sys.exit(main())
