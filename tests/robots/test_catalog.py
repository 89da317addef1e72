"""Robots by name or path, and what is said when there is none."""

from __future__ import annotations

import os
import shutil
import sys
import warnings
from pathlib import Path

import numpy as np
import pytest

from gaitopt.certificate.claims.known_robot import refuse_other_robot
from gaitopt.conventions import GRAVITY, LEGS
from gaitopt.errors import InputError, MissingPackageError, RobotError
from gaitopt.robots.catalog import (
    EXAMPLE_ROBOTS,
    OWN_ROBOTS,
    load_robot,
    own_urdf,
    robot_file,
    robot_names,
)
from gaitopt.robots.files import reading
from gaitopt.robots.quadruped import Quadruped


def refusal(source: str | Path) -> str:
    with pytest.raises(RobotError) as caught:
        load_robot(source)
    return str(caught.value)


def test_catalogue_holds_wang2020_and_the_eleven_quadrupeds_of_example_robot_data() -> None:
    assert OWN_ROBOTS == ("wang2020", "frog1")
    assert sorted(EXAMPLE_ROBOTS) == sorted(
        "a1 go1 go2 b1 laikago anymal anymal_c hyq solo12 solo8 quadruped".split()  # noqa: SIM905
    )
    assert robot_names() == (*OWN_ROBOTS, "wang2020-fast", *EXAMPLE_ROBOTS)


@pytest.mark.parametrize("name", robot_names())
def test_every_name_loads_with_four_legs(name: str) -> None:
    robot = load_robot(name)
    joints = 2 if name in ("solo8", "quadruped", "frog1") else 3
    assert robot.name == name
    assert [len(leg.joints) for leg in robot.legs.values()] == [joints] * 4


@pytest.mark.parametrize("name", ["solo8", "quadruped"])
def test_two_joint_robots_have_no_roll(name: str) -> None:
    assert not any(leg.has_roll for leg in load_robot(name).legs.values())


def test_path_gives_the_robot_of_the_file_under_its_file_name(tmp_path: Path) -> None:
    copy = tmp_path / "my_robot.urdf"
    shutil.copy(own_urdf("wang2020"), copy)
    for source in (copy, str(copy)):
        robot = load_robot(source)
        assert robot.name == "my_robot"
        assert robot.sha256 == load_robot("wang2020").sha256


def test_another_robot_with_a_known_name_is_told_apart(tmp_path: Path) -> None:
    """Its plans would be judged by the known robot, which it is not."""
    text = own_urdf("wang2020").read_text("utf-8")
    other = text.replace('mass value="0.05"', 'mass value="0.06"')
    assert other != text
    (tmp_path / "Wang2020.urdf").write_text(other)
    robot = load_robot(tmp_path / "Wang2020.urdf")
    assert robot.name == "Wang2020 (Wang2020.urdf)"
    assert load_robot(other).name == "wang2020 (text)" and load_robot(text).name == "wang2020"
    quoted = other.replace('<robot name="wang2020">', "<robot name = 'wang2020'>")
    assert quoted != other and load_robot(quoted).name == "wang2020 (text)"
    refuse_other_robot(robot)
    (tmp_path / "a1.urdf").write_text(other)
    assert load_robot(tmp_path / "a1.urdf").name == "a1 (a1.urdf)"
    # The certificate takes such a name for the known one, too.
    (tmp_path / "go1_.urdf").write_text(other)
    found = load_robot(tmp_path / "go1_.urdf")
    assert found.name == "go1_ (go1_.urdf)" and not refuse_other_robot(found)


def test_path_need_not_end_in_urdf(tmp_path: Path) -> None:
    shutil.copy(own_urdf("wang2020"), tmp_path / "robot")
    assert load_robot(tmp_path / "robot").name == "wang2020"


