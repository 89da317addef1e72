"""What commands write and say: folders of runs, reports for programs, tables that fit."""

from __future__ import annotations

import io
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from rich.console import Console
from rich.markup import escape
from rich.table import Table
from typer.testing import Result

import gaitopt
from gaitopt import InputError, Plan
from gaitopt.cli.results import report
from gaitopt.cli.results.documents import plain
from gaitopt.cli.results.run_folder import record_run, run_folder
from gaitopt.cli.results.verdict import verdict_line

Command = Callable[..., Result]
HIPS = {"LF": (0.2, 0.15), "LH": (-0.2, 0.15), "RH": (-0.2, -0.15), "RF": (0.2, -0.15)}
SHORT = "leg,step,x,y,z\n" + "".join(
    f"{leg},{step},{x + 0.06 * step},{y},0\n" for leg, (x, y) in HIPS.items() for step in range(2)
)
"""Footholds of one step with every leg, for wang2020."""


@pytest.fixture(scope="module")
def table(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("footholds") / "short.csv"
    path.write_text(SHORT)
    return path


def write(folder: Path, names: tuple[str, ...]) -> None:
    for name in names:
        (folder / name).write_text("new")


# The folder of a run.


def test_every_run_gets_a_folder_of_its_own(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.chdir(tmp_path)
    places = []
    for _ in range(3):
        with run_folder(None, "walk-go2-seed0", False).writing() as (made, place):
            write(made, ("plan.npz",))
        places.append(place.as_posix())
    assert places == ["out/walk-go2-seed0", "out/walk-go2-seed0-2", "out/walk-go2-seed0-3"]
    assert all((tmp_path / place / "plan.npz").is_file() for place in places)


def test_a_run_that_fails_leaves_nothing(tmp_path: Path) -> None:
    folder = run_folder(tmp_path / "here", "walk", False)
    for error in (ValueError, KeyboardInterrupt):
        with pytest.raises(error), folder.writing() as (made, _):
            write(made, ("plan.npz",))
            raise error
    assert list(tmp_path.iterdir()) == []


def test_errors_name_the_folder_that_was_asked_for(tmp_path: Path) -> None:
    """And not the temporary one, which is gone when they are read."""
    folder = run_folder(tmp_path / "walk", "walk", False)
    with pytest.raises(InputError) as found, folder.writing() as (made, _):
        raise InputError(f"cannot write {made / 'plan.npz'}: No space left on device")
    assert str(found.value) == f"cannot write {tmp_path}/walk/plan.npz: No space left on device"
    assert list(tmp_path.iterdir()) == []


def test_nothing_is_overwritten_unasked(tmp_path: Path) -> None:
    (tmp_path / "plan.npz").write_text("old")
    (tmp_path / "mine.txt").write_text("mine")
    with pytest.raises(InputError, match=r"holds plan\.npz of an earlier run.*--overwrite"):
        run_folder(tmp_path, "walk", False, ("plan.npz", "walk.html"))
    with run_folder(tmp_path, "walk", True, ("plan.npz",)).writing() as (made, _):
        write(made, ("plan.npz",))
    assert (tmp_path / "plan.npz").read_text() == "new"
    assert (tmp_path / "mine.txt").read_text() == "mine"


def test_files_that_are_there_are_not_overwritten(
    command: Command, error_of: Callable[..., str], plan_file: Path, tmp_path: Path
) -> None:
    """Nor is a file of the user's own: no command has it written by itself."""
    page, table, drawing = (tmp_path / name for name in ("a.html", "a.csv", "wang2020.html"))
    for path, arguments in (
        (page, ("replay", str(plan_file), str(page))),
        (page, ("replay", str(plan_file), "--out", str(page))),
        (page, ("simulate", str(plan_file), "--out", str(page))),
        (table, ("export", str(plan_file), str(table))),
        (table, ("export", str(plan_file), "--csv", str(table))),
        (drawing, ("robot", "wang2020", "--out", str(tmp_path))),
    ):
        path.write_text("mine")
        told = error_of(*arguments)
        assert path.name in told and "--overwrite" in told
        assert path.read_text() == "mine"
    done = command("replay", str(plan_file), "--out", str(page), "--overwrite")
    assert done.exit_code == 0 and page.stat().st_size > 1000
    both = error_of("replay", str(plan_file), str(page), "--out", str(page))
    assert "HTML and --out exclude each other" in both


def test_a_drawing_without_a_name_gets_a_folder_of_its_own(
    command: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("webbrowser.open", lambda url: True)
    for _ in range(2):
        assert command("robot", "wang2020", "--open").exit_code == 0
    assert sorted(p.name for p in tmp_path.iterdir()) == ["out"]
    folders = {"robot-wang2020", "robot-wang2020-2"}
    assert {p.name for p in (tmp_path / "out").iterdir()} == folders


def test_a_file_that_came_meanwhile_is_not_overwritten(tmp_path: Path) -> None:
    folder = run_folder(tmp_path, "walk", False, ("plan.npz",))
    with pytest.raises(InputError, match="of an earlier run"), folder.writing() as (made, _):
        write(made, ("plan.npz",))
        (tmp_path / "plan.npz").write_text("of somebody else")
    assert (tmp_path / "plan.npz").read_text() == "of somebody else"


def test_files_of_two_runs_are_never_mixed(tmp_path: Path) -> None:
    with run_folder(tmp_path, "stride", False).writing() as (made, _):
        write(made, ("plan.npz", "stride.html"))
        (made / "figures").mkdir()
        write(made / "figures", ("first.png", "both.png"))
        record_run(made, {"files": ["plan.npz", "stride.html", "figures", "../secret", 3]})
    with run_folder(tmp_path, "walk", True).writing() as (made, _):
        write(made, ("plan.npz", "walk.html"))
        (made / "figures").mkdir()
        write(made / "figures", ("both.png", "second.png"))
        record_run(made, {"files": ["plan.npz", "walk.html", "figures"]})
    assert {p.name for p in tmp_path.iterdir()} == {
        "plan.npz", "walk.html", "figures", "run.json"}  # fmt: skip
    assert {p.name for p in (tmp_path / "figures").iterdir()} == {"both.png", "second.png"}


def test_folders_that_cannot_be_made_are_named_before_the_run(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="is a file, and no folder"):
        run_folder(tmp_path / "file", "walk", False)
    with pytest.raises(InputError, match="file is no folder"):
        run_folder(tmp_path / "file" / "below", "walk", False)


# Whole commands.


def test_a_fast_walk_has_plan_and_replay_only_and_a_record(
    command: Command, table: Path, tmp_path: Path
) -> None:
    out = tmp_path / "out"
    arguments = ("walk", "--footholds", str(table), "--fast", "--out", str(out))
    done = command(*arguments)
    assert done.exit_code == 0, done.output
    assert {p.name for p in out.iterdir()} == {"plan.npz", "walk.html", "run.json"}
    assert "Table II" not in done.output
    assert "certified at every instant" in done.output
    record = json.loads((out / "run.json").read_text())
    assert record["certificate"] == "certified" and record["physics"] is None
    assert record["plan"]["duration"] == gaitopt.load_plan(out / "plan.npz").duration
    again = command(*arguments)
    assert isinstance(again.exception, InputError) and "--overwrite" in str(again.exception)
    assert command(*arguments, "--overwrite").exit_code == 0


def test_the_verdict_sends_only_robots_with_masses_into_physics(table: Path) -> None:
    robot = gaitopt.load_robot("wang2020")
    plan = gaitopt.plan_crawl(robot, gaitopt.Footholds.from_csv(table), timing="velocity")
    certificate = gaitopt.verify(plan, collisions=False)
    file = Path("out/plan.npz")
    assert verdict_line(certificate, None, file).endswith("next: gaitopt simulate out/plan.npz")
    told = verdict_line(certificate, None, file, masses=False)
    assert "next: gaitopt export out/plan.npz" in told and "--masses shapes" in told
    assert "simulate" not in told


@pytest.mark.parametrize(
    ("arguments", "names"),
    [
        (("walk", "--fast", "--simulate"), {"plan", "certificate", "physics", "files"}),
        (("compare",), {"outcomes", "infeasible"}),
        (("race", "--rows", "route", "--no-bound"), {"finishes", "files", "robot"}),
    ],
)
def test_programs_get_one_document(
    command: Command, table: Path, tmp_path: Path, arguments: tuple[str, ...], names: set[str]
) -> None:
    out = () if arguments[0] == "compare" else ("--out", str(tmp_path / "out"))
    done = command(*arguments, "--footholds", str(table), "--json", *out)
    assert done.exit_code == 0, done.output
    document = json.loads(done.stdout)
    assert document["command"] == arguments[0] and names <= set(document)
    if arguments[0] == "walk":
        assert document["physics"]["passed"] and document["certificate"]["outcome"] == "certified"


def test_programs_get_certificates_simulations_and_robots(
    command: Command, plan_file: Path, short_plan: Plan
) -> None:
    certificate = json.loads(command("verify", str(plan_file), "--json").stdout)
    assert certificate["outcome"] == "kinematics only"
    assert {"slip of standing feet", "joint velocities"} <= {
        check["name"] for check in certificate["checks"]
    }
    result = json.loads(command("simulate", str(plan_file), "--json").stdout)
    assert result["passed"] and result["steps"] == len(short_plan.swings)
    robot = json.loads(command("robot", "--json").stdout)
    assert robot["legs"]["LF"]["joints"] == ["LF_HAA", "LF_HFE", "LF_KFE"]
    assert robot["legs"]["LF"]["velocity_limits"][0] == pytest.approx(0.2967, abs=1e-4)


# Documents and tables.


def test_commands_that_write_files_name_them_to_programs(
    command: Command, plan_file: Path, no_pixels: None
) -> None:
    folder = plan_file.parent
    table = str(folder / "walk.yaml")
    exported = json.loads(command("export", str(plan_file), table, "--json").stdout)
    (what,) = exported["files"].values()
    assert list(exported["files"]) == [table] and "[rad]" in what and "\\" not in what
    assert exported["numbers"][table]["points"] > 1 and isinstance(exported["notes"][table], list)
    page = str(folder / "page.html")
    shown = json.loads(command("replay", str(plan_file), page, "--json").stdout)
    assert shown == {"command": "replay", "files": {page: ""}}
    drawn = json.loads(command("figures", str(plan_file), str(folder / "f"), "--json").stdout)
    assert sorted(drawn["files"]) == sorted(map(str, (folder / "f").glob("*.png")))


def test_documents_are_strict_json() -> None:
    values: dict[str, Any] = {"nan": float("nan"), "inf": [float("-inf")], "none": None}
    assert plain(values) == {"nan": None, "inf": [None], "none": None}
    outcome = gaitopt.SimulationStatus.FELL
    text = json.dumps(plain({"status": outcome, "yes": True, "three": 3}), allow_nan=False)
    assert json.loads(text) == {"status": "fell", "yes": True, "three": 3}


def printed(table: Table, width: int, monkeypatch: pytest.MonkeyPatch) -> str:
    console = Console(file=io.StringIO(), width=width, color_system=None)
    monkeypatch.setattr(report, "terminal", lambda markup=True: console)
    report.print_table(table)
    return console.file.getvalue()  # type: ignore[attr-defined,no-any-return]


def wide_table() -> Table:
    table = Table(title="walks", caption="a note")
    for name in ("method", "planning [s]", "speed-up [%]", "margin [mm]"):
        table.add_column(escape(name))
    table.add_row("proposed", "333.123456", "1551.25", "20.0")
    return table


@pytest.mark.parametrize("width", [30, 40, 48, 60, 80, 150])
def test_tables_cut_no_word_at_any_width(monkeypatch: pytest.MonkeyPatch, width: int) -> None:
    text = printed(wide_table(), width, monkeypatch)
    assert max(map(len, text.splitlines())) <= width
    assert "…" not in text
    for word in ("proposed", "planning", "333.123456", "speed-up", "[mm]", "20.0", "a note"):
        assert word in text


def test_the_tables_of_the_commands_fit_into_80_letters(
    monkeypatch: pytest.MonkeyPatch, wang: gaitopt.Quadruped, short_plan: Plan
) -> None:
    from gaitopt.cli.robot_table import robot_tables

    comparison = gaitopt.compare(wang, gaitopt.s_columns(0, columns=2))
    certificate = gaitopt.verify(short_plan, collisions=False)
    for table in (comparison.table(), certificate.table(), *robot_tables(wang)):
        text = printed(table, 80, monkeypatch)
        assert "…" not in text and max(map(len, text.splitlines())) <= 80
        # As a table, and not row by row.
        assert "━━━" in text or " ───" in text


# Other commands.


def test_figures_of_two_plans_are_never_mixed(command: Command, plan_file: Path) -> None:
    first = command("figures", str(plan_file))
    assert first.exit_code == 0, first.output
    folder = plan_file.with_name("plan-figures")
    assert list(folder.glob("*.png")) and str(folder) in "".join(first.output.split())
    again = command("figures", str(plan_file))
    assert isinstance(again.exception, InputError) and "--overwrite" in str(again.exception)
    (folder / "of_another_plan.png").write_bytes(b"")
    record_run(folder, {"files": ["of_another_plan.png"]})
    assert command("figures", str(plan_file), "--overwrite").exit_code == 0
    assert not (folder / "of_another_plan.png").exists()


def test_options_that_exclude_each_other_say_so(command: Command, tmp_path: Path) -> None:
    refused = command("trot", "--distance", "1", "--duration", "2", "--out", str(tmp_path / "no"))
    assert "--distance and --duration exclude each other" in str(refused.exception)
    gait = gaitopt.plan_gait(gaitopt.load_robot("wang2020-fast"), gaitopt.trot(0.5),
                             velocity=0.2, distance=0.1, timing="velocity")  # fmt: skip
    gait.save(tmp_path / "gait.npz")
    refused = command("figures", str(tmp_path / "gait.npz"), "--step", "1")
    assert "--step is for walks over footholds" in str(refused.exception)


def test_trot_and_gait_trot_are_the_same(command: Command, tmp_path: Path) -> None:
    plans = []
    for words in (("trot",), ("gait", "trot")):
        out = tmp_path / words[0]
        done = command(*words, "--timing", "velocity", "--fast", "--out", str(out))
        assert done.exit_code == 0, done.output
        plans.append(gaitopt.load_plan(out / "plan.npz"))
    assert plans[0].settings == plans[1].settings
    usual = gaitopt.plan_gait(
        plans[0].robot, gaitopt.trot(0.5), velocity=0.3, distance=1.5, timing="velocity"
    )
    assert usual.settings == plans[0].settings and usual.duration == plans[0].duration


def test_the_demo_walks_in_physics_and_opens_its_replay(
    command: Command, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    from gaitopt.viewing.replay import browser

    opened: list[Path] = []
    monkeypatch.setattr(browser, "open_in_browser", lambda path: bool(opened.append(path)))
    monkeypatch.chdir(tmp_path)
    done = command("demo", "solo12", "--velocity-limit", "12", "--effort-limit", "2.7")
    assert done.exit_code == 0, done.output
    assert opened == [Path("out/demo-solo12/demo.html")]
    assert "passed in physics" in done.output and "no browser could be started" in done.output


@pytest.mark.parametrize(
    ("begun", "expected"),
    [("walk --robot go", ["go1", "go2"]), ("gait quasi", ["quasi-static"]),
     ("terrain stairs_", ["stairs_up", "stairs_down"]), ("demo wang2020-", ["wang2020-fast"])],
)  # fmt: skip
def test_the_shell_completes_names(
    command: Command, monkeypatch: pytest.MonkeyPatch, begun: str, expected: list[str]
) -> None:
    from typer.testing import CliRunner

    from gaitopt.cli.app import app

    words = f"gaitopt {begun}"
    asked = {"_GAITOPT_COMPLETE": "complete_bash", "COMP_WORDS": words,
             "COMP_CWORD": str(len(words.split()) - 1)}  # fmt: skip
    found = CliRunner().invoke(app, [], env=asked, prog_name="gaitopt")
    assert found.stdout.split() == expected
