"""Wrong inputs: ``python -m benchmarks.fuzz [--only api] [--cases N] [--seed S]``.

Robots (with ``--robot-file FILE`` also those of other files), footholds, maps, plan files, and all
public functions. Each case runs in a child process
with a bound on time and memory. What counts as a fault is an exception that is not gaitopt's own, a
case that does not end, a file that is left half written, and silent nonsense: a wrong value that
was taken, or a result that is no number. Exit code 1 when there is one.
"""

from __future__ import annotations

import argparse
import json
import os
import select
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

from benchmarks.fuzz.outcome import DIED, FAULTS, HANG
from benchmarks.fuzz.robot_files import FILES_OF_USERS

KINDS = ("robots", "footholds", "maps", "plans", "api", "variants")
PATIENCE = 60.0
"""Most seconds of one case, of processor time where the system tells it. Chosen here: the slowest
sound call takes 15 s on these machines."""
MOST_WAITS = 10
"""Most times that :data:`PATIENCE` passes on the clock: a machine that does other work is slow."""


def main() -> None:
    """Run all cases, print counts and faults."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.fuzz")
    parser.add_argument("--only", choices=KINDS, action="append", help="only this kind")
    parser.add_argument("--cases", type=int, default=2500, help="cases of each kind")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--robot-file", action="append", default=[], metavar="FILE",
                        help="robot files that get faults, too")  # fmt: skip
    parser.add_argument("--show", type=int, default=40, help="faults that are printed of each kind")
    options = parser.parse_args()
    files = [str(Path(file).resolve(strict=True)) for file in options.robot_file]
    os.environ[FILES_OF_USERS] = os.pathsep.join(files)
    faults = 0
    for kind in options.only or KINDS:
        begin = time.monotonic()
        counts: Counter[str] = Counter()
        shown: dict[str, list[str]] = {}
        for found, words, case in results(kind, options.seed, options.cases):
            counts[found] += 1
            if found in FAULTS:
                shown.setdefault(f"{found}: {words}", []).append(str(case))
        told = ", ".join(f"{n} {k}" for k, n in counts.most_common())
        took = time.monotonic() - begin
        print(f"{kind}: {counts.total()} cases in {took:.0f} s, seed {options.seed}: {told}")
        for words, cases in sorted(shown.items(), key=lambda item: -len(item[1]))[: options.show]:
            print(f"  {len(cases)} x {words}\n      {'; '.join(cases[:4])}"[:600])
        faults += sum(counts[k] for k in FAULTS)
    sys.exit(1 if faults else 0)


def results(kind: str, seed: int, count: int) -> Iterator[tuple[str, str, object]]:
    """What becomes of each case: the kind of outcome, words, and the case."""
    first = 0
    while first < count:
        child = subprocess.Popen(
            [sys.executable, "-m", "benchmarks.fuzz.child", kind, str(seed), str(first),
             str(count)], stdout=subprocess.PIPE, env={**os.environ, "OMP_NUM_THREADS": "1"},
        )  # fmt: skip
        running: tuple[int, object] | None = None
        end = ""
        for line in _lines(child):
            index, found, words = json.loads(line)
            if found == "begin":
                running = index, words
            else:
                yield found, words, running[1] if running else None
                running, first = None, index + 1
        if child.poll() is None:
            child.kill()
            end = HANG
        child.wait()
        if running is None:
            if child.returncode:
                raise SystemExit(f"the process of {kind} does not start: {child.returncode}")
            return
        yield end or DIED, f"exit code {child.returncode}", running[1]
        first = running[0] + 1


def _lines(child: subprocess.Popen[bytes]) -> Iterator[bytes]:
    """Lines of a process, as long as each comes in time."""
    stream, rest = child.stdout, b""
    assert stream is not None
    waits, before = 0, _processor_seconds(child.pid)
    while waits < MOST_WAITS:
        if not select.select([stream], [], [], PATIENCE)[0]:
            waits += 1
            # Where nobody knows, this is no number, and the clock counts.
            if not _processor_seconds(child.pid) - before < PATIENCE:
                return
            continue
        more = os.read(stream.fileno(), 65536)
        if not more:
            child.wait()
            return
        waits, before = 0, _processor_seconds(child.pid)
        *whole, rest = (rest + more).split(b"\n")
        yield from whole


def _processor_seconds(process: int) -> float:
    """What a process has used [s]; infinite where the system does not tell."""
    try:
        told = Path(f"/proc/{process}/stat").read_text()
    except OSError:
        return float("inf")
    user, system = told.rpartition(")")[2].split()[11:13]
    return (int(user) + int(system)) / os.sysconf("SC_CLK_TCK")


if __name__ == "__main__":
    main()
