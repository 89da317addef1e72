"""Tables of walks with forces: rows are kept, continued and counted, and bounds are bounds."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import pytest

import gaitopt
from benchmarks.physics import force_rows, forces, limits, standing
from benchmarks.physics.force_rows import SWEEP, Row, RowFile
from benchmarks.speed.timing import untimed

DONE = Row(0, "go2", "default", "certified", True, True, 3.6, 4.0, 17.0, "")


def test_a_table_goes_on_where_it_was_stopped(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    made = []

    def quick(robot: gaitopt.Quadruped, row: Row, *_: object) -> Row:
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


def test_a_sweep_finds_the_fastest_speed_that_passes_wherever_it_begins(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Speeds up to 0.7 m/s pass. On the third terrain 1.2 m/s passes as well, and 1.0 does not."""
    tried: list[float] = []
    passing = [round(0.1 * k, 1) for k in range(1, 8)]

    def plan(robot: gaitopt.Quadruped, footholds: object, *, speed: float, timing: str) -> Walk:
        tried.append(speed)
        return Walk(1.0 / speed, speed)

    def walked(walk: Walk) -> Walk:
        return replace(walk, passed=walk.speed in passing)

    monkeypatch.setattr(gaitopt, "plan_crawl", plan)
    monkeypatch.setattr(gaitopt, "simulate", walked)
    robot, rows = gaitopt.load_robot("a1"), []
    for seed, first in ((0, 2.0), (1, 2.0), (2, 1.0), (3, 1.0)):
        tried.clear()
        passing += [1.0, 1.2] if seed == 3 else []
        rows.append(force_rows.made(robot, Row(seed, "a1", SWEEP), False, True, rows))
        assert tried[0] == first
    assert [row.told for row in rows] == ["0.7 m/s", "0.7 m/s", "0.7 m/s", "1.2 m/s"]


@dataclass(frozen=True)
class Walk:
    """A walk of a speed, and what physics makes of it."""

    duration: float
    speed: float
    passed: bool = False
    end: float = 5.0


def test_walks_with_a_large_reserve_are_found_by_regions_only(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(standing, "COLUMNS", 2)
    robot, limits = gaitopt.load_robot("a1"), standing.LIMITS["reserve 10 %"]
    times, steps = standing.walks(robot, limits, 1)
    assert len(times) == 1 and steps > 0
    with standing.without_regions():
        assert standing.walks(robot, limits, 1) == ([], 0)


def test_the_timing_that_is_measured_is_the_last_part_of_a_plan() -> None:
    robot = gaitopt.load_robot("go2")
    columns = gaitopt.s_columns(seed=0, columns=2, robot=robot)
    assert untimed(robot, columns)().duration == gaitopt.plan_crawl(robot, columns).duration
