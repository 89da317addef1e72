"""The command line, run as a user runs it."""

from __future__ import annotations

import dataclasses
import subprocess
import sys
import webbrowser
from pathlib import Path

import pytest
from typer.testing import CliRunner

import gaitopt
from gaitopt import GaitoptError, Plan, Quadruped
from gaitopt.cli.app import app

runner = CliRunner()


def run(*arguments: str, cwd: Path | None = None) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "gaitopt", *arguments],
        capture_output=True, text=True, cwd=cwd, timeout=120, check=False,
    )  # fmt: skip


def fails(*arguments: str) -> str:
    """The words of the error that these arguments end in."""
    result = runner.invoke(app, list(arguments))
    assert isinstance(result.exception, GaitoptError), result.output
    return str(result.exception)


def test_walk_writes_plan_replay_and_figures(tmp_path: Path) -> None:
    """What `make walk` runs."""
    done = run("walk", "--out", "out", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    plan = gaitopt.load_plan(tmp_path / "out" / "plan.npz")
    assert len(plan.phases) == 128
    assert (tmp_path / "out" / "walk.html").stat().st_size < 3_000_000
    assert len(list((tmp_path / "out" / "figures").glob("*.png"))) >= 7
    for words in ("Table II", "proposed", "SSM", "64 steps", "walk.html", "plan.npz", "figures"):
        assert words in done.stdout
    assert {p.name for p in (tmp_path / "out").iterdir()} == {"plan.npz", "walk.html", "figures"}


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["robot", "nope"], "unknown robot 'nope'; known are wang2020, "),
        (["walk", "--footholds", "none.csv"], "cannot read none.csv"),
        (["walk", "--stability-margin", "0.3"], "inscribed circle"),
        (["walk", "--body-height", "2"], "take body_height below"),
        (["replay", "none.npz"], "cannot read none.npz"),
        (["walk", "--robot", "solo8"], "no roll joint"),
    ],
)
def test_mistakes_end_in_one_line_and_code_two(
    tmp_path: Path, arguments: list[str], words: str
) -> None:
    done = run(*arguments, cwd=tmp_path)
    assert done.returncode == 2
    lines = [line for line in done.stderr.splitlines() if not line.startswith("planning")]
    message = [line for line in lines if line.startswith("gaitopt: ")]
    assert len(message) == 1 and words in message[0]
    assert "Traceback" not in done.stderr + done.stdout
    assert not [p for p in tmp_path.rglob("*") if p.is_file()]


def test_a_bad_row_is_named_with_its_line(tmp_path: Path) -> None:
    path = tmp_path / "feet.csv"
    path.write_text("leg,step,x,y,z\nLF,0,0.2,0.15,0\nLF,1,abc,0.15,0\n")
    assert "line 3: x is 'abc', no number" in fails("walk", "--footholds", str(path))


def test_a_csv_of_ones_own_is_walked(tmp_path: Path) -> None:
    gaitopt.s_columns(2, columns=3).to_csv(tmp_path / "feet.csv")
    out = tmp_path / "out"
    result = runner.invoke(
        app,
        ["walk", "--footholds", str(tmp_path / "feet.csv"), "--out", str(out), "--speed", "0.05"],
    )
    assert result.exit_code == 0, result.output
    plan = gaitopt.load_plan(out / "plan.npz")
    assert plan.settings.speed == 0.05 and len(plan.phases) == 16


def test_a_time_optimal_walk_is_held_against_the_papers(tmp_path: Path) -> None:
    gaitopt.s_columns(2, columns=2).to_csv(tmp_path / "feet.csv")
    result = runner.invoke(
        app,
        ["walk", "--footholds", str(tmp_path / "feet.csv"), "--objective", "time", "--free",
         "height", "--acceleration-limit", "6", "--horizon", "3", "--sequence", "free",
         "--out", str(tmp_path / "out")],
    )  # fmt: skip
    assert result.exit_code == 0, result.output
    plan = gaitopt.load_plan(tmp_path / "out" / "plan.npz")
    assert plan.settings.acceleration_limit == 6.0 and float(plan.record.windows) > 1
    paper = gaitopt.plan_crawl(
        plan.robot, plan.footholds, sequence=plan.settings.swing_legs(2) or "free"
    )
    assert f"{paper.duration / plan.duration:.2f} times as fast as the paper's" in result.output


