"""Plan files with faults: in the archive's bytes, and in the text and arrays inside."""

from __future__ import annotations

import io
import zipfile
from functools import cache
from typing import Any

import gaitopt
from benchmarks.fuzz.calls import folder, plan, plan_file
from benchmarks.fuzz.mutations import damaged, mutated
from benchmarks.fuzz.outcome import Outcome, holds_nan, outcome

CASES = 10_000


def cases() -> list[int]:
    """Seeds of the faults."""
    return list(range(CASES))


@cache
def _sound(forces: bool) -> bytes:
    if not forces:
        return plan_file().read_bytes()
    path = folder() / "forces.npz"
    plan().save(path)
    return path.read_bytes()


def run(case: int) -> Outcome:
    """Read a plan with faults, and judge every fourth."""
    data = _sound(case % 2 == 0)
    path = folder() / "faulty.npz"
    path.write_bytes(damaged(data, case) if case % 3 == 0 else _inside(data, case))
    return outcome(lambda: _read(path, case), _nonsense)


def _read(path: Any, case: int) -> Any:
    read = gaitopt.load_plan(path)
    found = gaitopt.verify(read, collisions=False) if case % 4 == 0 else None
    return read, read.sample(0.5), found


def _inside(data: bytes, case: int) -> bytes:
    """The archive with one member that has faults."""
    out = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(data)) as old, zipfile.ZipFile(out, "w") as new:
        names = old.namelist()
        for i, name in enumerate(names):
            member = old.read(name)
            if i == case % len(names):
                try:
                    member = mutated(member.decode("utf-8"), case).encode("utf-8", "replace")
                except UnicodeDecodeError:
                    member = damaged(member, case)
            new.writestr(name, member)
    return out.getvalue()


def _nonsense(result: Any) -> str:
    _, samples, _ = result
    return "samples that are no numbers" if holds_nan(samples.q) or holds_nan(samples.v) else ""
