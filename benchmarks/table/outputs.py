"""What is done with a plan: sampling it, keeping it, showing it."""

from __future__ import annotations

import tempfile
from pathlib import Path

import gaitopt
from benchmarks import walks
from benchmarks.measuring import Result, timed


def measure_sample(quick: bool) -> list[Result]:
    """Sampling a plan every 10 ms."""
    plan = walks.plan()
    count = len(plan.sample(0.01))
    timing = timed(lambda: plan.sample(0.01), rounds=3 if quick else 20)
    return [timing.result("sample", f"plan.sample(0.01), {count} samples", "ms")]


def measure_files(quick: bool) -> list[Result]:
    """Writing a plan file, and reading it again."""
    plan, rounds = walks.plan(), 3 if quick else 20
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "plan.npz"
        saving = timed(lambda: plan.save(path), rounds)
        loading = timed(lambda: gaitopt.load_plan(path), rounds)
        size = path.stat().st_size
    return [
        saving.result("save", "plan.save", "ms"),
        loading.result("load", "load_plan", "ms"),
        Result("file-size", "size of the plan file", "kB", (size / 1e3,)),
    ]


def measure_replay(quick: bool) -> list[Result]:
    """Writing the replay of the main job."""
    plan = walks.plan()
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "walk.html"
        timing = timed(lambda: gaitopt.replay(plan, path), 1 if quick else 5, warm_up=not quick)
        size = path.stat().st_size
    return [
        timing.result("replay", "replay", "s", limit=5.0),
        Result("replay-size", "size of the replay", "MB", (size / 1e6,), limit=3.0),
    ]