def test_trot_writes_plan_replay_and_figures(tmp_path: Path) -> None:
    done = run("trot", "--speed", "0.3", "--distance", "1.5", "--out", "out", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    plan = gaitopt.load_plan(tmp_path / "out" / "plan.npz")
    assert plan.settings.to_dict()["velocity"] == [0.3, 0.0]
    assert (tmp_path / "out" / "trot.html").stat().st_size < 3_000_000
    assert len(list((tmp_path / "out" / "figures").glob("*.png"))) >= 5
    assert "wang2020-fast takes" in done.stdout and "trot.html" in done.stdout
    verified = runner.invoke(app, ["verify", str(tmp_path / "out" / "plan.npz")])
    assert verified.exit_code == 0 and "ZMP" in verified.output


def test_a_gait_of_ones_choice_is_planned(tmp_path: Path) -> None:
    arguments = ["gait", "RH,RF,LH,LF", "--cycle", "2", "--duty", "0.85", "--speed", "0.05",
                 "--distance", "0.1", "--out", str(tmp_path)]  # fmt: skip
    result = runner.invoke(app, arguments)
    assert result.exit_code == 0, result.output
    assert (tmp_path / "rh-rf-lh-lf.html").exists()


def test_a_trot_that_the_joints_do_not_allow_says_so() -> None:
    words = fails("trot", "--robot", "wang2020")
    assert "its limit is 0.2967 rad/s" in words and "stepping on the spot" in words
    assert "--duration" in fails("trot", "--speed", "0")
    assert "gait must be one of" in fails("gait", "gallop")


def test_tables_have_their_units() -> None:
    """Text in square brackets is markup to the library that prints them."""
    assert "time [s]" in runner.invoke(app, ["compare"]).output
    assert "reach [m]" in runner.invoke(app, ["robot", "wang2020"]).output


def test_compare_prints_the_table() -> None:
    result = runner.invoke(app, ["compare", "--seeds", "2"])
    assert result.exit_code == 0
    assert "over 2 terrains" in result.output and "SSM" in result.output


def test_compare_refuses_a_csv_with_many_seeds() -> None:
    assert "exclude each other" in fails("compare", "--footholds", "x.csv", "--seeds", "3")


def test_replay_opens_the_file_that_it_wrote(
    short_plan: Plan, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    source, opened = tmp_path / "plan.npz", []
    short_plan.save(source)
    monkeypatch.setattr(webbrowser, "open", lambda url: opened.append(url))
    result = runner.invoke(app, ["replay", str(source), "--open"])
    assert result.exit_code == 0, result.output
    assert opened == [(tmp_path / "plan.html").as_uri()] and (tmp_path / "plan.html").exists()
    assert "open the file by hand" in result.output


def test_replay_figures_and_export_take_a_plan_file(short_plan: Plan, tmp_path: Path) -> None:
    source = tmp_path / "plan.npz"
    short_plan.save(source)
    for arguments in (
        ["replay", str(source)],
        ["figures", str(source), str(tmp_path / "figures")],
        [
            "export",
            str(source),
            "--csv",
            str(tmp_path / "a.csv"),
            "--ros",
            str(tmp_path / "a.yaml"),
        ],
    ):
        result = runner.invoke(app, arguments)
        assert result.exit_code == 0, result.output
    assert (tmp_path / "plan.html").is_file()
    assert list((tmp_path / "figures").glob("*.png"))
    assert (tmp_path / "a.csv").is_file() and (tmp_path / "a.yaml").is_file()
    assert "nothing to write" in fails("export", str(source))


def test_help_reads_well() -> None:
    result = runner.invoke(app, ["--help"])
    for command in ("walk", "compare", "replay", "figures", "export", "robot"):
        assert command in result.output
    text = runner.invoke(app, ["walk", "--help"], env={"COLUMNS": "100"}).output
    what = "robot footholds seed objective speed out stability-margin body-height swing-height"
    for option in what.split():
        assert f"--{option}" in text


def test_robots_are_listed_and_described() -> None:
    assert "anymal_c" in runner.invoke(app, ["robot", "--list"]).output
    assert "LF_HAA" in runner.invoke(app, ["robot"]).output


def test_a_bad_speed_is_refused() -> None:
    assert "--speed must be 'max' or a number" in fails("walk", "--speed", "quick")


def test_verify_is_an_exit_code_and_a_report(short_plan: Plan, tmp_path: Path) -> None:
    good, bad = tmp_path / "good.npz", tmp_path / "bad.npz"
    short_plan.save(good)
    settings = dataclasses.replace(short_plan.settings, stability_margin=0.03)
    dataclasses.replace(short_plan, settings=settings).save(bad)
    passed, failed = (runner.invoke(app, ["verify", str(path)]) for path in (good, bad))
    assert passed.exit_code == 3 and "kinematics only" in passed.output
    assert failed.exit_code == 1 and "violated" in failed.output
    assert "margin of the body centre" in failed.output


def test_a_walk_that_has_forces_is_certified(wang: Quadruped, tmp_path: Path) -> None:
    plan = gaitopt.plan_crawl(wang, gaitopt.s_columns(0, columns=2), objective="time",
                              free="route", acceleration_limit=2.0)  # fmt: skip
    plan.save(tmp_path / "plan.npz")
    result = runner.invoke(app, ["verify", str(tmp_path / "plan.npz")])
    assert result.exit_code == 0 and "wang2020: certified" in result.output
    slippery = runner.invoke(app, ["verify", str(tmp_path / "plan.npz"), "--friction", "0.02"])
    assert slippery.exit_code == 3 and "not promised" in " ".join(slippery.output.split())


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["walk", "--bogus"], "No such option: --bogus"),
        (["walk", "--seed", "x"], "--seed"),
        (["walk", "--seed", "1", "--footholds", "a.csv"], "exclude each other"),
        (["export", "p.npz", "--csv", "a", "--ros", "a"], "both name a"),
        (["nonsense"], "nonsense"),
    ],
)
def test_options_that_make_no_sense_end_in_one_line(arguments: list[str], words: str) -> None:
    done = run(*arguments)
    assert done.returncode == 2
    assert len(done.stderr.splitlines()) == 1 and words in done.stderr


def test_names_with_brackets_are_no_markup(short_plan: Plan, tmp_path: Path) -> None:
    source = tmp_path / "[bold]q[" / "p.npz"
    source.parent.mkdir()
    short_plan.save(source)
    done = run("replay", str(source))
    assert done.returncode == 0 and "[bold]q[" in done.stdout.replace("\n", "")


def test_a_step_can_be_chosen_for_the_figures(short_plan: Plan, tmp_path: Path) -> None:
    short_plan.save(tmp_path / "p.npz")
    arguments = ["figures", str(tmp_path / "p.npz"), str(tmp_path / "f"), "--step"]
    assert runner.invoke(app, [*arguments, "3"]).exit_code == 0
    assert "step" in fails(*arguments, "99")


def test_the_version_and_the_bare_command() -> None:
    assert run("--version").stdout.startswith("gaitopt ")
    assert "walk" in run().stdout
