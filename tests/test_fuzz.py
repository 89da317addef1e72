"""A short run of the fuzz: wrong inputs end in gaitopt's own errors, whatever they are."""

from __future__ import annotations

import pytest

from benchmarks.fuzz.__main__ import results
from benchmarks.fuzz.outcome import FAULTS, FOREIGN, REFUSED, holds_nan, outcome


@pytest.mark.parametrize(
    ("kind", "cases"), [("footholds", 120), ("maps", 120), ("plans", 40), ("api", 100)]
)
def test_no_fault_in_files_ends_in_anything_but_an_error_of_gaitopt(kind: str, cases: int) -> None:
    found = list(results(kind, 7, cases))
    assert len(found) == cases
    assert [each for each in found if each[0] in FAULTS] == []
    assert sum(each[0] == REFUSED for each in found) > cases // 2


def test_the_fuzz_sees_foreign_exceptions_and_numbers_that_are_none() -> None:
    assert outcome(lambda: 1 / 0, lambda r: "").kind == FOREIGN
    assert outcome(lambda: float("nan"), lambda r: "nan" * holds_nan(r)).words == "nan"
    assert holds_nan({"a": [(1.0, float("nan"))]}) and not holds_nan(["nan", 1])


def test_numbers_in_another_form_give_the_same_result() -> None:
    """Read-only, big-endian, behind nothing of a mask, in a frame: what is taken is the same."""
    found = list(results("variants", 7, 80))
    assert len(found) == 80
    assert [each for each in found if each[0] in FAULTS] == []
