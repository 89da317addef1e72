"""What a URDF says of the balls under its feet."""

from __future__ import annotations

from xml.etree import ElementTree

import numpy as np
import pytest
import trimesh

from gaitopt.robots.catalog import example_urdf, load_robot, robot_names
from gaitopt.robots.feet import ball_radius

RADII = {
    "wang2020": 0.015, "wang2020-fast": 0.015, "frog1": 0.02,
    "a1": 0.02, "go1": 0.02, "b1": 0.04, "laikago": 0.0265, "anymal": 0.031,
    "anymal_c": 0.03, "hyq": 0.02175, "quadruped": 0.025,
}  # fmt: skip
MESHED = {
    "go2": "go2_description/collisions/foot_convex.stl",
    "solo12": "solo_description/meshes/stl/with_foot/solo_foot.stl",
    "solo8": "solo_description/meshes/obj/with_foot/solo_foot.obj",
}
"""Robots whose feet are meshes; at zero their lower legs point down."""


def link(name: str, *shapes: str) -> str:
    collisions = "".join(f"<collision><geometry>{s}</geometry></collision>" for s in shapes)
    return f'<link name="{name}">{collisions}</link>'


def robot(*links: str) -> str:
    return f'<robot name="r">{"".join(links)}</robot>'


def sphere(radius: float) -> str:
    return f'<sphere radius="{radius}"/>'


BOX = '<box size="1 1 1"/>'
MESH = '<mesh filename="package://nowhere/foot.stl"/>'


@pytest.mark.parametrize("name", RADII)
def test_radius_is_that_of_the_foot_link_s_ball(name: str) -> None:
    assert load_robot(name).foot_radius == RADII[name]


def test_every_robot_has_a_radius() -> None:
    assert {*RADII, *MESHED} == set(robot_names())


@pytest.mark.parametrize("name", MESHED)
def test_foot_of_a_mesh_ends_where_the_mesh_does(name: str) -> None:
    folder = [p for p in example_urdf(name).parents if p.name == "robots"][-1]
    corners = trimesh.load(folder / MESHED[name], force="mesh").vertices
    # solo's feet lie 8 mm beside their knees' axes, so the leg is 3 degrees off the vertical.
    assert load_robot(name).foot_radius == pytest.approx(-corners[:, 2].min(), abs=1e-4)


@pytest.mark.parametrize("name", ["anymal", "anymal_c"])
def test_foot_frame_is_the_middle_of_the_ball(name: str) -> None:
    """The ball of these is above the origin of the link that is called foot."""
    robot = load_robot(name)
    text = example_urdf(name).read_text("utf-8")
    ball = next(
        shape for shape in ElementTree.fromstring(text).iterfind("link[@name='LF_FOOT']/collision")
        if shape.find("geometry/sphere") is not None
    )  # fmt: skip
    above = [float(x) for x in ball.find("origin").get("xyz").split()]
    frames = [robot.model.frames[robot.model.getFrameId(link)].placement
              for link in ("LF_FOOT", robot.legs["LF"].foot)]  # fmt: skip
    offset = frames[0].actInv(frames[1].translation)
    np.testing.assert_allclose(offset, above, rtol=0, atol=1e-12)


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
