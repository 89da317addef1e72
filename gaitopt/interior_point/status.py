"""How a minimisation ended."""

from __future__ import annotations

from enum import Enum


class Status(Enum):
    """How :func:`gaitopt.interior_point.solver.minimise` ended; the value tells what to do."""

    SOLVED = "solved"
    ITERATION_LIMIT = (
        "the iteration limit was reached; allow more iterations, or start nearer to the minimum"
    )
    NO_PROGRESS = (
        "no step made progress; the inequalities may contradict each other: relax them, or start "
        "from another point"
    )
    UNDEFINED_START = (
        "the inequalities have no finite values at the start; start from a point where they have"
    )

    def __str__(self) -> str:
        return self.value
