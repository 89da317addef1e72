"""A plan may not bring a stronger robot along than the one whose name it bears."""

from __future__ import annotations

import dataclasses
import sys
import warnings

import pytest
from robot_texts import robot as robot_text

import gaitopt
from gaitopt.certificate.claims.known_robot import refuse_other_robot, refuse_stronger
from gaitopt.certificate.verify import verify
from gaitopt.errors import RobotError
from gaitopt.plan.plan import Plan
from gaitopt.robots.catalog import example_urdf, known_urdf, load_robot, robot_names
from gaitopt.robots.quadruped import Quadruped


def quiet(name: str, **options: object) -> Quadruped:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", gaitopt.RobotWarning)
        return load_robot(name, **options)  # type: ignore[arg-type]


@pytest.mark.parametrize("name", ["A1 ", "go2", "anymal", "wang2020"])
def test_robot_of_the_catalogue_is_itself(name: str) -> None:
    robot = quiet(name)
    refuse_other_robot(dataclasses.replace(robot, name=name))


@pytest.mark.parametrize("name", ["solo12", "wang2020"])
def test_lower_limits_of_the_user_are_no_fault(name: str) -> None:
    refuse_other_robot(quiet(name, velocity_limits=0.2, effort_limits=1.0, foot_radius=0.01))


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        (
            'velocity="21"',
            'velocity="22"',
            "the velocity limit of FL_hip_joint is wider (22 and 21",
        ),
        ('effort="33.5"', 'effort="34"', "the torque limit of FL_hip_joint is wider (34 and 33.5"),
        ('upper="0.80', 'upper="0.90', "the upper position limit of FL_hip_joint is wider"),
        ('lower="-0.80', 'lower="-0.90', "the lower position limit of FL_hip_joint is wider"),
        ('xyz="0 0 -0.2"', 'xyz="0 0 -0.21"', "lengths of leg LF differ by 0.01 m"),
        ('mass value="0.06"', 'mass value="0.05"', "masses or inertias differ"),
    ],
)
def test_a1_that_is_stronger_or_another_one_is_refused(old: str, new: str, words: str) -> None:
    text = example_urdf("a1").read_text("utf-8")
    assert old in text
    with pytest.raises(RobotError) as caught:
        refuse_other_robot(Quadruped.from_urdf(text.replace(old, new), "A1"))
    assert words in str(caught.value) and "--robot FILE" in str(caught.value)


def test_raised_limits_are_refused_by_verify(short_plan: Plan) -> None:
    fast = quiet("wang2020", velocity_limits=5.0)
    with pytest.raises(RobotError, match="the velocity limit of LF_HAA is wider"):
        verify(dataclasses.replace(short_plan, robot=fast))


def test_names_that_nobody_knows_are_not_compared() -> None:
    robot = quiet(robot_text())
    assert not refuse_other_robot(robot)
    refuse_stronger(robot, robot)
    with pytest.raises(RobotError, match="leg LF has the joints LF_j0, LF_j1, LF_j2"):
        refuse_stronger(robot, quiet("a1"))


def test_robot_whose_package_is_missing_is_not_compared(monkeypatch: pytest.MonkeyPatch) -> None:
    strong = dataclasses.replace(quiet("a1", velocity_limits=100.0), name="a1")
    with pytest.raises(RobotError, match="is wider"):
        refuse_other_robot(strong)
    known_urdf.cache_clear()
    for module in [m for m in sys.modules if m.split(".")[0] == "example_robot_data"]:
        monkeypatch.delitem(sys.modules, module)
    monkeypatch.setitem(sys.modules, "example_robot_data", None)
    refuse_other_robot(strong)


@pytest.mark.parametrize("name", robot_names())
def test_known_urdfs_are_those_of_loaded_robots(name: str) -> None:
    assert known_urdf(name) == quiet(name).urdf
