"""The command line, run as a user runs it."""

from __future__ import annotations

import dataclasses
import shutil
import subprocess
import sys
import webbrowser
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import robot_texts
from typer.testing import CliRunner, Result

import gaitopt
from gaitopt import Plan
from gaitopt.cli.app import app
from gaitopt.cli.options import FRICTIONS, LONGEST_TRANSFER
from gaitopt.cli.results.verdict import verdict_line
from gaitopt.cli.support import force_limits

Command = Callable[..., Result]
ErrorOf = Callable[..., str]


def in_a_new_process(*arguments: str, cwd: Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "gaitopt", *arguments],
        capture_output=True, text=True, cwd=cwd, timeout=600, check=False,
    )  # fmt: skip


def test_walk_writes_plan_replay_and_figures(tmp_path: Path) -> None:
    """What `make walk` runs."""
    done = in_a_new_process("walk", "--out", "out", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    plan = gaitopt.load_plan(tmp_path / "out" / "plan.npz")
    assert len(plan.phases) == 128
    assert (tmp_path / "out" / "walk.html").stat().st_size < 3_000_000
    assert len(list((tmp_path / "out" / "figures").glob("*.png"))) >= 7
    for words in ("Table II", "proposed", "SSM", "64 steps", "walk.html", "plan.npz", "figures"):
        assert words in done.stdout
    names = {"plan.npz", "walk.html", "figures", "run.json"}
    assert {p.name for p in (tmp_path / "out").iterdir()} == names
    assert done.stdout.splitlines()[-1] == (
        "certified at every instant, contact forces included; not tried in physics; next: gaitopt "
        "simulate out/plan.npz"
    )


def test_a_mistake_ends_a_process_with_one_line_and_code_two(tmp_path: Path) -> None:
    done = in_a_new_process("walk", "--seed", "1", "--footholds", "a.csv", cwd=tmp_path)
    assert done.returncode == 2 and done.stdout == ""
    assert done.stderr == ("gaitopt: --footholds and --seed exclude each other: give one of them\n")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["robot", "nope"], "unknown robot 'nope'; known are wang2020, "),
        (["walk", "--footholds", "none.csv"], "cannot read none.csv"),
        (["walk", "--stability-margin", "0.3"], "inscribed circle"),
        (["walk", "--body-height", "2"], "take body_height below"),
        (["walk", "--robot", "solo8", "--objective", "time"], "no roll joint"),
        (["walk", "--bogus"], "No such option: --bogus"),
        (["walk", "--seed", "x"], "'--seed': Input should be a valid integer"),
        (["walk", "--objective", "tim"], "'--objective': 'tim' is not one of 'distance'"),
        (["replay", "none.npz"], "cannot read none.npz"),
        (["export", "p.npz", "--csv", "a", "--ros", "a"], "both name a"),
        (["nonsense"], "nonsense"),
    ],
)
def test_mistakes_end_in_one_line_and_code_two(
    shell: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, arguments: list[str], words: str
) -> None:
    monkeypatch.chdir(tmp_path)
    done = shell(*arguments)
    assert done.code == 2
    lines = [line for line in done.stderr.splitlines() if line.startswith("gaitopt: ")]
    # solo8 is loaded with a warning of its placeholders, which is one line, too.
    message = [line for line in lines if not line.startswith("gaitopt: warning: ")]
    assert len(message) == 1 and words in message[0]
    assert "Traceback" not in done.stderr + done.stdout
    assert not [p for p in tmp_path.rglob("*") if p.is_file()]


