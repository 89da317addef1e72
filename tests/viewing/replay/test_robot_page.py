"""The drawing of a robot: every joint is moved through its limits, every foot is a ball."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pinocchio as pin

import gaitopt
from gaitopt.conventions import LEGS
from gaitopt.viewing.replay.robot_page import draw_robot, robot_page, sweeps
from gaitopt.viewing.replay.scene import Ball, Segments

WANG = gaitopt.load_robot("wang2020")


def test_robot_stands_on_the_ground_with_its_feet_below_its_hips() -> None:
    joints = WANG.standing_joints()
    data, q = WANG.model.createData(), pin.neutral(WANG.model)
    q[7:] = joints
    pin.framesForwardKinematics(WANG.model, data, q)
    for name, leg in WANG.legs.items():
        foot = data.oMf[WANG.model.getFrameId(leg.foot)].translation
        np.testing.assert_allclose(
            foot - leg.hip, [0.0, leg.lateral, -WANG.standing_height], rtol=0, atol=1e-12
        )
        assert name in LEGS


def test_every_joint_reaches_both_of_its_limits() -> None:
    angles = sweeps(WANG)[0].knots()[:, 6:]
    np.testing.assert_allclose(angles.min(axis=0), WANG.position_limits[0], rtol=0, atol=1e-12)
    np.testing.assert_allclose(angles.max(axis=0), WANG.position_limits[1], rtol=0, atol=1e-12)


def test_each_joint_has_a_caption_with_its_limits() -> None:
    captions = [caption.label for caption in robot_page(WANG).captions]
    assert captions[0] == "standing" and len(captions) == 1 + 12
    assert captions[1] == "LF: LF_HAA, -1.57 to 1.57 rad, 0.2967 rad/s, 75 N m"


def test_feet_are_balls_and_axes_are_lines() -> None:
    parts = [part for node in robot_page(WANG).scene.nodes for part in node.parts]
    feet = [p for p in parts if isinstance(p.shape, Ball) and p.appearance.opacity == 0.6]
    assert [p.shape.radius for p in feet] == [0.015] * 4
    assert sum(isinstance(p.shape, Segments) for p in parts) == 12


def test_drawing_is_one_file_with_the_warnings_in_it(tmp_path: Path) -> None:
    path = draw_robot(gaitopt.load_robot("wang2020"), tmp_path / "robot.html")
    text = path.read_text("utf-8")
    assert "<title>wang2020" in text and "feet: balls of 15 mm" in text
