"""How a robot's file is read, said on the command line: the same options for all commands."""

from __future__ import annotations

from collections.abc import Callable
from inspect import Parameter, signature
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import robot_texts
import typer
from typer.testing import Result

import gaitopt
from gaitopt.cli.app import app
from gaitopt.cli.robot_options import OPTION_OF, in_options

Command = Callable[..., Result]
ErrorOf = Callable[..., str]
COMMANDS = ("walk", "trot", "gait", "stride", "race", "compare", "verify", "study", "robot",
            "terrain")  # fmt: skip


@pytest.fixture
def massless(tmp_path: Path) -> Path:
    """The file of a robot whose links have shapes, but no masses."""
    box = robot_texts.collision('<box size="0.03 0.03 0.2"/>', "0 0 -0.1")
    text = robot_texts.robot(shank=box, masses=(0.0, 0.0, 0.0))
    path = tmp_path / "massless.urdf"
    path.write_text(text)
    return path


@pytest.fixture
def terrain(tmp_path: Path) -> Path:
    """One step for each leg of wang2020."""
    gaitopt.s_columns(0, columns=2).to_csv(tmp_path / "feet.csv")
    return tmp_path / "feet.csv"


def options_of(name: str) -> set[str]:
    """The options of a command."""
    group: Any = typer.main.get_command(app)
    return {text for parameter in group.commands[name].params for text in parameter.opts}


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_that_takes_a_robot_takes_all_options(name: str) -> None:
    """What ``load_robot`` can be told is an option of each command."""
    keywords = {p.name for p in signature(gaitopt.load_robot).parameters.values()
                if p.kind is Parameter.KEYWORD_ONLY} | {"knees"}  # fmt: skip
    assert keywords == set(OPTION_OF)
    wanted = {option.split()[0] for option in OPTION_OF.values()} | {"--masses"}
    assert wanted <= options_of(name)


def test_no_other_command_names_a_robot() -> None:
    group: Any = typer.main.get_command(app)
    taking = {name for name in group.commands if "--robot" in options_of(name)}
    assert taking | {"robot"} == set(COMMANDS)


def test_a_walk_keeps_the_limits_that_were_given(
    command: Command, no_figures: None, terrain: Path, tmp_path: Path
) -> None:
    arguments = ("walk", "--footholds", str(terrain), "--out", str(tmp_path / "out"))
    result = command(*arguments, "--velocity-limit", "0.2", "--effort-limit", "LF_KFE=40",
                     "--motor-inertia", "LF_KFE=0.1", "--motor-inertia", "RF_KFE=0.2",
                     "--joint-acceleration-limit", "LF_KFE=3", "--foot-radius", "0.02")  # fmt: skip
    assert result.exit_code == 0, result.output
    robot = gaitopt.load_plan(tmp_path / "out" / "plan.npz").robot
    assert np.allclose(robot.velocity_limits, 0.2) and robot.foot_radius == 0.02
    columns = {leg: robot.leg_columns[leg][2] for leg in gaitopt.LEGS}
    assert robot.effort_limits[columns["LF"]] == 40.0 != robot.effort_limits[columns["LH"]]
    assert (
        robot.acceleration_limits[columns["LF"]] == 3.0 < robot.acceleration_limits[columns["LH"]]
    )
    inertia = robot.motor_inertia[[columns[leg] for leg in gaitopt.LEGS]]
    assert inertia.tolist() == [0.1, 0.0, 0.0, 0.2]
    # The certificate judges by the robot that is named, read in the same way.
    plan = str(tmp_path / "out" / "plan.npz")
    same = command("verify", plan, "--robot", "wang2020", "--velocity-limit", "0.2",
                   "--motor-inertia", "LF_KFE=0.1", "--motor-inertia", "RF_KFE=0.2",
                   "--foot-radius", "0.02")  # fmt: skip
    assert same.exit_code == 0, same.output
    slower = command("verify", plan, "--robot", "wang2020", "--velocity-limit", "0.1")
    assert isinstance(slower.exception, gaitopt.RobotError)


def test_gaits_keep_the_limits_that_were_given(error_of: ErrorOf, tmp_path: Path) -> None:
    out = ("--distance", "0.2", "--out", str(tmp_path / "out"))
    assert "joint" in error_of("trot", "--velocity-limit", "0.1", *out)
    assert "joint" in error_of("gait", "walk", "--velocity-limit", "0.01", *out)


