"""Joints in the order and under the names of a controller."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import gaitopt
from gaitopt import InputError, Plan
from gaitopt.exporting.joint_order import joint_order

KNOWN = ("LF_HAA", "LF_HFE", "RF_HAA")
CONTROLLER = """
controller_manager:
  ros__parameters: {update_rate: 500}
legs:
  ros__parameters:
    type: joint_trajectory_controller/JointTrajectoryController
    joints: [r1_RF_HAA, r1_LF_HFE, r1_LF_HAA]
    command_interfaces: [position]
"""


def test_names_in_the_order_that_is_asked_for() -> None:
    order = joint_order(KNOWN, ["RF_HAA", "LF_HAA"])
    assert order.names == ("RF_HAA", "LF_HAA") and order.columns.tolist() == [2, 0]
    assert order.left_out == ("LF_HFE",)
    assert joint_order(KNOWN, {"LF_HFE": "knee"}, prefix="a/").names == ("a/knee",)
    assert joint_order(KNOWN, prefix="a/").names == ("a/LF_HAA", "a/LF_HFE", "a/RF_HAA")


def test_a_controllers_parameter_file_gives_the_order(tmp_path: Path) -> None:
    file = tmp_path / "controllers.yaml"
    file.write_text(CONTROLLER)
    order = joint_order(KNOWN, file, prefix="r1_")
    assert order.names == ("r1_RF_HAA", "r1_LF_HFE", "r1_LF_HAA")
    assert order.columns.tolist() == [2, 1, 0]
    with pytest.raises(InputError, match="no joint 'r1_RF_HAA'"):
        joint_order(KNOWN, file)


def test_of_several_controllers_one_is_named(tmp_path: Path) -> None:
    file = tmp_path / "controllers.yaml"
    file.write_text(CONTROLLER + CONTROLLER.split("legs:")[1].join(["other:", ""]))
    with pytest.raises(InputError, match=r"2 controllers .*\(legs, other\)"):
        joint_order(KNOWN, file, prefix="r1_")
    assert len(joint_order(KNOWN, file, "r1_", controller="other")) == 3
    with pytest.raises(InputError, match="no controller 'third'"):
        joint_order(KNOWN, file, "r1_", controller="third")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("legs: [", "no YAML"),
        ("legs: {ros__parameters: {joints: 3}}", "0 controllers"),
        ("!!python/object/apply:os.system [true]", "no YAML"),
        ("a: &a [*a, *a]\nlegs: &b {x: *b}", "0 controllers"),
        ("legs: {ros__parameters: {joints: ['x\\ny']}}", "0 controllers|holds the character"),
        ('legs:\n  ros__parameters:\n    joints: ["a\\nb"]', r"U\+000A"),
    ],
)
def test_a_bad_parameter_file_does_no_harm(tmp_path: Path, text: str, words: str) -> None:
    file = tmp_path / "c.yaml"
    file.write_text(text)
    with pytest.raises(InputError, match=words):
        joint_order(KNOWN, file)


def test_wrong_names_say_what_may_be_meant() -> None:
    with pytest.raises(InputError, match="did you mean LF_HAA"):
        joint_order(KNOWN, ["LF_HAX"])
    with pytest.raises(InputError, match="two of the joints"):
        joint_order(KNOWN, {"LF_HAA": "a", "LF_HFE": "a"})
    with pytest.raises(InputError, match="joints is empty"):
        joint_order(KNOWN, [])


def test_the_file_has_the_joints_in_this_order(short_plan: Plan, tmp_path: Path) -> None:
    wanted = [f"r_{n}" for n in sorted(short_plan.robot.joint_names, reverse=True)]
    gaitopt.export(short_plan, tmp_path / "a.json", joints=wanted, prefix="r_")
    message = json.loads((tmp_path / "a.json").read_text())
    assert message["joint_names"] == wanted
    q = dict(zip(short_plan.robot.joint_names, short_plan.at([0.0]).q[0, 7:], strict=True))
    assert message["points"][0]["positions"] == pytest.approx([q[n[2:]] for n in wanted])
