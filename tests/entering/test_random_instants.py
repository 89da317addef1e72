"""Random instants of ten plans, handed back: what is planned continues them, and is certified."""

from __future__ import annotations

import pytest

from benchmarks.physics.from_state import CASES, main, outcomes


@pytest.mark.slow
@pytest.mark.parametrize("name", list(CASES))
def test_a_hundred_random_instants_of_each_plan(name: str) -> None:
    found = outcomes(name, 100).found
    good = found.pop("certified")
    # Time-optimal walks are refused where a foot that lands takes all that friction leaves.
    assert good >= (80 if name.startswith("route") else 98), found
    assert all(what.startswith("refused") for what in found), found


def test_the_benchmark_counts_outcomes(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--instants", "2", "--cases", "crawl of a1"]) == 0
    assert "2 of 2" in capsys.readouterr().out
