"""Self-collisions of robots whose shapes are meshes: their convex hulls, held against boxes."""

from __future__ import annotations

import dataclasses
import re
import warnings
from pathlib import Path

import numpy as np
import pytest
import trimesh
from robot_texts import collision, robot

import gaitopt
from gaitopt.certificate.claims.known_robot import refuse_other_robot
from gaitopt.certificate.collisions.self_collision import self_collision
from gaitopt.errors import RobotError
from gaitopt.motion.path import MotionPath
from gaitopt.plan.plan import Plan
from gaitopt.robots.catalog import example_urdf, load_robot
from gaitopt.robots.quadruped import Quadruped

SHANK = (0.03, 0.04, 0.2)
BOX = collision(f'<box size="{SHANK[0]} {SHANK[1]} {SHANK[2]}"/>', "0 0 -0.1", "0 0.1 0")
MESH = collision('<mesh filename="shank.stl" scale="0.001 0.001 0.001"/>', "0 0 -0.1", "0 0.1 0")


def quiet(source: str | Path) -> Quadruped:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", gaitopt.RobotWarning)
        return load_robot(source)


@pytest.fixture(scope="module")
def meshed(tmp_path_factory: pytest.TempPathFactory) -> Quadruped:
    """A robot whose lower legs are meshes of boxes, in millimetres."""
    folder = tmp_path_factory.mktemp("meshed")
    trimesh.creation.box(extents=[1e3 * size for size in SHANK]).export(folder / "shank.stl")
    (folder / "meshed.urdf").write_text(robot(shank=MESH))
    return quiet(folder / "meshed.urdf")


@pytest.fixture(scope="module")
def boxed() -> Quadruped:
    """The same with boxes."""
    return quiet(robot(shank=BOX))


def crossing(made: Quadruped, angle: float, short_plan: Plan) -> Plan:
    """A plan whose front legs roll towards each other, as far as the collision check needs one."""
    leg_joints = np.tile([0.0, 0.9, -1.5], 4)
    joints = np.zeros((2, 12))
    joints[:, made.leg_joint_columns] = leg_joints
    joints[1, made.leg_columns["LF"][0]], joints[1, made.leg_columns["RF"][0]] = -angle, angle
    values = np.hstack([np.tile([0.0, 0.0, 0.4, 0.0, 0.0, 0.0], (2, 1)), joints])
    path = MotionPath.polyline([0.0, 1.0], values)
    return dataclasses.replace(short_plan, robot=made, path=path)


@pytest.mark.parametrize("angle", [0.1, 0.3, 0.9])
def test_hulls_of_boxes_are_as_far_apart_as_the_boxes(
    meshed: Quadruped, boxed: Quadruped, short_plan: Plan, angle: float
) -> None:
    ours, theirs = (self_collision(crossing(made, angle, short_plan)) for made in (meshed, boxed))
    assert ours.status == theirs.status == ("violated" if angle == 0.9 else "ok")
    assert "meshes count as their convex hulls" in ours.about
    if angle < 0.9:
        assert ours.worst == pytest.approx(theirs.worst, abs=5e-5)  # hulls have five digits


def test_hulls_go_with_the_plan(meshed: Quadruped, tmp_path: Path) -> None:
    """The receiver has no mesh files."""
    plan = gaitopt.plan_crawl(meshed, gaitopt.s_columns(0, columns=1, robot=meshed))
    plan.save(tmp_path / "plan.npz")
    received = gaitopt.load_plan(tmp_path / "plan.npz")
    assert received.robot.notes.hulls == meshed.notes.hulls
    assert self_collision(received).status == "ok"


def test_meshes_that_were_missing_leave_collisions_unchecked(short_plan: Plan) -> None:
    made = quiet(robot(shank=MESH))
    check = self_collision(crossing(made, 0.1, short_plan))
    assert check.status == "unchecked" and "were not found" in check.note


def test_go2_is_checked() -> None:
    go2 = quiet("go2")
    plan = gaitopt.plan_crawl(go2, gaitopt.s_columns(0, columns=2, robot=go2))
    check = self_collision(plan)
    assert check.status == "ok" and "convex hulls" in check.about
    raw = Quadruped.from_urdf(example_urdf("go2").read_text("utf-8"), "go2")
    assert self_collision(dataclasses.replace(plan, robot=raw)).status == "unchecked"


def test_hulls_that_were_made_smaller_are_noticed() -> None:
    """The planted fault: a go2 whose hulls somebody has shrunk."""
    text = quiet("go2").urdf
    first = re.search(r'<hull link="base">([^<]*)</hull>', text)
    assert first is not None
    small = " ".join(repr(0.5 * float(x)) for x in first.group(1).split())
    with pytest.raises(RobotError, match="collision shapes differ"):
        refuse_other_robot(Quadruped.from_urdf(text.replace(first.group(1), small), "go2"))


@pytest.mark.parametrize(
    ("hull", "words"),
    [
        ('<hull link="base">0 0 0 1 0 0 0 1 0</hull>', "four corners or more"),
        ('<hull link="base">0 0 0 1 0 0 0 1 0 0 0 nan</hull>', "four corners or more"),
        ('<hull link="nothing">0 0 0 1 0 0 0 1 0 0 0 1</hull>', "no link 'nothing'"),
        ('<hull link="base">0 0 0 1 0 0 0 1 0 1 1 0</hull>', "is flat"),
    ],
)
def test_hulls_of_somebody_else_are_checked(short_plan: Plan, hull: str, words: str) -> None:
    text = robot().replace("</robot>", f"<gaitopt>{hull}</gaitopt></robot>")
    with pytest.raises(RobotError) as caught:
        made = Quadruped.from_urdf(text)
        self_collision(crossing(made, 0.1, short_plan))
    assert words in str(caught.value)
