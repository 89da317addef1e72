"""Tables of walks with forces: rows are kept, continued and counted, and bounds are bounds."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

import gaitopt
from benchmarks.physics import force_rows, forces, limits
from benchmarks.physics.force_rows import SWEEP, Row, RowFile

DONE = Row(0, "go2", "default", "certified", True, True, 3.6, 4.0, 17.0, "")


def test_a_table_goes_on_where_it_was_stopped(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    made = []

    def quick(robot: gaitopt.Quadruped, row: Row, certify: bool, physics: bool) -> Row:
        made.append((row.seed, row.robot, row.walk))
        if row.walk == SWEEP:
            return replace(row, duration=5.0, walked=6.0, found=True, passed=True)
        if row.seed == 1:
            return replace(row, outcome="no plan: step 3")
        return replace(DONE, seed=row.seed)

    monkeypatch.setattr(forces, "made", quick)
    kept = RowFile(str(tmp_path / "rows.csv"))
    kept.add(DONE)
    arguments = ["--seeds", "2", "--robots", "go2", "--sweep", "--rows", str(tmp_path / "rows.csv")]
    assert forces.main(arguments) == 0
    assert made == [(0, "go2", SWEEP), (1, "go2", "default"), (1, "go2", SWEEP)]
    out, error = capsys.readouterr()
    assert "| go2 | default | 2 | 1 | 1 | 1 | 3.60 | 4.00 | 17 |" in out
    assert "go2, default: 1.50 times as fast as the fastest fixed speed" in out
    assert "go2, default, seed 1: no plan: step 3" in error
    assert forces.main(arguments) == 0 and len(made) == 3


def test_rows_come_back_from_their_file(tmp_path: Path) -> None:
    path = str(tmp_path / "rows.csv")
    told = replace(DONE, seed=4, outcome="violated", passed=False, told='fell, said "no"\nat 3 s')
    RowFile(path).add(told)
    assert list(RowFile(path).rows.values()) == [told]
    assert not told.kept and told.planned and DONE.kept


def test_rows_of_a_terrain_come_together() -> None:
    order = [row.seed for row in force_rows.wanted(2, ["go2", "a1"], ["default", "swing"])]
    assert order == [0] * 4 + [1] * 4


def test_no_timing_of_a_path_is_faster_than_its_joints() -> None:
    """And along a path that joints hold back they take as long as the plan."""
    robot = gaitopt.load_robot("wang2020")
    columns = gaitopt.s_columns(seed=0, columns=2)
    by_velocity = gaitopt.plan_crawl(robot, columns, timing="velocity")
    least, held = limits.by_joints(by_velocity)
    assert least == pytest.approx(by_velocity.duration, rel=1e-3) and held > 0.99
    slower = by_velocity.slowed(2.0)
    least, held = limits.by_joints(slower)
    assert least == pytest.approx(by_velocity.duration, rel=1e-3) and held == 0.0
