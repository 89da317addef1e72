"""``gaitopt race``, run as a user runs it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from typer.testing import Result

import gaitopt

Command = Callable[..., Result]


def test_a_race_prints_its_table_and_writes_replay_picture_and_plans(
    command: Command, tmp_path: Path
) -> None:
    out = tmp_path / "out"
    result = command("race", "--columns", "3", "--rows", "ssm,swing,posture", "--out", str(out))
    assert result.exit_code == 0, result.output
    for words in ("SSM baseline", "the paper", "swing", "posture", "× the paper", "kinematics only",
                  "race.html", "race.png", "4 plans"):  # fmt: skip
        assert words in result.output
    assert {path.name for path in out.iterdir()} == {
        "race.html", "race.png", "plan_ssm_baseline.npz", "plan_the_paper.npz", "plan_swing.npz",
        "plan_posture.npz", "run.json",
    }  # fmt: skip
    plan = gaitopt.load_plan(out / "plan_posture.npz")
    assert str(plan.settings.free) == "posture" and f"{plan.duration:.2f}" in result.output
    assert (out / "race.png").read_bytes().startswith(b"\x89PNG")


def test_several_seeds_give_medians_and_a_line_a_walk(command: Command, tmp_path: Path) -> None:
    result = command(
        "race", "--columns", "2", "--rows", "swing", "--seed", "5", "--seeds", "2", "--jobs", "1",
        "--no-collisions", "--stability-margin", "0.025", "--out", str(tmp_path),
    )  # fmt: skip
    assert result.exit_code == 0, result.output
    assert "of 2 terrains" in result.output and "2 of 2" in result.output
    lines = (tmp_path / "race.csv").read_text().splitlines()
    assert len(lines) == 5 and [line[:2] for line in lines[1:]] == ["5,", "5,", "6,", "6,"]
    assert gaitopt.load_plan(tmp_path / "plan_swing.npz").settings.stability_margin == 0.025


def test_a_race_with_forces_tells_what_is_certified(command: Command, tmp_path: Path) -> None:
    result = command(
        "race", "--columns", "2", "--rows", "phases", "--timing", "forces", "--friction", "0.5",
        "--no-bound", "--out", str(tmp_path),
    )  # fmt: skip
    assert result.exit_code == 0, result.output
    for words in ("phase by phase", "certified", "kinematics only", "timed by contact forces"):
        assert words in " ".join(result.output.split())
    plan = gaitopt.load_plan(tmp_path / "plan_phase_by_phase.npz")
    assert plan.settings.forces is not None and plan.settings.forces.friction == 0.5
    assert "\\ncertified" in (tmp_path / "race.html").read_text("utf-8")


def test_footholds_of_ones_own_are_raced(command: Command, tmp_path: Path) -> None:
    gaitopt.s_columns(2, columns=2).to_csv(tmp_path / "feet.csv")
    result = command("race", "--footholds", str(tmp_path / "feet.csv"), "--rows", "route",
                     "--no-certify", "--out", str(tmp_path))  # fmt: skip
    assert result.exit_code == 0, result.output
    assert "over 4 steps" in result.output and "unchecked" in result.output


def test_a_race_that_nobody_can_run_says_why_and_exits_with_1(
    command: Command, tmp_path: Path
) -> None:
    result = command("race", "--columns", "2", "--rows", "swing", "--stability-margin", "0.3",
                 "--out", str(tmp_path))  # fmt: skip
    assert result.exit_code == 1, result.output
    assert "inscribed circle" in " ".join(result.output.split())
    assert {path.name for path in tmp_path.iterdir()} == {"race.png", "run.json"}


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--rows", "swing,fly"], "rows names 'fly'; there are ssm, paper"),
        (["--footholds", "a.csv", "--seeds", "2"], "a CSV is one terrain"),
        (["--footholds", "a.csv", "--columns", "3"], "a CSV is one terrain"),
        (["--robot", "nope"], "unknown robot 'nope'"),
        (["--columns", "2", "--stability-margin", "-1"], "stability_margin"),
    ],
)
def test_mistakes_are_named_before_anything_is_written(
    error_of: Callable[..., str], arguments: list[str], words: str, tmp_path: Path
) -> None:
    assert words in error_of("race", *arguments, "--out", str(tmp_path / "out"))
    assert not (tmp_path / "out").exists()