def test_a_path_may_hold_what_a_tag_begins_with(tmp_path: Path) -> None:
    folder = tmp_path / "<mine>"
    folder.mkdir()
    shutil.copy(own_urdf("wang2020"), folder / "dog<1>.urdf")
    for source in (folder / "dog<1>.urdf", str(folder / "dog<1>.urdf")):
        assert load_robot(source).name == "dog<1>"
        assert robot_file(source) == folder / "dog<1>.urdf"
    shutil.copy(own_urdf("wang2020"), folder / "dog<2>")
    assert load_robot(str(folder / "dog<2>")).name == "dog<2>"
    assert refusal(str(folder / "dog<3>.urdf")).startswith(f"no robot file at {folder}")


def test_case_and_blanks_of_a_name_do_not_count() -> None:
    assert load_robot(" Wang2020 ").sha256 == load_robot("wang2020").sha256


def test_unknown_name_lists_the_known_ones() -> None:
    assert refusal("wang2021") == (
        "unknown robot 'wang2021'; known are wang2020, frog1, wang2020-fast, a1, go1, go2, b1, "
        "laikago, anymal, anymal_c, hyq, solo12, solo8, quadruped, or give a path to a robot file"
    )


@pytest.mark.parametrize("name", ["", "wang_2020", "anymal-c", "n" * 5000, "nul\0"])
def test_other_names_are_unknown(name: str) -> None:
    assert refusal(name).startswith(
        f"unknown robot {name!r}; known are wang2020, frog1, wang2020-fast, a1, "
    )


@pytest.mark.parametrize("source", [None, 3, b"wang2020", []])
def test_what_is_no_text_or_path_is_an_input_error(source: object) -> None:
    with pytest.raises(InputError, match="a robot is a name, a path or the text of a file"):
        load_robot(source)  # type: ignore[arg-type]


def test_missing_file_is_named(tmp_path: Path) -> None:
    path = tmp_path / "none.urdf"
    assert refusal(path) == f"no robot file at {path}; give an existing file or a robot's name"
    assert refusal("none.urdf").startswith("no robot file at none.urdf;")


def test_a_file_with_nearly_the_same_name_is_suggested(tmp_path: Path) -> None:
    (tmp_path / "go2_vendor.urdf").touch()
    (tmp_path / "go2_vender.txt").touch()
    assert refusal(tmp_path / "go2_vender.urdf") == (
        f"no robot file at {tmp_path / 'go2_vender.urdf'} (did you mean "
        f"{str(tmp_path / 'go2_vendor.urdf')!r}?); give an existing file or a robot's name"
    )


def test_folder_is_no_urdf(tmp_path: Path) -> None:
    assert refusal(tmp_path) == (
        f"no robot file at {tmp_path}; give an existing file or a robot's name"
    )


def test_file_that_may_not_be_read_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "closed.urdf"
    path.write_text("<robot/>")

    def refuse(*_: object) -> None:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(Path, "open", refuse)  # root may read anything
    assert refusal(path) == f"cannot read {path}: Permission denied"


def test_binary_file_is_no_urdf(tmp_path: Path) -> None:
    path = tmp_path / "robot.stl"
    path.write_bytes(b"solid\x00\xff\xfe\x80")
    assert refusal(path) == f"{path} is no text in UTF-8 (byte 6); a URDF is"


@pytest.mark.parametrize("encoding", ["gbk", "latin-1", "utf-16", "utf-8-sig"])
def test_text_in_the_encoding_that_it_declares_is_read(tmp_path: Path, encoding: str) -> None:
    text = own_urdf("wang2020").read_text("utf-8")
    comment = "\u817f" if encoding == "gbk" else "\u00fc"
    declared = f'<?xml version="1.0" encoding="{encoding.removesuffix("-sig")}"?>'
    body = text[text.index("<robot") :].replace("</robot>", f"<!-- {comment} --></robot>")
    (tmp_path / "dog.urdf").write_bytes((declared + body).encode(encoding))
    assert load_robot(tmp_path / "dog.urdf").mass == pytest.approx(25.0)


def test_empty_file_is_no_urdf(tmp_path: Path) -> None:
    (tmp_path / "empty.urdf").touch()
    assert (
        refusal(tmp_path / "empty.urdf") == "empty: the file is empty; give one that holds a robot"
    )


