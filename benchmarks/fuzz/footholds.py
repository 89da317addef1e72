"""CSV files of footholds with faults."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np

import gaitopt
from benchmarks.fuzz.calls import folder, footholds
from benchmarks.fuzz.mutations import damaged, mutated
from benchmarks.fuzz.outcome import Outcome, outcome

CASES = 10_000


def cases() -> list[int]:
    """Seeds of the faults."""
    return list(range(CASES))


@cache
def _text() -> str:
    path = folder() / "sound.csv"
    footholds().to_csv(path)
    return path.read_text("utf-8")


def run(case: int) -> Outcome:
    """Read footholds with faults."""
    path = folder() / "faulty.csv"
    data = _text().encode()
    data = (
        damaged(data, case) if case % 3 == 0 else mutated(_text(), case).encode("utf-8", "replace")
    )
    path.write_bytes(data)
    return outcome(lambda: gaitopt.Footholds.from_csv(path), _nonsense)


def _nonsense(found: Any) -> str:
    rows = np.concatenate([found[leg] for leg in gaitopt.LEGS])
    if not np.isfinite(rows).all():
        return "places that are no numbers"
    return "places beyond all measure" if np.abs(rows).max(initial=0.0) > 1e6 else ""
