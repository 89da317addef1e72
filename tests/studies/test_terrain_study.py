"""Studies of made grounds: what becomes of each walk, and how the table counts."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import gaitopt
from gaitopt import InfeasibleStepError, InputError, TerrainError
from gaitopt.studies import terrain_study
from gaitopt.studies.tables import as_text
from gaitopt.studies.terrain_report import (
    failures,
    plot_terrain_study,
    standings,
    terrain_markdown,
    terrain_table,
)
from gaitopt.studies.terrain_study import (
    TERRAIN_HEADER,
    TerrainRow,
    TerrainWalk,
    run_terrain_study,
    run_terrain_walk,
    terrain_grid,
)
from gaitopt.viewing.figures.panels import figure_of

SHORT: dict[str, Any] = {"robot": "wang2020", "length": 1.1, "collisions": False}
"""The shortest ground of wang2020."""
WALL = TerrainWalk(terrain="stairs", sizes="riser=0.5", width_limit=6, exhaustive=12, **SHORT)
"""Stairs of 0.5 m, higher than the robot."""


@pytest.fixture(scope="module")
def flat_row() -> TerrainRow:
    """A walk over level ground."""
    return run_terrain_walk(TerrainWalk(terrain="flat", **SHORT))


def test_a_walk_over_level_ground_is_found_planned_and_judged(flat_row: TerrainRow) -> None:
    assert (flat_row.found, flat_row.planned, flat_row.passed) == (True, True, None)
    assert flat_row.solvable is True and flat_row.metres == pytest.approx(1.1)
    # Without self-collisions not all is checked, and nothing is certified.
    assert flat_row.certified is False and flat_row.status == "not certified"
    assert flat_row.message == "not all checked" and flat_row.violations == ""
    times = [flat_row.search_time, flat_row.plan_time, flat_row.certify_time]
    assert all(t is not None and t > 0.0 for t in times)
    assert flat_row.duration is not None and flat_row.mean_speed is not None
    assert flat_row.duration * flat_row.mean_speed == pytest.approx(1.1, abs=0.1)


@pytest.mark.parametrize(
    ("succeeded", "within", "status"),
    [(True, True, "ok"), (True, False, "too fast"), (False, True, "fell")],
)
def test_a_walk_in_physics_passes_falls_or_is_too_fast(
    monkeypatch: pytest.MonkeyPatch, succeeded: bool, within: bool, status: str
) -> None:
    result = SimpleNamespace(
        passed=succeeded and within, succeeded=succeeded, failures=("a reason",),
        landing_error=0.01, tilt=0.02,
    )  # fmt: skip
    given: list[Any] = []

    def simulated(plan: gaitopt.Plan, settings: Any) -> SimpleNamespace:
        given.append(settings)
        return result

    monkeypatch.setattr("gaitopt.simulation.simulate.simulate", simulated)
    walk = TerrainWalk(terrain="flat", certify=False, simulate=True, **SHORT)
    row = run_terrain_walk(walk)
    assert given == [None]
    assert (row.status, row.passed) == (status, status == "ok")
    assert row.message == ("" if status == "ok" else "a reason")
    assert (row.landing_error, row.tilt, row.certified) == (0.01, 0.02, None)


@pytest.fixture
def searched(monkeypatch: pytest.MonkeyPatch) -> list[int | None]:
    """Widths up to which was searched. All lengths of steps would take seconds: here it is one."""
    widths: list[int | None] = []
    original = gaitopt.search_terrain
    usual = gaitopt.TerrainSettings.for_robot(gaitopt.load_robot("wang2020"))
    one = {"step_length": usual.step_length, "stance": usual.stance}

    def quick(*arguments: Any, **options: Any) -> Any:
        widths.append(options.get("width_limit"))
        narrow = min(options.get("width_limit") or 6, 12)
        return original(*arguments, **{**options, "width_limit": narrow, **one})

    monkeypatch.setattr("gaitopt.planners.over_terrain.planner.search_terrain", quick)
    return widths


def test_stairs_higher_than_the_robot_have_no_way_however_wide_the_search(
    searched: list[int | None],
) -> None:
    row = run_terrain_walk(WALL)
    assert (row.status, row.found, row.solvable, row.planned) == ("no way", False, False, False)
    assert row.failed_step is not None and row.failed_leg in gaitopt.LEGS
    assert row.causes and "no way over the ground was found" in row.message
    assert row.plan_time is None and row.certified is None and row.passed is None
    assert searched == [6, 12]


def test_without_a_wider_search_it_stays_open_whether_a_map_is_solvable(
    searched: list[int | None],
) -> None:
    wall = {"terrain": "stairs", "sizes": "riser=0.5", **SHORT}
    assert run_terrain_walk(TerrainWalk(exhaustive=0, **wall)).solvable is None
    assert run_terrain_walk(TerrainWalk(exhaustive=500, **wall)).solvable is False
    # A second search that is no wider than the first would find the same.
    assert run_terrain_walk(TerrainWalk(exhaustive=192, **wall)).solvable is False
    assert searched == [None, None, 500, None]


def test_a_refusal_of_the_planner_and_a_fault_are_rows_that_say_why(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    walk = TerrainWalk(terrain="flat", **SHORT)
    errors: list[Exception] = [
        InfeasibleStepError("step 3 is too long", 3, "LF", 0.0),
        TerrainError(f"no way; {terrain_study.SAID}step 4: too steep; what", 24, "", {}, None),
        ZeroDivisionError("division by zero"),
    ]

    def broken(*arguments: Any, **options: Any) -> None:
        raise errors.pop(0)

    monkeypatch.setattr("gaitopt.planners.over_terrain.planner.plan_terrain", broken)
    refused, told, fault = (run_terrain_walk(walk) for _ in range(3))
    assert refused.status == "refused" and "step 3 is too long" in refused.message
    assert refused.found and not refused.planned
    assert (told.status, told.message) == ("refused", "step 4: too steep; what")
    assert told.failed_step is None
    assert (fault.status, fault.message) == ("error", "ZeroDivisionError: division by zero")
    unknown = run_terrain_walk(TerrainWalk(terrain="lava", **SHORT))
    assert unknown.status == "error" and "there is no ground named 'lava'" in unknown.message


def test_a_study_goes_on_where_it_stopped(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    done: list[int] = []

    def quick(walk: TerrainWalk) -> TerrainRow:
        done.append(walk.seed)
        return TerrainRow(found=True, metres=2.0, search_time=float(walk.seed))

    monkeypatch.setattr(terrain_study, "run_terrain_walk", quick)
    table = tmp_path / "study.csv"
    run_terrain_study(terrain_grid(range(2)), table, jobs=1)
    rows = run_terrain_study(terrain_grid(range(4)), table, jobs=1)
    assert done == [0, 1, 2, 3] and [row["seed"] for row in rows] == ["0", "1", "2", "3"]
    assert tuple(table.read_text().splitlines()[0].split(",")) == TERRAIN_HEADER
    with pytest.raises(InputError, match="is no table of a study"):
        run_terrain_study(terrain_grid(range(1)), _other_table(tmp_path))


def _other_table(folder: Path) -> Path:
    path = folder / "mine.csv"
    path.write_text("a,b\n1,2\n")
    return path


def row(seed: int, **fields: Any) -> dict[str, str]:
    """A row of the table as text."""
    values = {
        **TerrainWalk(seed=seed).__dict__, **TerrainRow(**fields).__dict__, "key": str(seed)
    }  # fmt: skip
    return {name: "" if values[name] is None else str(values[name]) for name in TERRAIN_HEADER}


@pytest.fixture
def rows() -> list[dict[str, str]]:
    """Four walks: one that passes, one that falls, one without a way, and one not solvable."""
    done = {"solvable": True, "found": True, "planned": True, "certified": True, "metres": 2.0}
    lost = {"status": "no way", "failed_step": 7, "failed_leg": "RF", "causes": "a limb: 12"}
    return [
        row(0, **done, search_time=1.0, mean_speed=0.1, passed=True),
        row(1, **done, search_time=3.0, mean_speed=0.2, passed=False, status="fell"),
        row(2, **lost, solvable=True, metres=2.0, search_time=50.0),
        row(3, **lost, solvable=False, metres=2.0, search_time=70.0),
    ]


def test_the_table_counts_how_far_walks_got_and_the_time_of_searches_that_succeeded(
    rows: list[dict[str, str]],
) -> None:
    (line,) = standings(rows)
    assert line.counts == {"solvable": 3, "found": 2, "planned": 2, "certified": 2, "passed": 1}
    np.testing.assert_allclose(line.rates, [0.5, 1.5])
    text = as_text(terrain_table(rows), 200)
    assert "4 walks" in text and "1.00" in text and "1.45" in text  # median and 95th percentile
    assert "seed 2: no way: step 7 (RF): a limb: 12" in text
    assert terrain_markdown(rows).splitlines()[-1] == (
        "| go2 | rubble 0.5 | 4 | 3 | 2 | 2 | 2 | 1 | 1.00 | 1.45 | 150 |"
    )
    assert len(failures(rows)) == 3


def test_what_was_not_looked_at_is_left_empty() -> None:
    (line,) = standings([row(0, found=True, metres=2.0, search_time=1.0)])
    assert line.counts == {
        "solvable": None, "found": 1, "planned": 0, "certified": None, "passed": None,
    }  # fmt: skip
    assert standings([row(0, metres=2.0, search_time=1.0)])[0].rates.size == 0


def test_the_picture_has_a_bar_for_each_stage(rows: list[dict[str, str]]) -> None:
    figure = figure_of(plot_terrain_study(rows))
    heights = [bar.get_height() for bar in figure.axes[0].patches]
    assert heights == [75.0, 50.0, 50.0, 50.0, 25.0]
