"""What can only be measured in a process of its own: starting up, and peak memory."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

from benchmarks.measuring import Result, Timing, timed
from benchmarks.walks import MAIN_STEPS

_ROOT = Path(__file__).resolve().parents[2]
_IMPORT = "import gaitopt"
_FIRST_PLAN = (
    "import gaitopt; gaitopt.plan_crawl(gaitopt.load_robot('wang2020'), gaitopt.s_columns(0),"
    " timing='velocity')"
)


def measure_import(quick: bool) -> list[Result]:
    """Whole life of an interpreter that imports gaitopt, or plans once: what a user waits for."""
    rounds = 1 if quick else 10
    return [
        _lives(_IMPORT, rounds).result("import", "python -c 'import gaitopt'", "s", limit=1.0),
        _lives(_FIRST_PLAN, rounds).result(
            "first-plan", f"fresh interpreter to first plan, {MAIN_STEPS} steps", "s"
        ),
    ]


def _lives(code: str, rounds: int) -> Timing:
    """Times of whole interpreters; CPU time is the child's."""
    import resource

    def used() -> float:
        usage = resource.getrusage(resource.RUSAGE_CHILDREN)
        return usage.ru_utime + usage.ru_stime

    _run("-c", code)
    wall: list[float] = []
    cpu: list[float] = []
    for _ in range(rounds):
        before = used()
        wall += timed(lambda: _run("-c", code), rounds=1, warm_up=0).wall
        cpu.append(used() - before)
    return Timing(tuple(wall), tuple(cpu))


def measure_memory(quick: bool) -> list[Result]:
    """Peak memory of planning, at the main job's size and a long walk's."""
    results = []
    for steps in (MAIN_STEPS, 256 if quick else 4096):
        peak = json.loads(_run("-m", "benchmarks.table.peak", str(steps)))
        results += [
            Result(f"memory-plan-{steps}", f"peak within plan_crawl, {steps} steps (tracemalloc)",
                   "MB", (peak["plan"] / 1e6,)),
            Result(f"memory-process-{steps}", f"peak of the process, {steps} steps (resident)",
                   "MB", (peak["process"] / 1e6,)),
        ]  # fmt: skip
    return results


def _run(*arguments: str) -> str:
    """Output of a fresh interpreter, which runs on this process's one core too."""
    done = subprocess.run(
        [sys.executable, *arguments], cwd=_ROOT, check=True, capture_output=True, text=True
    )
    return done.stdout
