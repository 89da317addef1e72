"""The benchmarks run, their numbers are numbers, and they compare two ways to the same walk.

No time is asserted: that is for people to read, on a quiet machine.
"""

from __future__ import annotations

import json
import math
import subprocess
import sys
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import gaitopt
from benchmarks import __main__ as command
from benchmarks.physics import terrain_table
from benchmarks.planning import constants
from benchmarks.planning.onward import way_on
from benchmarks.planning.prices import prices
from benchmarks.planning.turns import raced, values_of
from benchmarks.speed import terrain
from benchmarks.table import rivals
from gaitopt.errors import InputError
from gaitopt.planners.over_terrain.settings import TerrainSettings
from gaitopt.planners.over_terrain.setup import search_for
from gaitopt.studies import terrain_study

ROOT = Path(__file__).resolve().parent.parent
FAST = ("plan", "cog", "import", "sample", "files", "obvious", "route")


def run(*arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, *arguments], cwd=ROOT, capture_output=True, text=True)


@pytest.fixture(scope="module")
def report(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    path = tmp_path_factory.mktemp("benchmarks") / "numbers.json"
    done = run("-m", "benchmarks", "--quick", "--json", str(path), *FAST)
    assert done.returncode == 0, done.stderr
    return {"table": done.stdout, **json.loads(path.read_text())}


def rows(report: dict[str, Any]) -> dict[str, dict[str, Any]]:
    return {row["name"]: row for results in report["results"].values() for row in results}


def test_every_number_is_finite_and_no_time_is_negative(report: dict[str, Any]) -> None:
    """A power of growth may have any sign: two short times on a busy machine are noise."""
    assert tuple(report["results"]) == FAST
    for row in rows(report).values():
        numbers = [row[key] for key in ("median", "min", "p90", "cpu_median", "ratio", "limit")]
        for number in (n for n in numbers if n is not None):
            assert math.isfinite(number), row
            assert number >= 0.0 or row["name"].endswith("-power"), row


def test_least_median_and_most_come_in_order(report: dict[str, Any]) -> None:
    for row in rows(report).values():
        assert row["min"] <= row["median"] <= row["p90"], row


def test_the_table_shows_every_benchmark_and_what_it_measured(report: dict[str, Any]) -> None:
    for name, results in report["results"].items():
        assert name in report["table"]
        for row in results:
            assert row["what"] in report["table"]


def test_the_plan_is_held_against_its_goal_and_limit(report: dict[str, Any]) -> None:
    plan = rows(report)["plan"]
    assert (plan["unit"], plan["goal"], plan["limit"]) == ("ms", 10.0, 30.0)
    assert plan["cpu_median"] > 0.0


def test_the_obvious_way_finds_the_same_walk(report: dict[str, Any]) -> None:
    found = rows(report)
    assert found["cog-apart"]["unit"] == "m" and found["cog-apart"]["median"] <= 1e-5
    assert found["time-apart"]["unit"] == "%" and found["time-apart"]["median"] <= 1.0


def test_other_solvers_find_the_same_fastest_walk(report: dict[str, Any]) -> None:
    """The time that IPOPT and fatrop find for the very same problem, over ours."""
    found = rows(report)
    for rival in ("route-ipopt-time", "route-fatrop-time"):
        assert found[rival]["median"] == pytest.approx(1.0, abs=2e-3)


def test_ratios_are_those_of_the_cpu_times_in_the_same_run(report: dict[str, Any]) -> None:
    found = rows(report)
    for theirs, ours in (("obvious-cog-anew", "ours-cog"), ("obvious-plan", "ours-plan")):
        ratio = found[theirs]["cpu_median"] / found[ours]["cpu_median"]
        assert found[theirs]["ratio"] == pytest.approx(ratio, rel=1e-9)


def test_no_host_name_or_path_is_reported(report: dict[str, Any]) -> None:
    text = json.dumps(report["machine"])
    assert str(ROOT) not in text and "/" not in text
    assert report["machine"]["cores"] >= 1 and report["quick"] is True


def test_another_walk_makes_the_run_fail(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(command, "use_one_core", lambda: False)  # this process goes on after it
    monkeypatch.setattr(rivals, "TIME_AGREEMENT", -1.0)
    assert command.main(["--quick", "obvious"]) == 1
    assert "beyond its limit: durations of both walks" in capsys.readouterr().err


def test_an_unknown_benchmark_is_refused_and_the_known_ones_named(
    capsys: pytest.CaptureFixture[str],
) -> None:
    with pytest.raises(SystemExit) as exit_:
        command.main(["plans"])
    assert exit_.value.code == 2
    error = capsys.readouterr().err
    assert "no benchmark plans" in error and "obvious" in error


def test_the_readme_names_every_benchmark(capsys: pytest.CaptureFixture[str]) -> None:
    readme = (ROOT / "benchmarks" / "README.md").read_text()
    with pytest.raises(SystemExit):
        command.main(["--help"])
    listed = capsys.readouterr().out.split("of ")[1].split(";")[0]
    names = [name.strip() for name in listed.replace("\n", " ").split(",")]
    assert len(names) == 11
    for name in names:
        assert f"`{name}`" in readme, name


def test_a_constant_has_another_value_for_a_while_in_all_modules_that_use_it() -> None:
    users = [m for m in constants._modules() if hasattr(m, "RESERVE_KEPT")]
    before = [m.RESERVE_KEPT for m in users]
    assert len(users) > 0
    with pytest.raises(ZeroDivisionError), constants.changed("RESERVE_KEPT", 0.25):
        assert [m.RESERVE_KEPT for m in users] == [0.25] * len(users)
        raise ZeroDivisionError
    assert [m.RESERVE_KEPT for m in users] == before


def test_a_constant_that_two_modules_understand_differently_is_not_changed(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    first, second = constants._modules()[:2]
    monkeypatch.setattr(first, "PLANTED", 1.0, raising=False)
    monkeypatch.setattr(second, "PLANTED", 2.0, raising=False)
    with pytest.raises(InputError, match="different values"), constants.changed("PLANTED", 3.0):
        pass
    assert (first.PLANTED, second.PLANTED) == (1.0, 2.0)  # type: ignore[attr-defined]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["RESERVE_KEP", "0.3"], "RESERVE_KEPT"),
        (["reserve", "0.3"], "name in capitals"),
        (["RESERVE_KEPT"], "give one or more values"),
        (["RESERVE_KEPT", "half"], "malformed"),
    ],
)
def test_mistakes_are_named_before_anything_is_planned(
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    arguments: list[str],
    words: str,
) -> None:
    monkeypatch.setattr(constants, "measured", lambda cases: pytest.fail("planned"))
    with pytest.raises(SystemExit) as exit_:
        constants.main(arguments)
    assert exit_.value.code == 2
    assert words in capsys.readouterr().err


def test_prices_of_speeds_and_accelerations_make_up_the_time_of_a_walk() -> None:
    """Faster by one percent is a walk whose speeds are that much higher, and accelerations twice.

    The rest is the problem's quadratic term, and the rows of shortest spans and of the ZMP.
    """
    robot, columns = gaitopt.load_robot("wang2020"), gaitopt.s_columns(0, columns=2)
    duration, *heights, speeds, about, elsewhere = prices(robot, columns, "swing", 0.02, 0.4)
    assert min(heights) > 0.0 and about > 0.0 and elsewhere > 0.0
    steps = columns.steps
    assert 100.0 * speeds + 2.0 * (about + elsewhere) == pytest.approx(
        1e3 * duration / steps, rel=0.1
    )


def test_times_of_searches_are_given_as_multiples_of_the_workload_too() -> None:
    searches = [terrain.Searched(True, rate) for rate in (1.0, 2.0, 3.0)]
    line = terrain.row("go2", "rubble", [*searches, terrain.Searched(False, 90.0)], 0.5)
    assert line == "| go2 | rubble | 3 of 4 | 2.00 | 4 | 2.90 | 6 |"
    assert terrain.row("go2", "rubble", [], 0.5) == "| go2 | rubble | 0 of 0 |  |  |  |  |"


def test_the_table_of_walks_is_written_between_the_marks_of_its_page(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def quick(walk: terrain_study.TerrainWalk) -> terrain_study.TerrainRow:
        if walk.seed:
            return terrain_study.TerrainRow("no way", causes="a_limb: 3", failed_step=2)
        done = {"solvable": True, "found": True, "planned": True, "certified": True}
        return terrain_study.TerrainRow(**done, passed=True, metres=2.0, search_time=1.0)

    monkeypatch.setattr(terrain_study, "run_terrain_walk", quick)
    page = tmp_path / "page.md"
    page.write_text(f"# Title\n\n{terrain_table.BEGIN}\nold\n{terrain_table.END}\nafter\n")
    arguments = ["--seeds", "2", "--robots", "go2", "--grounds", "ramp:0.7", "--jobs", "1",
                 "--rows", str(tmp_path / "rows.csv"), "--write", str(page)]  # fmt: skip
    assert terrain_table.main(arguments) == 0
    text = page.read_text()
    assert text.startswith("# Title\n") and text.endswith("after\n") and "old" not in text
    assert "| go2 | ramp 1, friction 0.7 | 2 | 1 | 1 | 1 | 1 | 1 | 0.50 | 0.50 |  |" in text
    assert "- go2, ramp, seed 1: no way: step 2 (): a\\_limb: 3" in text
    command_line = (
        "python -m benchmarks.physics.terrain_table --seeds 2 --robots go2 --grounds ramp:0.7"
    )
    assert f"{command_line}\n" in text and str(tmp_path) not in text
    assert text.split(terrain_table.BEGIN)[1].split(terrain_table.END)[0].strip() in (
        capsys.readouterr().out
    )
    # What is there is printed without a run, with a summary.
    monkeypatch.setattr(terrain_study, "run_terrain_walk", None)
    assert terrain_table.main([*arguments, "--so-far"]) == 0
    assert page.read_text() == text and "Of 2 grounds 1 solvable, 1 found, 1 planned" in text
    page.write_text("no marks")
    with pytest.raises(InputError, match="needs a line"):
        terrain_table.main([*arguments, "--so-far"])


def test_a_table_of_grounds_that_is_cut_is_balanced(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[terrain_study.TerrainWalk] = []

    def noted(walk: terrain_study.TerrainWalk) -> terrain_study.TerrainRow:
        asked.append(walk)
        return terrain_study.TerrainRow(found=True, metres=1.0, search_time=0.5)

    monkeypatch.setattr(terrain_study, "run_terrain_walk", noted)
    terrain_table.main(["--robots", "go2,hyq:0.5", "--grounds", "ramp:0.7,hills", "--seeds", "2",
                        "--slippery", "1", "--first", "7", "--jobs", "1",
                        "--rows", str(tmp_path / "rows.csv")])  # fmt: skip
    assert [walk.seed for walk in asked] == 4 * [7] + 4 * [8] + 4 * [9]
    assert [(w.robot, w.terrain, w.difficulty) for w in asked[:4]] == [
        ("go2", "ramp", 1.0), ("hyq", "ramp", 0.5), ("go2", "hills", 1.0), ("hyq", "hills", 0.5),
    ]  # fmt: skip
    assert [w.physics_friction for w in asked] == 8 * [None] + [0.7, 0.7, 0.6, 0.6]


def test_constants_of_one_name_are_told_apart_by_their_modules() -> None:
    assert constants.present("pacing.ENOUGH") != constants.present("rounds.MOST_ROUNDS")
    with pytest.raises(InputError, match="different values"):
        constants.present("ENOUGH")


def test_walks_are_raced_with_other_constants() -> None:
    """Turns that are less sharp take time, also from what joints alone allow."""
    robot, columns = gaitopt.load_robot("wang2020"), gaitopt.s_columns(0, columns=2)
    found = []
    for text in ("", "RAMPS=(0.05, 0.05); LOAD_TIME=0.1"):
        with ExitStack() as stack:
            for name, value in values_of(text).items():
                stack.enter_context(constants.changed(name, value))
            found.append(
                raced(robot, columns, "swing", 0.02, 0.4, physics=False, certificate=False)
            )
    known, gentle = found
    assert 1.5 < gentle.ratio < known.ratio < known.by_joints < 2.5
    assert gentle.by_joints < known.by_joints
    with pytest.raises(InputError, match="NAME=VALUE"):
        values_of("RAMPS")


def test_a_search_goes_on_from_before_its_dead_end_with_more_freedom() -> None:
    """A trench is too wide for steps of little freedom, and not for freer ones."""
    go2 = gaitopt.load_robot("go2")
    x = -0.6 + 0.02 * np.arange(91)
    z = np.where((x > 0.41) & (x < 0.65), -0.5, 0.0)[:, None] * np.ones(41)
    ground = gaitopt.HeightMap(z, 0.02, (-0.6, -0.4))
    settings = TerrainSettings.for_robot(go2, freedom=0.04, width_limit=12)
    found = way_on(search_for(go2, ground, (0.5, 0.0), (0.0, 0.0, 0.0), settings))
    assert found is not None and found.complete
    assert found.settings.freedom > settings.freedom