def test_an_error_of_the_program_itself_keeps_its_traceback(
    shell: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(*arguments: object) -> None:
        raise ZeroDivisionError

    monkeypatch.setattr(gaitopt.cli.plans, "open_plan", broken)
    with pytest.raises(ZeroDivisionError):
        shell("verify", "plan.npz")


def test_a_bad_row_is_named_with_its_line(error_of: ErrorOf, tmp_path: Path) -> None:
    path = tmp_path / "feet.csv"
    path.write_text("leg,step,x,y,z\nLF,0,0.2,0.15,0\nLF,1,abc,0.15,0\n")
    assert "line 3: x is 'abc', no number" in error_of("walk", "--footholds", str(path))


def test_a_csv_of_ones_own_is_walked_in_the_fastest_order(
    command: Command, no_figures: None, tmp_path: Path
) -> None:
    footholds = gaitopt.s_columns(2, columns=2)
    footholds.to_csv(tmp_path / "feet.csv")
    result = command("walk", "--footholds", str(tmp_path / "feet.csv"), "--sequence", "free",
                     "--speed", "0.05", "--out", str(tmp_path / "out"))  # fmt: skip
    assert result.exit_code == 0, result.output
    plan = gaitopt.load_plan(tmp_path / "out" / "plan.npz")
    assert plan.settings.speed == 0.05 and len(plan.phases) == 8
    in_order = gaitopt.plan_crawl(plan.robot, footholds, speed=0.05)
    assert plan.duration <= in_order.duration and "SSM" in result.output


def test_a_time_optimal_walk_is_compared_with_the_papers(
    command: Command, no_figures: None, tmp_path: Path
) -> None:
    gaitopt.s_columns(2, columns=2).to_csv(tmp_path / "feet.csv")
    result = command(
        "walk", "--footholds", str(tmp_path / "feet.csv"), "--objective", "time", "--free",
        "height", "--acceleration-limit", "6", "--horizon", "3", "--out", str(tmp_path / "out"),
    )  # fmt: skip
    assert result.exit_code == 0, result.output
    plan = gaitopt.load_plan(tmp_path / "out" / "plan.npz")
    assert plan.settings.acceleration_limit == 6.0 and float(plan.record.windows) > 1
    paper = gaitopt.plan_crawl(plan.robot, plan.footholds, timing="velocity")
    assert f"{paper.duration / plan.duration:.2f} times as fast as the paper's" in result.output


def test_trot_writes_plan_replay_and_figures(command: Command, tmp_path: Path) -> None:
    result = command("trot", "--speed", "0.3", "--distance", "0.3", "--out", str(tmp_path / "out"))
    assert result.exit_code == 0, result.output
    plan = gaitopt.load_plan(tmp_path / "out" / "plan.npz")
    assert plan.settings.to_dict()["velocity"] == [0.3, 0.0]
    assert (tmp_path / "out" / "trot.html").stat().st_size < 3_000_000
    assert len(list((tmp_path / "out" / "figures").glob("*.png"))) >= 5
    assert "wang2020-fast takes" in result.output and "trot.html" in result.output
    verified = command("verify", str(tmp_path / "out" / "plan.npz"))
    assert "ZMP" in verified.output and verified.exit_code != 1


def test_a_gait_of_ones_choice_is_planned(
    command: Command, no_figures: None, tmp_path: Path
) -> None:
    result = command("gait", "RH,RF,LH,LF", "--cycle", "2", "--duty", "0.85", "--speed", "0.05",
                     "--distance", "0.1", "--out", str(tmp_path))  # fmt: skip
    assert result.exit_code == 0, result.output
    assert (tmp_path / "rh-rf-lh-lf.html").exists()


def test_a_trot_that_the_joints_do_not_allow_says_so(error_of: ErrorOf) -> None:
    words = error_of("trot", "--robot", "wang2020")
    assert "its limit is 0.2967 rad/s" in words and "stepping on the spot" in words
    assert "--duration" in error_of("trot", "--speed", "0")
    assert "gait must be one of" in error_of("gait", "gallop")


def test_compare_prints_the_table(command: Command) -> None:
    result = command("compare", "--seeds", "2")
    assert result.exit_code == 0
    assert "over 2 terrains" in result.output and "SSM" in result.output
    # Text in square brackets is markup to the library that prints tables.
    assert "time [s]" in result.output


def test_compare_refuses_a_csv_with_many_seeds(error_of: ErrorOf) -> None:
    assert "exclude each other" in error_of("compare", "--footholds", "x.csv", "--seeds", "3")


def test_replay_opens_the_file_that_it_wrote(
    command: Command, plan_file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    opened: list[str] = []
    monkeypatch.setattr(webbrowser, "open", lambda url: opened.append(url))
    page = tmp_path / "walk.html"
    result = command("replay", str(plan_file), str(page), "--open")
    assert result.exit_code == 0, result.output
    assert opened == [page.as_uri()] and page.exists()
    assert "open the file by hand" in result.output


def test_a_replay_stands_beside_its_plan_file(command: Command, plan_file: Path) -> None:
    result = command("replay", str(plan_file))
    assert result.exit_code == 0, result.output
    assert plan_file.with_suffix(".html").is_file()


def test_figures_take_a_plan_file_and_a_step(
    command: Command, error_of: ErrorOf, plan_file: Path, tmp_path: Path
) -> None:
    result = command("figures", str(plan_file), str(tmp_path / "figures"), "--step", "3")
    assert result.exit_code == 0, result.output
    assert list((tmp_path / "figures").glob("*.png"))
    assert "step" in error_of("figures", str(plan_file), str(tmp_path / "no"), "--step", "99")


def test_export_writes_the_tables_that_are_named(
    command: Command, error_of: ErrorOf, plan_file: Path, tmp_path: Path
) -> None:
    csv, ros = tmp_path / "a.csv", tmp_path / "a.yaml"
    result = command("export", str(plan_file), "--csv", str(csv), "--ros", str(ros))
    assert result.exit_code == 0, result.output
    assert csv.is_file() and ros.is_file()
    assert "nothing to write" in error_of("export", str(plan_file))


def test_help_reads_well(command: Command) -> None:
    result = command("--help")
    for name in ("walk", "compare", "replay", "figures", "export", "robot"):
        assert name in result.output
    text = CliRunner().invoke(app, ["walk", "--help"], env={"COLUMNS": "100"}).output
    what = "robot footholds seed objective speed out stability-margin body-height swing-height"
    for option in what.split():
        assert f"--{option}" in text


def test_robots_are_listed_and_described(command: Command) -> None:
    assert "anymal_c" in command("robot", "--list").output
    table = command("robot").output
    assert "LF_HAA" in table and "reach [m]" in table


def test_robot_tells_what_was_guessed_and_writes_files(command: Command, tmp_path: Path) -> None:
    file = tmp_path / "dog.urdf"
    file.write_text(robot_texts.robot(foot=""))
    result = command("robot", str(file), "--out", str(tmp_path / "out"))
    assert "read as urdf" in result.output and "LF: LF_foot" in result.output
    assert "warning: the radius of the feet is not known" in " ".join(result.output.split())
    result = command("robot", str(file), "--out", str(tmp_path / "out"), "--overwrite",
                     "--foot-radius", "0.02", "--velocity-limit", "5", "--leg", "FL=LF_foot",
                     "--leg", "RL=LH_foot", "--leg", "RR=RH_foot",
                     "--leg", "FR=RF_foot")  # fmt: skip
    assert result.exit_code == 0 and "no warnings" in result.output
    made = gaitopt.load_robot(tmp_path / "out" / "dog.urdf")
    assert made.foot_radius == 0.02 and (made.velocity_limits == 5.0).all()
    assert gaitopt.Footholds.from_csv(tmp_path / "out" / "dog-footholds.csv").steps > 0
    assert (tmp_path / "out" / "dog.html").is_file()


@pytest.mark.parametrize("option", ["--leg", "--pose", "--argument"])
def test_options_of_robot_files_are_pairs(error_of: ErrorOf, option: str) -> None:
    assert f"{option} takes NAME=VALUE" in error_of("robot", "wang2020", option, "LF")


def test_a_bad_speed_is_refused(error_of: ErrorOf) -> None:
    assert "--speed must be 'max' or a number" in error_of("walk", "--speed", "quick")


def test_verify_is_an_exit_code_and_a_report(
    command: Command, plan_file: Path, short_plan: Plan, tmp_path: Path
) -> None:
    bad = tmp_path / "bad.npz"
    settings = dataclasses.replace(short_plan.settings, stability_margin=0.03)
    dataclasses.replace(short_plan, settings=settings).save(bad)
    passed, failed = (command("verify", str(path)) for path in (plan_file, bad))
    assert passed.exit_code == 3 and "kinematics only" in passed.output
    assert failed.exit_code == 1 and "violated" in failed.output
    assert "margin of the body centre" in failed.output


def test_verify_judges_by_the_robot_that_is_named(
    command: Command, plan_file: Path, tmp_path: Path
) -> None:
    slow = tmp_path / "slow.urdf"
    slow.write_text(gaitopt.load_robot("wang2020", velocity_limits=0.1).urdf)
    assert command("verify", str(plan_file), "--robot", "wang2020").exit_code == 3
    refused = command("verify", str(plan_file), "--robot", str(slow))
    assert "the velocity limit of LF_HAA is wider" in str(refused.exception)


def test_a_walk_that_has_forces_is_certified(
    command: Command, wang: gaitopt.Quadruped, tmp_path: Path
) -> None:
    plan = gaitopt.plan_crawl(wang, gaitopt.s_columns(0, columns=2), objective="time",
                              free="route", acceleration_limit=2.0, timing="velocity")  # fmt: skip
    plan.save(tmp_path / "plan.npz")
    result = command("verify", str(tmp_path / "plan.npz"))
    assert result.exit_code == 0 and "wang2020: certified" in result.output
    slippery = command("verify", str(tmp_path / "plan.npz"), "--friction", "0.02")
    assert slippery.exit_code == 3 and "(not" in slippery.output


def test_verify_judges_forces_by_what_the_plan_promises(
    command: Command, error_of: ErrorOf, tmp_path: Path
) -> None:
    """A walk for rough ground would slip on usual ground, and keeps its promises all the same."""
    robot, path = gaitopt.load_robot("a1"), str(tmp_path / "plan.npz")
    rough = gaitopt.ForceLimits(friction=0.9, reserve=0.01)
    walk = gaitopt.plan_crawl(robot, gaitopt.s_columns(0, columns=2, robot=robot), forces=rough)
    certificate = gaitopt.verify(walk, forces=gaitopt.ForceLimits())
    assert certificate.outcome == "kinematics only" and certificate.ok
    assert certificate["contact forces"].promised and certificate["contact forces"].status == "ok"
    asked = certificate["contact forces as asked"]
    assert not asked.promised and asked.status == "violated"
    line = verdict_line(certificate, None, Path(path))
    assert "limits that were asked for" in line and "not promised" not in line
    walk.save(path)
    promised = command("verify", path)
    assert promised.exit_code == 0 and promised.output.count("contact forces") == 1
    usual = command("verify", path, "--friction", "0.6")
    assert usual.exit_code == 3 and usual.output.count("contact forces") == 2
    assert usual.output.count("as asked") == 1
    assert "leave out --no-forces" in error_of("verify", path, "--friction", "0.6", "--no-forces")


def test_friction_is_refused_where_nothing_is_said_of_forces(
    error_of: Callable[..., str], tmp_path: Path
) -> None:
    error = error_of("walk", "--timing", "velocity", "--friction", "0.4", "--out", str(tmp_path))
    assert "forces are limits of the timing 'forces'" in error
    assert not list(tmp_path.iterdir())


def test_names_with_brackets_are_no_markup(shell: Any, short_plan: Plan, tmp_path: Path) -> None:
    source = tmp_path / "[bold]q[" / "p.npz"
    source.parent.mkdir()
    short_plan.save(source)
    done = shell("replay", str(source))
    assert done.code == 0 and "[bold]q[" in done.stdout.replace("\n", "")


def test_the_version_and_the_bare_command(shell: Any) -> None:
    assert shell("--version").stdout == f"gaitopt {gaitopt.__version__}\n"
    assert "walk" in shell().stdout


def test_the_range_of_friction_is_the_one_of_its_limits(command: Command) -> None:
    for bound in FRICTIONS:
        assert gaitopt.ForceLimits(friction=bound).friction == bound
    for beyond in (0.99 * FRICTIONS[0], 1.01 * FRICTIONS[1]):
        with pytest.raises(gaitopt.InputError, match="friction must be a number from"):
            gaitopt.ForceLimits(friction=beyond)
        for name in ("walk", "verify"):
            refused = command(name, "--friction", str(beyond))
            assert refused.exit_code == 2 and "--friction" in refused.output


def test_the_longest_transfer_time_is_the_one_of_its_limits(command: Command) -> None:
    assert force_limits(None, LONGEST_TRANSFER) == gaitopt.ForceLimits(transfer_time=10.0)
    with pytest.raises(gaitopt.InputError, match="transfer_time must be a number from"):
        gaitopt.ForceLimits(transfer_time=1.01 * LONGEST_TRANSFER)
    refused = command("walk", "--transfer-time", str(1.01 * LONGEST_TRANSFER))
    assert refused.exit_code == 2 and "--transfer-time" in refused.output


def test_a_transfer_time_leaves_the_usual_friction_of_each_objective() -> None:
    assert force_limits(None) is None
    assert force_limits(None, 0.1, "margin") == gaitopt.ForceLimits(friction=0.3, transfer_time=0.1)
    assert force_limits(0.5, 0.1, "margin") == gaitopt.ForceLimits(friction=0.5, transfer_time=0.1)


def test_the_folder_of_a_run_stands_for_its_plan(
    plan_file: Path, command: Command, error_of: ErrorOf, tmp_path: Path
) -> None:
    """``gaitopt verify out/walk-go2-seed0``: the folder that a command names at its end."""
    assert command("verify", str(plan_file.parent)).output == command(
        "verify", str(plan_file)
    ).output.replace(str(plan_file), str(plan_file.parent))
    assert "is a folder without a plan file (.npz)" in error_of("verify", str(tmp_path))
    for name in ("one.npz", "two.npz"):
        shutil.copy(plan_file, tmp_path / name)
    words = error_of("simulate", str(tmp_path))
    assert "holds 2 files of plans; give one: " in words and "one.npz" in words
