"""What a URDF says of the balls under its feet."""

from __future__ import annotations

import pytest

from gaitopt.robots.catalog import load_robot, robot_names
from gaitopt.robots.feet import ball_radius

RADII = {
    "wang2020": 0.015, "wang2020-fast": 0.015, "frog1": 0.02,
    "a1": 0.02, "go1": 0.02, "b1": 0.04, "laikago": 0.0265, "anymal": 0.031,
    "anymal_c": 0.03, "hyq": 0.02175, "quadruped": 0.025,
    "go2": 0.0, "solo12": 0.0, "solo8": 0.0,  # their URDFs hold meshes only
}  # fmt: skip


def link(name: str, *shapes: str) -> str:
    collisions = "".join(f"<collision><geometry>{s}</geometry></collision>" for s in shapes)
    return f'<link name="{name}">{collisions}</link>'


def robot(*links: str) -> str:
    return f'<robot name="r">{"".join(links)}</robot>'


def sphere(radius: float) -> str:
    return f'<sphere radius="{radius}"/>'


BOX = '<box size="1 1 1"/>'
MESH = '<mesh filename="package://nowhere/foot.stl"/>'


@pytest.mark.parametrize("name", robot_names())
def test_radius_is_that_of_the_foot_link_s_ball(name: str) -> None:
    assert load_robot(name).foot_radius == RADII[name]


def test_radius_is_the_smallest_of_the_balls() -> None:
    text = robot(link("a", sphere(0.03), sphere(0.02)), link("b", sphere(0.025)))
    assert ball_radius(text, ["a", "b"]) == 0.02
    assert ball_radius(text, ["b"]) == 0.025


def test_other_shapes_and_other_links_do_not_count() -> None:
    text = robot(link("a", BOX, sphere(0.04)), link("knee", sphere(0.01)))
    assert ball_radius(text, ["a"]) == 0.04


@pytest.mark.parametrize("shapes", [(), (BOX,), (MESH,)])
def test_foot_without_a_ball_has_radius_zero(shapes: tuple[str, ...]) -> None:
    assert ball_radius(robot(link("a", *shapes)), ["a", "nowhere"]) == 0.0


def test_foot_drawn_as_a_ball_but_not_colliding_as_one_has_radius_zero() -> None:
    drawn = f'<link name="a"><visual><geometry>{sphere(0.02)}</geometry></visual></link>'
    assert ball_radius(robot(drawn), ["a"]) == 0.0
