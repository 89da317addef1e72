"""Clocks, and the one kind of result that every benchmark returns."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

_PER_SECOND = {"s": 1.0, "ms": 1e3, "µs": 1e6}


@dataclass(frozen=True)
class Result:
    """One measured quantity.

    Attributes:
        name: what to call it in a JSON file.
        what: what was measured, in words.
        unit: of all numbers but the ratio.
        values: every measurement; times are by the wall clock.
        cpu: the same runs by the process's CPU time, where that has a meaning.
        goal, limit: what is aimed at, and what must hold.
        ratio: how many times ours this is, measured in the same run.
        must_hold: whether a value beyond ``limit`` makes the whole run worthless.
    """

    name: str
    what: str
    unit: str
    values: tuple[float, ...]
    cpu: tuple[float, ...] = ()
    goal: float | None = None
    limit: float | None = None
    ratio: float | None = None
    must_hold: bool = False

    @property
    def median(self) -> float:
        """Median of :attr:`values`."""
        return float(np.median(self.values))

    @property
    def cpu_median(self) -> float | None:
        """Median of :attr:`cpu`."""
        return float(np.median(self.cpu)) if self.cpu else None

    @property
    def broken(self) -> bool:
        """Whether this result takes the worth from the others."""
        beyond = self.limit is not None and not self.median <= self.limit
        return self.must_hold and beyond

    def to_dict(self) -> dict[str, Any]:
        """Plain JSON values."""
        return {
            "name": self.name,
            "what": self.what,
            "unit": self.unit,
            "median": self.median,
            "min": min(self.values),
            "p90": float(np.percentile(self.values, 90)),
            "cpu_median": self.cpu_median,
            "repetitions": len(self.values),
            "goal": self.goal,
            "limit": self.limit,
            "ratio": self.ratio,
        }


class Timing(NamedTuple):
    """Times of repeated calls [s].

    Attributes:
        wall: by the wall clock.
        cpu: CPU time of the process, which other programs on the machine disturb less.
    """

    wall: tuple[float, ...]
    cpu: tuple[float, ...]

    @property
    def median(self) -> float:
        """Median CPU time [s], of which ratios are made."""
        return float(np.median(self.cpu))

    def result(self, name: str, what: str, unit: str, **more: Any) -> Result:
        """The times as a result, in ``unit``: ``"s"``, ``"ms"`` or ``"µs"``."""
        wall, cpu = (tuple(_PER_SECOND[unit] * t for t in times) for times in self)
        return Result(name, what, unit, wall, cpu, **more)


def timed(
    calls: Callable[[], object] | Sequence[Callable[[], object]], rounds: int, warm_up: int = 1
) -> Timing:
    """Time one call, or each of several in turn, ``rounds`` times after ``warm_up`` more."""
    todo = [calls] if callable(calls) else list(calls)
    for call in todo * warm_up:
        call()
    wall, cpu = [], []
    for call in todo * rounds:
        wall_start, cpu_start = time.perf_counter(), time.process_time()
        call()
        cpu.append(time.process_time() - cpu_start)
        wall.append(time.perf_counter() - wall_start)
    return Timing(tuple(wall), tuple(cpu))


def least_time(call: Callable[[], object], rounds: int = 5) -> float:
    """Least processor time of some calls [s], after one that does not count."""
    return min(timed(call, rounds).cpu)


def workload() -> float:
    """Least processor time of a fixed workload [s], which shows how fast the machine is just now.

    It has the mixture of most of our code: NumPy on small and on larger arrays, linear algebra, and
    plain Python. It uses nothing of gaitopt, so that it stays the same while gaitopt changes.
    """
    return least_time(_work, rounds=15)


def _work() -> float:
    matrix = np.cos(np.arange(90_000.0)).reshape(300, 300) + 300.0 * np.eye(300)
    total = float(np.linalg.solve(matrix, matrix).trace())
    small = np.arange(30.0).reshape(10, 3)
    for _ in range(1000):
        total += float((small @ small.T).max() + np.linalg.norm(small, axis=1).sum())
    large = np.arange(300_000.0).reshape(100_000, 3)
    for _ in range(3):
        total += float(np.sqrt((large * large).sum(axis=1)).max())
    for number in range(50_000):
        total += number % 7
    return total


def use_one_core() -> bool:
    """Keep this process and its children on one CPU; whether the system can."""
    if not hasattr(os, "sched_setaffinity"):
        return False
    os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})
    return True
