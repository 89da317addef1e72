"""Programs that are used before they are judged: what is found is what exact programs give."""

from __future__ import annotations

import numpy as np
import pytest
from body_moves import COUNT, INTERVALS, Move, move

from gaitopt import ForceLimits
from gaitopt.dynamics.chains import program_sequence
from gaitopt.dynamics.chains import sweeps as chain_sweeps
from gaitopt.dynamics.chains.interval_programs import interval_programs
from gaitopt.dynamics.chains.program_sequence import LinearProgram, ProgramSequence
from gaitopt.dynamics.chains.sweeps import ProgramSweeps
from gaitopt.dynamics.small_programs import NO_BOUND

LIMITS = ForceLimits()


def sweeps(given: Move) -> ProgramSweeps:
    rows = interval_programs(given.robot, given.dynamics, INTERVALS, LIMITS, given.timing)
    return ProgramSweeps(rows, INTERVALS, given.timing, np.arange(COUNT))


def square() -> LinearProgram:
    """The square ``|x| <= 1, |y| <= 1``, with limits of ``x`` in the last two rows."""
    rows = np.array([[0.0, 1.0], [1.0, 0.0], [1.0, 0.0]])
    return LinearProgram(rows, np.full(3, -1.0), np.full(3, 1.0))


@pytest.mark.parametrize("careful", [False, True])
def test_extremes_of_a_square(careful: bool) -> None:
    sequence, program = ProgramSequence(), square()
    sequence.careful = careful
    for unknown, largest, expected in ((0, True, 0.5), (0, False, -0.25), (1, True, 1.0)):
        found = sequence.extreme(program, unknown, largest, (-0.25, -1.0), (0.5, 1.0))
        assert found is not None and found[unknown] == pytest.approx(expected, abs=1e-6)
    assert sequence.extreme(program, 0, True, (0.5, -NO_BOUND), (1.0, 0.25)) is None
    found = sequence.extreme(program, 0, True, (0.0, -1.0), (0.75, 1.0))
    assert found is not None and found[0] == pytest.approx(0.75)
    assert sequence.all_proven()


def test_an_answer_that_is_not_the_best_is_found_out(monkeypatch: pytest.MonkeyPatch) -> None:
    """It keeps all rows, and its multipliers prove nothing."""
    sequence = ProgramSequence()
    inside = np.zeros(2), np.zeros(3)
    monkeypatch.setattr(sequence, "_answer", lambda *_: inside)
    assert sequence.extreme(square(), 0, True, (-1.0, -1.0), (1.0, 1.0)) is inside[0]
    assert not sequence.all_proven()
    assert sequence.all_proven()
    sequence.careful = True
    found = sequence.extreme(square(), 0, True, (-1.0, -1.0), (1.0, 1.0))
    assert found is not None and found[0] == pytest.approx(1.0)


@pytest.mark.parametrize("bad", [np.inf, np.nan, 0.0, 0.5])
def test_wrong_answers_change_nothing(monkeypatch: pytest.MonkeyPatch, bad: float) -> None:
    """Blocks with answers that are not proven are gone through anew."""
    given = move("anymal_c", 0.06)
    expected = sweeps(given).fastest()
    monkeypatch.setattr(chain_sweeps, "BLOCK", 5)
    answer, asked = ProgramSequence._answer, []

    def wrong(self: ProgramSequence, program: LinearProgram, costs: np.ndarray) -> object:
        found = answer(self, program, costs)
        asked.append(found)
        if found is None or len(asked) % 7:
            return found
        return np.full_like(found[0], bad), np.full_like(found[1], bad)

    monkeypatch.setattr(program_sequence.ProgramSequence, "_answer", wrong)
    found = sweeps(given).fastest()
    assert not isinstance(found, int) and not isinstance(expected, int)
    assert len(asked) > COUNT
    for one, other in zip(found, expected, strict=True):
        assert one == pytest.approx(other, rel=1e-6, abs=1e-9)


def test_other_limits_of_speeds_give_what_new_sweeps_give() -> None:
    """Where they change nothing, what was found before is used."""
    given = move("anymal_c", 0.06)
    first, before = sweeps(given), sweeps(given).fastest()
    again = first.fastest()
    assert not isinstance(before, int) and not isinstance(again, int)
    squares = given.timing.squares.copy()
    middle = COUNT // 2
    squares[middle] = before[0][middle] / 2.0
    slower = given._replace(timing=given.timing.__class__(
        squares, given.timing.first, given.timing.second
    ))  # fmt: skip
    first.limit(slower.timing)
    found, anew = first.fastest(), sweeps(slower).fastest()
    assert not isinstance(found, int) and not isinstance(anew, int)
    for one, other in zip(found, anew, strict=True):
        assert one == pytest.approx(other, rel=1e-6, abs=1e-9)
    assert found[0][middle] == pytest.approx(squares[middle], rel=1e-6)
