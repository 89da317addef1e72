"""Linear programs of neighbours on a path: solved one after another, and judged together.

The answer of one program is a limit of the next one. So they cannot all be solved before the first
of them is used, as in :mod:`gaitopt.dynamics.many_programs`. But DAQP [Arnstrom2022] takes 15 us
for one of them, and a judgement of its answer by itself 50 us. So answers are used first, and
judged later, many of them in a few operations on arrays.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from gaitopt.conventions import BoolArray, FloatArray
from gaitopt.dynamics.small_programs import (
    LINEAR_WEIGHT,
    NO_BOUND,
    PROGRAM_TOLERANCE,
    PROOF_TOLERANCE,
    SOLVER_TOLERANCE,
    solve_linear,
)


class LinearProgram(NamedTuple):
    """The rows of a linear program that is solved for several objectives and last limits.

    Attributes:
        rows: ``A (m, n)``, of order one.
        low, high: of all rows ``(m,)``, within ``-NO_BOUND`` and ``NO_BOUND``; those of the last
            two are written anew for each solution.
    """

    rows: FloatArray
    low: FloatArray
    high: FloatArray


class _Answer(NamedTuple):
    """What is to be judged: a point and multipliers of a program with these last limits.

    ``values`` and ``pull`` are the products of its rows with them. They are made at once, while the
    rows are in the processor's cache: those of 256 programs take 5 MB.
    """

    program: LinearProgram
    costs: FloatArray
    last: tuple[float, float, float, float]
    point: FloatArray
    multipliers: FloatArray
    values: FloatArray
    pull: FloatArray


class ProgramSequence:
    """Solves linear programs one after another.

    A program begins with the rows that held the last one of its size back: neighbours on a path are
    much alike.

    Attributes:
        careful: whether each answer is judged at once, and others are looked for where it is not
            proven.
    """

    def __init__(self) -> None:
        self.careful = False
        self._models: dict[tuple[int, int], tuple[Any, FloatArray]] = {}
        self._costs: dict[tuple[int, int, bool], FloatArray] = {}
        self._answers: list[_Answer] = []

    def extreme(
        self, program: LinearProgram, unknown: int, largest: bool,
        low: tuple[float, float], high: tuple[float, float],
    ) -> FloatArray | None:  # fmt: skip
        """Where one of the unknowns is largest or least ``(n,)``; ``None`` if nowhere.

        Args:
            program: its rows.
            unknown: number of the unknown.
            largest: whether it is to be largest.
            low, high: limits of the last two rows.
        """
        # One by one: a slice takes ten times as long.
        program.low[-2], program.low[-1] = low
        program.high[-2], program.high[-1] = high
        costs = self._costs_of(program.rows.shape[1], unknown, largest)
        found = self._answer(program, costs)
        if found is None:
            return self._proven(program, costs)
        point, multipliers = found
        answer = _Answer(program, costs, (*low, *high), point, multipliers,
                         program.rows.dot(point), multipliers.dot(program.rows))  # fmt: skip
        if not self.careful:
            self._answers.append(answer)
        elif not _proven([answer])[0]:
            return self._proven(program, costs)
        return answer.point

    def all_proven(self) -> bool:
        """Whether multipliers prove all answers since the last call."""
        by_size: dict[tuple[int, int], list[_Answer]] = {}
        for answer in self._answers:
            by_size.setdefault(answer.program.rows.shape, []).append(answer)
        self._answers = []
        return all(_proven(answers).all() for answers in by_size.values())

    def _proven(self, program: LinearProgram, costs: FloatArray) -> FloatArray | None:
        """A minimiser that is proven by itself, without a program before it."""
        self._models.pop(program.rows.shape, None)
        for by_highs in (False, True):
            found = solve_linear(costs, *program, tolerance=PROGRAM_TOLERANCE, by_highs=by_highs)
            if found is not None:
                return found.point
        return None

    def _answer(
        self, program: LinearProgram, costs: FloatArray
    ) -> tuple[FloatArray, FloatArray] | None:
        """DAQP's last point and its multipliers; ``None`` where it says that there is none."""
        import daqp

        rows, low, high = program
        model, last = self._models.get(rows.shape, (None, costs))
        if model is None:
            model = daqp.Model()
            weight, sense = LINEAR_WEIGHT * np.eye(len(costs)), np.zeros(len(rows), dtype=np.int32)
            ready = model.setup(weight, costs, rows, high, low, sense)[0]
            model.settings = {"primal_tol": SOLVER_TOLERANCE}
        elif last is costs:
            ready = model.update(A=rows, bupper=high, blower=low)
        else:
            ready = model.update(f=costs, A=rows, bupper=high, blower=low)
        if ready < 0:
            return None
        self._models[rows.shape] = model, costs
        point, _, status, report = model.solve()
        return (point, report["lam"]) if status > 0 else None

    def _costs_of(self, size: int, unknown: int, largest: bool) -> FloatArray:
        """Costs of a program with ``size`` unknowns, the same array for the same question."""
        key = size, unknown, largest
        if key not in self._costs:
            self._costs[key] = np.zeros(size)
            self._costs[key][unknown] = -1.0 if largest else 1.0
        return self._costs[key]


def _proven(answers: list[_Answer]) -> BoolArray:
    """Which answers of programs of one size are minimisers, by their multipliers ``(N,)``."""
    programs, costs, lasts, *parts = zip(*answers, strict=True)
    low, high = np.array([p.low for p in programs]), np.array([p.high for p in programs])
    last = np.array(lasts)
    low[:, -2:], high[:, -2:] = last[:, :2], last[:, 2:]
    points, multipliers, values, pull = (np.array(part) for part in parts)
    finite = np.maximum(np.abs(points).max(axis=1), np.abs(multipliers).max(axis=1)) < NO_BOUND
    for part in (points, multipliers, values, pull):
        part[~finite] = 0.0
    above, below = high - values, values - low
    gradient = np.array(costs) + LINEAR_WEIGHT * points + pull
    held = np.where(multipliers > 0.0, above, np.where(multipliers < 0.0, below, 0.0))
    return np.asarray(
        finite
        & (np.minimum(above, below) >= -PROGRAM_TOLERANCE).all(axis=1)
        & (np.abs(gradient).max(axis=1) <= PROOF_TOLERANCE)
        & (np.abs(multipliers * held) <= PROOF_TOLERANCE).all(axis=1)
    )
