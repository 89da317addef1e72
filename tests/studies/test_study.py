"""Studies over many terrains: rows, resuming, and workers that fail."""

from __future__ import annotations

import csv
from pathlib import Path

import pytest

import gaitopt
from gaitopt import InputError
from gaitopt.studies.resumable import key_of
from gaitopt.studies.study import HEADER, Walk, grid, run_study, run_walk
from gaitopt.studies.study_report import plot_study, study_table
from gaitopt.studies.tables import as_cell, as_text, csv_line
from gaitopt.terrain.columns import s_columns
from gaitopt.viewing.figures.panels import figure_of


def test_a_walk_becomes_a_row_with_the_plans_figures() -> None:
    row = run_walk(Walk(seed=4, columns=3))
    robot = gaitopt.load_robot("wang2020")
    plan = gaitopt.plan_crawl(robot, s_columns(4, columns=3, robot=robot), timing="velocity")
    assert (row.status, row.message, row.violations) == ("ok", "", "")
    assert row.duration == pytest.approx(plan.duration, rel=1e-12)
    assert row.margin == pytest.approx(plan.margin)
    assert row.com_margin == pytest.approx(float(gaitopt.com_margin(plan)[1].min()), abs=1e-4)
    assert row.steps_done is None and row.work_time is not None


@pytest.mark.parametrize(
    ("walk", "status", "words"),
    [
        (Walk(columns=2, stability_margin=0.3), "infeasible", "inscribed circle"),
        (Walk(columns=5, stability_margin=0.0, seed=1), "violated", "margin of the true COM"),
        (Walk(robot="nope"), "error", "RobotError: unknown robot 'nope'"),
        (Walk(robot="solo8", columns=2, objective="time"), "error", "no roll joint"),
    ],
)
def test_what_goes_wrong_is_a_row_that_says_why(walk: Walk, status: str, words: str) -> None:
    row = run_walk(walk)
    assert row.status == status and words in row.message


def test_a_fault_of_the_program_is_a_row_too(monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(name: str) -> None:
        raise ZeroDivisionError("division by zero")

    monkeypatch.setattr("gaitopt.robots.catalog.load_robot", broken)
    row = run_walk(Walk())
    assert (row.status, row.message) == ("error", "ZeroDivisionError: division by zero")


def test_a_study_fills_its_table_and_goes_on_where_it_stopped(tmp_path: Path) -> None:
    table = tmp_path / "study.csv"
    seen: list[tuple[int, int]] = []
    first = run_study(grid(range(2), columns=2), table, jobs=1)
    text = table.read_text()
    rows = run_study(grid(range(4), columns=2), table, jobs=2,
                     progress=lambda a, b: seen.append((a, b)))  # fmt: skip
    assert seen == [(2, 4), (3, 4), (4, 4)]
    assert table.read_text().startswith(text)
    assert rows[:2] == first and [row["seed"] for row in rows] == ["0", "1", "2", "3"]
    with table.open(newline="") as stream:
        stored = list(csv.DictReader(stream))
    assert len(stored) == 4 and tuple(stored[0]) == HEADER


def test_a_line_cut_off_by_a_crash_is_done_again(tmp_path: Path) -> None:
    table = tmp_path / "study.csv"
    whole = run_study(grid(range(2), columns=2), table, jobs=1)
    table.write_text(table.read_text()[:-40])
    again = run_study(grid(range(2), columns=2), table, jobs=1)

    def facts(rows: list[dict[str, str]]) -> list[dict[str, str]]:
        return [{k: v for k, v in row.items() if k != "work_time"} for row in rows]

    assert facts(again) == facts(whole)
    assert len(table.read_text().splitlines()) == 3


def test_another_table_is_not_touched(tmp_path: Path) -> None:
    table = tmp_path / "mine.csv"
    table.write_text("a,b\n1,2\n")
    with pytest.raises(InputError, match="is no table of a study"):
        run_study(grid(range(1)), table)
    assert table.read_text() == "a,b\n1,2\n"
    with pytest.raises(InputError, match="cannot write"):
        run_study(grid(range(1)), tmp_path / "none" / "t.csv")


def test_a_table_of_another_version_is_told_and_not_touched(tmp_path: Path) -> None:
    table, before = tmp_path / "old.csv", ",".join(n for n in HEADER if n != "timing") + "\n"
    table.write_text(before)
    with pytest.raises(InputError, match=r"has other columns: .* another version of gaitopt"):
        run_study(grid(range(1)), table)
    assert table.read_text() == before


def test_the_grid_is_every_combination() -> None:
    walks = grid(range(3), objectives=("distance", "margin"), stability_margins=(0.01, 0.02))
    assert len(walks) == len({key_of(walk) for walk in walks}) == 12


def test_the_summary_counts_and_draws(tmp_path: Path) -> None:
    walks = [*grid(range(2), columns=2), Walk(columns=2, stability_margin=0.3)]
    rows = run_study(walks, tmp_path / "t.csv", jobs=1)
    text = as_text(study_table(rows))
    assert "3 walks" in text and "infeasible" in text and "inscribed circle" in text
    figure = figure_of(plot_study(rows))
    assert [ax.get_title() for ax in figure.axes] == ["Duration", "Stability",
                                                      "Result"]  # fmt: skip
    heights = [bar.get_height() for bar in figure.axes[2].patches]
    assert heights == [2, 1, 0, 0, 0, 0]


def test_the_same_on_a_dask_cluster(tmp_path: Path) -> None:
    distributed = pytest.importorskip("distributed")
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=1, processes=False, dashboard_address=None
    ) as cluster:
        rows = run_study(grid(range(2), columns=2), tmp_path / "t.csv",
                         scheduler=cluster.scheduler_address)  # fmt: skip
    assert [row["status"] for row in rows] == ["ok", "ok"]


def test_a_cluster_that_does_not_answer(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    distributed = pytest.importorskip("distributed")

    def absent(*args: object, **kwargs: object) -> None:
        raise OSError("timed out")

    monkeypatch.setattr(distributed, "Client", absent)
    with pytest.raises(InputError, match="no Dask scheduler answers"):
        run_study(grid(range(1)), tmp_path / "t.csv", scheduler="tcp://127.0.0.1:1")


@pytest.mark.parametrize(
    ("text", "cell"),
    [
        ("a\x1b[31m\n b\u202ec", r"a\x1b[31m b\u202ec"),
        ("=cmd()", "'=cmd()"),
        ("@x", "'@x"),
        ("-1.5", "-1.5"),
        ("", ""),
    ],
)
def test_cells_hold_nothing_that_terminals_and_spreadsheets_obey(text: str, cell: str) -> None:
    assert as_cell(text) == as_cell(as_cell(text)) == cell
    assert csv_line([text]).decode().strip().strip('"') == cell
