"""Lower legs that are wider than the balls of their feet are told when a robot is loaded."""

from __future__ import annotations

import re

import numpy as np
import pytest
from robot_loading import quiet, warnings_of
from robot_texts import FOOT, LOWER, collision, robot

from gaitopt.robots.at_many_poses.leg_ends import DEEPER, LEANS


def told(shank: str, **options: object) -> str:
    """The warning of a robot whose lower legs have a shape, or nothing."""
    found = [w for w in warnings_of(robot(shank=shank), **options) if "is wider" in w]
    assert len(found) <= 1
    return "".join(found)


def ball(radius: float, below: float) -> str:
    """A ball on the leg's line, so far below the middle of the foot."""
    return collision(f'<sphere radius="{radius}"/>', f"0 0 {-LOWER - below}")


PEG = collision('<box size="0.002 0.002 0.04"/>', f"0 0 {-LOWER - 0.025}")
"""A peg that ends 45 mm from the middle of the foot."""


def test_a_peg_below_the_foot_is_told_with_the_radius_that_would_do() -> None:
    """It is seen from where its leg leans least."""
    words = told(PEG, foot_radius=0.03)
    (depth,) = re.findall(r"comes ([\d.]+) mm into the ground", words)
    (radius,) = re.findall(r"give foot_radius=([\d.]+)", words)
    joints = quiet(robot()).standing_joints()
    leans = abs(joints[1] + joints[2]) - max(LEANS)
    assert float(depth) == pytest.approx(45.0 * np.cos(leans) - 30.0, abs=1.0)
    assert 0.03 + 1e-3 * float(depth) - 1e-4 <= float(radius) <= 0.031 + 1e-3 * float(depth)
    assert told(PEG, foot_radius=float(radius)) == ""


def test_the_radius_that_would_do_is_taken_where_none_is_given() -> None:
    (radius,) = re.findall(r"give foot_radius=([\d.]+)", told(PEG, foot_radius=0.03))
    assert quiet(robot(shank=PEG)).foot_radius == pytest.approx(float(radius))
    assert f"taken as {1e3 * float(radius):.4g} mm: give foot_radius=0.03 for" in told(PEG)
    assert quiet(robot(shank=PEG), foot_radius=0.03).foot_radius == 0.03
    assert quiet(robot()).foot_radius == 0.03
    assert "mm, which holds the ends of the legs" in str(quiet(robot(shank=PEG)).notes)
    assert "mm, as given" in str(quiet(robot(shank=PEG), foot_radius=0.03).notes)


def test_no_ball_of_half_a_leg_is_taken_for_a_foot() -> None:
    """A skid far below the foot is told, and the foot stays what the file says."""
    skid = collision('<box size="0.1 0.02 0.02"/>', f"0 0 {-LOWER - 0.05}")
    assert quiet(robot(shank=skid)).foot_radius == 0.03
    assert "taken" not in told(skid) and "give foot_radius=" in told(skid)


@pytest.mark.parametrize("shank", [
    "",  # none
    ball(0.03, 0.0),  # the foot's own ball
    ball(0.03, 0.005),  # within 1.25 radii of its middle: the foot itself
    collision(f'<capsule radius="0.02" length="{LOWER}"/>', f"0 0 {-LOWER / 2}"),
    collision('<box size="0.04 0.04 0.1"/>', "0 0 -0.05"),
])  # fmt: skip
def test_shapes_within_the_foot_and_above_it_are_not_told(shank: str) -> None:
    assert told(shank) == ""


def test_a_foot_that_rolls_like_a_wheel_is_told() -> None:
    """A cylinder along y as wide as the ball: it is in the ground where the leg leans sideways."""
    wheel = collision('<cylinder radius="0.03" length="0.06"/>', f"0 0 {-LOWER}", "1.5708 0 0")
    assert "is wider than the ball" in told(wheel)
    narrow = collision('<cylinder radius="0.03" length="1e-4"/>', f"0 0 {-LOWER}", "1.5708 0 0")
    assert told(narrow) == ""


def test_feet_without_a_radius_are_not_told() -> None:
    texts = robot(foot="").replace(FOOT, "")
    assert not [w for w in warnings_of(texts) if "is wider" in w]
    assert DEEPER < 1e-3 and min(LEANS) == -max(LEANS)
