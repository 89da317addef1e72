"""The second judge, which looks at samples only, agrees with the certificate on small plans.

Its numbers are held against facts that are known without either of the two.
"""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from benchmarks import second_judge
from benchmarks.judge.body import depth
from benchmarks.judge.faults import hurried, planted
from benchmarks.judge.forces import velocities
from benchmarks.judge.judging import judge
from gaitopt import MotionPath, Plan


def test_both_judges_certify_a_walk_with_forces(a1_walk: Plan) -> None:
    case = second_judge.both(a1_walk, "a1", faulty=False, instants=20)
    assert (case.certificate, case.second.verdict) == ("certified", "holds")
    assert case.agreement == "agree"


def test_both_judges_find_the_same_faults(a1_walk: Plan) -> None:
    settings = a1_walk.settings
    assert settings.forces is not None
    slippery = replace(settings, forces=replace(settings.forces, friction=0.1))
    lower = np.array(a1_walk.path.coefficients)
    lower[-1, :, 2] -= 5e-3
    moved = replace(a1_walk, path=MotionPath(a1_walk.path.times, lower))
    for plan, check in (
        (replace(a1_walk, settings=slippery), "contact forces"),
        (moved, "feet on their footholds"),
        (replace(a1_walk, phases=a1_walk.phases[:-2]), "contact sequence"),
    ):
        case = second_judge.both(plan, check, faulty=True, instants=20)
        assert case.agreement == "agree" and case.certificate == "violated"
        assert check in [f.check for f in case.second.broken] and check in case.checks


def test_a_fault_that_one_judge_does_not_see_is_told(
    a1_walk: Plan, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Here it is the second judge who is given another plan, with half of the time."""
    monkeypatch.setattr(second_judge, "made", lambda number, seed, families: (a1_walk, "a1"))
    monkeypatch.setattr(
        second_judge, "judge", lambda plan, seed, instants: judge(hurried(plan, 0.5), seed, 5)
    )
    assert second_judge.main(["--plans", "1"]) == 1
    assert "MISSED: a1" in capsys.readouterr().out


def test_a_run_that_was_stopped_goes_on(
    a1_walk: Plan, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """Each plan is a line; one that was cut off in writing is judged again, the others are not."""
    asked: list[int] = []

    def made(number: int, seed: int, families: object) -> tuple[Plan, str] | None:
        asked.append(number)
        return None if number == 1 else (a1_walk, "a1")

    monkeypatch.setattr(second_judge, "made", made)
    rows = tmp_path / "rows.jsonl"
    first = ["--plans", "2", "--instants", "2", "--rows", str(rows)]
    assert second_judge.main(first) == 0 and asked == [0, 1]
    whole = rows.read_text()
    rows.write_text(whole + whole[:20])
    assert second_judge.main([*first[:1], "3", *first[2:]]) == 0 and asked == [0, 1, 2]
    assert [json.loads(line)["number"] for line in rows.read_text().splitlines()] == [0, 1, 2]


def test_the_same_seed_plants_the_same_fault(a1_walk: Plan) -> None:
    said = {planted(a1_walk, np.random.default_rng(5))[1] for _ in range(2)}
    assert len(said) == 1
    assert len({planted(a1_walk, np.random.default_rng(k))[1] for k in range(20)}) > 10


def test_depths_in_a_triangle_and_beside_a_line() -> None:
    triangle = np.array([[[0.0, 0.0], [4.0, 0.0], [0.0, 3.0]]])
    inside, outside = np.array([[1.0, 1.0]]), np.array([[1.0, -0.5]])
    assert depth(inside, triangle) == pytest.approx([1.0])  # the circle inside 3, 4, 5
    assert depth(outside, triangle) == pytest.approx([-0.5])
    square = np.array([[[0.0, 0.0], [1.0, 1.0], [1.0, 0.0], [0.0, 1.0]]])
    assert depth(np.array([[0.3, 0.5]]), square) == pytest.approx([0.3])
    line = np.array([[[0.0, 0.0], [1.0, 0.0]]])
    assert depth(np.array([[3.0, 4.0]]), line) == pytest.approx([-np.hypot(2.0, 4.0)])


def test_accelerations_of_the_base_are_differences_of_its_velocities() -> None:
    rng = np.random.default_rng(0)
    c = rng.normal(size=(3, 18)) * 0.5

    def at(t: float) -> tuple[np.ndarray, ...]:
        return velocities(c[0] + c[1] * t + c[2] * t**2, c[1] + 2 * c[2] * t, 2 * c[2])

    h = 1e-6
    numeric = (at(0.3 + h)[0] - at(0.3 - h)[0]) / (2 * h)
    np.testing.assert_allclose(at(0.3)[1], numeric, atol=1e-8)
