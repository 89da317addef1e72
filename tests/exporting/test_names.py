"""Names from files of others, in every format of text."""

from __future__ import annotations

import csv
import json
import unicodedata
from dataclasses import replace
from pathlib import Path

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

import gaitopt
from gaitopt import InputError, Plan, RobotError
from gaitopt.exporting.export import FORMATS
from gaitopt.exporting.names import check_names
from gaitopt.robots.xml_text import shown

BAD = [
    "a\nb: 1", "a\rb", "a\u2028b", "a\u2029b", "a\u0085b", "a\x1b[2Jb", "a\x9b2Jb", "a\x00b",
    "a,b", 'a"b', "a'b", "a;b", "=1+1", "@SUM(A1)", "+a", "-a", "", " a", "a ", "a\tb", "a\\nb",
    "!!python/x", "*a", "&a", "{a}", "[a]", "# a", "a\ud800b", "a\u202eb", "<a>", "a" * 201,
]  # fmt: skip


@pytest.mark.parametrize("name", BAD, ids=ascii)
def test_names_that_no_format_holds_safely_are_refused(name: str) -> None:
    with pytest.raises(InputError) as error:
        check_names(["good", name])
    assert str(error.value).isprintable(), "the message must not do what the name does"


@given(st.text(max_size=30))
def test_names_that_are_taken_come_back_from_every_reader(name: str) -> None:
    try:
        check_names([name])
    except InputError:
        return
    assert name.isprintable() and len(name.splitlines()) == 1
    quoted = json.dumps(name, ensure_ascii=False)
    assert yaml.safe_load(f"joint_names:\n- {quoted}\n") == {"joint_names": [name]}
    assert next(csv.reader([f"t,{name}\n"])) == ["t", name]


@given(st.text())
def test_what_is_shown_is_one_line_that_commands_no_terminal(text: str) -> None:
    line = shown(text)
    assert all(unicodedata.category(c)[0] not in "CZ" or c == " " for c in line)
    assert len(line.splitlines()) <= 1
    assert yaml.safe_load(f"# {line}\na: 1\n") == {"a": 1}


@pytest.mark.parametrize("suffix", [".yaml", ".json", ".csv"])
def test_a_robots_bad_name_does_no_harm(short_plan: Plan, tmp_path: Path, suffix: str) -> None:
    evil = replace(short_plan, robot=replace(short_plan.robot, name="x\nevil: 1\u2028\x1b[2J"))
    file = tmp_path / f"a{suffix}"
    gaitopt.export(evil, file)
    head = file.read_text("utf-8")[:2000]
    assert "\x1b" not in head and "\u2028" not in head
    assert not any(line.startswith("evil") for line in head.splitlines())


@pytest.mark.parametrize("format", list(FORMATS))
def test_no_format_takes_a_joints_bad_name(short_plan: Plan, tmp_path: Path, format: str) -> None:
    names = short_plan.robot.joint_names
    for bad in ("a\nb: 1", "a\x85b", "a\u2028b", "a,b", "=a", "\x1b[2Ja", "<b>a", 'a"b', "a&b"):
        with pytest.raises(InputError, match="no file can hold it safely") as error:
            gaitopt.export(short_plan, tmp_path / "a", format, joints={names[0]: bad})
        assert str(error.value).isprintable()
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("suffix", [".yaml", ".json", ".csv"])
def test_a_joints_bad_name_is_refused_until_it_has_a_new_one(
    short_plan: Plan, tmp_path: Path, suffix: str
) -> None:
    names = short_plan.robot.joint_names
    with pytest.raises(InputError, match="no file can hold it safely"):
        gaitopt.export(short_plan, tmp_path / f"a{suffix}", prefix="a\nb: ")
    assert not list(tmp_path.iterdir())
    renamed = {name: f"j{i}" for i, name in enumerate(names)}
    gaitopt.export(short_plan, tmp_path / f"a{suffix}", joints=renamed)
    assert "j0" in (tmp_path / f"a{suffix}").read_text("utf-8")


@pytest.mark.parametrize("character", ["\x85", "\u2028", "\x9b", "\u202e"])
@pytest.mark.parametrize("kind", ["joint", "link"])
def test_a_robot_file_with_such_names_is_refused_when_it_is_read(
    short_plan: Plan, character: str, kind: str
) -> None:
    """XML allows them in attributes; the robot's own name is escaped."""
    old = "LF_HAA" if kind == "joint" else short_plan.robot.legs["LF"].foot
    urdf = short_plan.robot.urdf
    assert f'"{old}"' in urdf
    with pytest.raises(RobotError, match=f"name of the {kind} .* cannot be printed") as error:
        gaitopt.Quadruped.from_urdf(urdf.replace(f'"{old}"', f'"x{character}y"'))
    assert str(error.value).isprintable()
    named = gaitopt.Quadruped.from_urdf(urdf, f"a{character}b")
    assert named.name.isprintable() and repr(named).isprintable()