def test_malformed_file_is_named(tmp_path: Path) -> None:
    (tmp_path / "broken.urdf").write_text("<robot name='x'><link></robot>")
    assert refusal(tmp_path / "broken.urdf").startswith("broken: the URDF is no well-formed XML: ")


def test_file_over_the_limit_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(reading, "LIMIT", 2_000_000)
    path = tmp_path / "large.urdf"
    path.write_bytes(b" " * 2_000_001)
    assert refusal(path) == f"{path} is larger than 2 MB, the most that is read"


def test_missing_package_is_named_with_the_line_that_installs_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    for module in [m for m in sys.modules if m.split(".")[0] == "example_robot_data"]:
        monkeypatch.delitem(sys.modules, module)
    monkeypatch.setitem(sys.modules, "example_robot_data", None)
    with pytest.raises(MissingPackageError) as caught:
        load_robot("solo12")
    assert str(caught.value) == (
        "robot 'solo12' needs the packages example-robot-data and -loaders: "
        "pip install 'gaitopt[robots]'"
    )
    assert load_robot("wang2020").name == "wang2020"


def test_knees_are_handed_on() -> None:
    assert load_robot("solo12", knees={"LF": "forward"}).legs["LF"].knee == 1.0
    assert load_robot("solo12").legs["LF"].knee == -1.0
    with pytest.raises(InputError, match="got 'sideways'"):
        load_robot("solo12", knees={"LF": "sideways"})


def test_urdf_missing_from_the_installation_says_so() -> None:
    with pytest.raises(RobotError) as caught:
        own_urdf("wang2222")
    assert str(caught.value) == (
        "wang2222.urdf is missing from this installation of gaitopt; reinstall it"
    )


def test_torque_limits_too_small_to_stand_are_warned_about() -> None:
    """The knee of wang2020 stands with 25 kg * 9.81 m/s^2 / 4 at a lever that geometry gives."""
    robot = load_robot("wang2020")
    leg, height = robot.legs["LF"], robot.standing_height
    # By the law of cosines: the knee's distance from the vertical through hip and foot.
    cosine = (leg.upper**2 + height**2 - leg.lower**2) / (2.0 * leg.upper * height)
    lever = leg.upper * np.sqrt(1.0 - cosine**2)
    needed = 25.0 * GRAVITY / 4.0 * lever
    for share, told in ((0.99, True), (1.01, False)):
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            made = load_robot("wang2020", effort_limits={"LF_KFE": share * needed})
        text = f"LF_KFE {needed:.3g} of {share * needed:.3g}; if they are placeholders"
        assert [text in str(w.message) for w in caught] == [True] * told
        assert len(made.notes.warnings) == told


def test_motors_heavier_to_turn_than_the_robot_are_warned_about() -> None:
    robot = load_robot("wang2020")
    whole = 25.0 * robot.legs["LF"].reach ** 2
    for share, told in ((0.25, 4), (0.15, 0)):
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            load_robot("wang2020", motor_inertia={f"{leg}_KFE": share * whole for leg in LEGS})
        texts = [str(w.message) for w in caught]
        assert len(texts) == (told > 0)
        assert all(f"LF_KFE {share * whole:.3g} of {whole:.3g}, " in text for text in texts)
        assert all("give motor_inertia= in kg m^2" in text for text in texts)


@pytest.mark.parametrize("kind", ["visual", "collision", "inertial"])
def test_a_part_of_a_link_that_lies_beyond_all_measure_is_refused(kind: str) -> None:
    text = own_urdf("wang2020").read_text()
    begin = text.index('xyz="', text.index(f"<{kind}>")) + len('xyz="')
    with pytest.raises(RobotError, match="1e200"):
        Quadruped.from_urdf(f"{text[:begin]}1e20{text[begin:]}")


def test_a_pipe_is_no_robot_file(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "robot.urdf")
    assert "it is a pipe, and no file" in refusal(tmp_path / "robot.urdf")
