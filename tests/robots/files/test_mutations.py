"""Robot files with random faults: each is read, or refused by an error of gaitopt."""

from __future__ import annotations

import pytest

from benchmarks.fuzz.outcome import FAULTS, OK, REFUSED
from benchmarks.fuzz.robot_files import sources
from benchmarks.fuzz.robots import run, with_faults


@pytest.mark.filterwarnings("ignore::gaitopt.RobotWarning")
@pytest.mark.parametrize("first", [1, 501])
def test_faults_give_a_robot_that_makes_sense_or_a_typed_error(first: int) -> None:
    """``python -m benchmarks.fuzz --only robots --cases 10000`` does the same more often."""
    slow = [case for case in range(first, first + 35)
            if case % 4 == 0 or with_faults(case)[1].endswith("xacro")]  # fmt: skip
    found = [run(case) for case in range(first, first + 35) if case not in slow]
    assert [each for each in found if each.kind in FAULTS] == []
    assert sum(each.kind == OK for each in found) > 2
    assert sum(each.kind == REFUSED for each in found) > 5


def test_faults_come_into_every_kind_of_file() -> None:
    kinds = {name.rpartition(".")[2] for _, name, _ in map(with_faults, range(300))}
    assert kinds == {"urdf", "xacro", "xml", "stl", "obj", "dae"}
    assert len(sources()) == 11
