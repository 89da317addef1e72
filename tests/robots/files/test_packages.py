"""Robots of robot_descriptions and mujoco_menagerie, with a cache that is there already."""

from __future__ import annotations

import sys
import warnings
from pathlib import Path

import pytest
from robot_texts import MASS, MJCF_MASS, joint, link, mjcf, robot

from gaitopt.cli.robot_table import robot_notes
from gaitopt.errors import MissingPackageError, RobotError, RobotWarning
from gaitopt.robots.catalog import load_robot


@pytest.fixture
def packages(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Stand-ins of both packages, whose files lie in a folder."""
    (tmp_path / "robot.urdf").write_text(robot())
    (tmp_path / "tester.xml").write_text(mjcf())
    descriptions = tmp_path / "robot_descriptions"
    descriptions.mkdir()
    (descriptions / "__init__.py").touch()
    for name, attribute, file in (
        ("tester", "URDF_PATH", "robot.urdf"),
        ("tester_mj", "MJCF_PATH", "tester.xml"),
    ):
        (descriptions / f"{name}_description.py").write_text(
            f"print('downloading')\n{attribute} = {str(tmp_path / file)!r}\n"
        )
    files = str(tmp_path / "robot.urdf"), str(tmp_path / "tester.xml")
    both = "URDF_PATH, MJCF_PATH = {!r}, {!r}\n".format(*files)
    (descriptions / "both_description.py").write_text(both)
    (descriptions / "both_mj_description.py").write_text(both)
    (descriptions / "offline_description.py").write_text("raise OSError('no network')\n")
    (descriptions / "empty_description.py").touch()
    (tmp_path / "mujoco_menagerie.py").write_text(
        "class Robot:\n"
        "    default_model = 'tester'\n"
        f"    def xml(self, entry): return {str(tmp_path)!r} + '/' + entry + '.xml'\n"
        "def names(): return ['maker_tester']\n"
        "def get(name): return Robot()\n"
    )
    monkeypatch.syspath_prepend(str(tmp_path))
    for name in [m for m in sys.modules if m.split(".")[0] in ("robot_descriptions",
                                                               "mujoco_menagerie")]:  # fmt: skip
        monkeypatch.delitem(sys.modules, name)
    yield tmp_path
    for name in [m for m in sys.modules if m.split(".")[0] in ("robot_descriptions",
                                                               "mujoco_menagerie")]:  # fmt: skip
        del sys.modules[name]


@pytest.mark.usefixtures("packages")
@pytest.mark.parametrize(
    ("name", "kind"),
    [("tester_description", "urdf"), ("tester_mj_description", "mjcf"), ("Maker_Tester", "mjcf"),
     ("both_description", "urdf"), ("both_mj_description", "mjcf")],
)  # fmt: skip
def test_robot_of_a_package_has_its_name(
    name: str, kind: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RobotWarning)
        made = load_robot(name)
    assert made.name == name.lower() and made.notes.kind == kind
    assert made.mass == pytest.approx(MASS if kind == "urdf" else MJCF_MASS)
    assert "downloading" not in capsys.readouterr().out, "what a package says is no result"


@pytest.mark.usefixtures("packages")
def test_meshes_of_a_package_are_looked_for_beside_its_file(packages: Path) -> None:
    shown = '<visual><geometry><mesh filename="trunk.obj"/></geometry></visual>'
    text = robot(extra=link("lamp", 0.1, shown) + joint("lamp_joint", "base", "lamp"))
    (packages / "robot.urdf").write_text(text)
    (packages / "trunk.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    lines = list(robot_notes(load_robot("tester_description"), "tester_description", []))
    assert "meshes: 1 of 1 found" in lines and f"  in {packages}: trunk.obj" in lines


@pytest.mark.usefixtures("packages")
def test_download_that_fails_is_told_in_one_line() -> None:
    with pytest.raises(RobotError) as caught:
        load_robot("offline_description")
    assert str(caught.value) == (
        "robot 'offline_description': robot_descriptions downloads its files at first use, and "
        "that failed: OSError no network; connect, or give the path of the robot's own file"
    )
    with pytest.raises(RobotError, match="names no file of a robot"):
        load_robot("empty_description")


@pytest.mark.usefixtures("packages")
@pytest.mark.parametrize("name", ["nobody_description", "maker_nothing"])
def test_names_that_no_package_knows_are_unknown(name: str) -> None:
    with pytest.raises(RobotError, match=f"unknown robot '{name}'"):
        load_robot(name)


def test_package_that_is_missing_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    from gaitopt.robots.files import packages

    monkeypatch.setattr(packages.importlib.util, "find_spec", lambda name: None)
    with pytest.raises(MissingPackageError, match="pip install robot_descriptions"):
        load_robot("go1_description")
    with pytest.raises(RobotError, match="unknown robot 'unitree_go1'"):
        load_robot("unitree_go1")
