"""``gaitopt terrain``: from a map in a file to a walk, or to what is in its way."""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image
from typer.testing import Result

import gaitopt
from gaitopt.cli.ground_options import ground_options, in_ground_options
from gaitopt.cli.results.report import Report
from gaitopt.cli.search_options import in_search_options, search_options
from gaitopt.cli.terrain import MapArgument, _tell_edges
from gaitopt.planners.over_terrain.planned_forces import usual_forces
from gaitopt.planners.over_terrain.settings import TerrainSettings
from gaitopt.terrain.maps.catalogue import GROUNDS

Command = Callable[..., Result]
SCALE = ("--resolution", "0.02", "--heights", "0,0.2")


@pytest.fixture(scope="module")
def sketch(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A PNG of 1.8 m by 1.2 m: level ground, and a step of 2 cm across it."""
    pixels = np.zeros((60, 90), np.uint8)
    pixels[:, 45:] = 26  # of 255, times 0.2 m: 2.04 cm
    path = tmp_path_factory.mktemp("maps") / "step.png"
    Image.fromarray(pixels).save(path)
    return path


@pytest.fixture(scope="module")
def walked(
    sketch: Path, command: Command, tmp_path_factory: pytest.TempPathFactory
) -> tuple[Result, Path]:
    """What the command prints and writes for the sketch."""
    out = tmp_path_factory.mktemp("walked")
    result = command("terrain", str(sketch), *SCALE, "--start", "0.6,0,0", "--goal", "0.9,0",
                     "--no-collisions", "--out", str(out))  # fmt: skip
    return result, out


def test_a_sketch_becomes_a_certified_walk_over_it(walked: tuple[Result, Path]) -> None:
    result, out = walked
    assert result.exit_code == 3, result.output  # self-collisions were left out
    plan = gaitopt.load_plan(out / "plan.npz")
    ground = plan.footholds.ground
    assert ground is not None and ground.extent == pytest.approx(
        np.array([[0.0, 1.78], [-0.59, 0.59]]))  # fmt: skip
    places = np.concatenate([plan.footholds[leg] for leg in gaitopt.LEGS])
    on_top = places[:, 0] > 0.9
    assert on_top.any() and not on_top.all()
    heights = np.where(on_top, 26 / 255 * 0.2, 0.0)
    np.testing.assert_allclose(places[:, 2] - plan.robot.foot_radius, heights, atol=1e-9)
    assert gaitopt.verify(plan, collisions=False).ok
    # Forces are planned as in Python: something is left for the controller.
    assert plan.settings.promised_forces == usual_forces(TerrainSettings.friction)


def test_it_writes_plan_replay_figure_and_footholds(walked: tuple[Result, Path]) -> None:
    result, out = walked
    names = {"plan.npz", "replay.html", "map.png", "footholds.csv"}
    assert {path.name for path in out.iterdir()} == names | {"run.json"}
    assert all(name in result.output for name in names)
    plan = gaitopt.load_plan(out / "plan.npz")
    over = f"steps over {plan.distance:.2f} m"
    for words in ("not tried in physics", "places were tried", "s a metre", over):
        assert words in result.output
    assert plan.distance == pytest.approx(0.3, abs=0.03)
    written = gaitopt.Footholds.from_csv(out / "footholds.csv")
    for leg in gaitopt.LEGS:
        assert (written[leg] == plan.footholds[leg]).all()


def test_where_there_is_no_way_it_says_what_is_in_it_and_draws_how_far_it_got(
    shell: Any, tmp_path: Path
) -> None:
    pixels = np.zeros((60, 90), np.uint8)
    pixels[:, 50:53] = 255
    Image.fromarray(pixels).save(tmp_path / "wall.png")
    done = shell("terrain", str(tmp_path / "wall.png"), "--resolution", "0.02", "--heights",
                 "0,0.6", "--start", "0.55,0,0", "--goal", "1.3,0", "--width-limit", "6", "--out",
                 str(tmp_path / "out"))  # fmt: skip
    assert done.code == 2
    told = " ".join(done.stderr.split())
    assert "No way was found." in done.stdout and "would touch the ground" in told
    words = r"after \d+ of \d+ steps the next one \(\w\w\) is not possible"
    assert re.search(f"gaitopt: no way over the ground was found: {words}", told)
    # What the error tells is not said twice.
    causes = re.findall(r"\d+ x (.*)", done.stdout)
    assert not any(cause in told for cause in causes)
    assert "what may help: " in done.stderr and "--body-height" in done.stderr
    assert {path.name for path in (tmp_path / "out").iterdir()} == {"map.png", "run.json"}


@pytest.mark.parametrize(
    ("given", "told"),
    [
        ((), "step.png tells no scale: 20 mm a pixel, black 0 m and white 0.12 m high;"),
        (("--heights", "0,0.2"), "20 mm a pixel, black 0 m and white 0.2 m high; --resolution"),
        (("--resolution", "0.01"), "10 mm a pixel, black 0 m and white 0.12 m high; --resol"),
        (SCALE, ""),
    ],
)
def test_a_png_without_a_scale_gets_one_that_is_told(
    shell: Any, sketch: Path, given: tuple[str, ...], told: str
) -> None:
    """wang2020 stands at 0.4 m: white is as high as 0.3 of it."""
    done = shell("terrain", str(sketch), *given, "--goal", "9,0")
    assert "x = 9 m, y = 0 m is off the map" in done.stderr
    assert told in done.stderr and ("tells no scale" in done.stderr) == bool(told)


@pytest.mark.parametrize(
    ("name", "content"),
    [("z.npy", lambda path, z: np.save(path, z)), ("z.npz", lambda path, z: np.savez(path, z=z))],
)
def test_arrays_without_a_place_begin_at_x_0_with_y_0_in_their_middle(
    shell: Any, tmp_path: Path, name: str, content: Any
) -> None:
    content(tmp_path / name, np.zeros((51, 41)))
    done = shell("terrain", str(tmp_path / name), "--resolution", "0.02", "--goal", "9,0")
    assert "from x = 0 to 1 m and from y = -0.4 to 0.4 m" in " ".join(done.stderr.split())


def test_a_saved_map_lies_where_it_says(shell: Any, tmp_path: Path) -> None:
    gaitopt.HeightMap(np.zeros((51, 41)), 0.02).save(tmp_path / "z.npz")
    done = shell("terrain", str(tmp_path / "z.npz"), "--goal", "9,0")
    assert "from x = 0 to 1 m and from y = 0 to 0.8 m" in " ".join(done.stderr.split())


def test_wrong_settings_and_starts_without_ground_name_options(shell: Any, tmp_path: Path) -> None:
    np.save(tmp_path / "flat.npy", np.zeros((120, 60)))
    z = np.zeros((120, 60))
    z[:40] = np.nan
    np.save(tmp_path / "hole.npy", z)
    scale = ("--robot", "go2", "--resolution", "0.02", "--goal", "1.6,0")
    wrong = shell("terrain", str(tmp_path / "flat.npy"), *scale, "--freedom", "-1")
    assert "--freedom must be" in wrong.stderr
    none = shell("terrain", str(tmp_path / "hole.npy"), *scale, "--start", "0.3,0,0")
    assert "a larger --freedom" in " ".join(none.stderr.split())
    np.save(tmp_path / "coarse.npy", np.random.default_rng(0).uniform(0.0, 0.2, (20, 16)))
    coarse = shell("terrain", str(tmp_path / "coarse.npy"), "--robot", "go2", "--resolution", "0.5")
    told = " ".join(coarse.stderr.split())
    assert "0.5 m apart" in told and "--resolution, --heights" in told and "(--grid)" in told


def test_a_goal_at_the_edge_is_refused_before_anything_is_searched(
    shell: Any, tmp_path: Path
) -> None:
    np.save(tmp_path / "flat.npy", np.zeros((90, 60)))
    done = shell("terrain", str(tmp_path / "flat.npy"), "--resolution", "0.02", "--goal", "1.77,0",
                 "--robot", "go2", "--out", str(tmp_path / "out"))  # fmt: skip
    assert done.code == 2 and "The search made" not in done.stdout
    assert "No way was looked for: no pose of the body" in " ".join(done.stdout.split())
    assert "move the goal by" in " ".join(done.stderr.split())


def test_where_the_planner_refuses_all_footholds_it_says_so(
    shell: Any, sketch: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*arguments: Any, **options: Any) -> None:
        raise gaitopt.InfeasibleStepError("step 3 is too long", 3, "LF", 0.0)

    monkeypatch.setattr("gaitopt.planners.over_terrain.walks.plan_crawl", refuse)
    monkeypatch.setattr("gaitopt.planners.over_terrain.walks.MOST_PLANS", 1)
    done = shell("terrain", str(sketch), *SCALE, "--start", "0.6,0,0", "--goal", "0.9,0", "--out",
                 str(tmp_path))  # fmt: skip
    assert done.code == 2 and "Footholds to the goal were found, but no walk" in done.stdout
    assert "the planner of the walk said: step 3 is too long" in done.stderr


def test_a_start_at_the_edge_of_the_map_is_told(shell: Any, sketch: Path, tmp_path: Path) -> None:
    done = shell("terrain", str(sketch), *SCALE, "--start", "0.3,0,0", "--goal", "1.2,0",
                 "--time-limit", "0.5", "--out", str(tmp_path))  # fmt: skip
    # Half the stance of wang2020, 0.2 m, and 0.8 of its standing height, 0.4 m.
    assert done.code == 2 and "The start is 0.30 m from the edge of the map" in done.stdout
    assert "choose a place 0.52 m from the edge" in done.stdout
    assert "The goal is" not in done.stdout


@pytest.mark.parametrize("name", ["go2", "anymal_c", "wang2020"])
def test_made_ground_has_room_about_start_and_goal(
    name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    robot = gaitopt.load_robot(name)
    flat = gaitopt.make_ground("flat", robot=robot)
    for gap in (0.0, 0.05):
        places = {"start": (-gap, 0.0), "goal": (3.0 + gap, 0.0)}
        _tell_edges(robot, flat, places, Report(False, {}))
        assert (capsys.readouterr().out.count("from the edge of the map") > 0) == (gap > 0.0)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["none.png"], "there is no file none.png, and no ground of this name is made"),
        (["step.png", *SCALE, "--goal", "9,0"], "x = 9 m, y = 0 m is off the map, which reaches"),
        (["step.png", *SCALE, "--goal", "1"], "--goal takes 2 or 3 numbers joined by commas"),
        (["step.png", *SCALE, "--start", "0,0"], "--start takes 3 numbers joined by commas"),
        (["step.png", *SCALE, "--goal", "1,0", "--waypoint", "0.8,0,1"], "or all without it"),
        (["step.png", *SCALE, "--seed", "1"], "--seed is for ground that is made"),
        (["step.png", *SCALE, "--layer", "z"], "take no option --layer"),
        (["rubble", "--heights", "0,1"], "rubble is made ground"),
        (["rubble", "--size", "riser=0.1"], "rubble has no size riser"),
        (["rubble", "--size", "height"], "--size takes NAME=NUMBER"),
        (["rubble", "--friction", "0"], "friction"),
    ],
)
def test_mistakes_end_in_one_line_that_says_what_to_do(
    shell: Any, sketch: Path, monkeypatch: pytest.MonkeyPatch, arguments: list[str], words: str
) -> None:
    monkeypatch.chdir(sketch.parent)
    done = shell("terrain", *arguments)
    assert done.code == 2 and words in done.stderr
    assert len([line for line in done.stderr.splitlines() if line]) == 1


def test_every_setting_of_the_search_is_an_option() -> None:
    options = set(inspect.signature(search_options).parameters)
    assert options == {field.name for field in fields(TerrainSettings)}


def test_everything_that_load_ground_takes_is_an_option() -> None:
    taken = set(inspect.signature(gaitopt.load_ground).parameters) - {"path"}
    assert taken <= set(inspect.signature(ground_options).parameters)


def test_the_help_names_every_ground_that_is_made() -> None:
    (argument,) = MapArgument.__metadata__  # type: ignore[attr-defined]
    named = argument.help.split("made: ")[1].rstrip(".").replace(" or ", ", ").split(", ")
    assert tuple(named) == tuple(GROUNDS)


def test_images_have_y_0_in_their_middle_unless_they_are_told_where_to_be(sketch: Path) -> None:
    robot = gaitopt.load_robot("wang2020")
    scale: dict[str, Any] = {"resolution": 0.02, "heights": "0,0.2"}
    middle = ground_options(**scale).load(str(sketch), robot)
    told = ground_options(**scale, origin="-1,2").load(str(sketch), robot)
    assert middle.origin == pytest.approx((0.0, -0.59)) and told.origin == (-1.0, 2.0)
    assert (middle.z == told.z).all()
    finer = ground_options(**scale, grid=0.01).load(str(sketch), robot)
    assert finer.resolution == 0.01 and finer.height([0.5, 0.1]) == 0.0


def test_made_ground_is_that_of_make_ground() -> None:
    robot = gaitopt.load_robot("wang2020")
    made = ground_options(seed=3, length=2.0, size=["height=0.1"], resolution=0.04)
    same = gaitopt.make_ground("rubble", seed=3, length=2.0, height=0.1, resolution=0.04,
                               robot=robot)  # fmt: skip
    assert (made.load("rubble", robot).z == same.z).all()


@pytest.mark.parametrize(
    ("told", "words"),
    [
        ("for instance heights=(0.0, 0.15)", "for instance --heights 0.0,0.15"),
        ("for instance unit=0.3048", "for instance --unit 0.3048"),
        ("for instance layer='elevation'", "for instance --layer elevation"),
        ("choose one with topic=...: a, b", "choose one with --topic ...: a, b"),
    ],
)
def test_messages_name_options_of_the_command_line(told: str, words: str) -> None:
    assert in_ground_options(told) == words


def test_cures_name_options_of_the_command_line() -> None:
    told = "shorter steps (step_length), or a finer and wider search (exhaustive)"
    assert in_search_options(told) == (
        "shorter steps (--step-length), or a finer and wider search (--exhaustive)"
    )


def test_a_study_of_maps_prints_its_table_and_goes_on(command: Command, tmp_path: Path) -> None:
    table = tmp_path / "maps.csv"
    arguments = ("study", str(table), "--terrain", "flat", "--length", "1.1", "--no-collisions",
                 "--jobs", "1", "--seeds", "1")  # fmt: skip
    result = command(*arguments)
    assert result.exit_code == 0, result.output
    assert "flat 0.5" in result.output and "1 walk " in result.output
    before = table.read_text()
    assert ",flat,0,0.5,1.1," in before and table.with_suffix(".png").exists()
    assert command(*arguments).exit_code == 0 and table.read_text() == before


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--terrain", "lava"], "there is no ground named 'lava'; there are flat, rubble"),
        (["--terrain", "flat", "--objective", "margin"], "--objective is for walks over columns"),
        (["--terrain", "flat", "--timing", "forces"], "--timing is for walks over columns"),
        (["--terrain", "flat", "--columns", "3"], "--columns is for walks over columns"),
        (["--terrain", "flat", "--every-robot"], "--every-robot is for walks over columns"),
        (["--every-robot", "--effort-limit", "20"], "--every-robot takes robots as they are"),
        (["--every-robot", "--robot", "go2"], "leave out --robot"),
        (["--widest", "96"], "--widest is for walks over height maps: give --terrain"),
        (["--difficulty", "0.5"], "--difficulty is for walks over height maps: give --terrain"),
        (["--terrain", "rubble", "--size", "height"], "sizes are written as NAME=NUMBER"),
    ],
)
def test_options_of_the_other_kind_of_study_are_refused(
    error_of: Callable[..., str], tmp_path: Path, arguments: list[str], words: str
) -> None:
    assert words in error_of("study", str(tmp_path / "t.csv"), *arguments)
    assert not list(tmp_path.iterdir())
