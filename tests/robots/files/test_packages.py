"""Robots of robot_descriptions and mujoco_menagerie, with a cache that is there already."""

from __future__ import annotations

import sys
import warnings
from pathlib import Path

import pytest
from robot_texts import MASS, MJCF_MASS, mjcf, robot

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
            f"{attribute} = {str(tmp_path / file)!r}\n"
        )
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
    [("tester_description", "urdf"), ("tester_mj_description", "mjcf"), ("Maker_Tester", "mjcf")],
)
def test_robot_of_a_package_has_its_name(name: str, kind: str) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RobotWarning)
        made = load_robot(name)
    assert made.name == name.lower() and made.notes.kind == kind
    assert made.mass == pytest.approx(MASS if kind == "urdf" else MJCF_MASS)


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
