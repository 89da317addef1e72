"""xacro files: macros, arguments, packages, and what happens without the extra."""

from __future__ import annotations

import warnings
from pathlib import Path

import pytest
from robot_texts import MASS, leg, link, mjcf, robot

from gaitopt.errors import InputError, MissingPackageError, RobotError, RobotWarning
from gaitopt.robots.catalog import load_robot
from gaitopt.robots.files.xacro import expansion

SPACE = 'xmlns:xacro="http://www.ros.org/wiki/xacro"'


def with_macros(arguments: str = "", more: str = "") -> str:
    """The small robot, whose legs are copies of a macro and whose mass is a property."""
    text = robot().replace('mass value="5.0"', 'mass value="${2 * half}"')
    head = (
        f'<robot name="tester" {SPACE}><xacro:property name="half" value="2.5"/>{arguments}{more}'
    )
    return text.replace('<robot name="tester">', head)


def test_expressions_and_properties_are_worked_out() -> None:
    made = load_robot(with_macros())
    assert made.mass == pytest.approx(MASS) and made.notes.kind == "xacro"
    assert made.name == "tester"


def test_arguments_are_passed_on() -> None:
    load = '<xacro:arg name="load" default="0"/><xacro:property name="extra" value="$(arg load)"/>'
    text = with_macros(load).replace("${2 * half}", "${2 * half + extra}")
    assert load_robot(text).mass == pytest.approx(MASS)
    made = load_robot(text, xacro_arguments={"load": "1.5"})
    assert made.mass == pytest.approx(MASS + 1.5)


def test_switch_without_a_value_is_taken_as_false_and_told() -> None:
    switch = f'<xacro:if value="$(arg DEBUG)">{link("hung")}</xacro:if>'
    with pytest.warns(RobotWarning, match="taken as false: DEBUG"):
        assert load_robot(with_macros(switch)).mass == pytest.approx(MASS)
    with pytest.raises(RobotError, match="hung"):
        load_robot(with_macros(switch), xacro_arguments={"DEBUG": "true"})


@pytest.mark.parametrize("place", ["package", "beside"])
def test_files_of_a_package_are_found(tmp_path: Path, place: str) -> None:
    """In the package above the file; or copied out of it, beside the file."""
    main = tmp_path / "dog_description" / "xacro" / "robot.xacro"
    if place == "beside":
        main = tmp_path / "robot.xacro"
    main.parent.mkdir(parents=True, exist_ok=True)
    include = '<xacro:include filename="$(find dog_description)/xacro/leg.xacro"/>'
    text = with_macros(more=include).replace(leg("LF"), "<xacro:front_left/>")
    assert "<xacro:front_left/>" in text
    main.write_text(text)
    macro = f'<robot {SPACE}><xacro:macro name="front_left">{leg("LF")}</xacro:macro></robot>'
    (main.parent / "leg.xacro").write_text(macro)
    assert load_robot(main).mass == pytest.approx(MASS)


def test_package_that_is_nowhere_is_named(tmp_path: Path) -> None:
    main = tmp_path / "robot.xacro"
    main.write_text(with_macros(more='<xacro:include filename="$(find nowhere)/a.xacro"/>'))
    with pytest.raises(RobotError, match=r"nowhere.*package_folders=\[...\]"):
        load_robot(main)
    (tmp_path / "folder" / "nowhere").mkdir(parents=True)
    (tmp_path / "folder" / "nowhere" / "a.xacro").write_text(f"<robot {SPACE}/>")
    assert load_robot(main, package_folders=[tmp_path / "folder"]).mass == pytest.approx(MASS)


def test_the_working_folder_is_the_one_that_holds_the_named_files(tmp_path: Path) -> None:
    """``$(cwd)/urdf/...`` is written for somebody who stands above the file's folder."""
    folder = tmp_path / "urdf"
    folder.mkdir()
    value = '<xacro:property name="half" value="3.5"/>'
    (folder / "values.xacro").write_text(f"<robot {SPACE}>{value}</robot>")
    text = with_macros('<xacro:include filename="$(cwd)/urdf/values.xacro"/>')
    (folder / "dog.xacro").write_text(text.replace("${2 * half}", "${4 + half}"))
    assert load_robot(folder / "dog.xacro").mass == pytest.approx(MASS + 2.5)


def test_variables_of_ros_need_not_be_set(monkeypatch: pytest.MonkeyPatch) -> None:
    """Files ask for the version of ROS, by which they choose a simulator."""
    text = with_macros('<xacro:property name="ros" value="$(env ROS_VERSION)"/>').replace(
        "${2 * half}", "${5.0 if int(ros) == 2 else 1.0}"
    )
    monkeypatch.delenv("ROS_VERSION", raising=False)
    assert load_robot(text).mass == pytest.approx(MASS)
    monkeypatch.setenv("ROS_VERSION", "1")
    assert load_robot(text).mass == pytest.approx(MASS - 4.0)


def test_variable_that_is_not_set_is_named_with_the_way_out(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.delenv("NO_SUCH_VARIABLE", raising=False)
    text = with_macros('<xacro:property name="x" value="$(env NO_SUCH_VARIABLE)"/>').replace(
        "${2 * half}", "${float(x)}"
    )
    with pytest.raises(RobotError, match=r"set it, as with NO_SUCH_VARIABLE=\.\.\."):
        load_robot(text)


def test_urdf_that_only_declares_the_namespace_is_a_urdf() -> None:
    text = robot().replace('<robot name="tester">', f'<robot name="tester" {SPACE}>')
    comment = text.replace("</robot>", "<!-- <xacro:include filename='x'/> --></robot>")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert load_robot(comment).notes.kind == "urdf"


def test_expression_without_any_element_is_xacro() -> None:
    text = robot().replace('mass value="5.0"', 'mass value="${2 + 3}"')
    assert load_robot(text).mass == pytest.approx(MASS)


def test_without_the_extra_it_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(expansion.importlib.util, "find_spec", lambda name: None)
    with pytest.raises(MissingPackageError, match=r"is xacro and no URDF; .*'gaitopt\[xacro\]'"):
        load_robot(with_macros())


@pytest.mark.parametrize("expression", ["${missing}", "${__import__('os').getcwd()}", "${1 / 0}"])
def test_expressions_that_fail_are_told_in_one_line(expression: str) -> None:
    with pytest.raises(RobotError, match="xacro cannot expand this file") as caught:
        load_robot(with_macros().replace("${2 * half}", expression))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("source", ["wang2020", robot(), mjcf()])
def test_arguments_of_a_file_that_is_no_xacro_are_refused(source: str) -> None:
    words = "xacro_arguments: load, DEBUG would change nothing, because this file is no xacro"
    with pytest.raises(InputError, match=words):
        load_robot(source, xacro_arguments={"load": "1", "DEBUG": "true"})
