"""What can only be measured in a process of its own: starting up, and peak memory."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path
from tempfile import TemporaryDirectory

from benchmarks.measuring import Result, Timing, timed
from benchmarks.walks import MAIN_STEPS

_ROOT = Path(__file__).resolve().parents[2]
_IMPORT = "import gaitopt"
_FLOOR = "import numpy, pinocchio, casadi, proxsuite"
_PLAN = "import gaitopt; gaitopt.plan_crawl(gaitopt.load_robot('wang2020'), gaitopt.s_columns(0){})"
_BY_VELOCITY, _BY_FORCES = _PLAN.format(", timing='velocity'"), _PLAN.format("")


def measure_import(quick: bool) -> list[Result]:
    """Whole life of an interpreter that imports gaitopt, or plans once: what a user waits for.

    Bytecode is kept, as it is for users, wherever the environment says that it is not: without it
    all of gaitopt is compiled in each process.
    """
    rounds = 1 if quick else 10
    with TemporaryDirectory() as folder:
        kept = dict(os.environ)
        if kept.pop("PYTHONDONTWRITEBYTECODE", ""):
            kept["PYTHONPYCACHEPREFIX"] = folder
        lives = {code: _lives(code, rounds, kept) for code in (_IMPORT, _FLOOR, _BY_VELOCITY)}
        lives[_BY_FORCES] = _lives(_BY_FORCES, min(rounds, 3), kept)
    steps = f"{MAIN_STEPS} steps"
    return [
        lives[_IMPORT].result("import", "python -c 'import gaitopt'", "s", limit=1.0),
        lives[_FLOOR].result("floor", "the packages that every plan needs, imported alone", "s"),
        lives[_BY_VELOCITY].result(
            "first-plan", f"fresh interpreter to first plan, {steps}", "s", goal=0.4
        ),
        lives[_BY_FORCES].result("first-forces", f"the same, timed by forces, {steps}", "s"),
    ]


def _lives(code: str, rounds: int, environment: Mapping[str, str]) -> Timing:
    """Times of whole interpreters; CPU time is the child's."""
    import resource

    def used() -> float:
        usage = resource.getrusage(resource.RUSAGE_CHILDREN)
        return usage.ru_utime + usage.ru_stime

    _run("-c", code, environment=environment)
    wall: list[float] = []
    cpu: list[float] = []
    for _ in range(rounds):
        before = used()
        wall += timed(lambda: _run("-c", code, environment=environment), rounds=1, warm_up=0).wall
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


def _run(*arguments: str, environment: Mapping[str, str] | None = None) -> str:
    """Output of a fresh interpreter, which runs on this process's one core too."""
    done = subprocess.run(
        [sys.executable, *arguments], cwd=_ROOT, check=True, capture_output=True, text=True,
        env=environment,
    )  # fmt: skip
    return done.stdout