def test_masses_from_shapes_or_by_link(
    command: Command, shell: Any, no_figures: None, massless: Path, tmp_path: Path
) -> None:
    robot = ("--robot", str(massless), "--out", str(tmp_path / "out"))
    refused = shell("gait", "trot", *robot)
    assert refused.code == 2 and "--masses shapes estimates" in refused.stderr
    assert "masses=" not in refused.stderr
    heavy = [text for k in range(3) for leg in gaitopt.LEGS
             for text in ("--mass", f"{leg}_l{k}=0.75")]  # fmt: skip
    result = command("robot", str(massless), *heavy)
    assert result.exit_code == 0, result.output
    total = robot_texts.BODY_MASS + 4 * (3 * 0.75 + 0.1)
    assert f"{total:.4g} kg" in result.output
    assert command("robot", str(massless), "--masses", "none").exit_code == 0
    # Only the lower legs have shapes.
    told = shell("robot", str(massless), "--masses", "shapes").stderr
    assert "link LF_l0 moves and has no mass and no shape" in told


def test_a_foot_has_a_place_in_its_link(command: Command, tmp_path: Path) -> None:
    path = tmp_path / "footless.urdf"
    path.write_text(robot_texts.robot(foot=None))
    feet = [text for leg in gaitopt.LEGS for text in ("--foot", f"{leg}={leg}_l2,0,0,-0.22")]
    result = command("robot", str(path), *feet, "--foot-radius", "0.03")
    assert result.exit_code == 0, result.output
    assert "0.250 0.220" in result.output and "foot radius 30 mm" in result.output


def test_knees_by_leg(command: Command) -> None:
    told = command("robot", "solo12", "--knee", "LF=forward", "--knee", "RF=forward").output
    assert "backward" not in told and "backward" in command("robot", "solo12").output


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--velocity-limit", "fast"), "--velocity-limit takes a number, or JOINT=NUMBER: 'fast'"),
        (("--velocity-limit", "1", "--velocity-limit", "2"), "takes NAME=VALUE, got '1'"),
        (("--effort-limit", "LF_KFE=strong"), "--effort-limit takes NAME=NUMBER"),
        (("--effort-limit", "nobody=3"), "nobody"),
        (("--mass", "base=1", "--masses", "shapes"), "exclude each other"),
        (("--mass", "base=1", "--mass", "base=2"), "--mass names 'base' twice"),
        (("--foot", "LF=base,0,0"), "feet: LF"),
        (("--foot", "LF=base,0,0,up"), "--foot takes LEG=LINK"),
        (("--knee", "LF=up"), "knee"),
    ],
)
def test_mistakes_are_named(error_of: ErrorOf, arguments: tuple[str, ...], words: str) -> None:
    assert words in error_of("robot", "wang2020", *arguments)


def test_ways_of_reading_need_a_robot(error_of: ErrorOf, plan_file: Path) -> None:
    words = "--velocity-limit says how a robot is read: give --robot as well"
    assert error_of("verify", str(plan_file), "--velocity-limit", "1") == words


def test_a_study_of_a_robot_with_options(command: Command, tmp_path: Path) -> None:
    table = tmp_path / "study.csv"
    arguments = ("study", str(table), "--seeds", "1", "--jobs", "1")
    result = command(*arguments, "--velocity-limit", "0.2")
    assert result.exit_code == 0, result.output
    (written,) = tmp_path.glob("study-wang2020-*.urdf")
    assert np.allclose(gaitopt.load_robot(written).velocity_limits, 0.2)
    # Another limit is another robot: its walks are not taken for those that are done.
    assert command(*arguments, "--velocity-limit", "0.25").exit_code == 0
    assert len(table.read_text().splitlines()) == 3


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("give masses={'link': kg, ...}; masses='shapes' estimates",
         "give --mass LINK=KG; --masses shapes estimates"),
        ("for plans with timing='velocity'", "for plans with --timing velocity"),
        ("give foot_radius=", "give --foot-radius"),
        ("give velocity_limits= in rad/s", "give --velocity-limit in rad/s"),
        ("or give feet={'LF': ('shank', (x, y, z))}", "or give --foot LF=LINK,X,Y,Z"),
        ("give scale=0.001 (that", "give --scale 0.001 (that"),
        ("package_folders=...)", "--package-folder DIR)"),
    ],
)  # fmt: skip
def test_messages_name_options(text: str, told: str) -> None:
    assert in_options(text) == told


def test_a_walk_whose_legs_touch_at_every_height_is_told(
    command: Command, no_figures: None, terrain: Path, tmp_path: Path
) -> None:
    """wang2020 with a plate between its knees."""
    plate = robot_texts.collision('<box size="0.06 0.16 0.06"/>', "0 0 -0.2")
    text = gaitopt.load_robot("wang2020").urdf
    path = tmp_path / "plated.urdf"
    path.write_text(text.replace('<link name="base">', f'<link name="base">{plate}', 1))
    arguments = ("walk", "--footholds", str(terrain), "--out", str(tmp_path / "out"), "--robot")
    words = "its legs touch each other or the trunk"
    assert words in command(*arguments, str(path)).output
    assert words not in command(*arguments, "wang2020").output
