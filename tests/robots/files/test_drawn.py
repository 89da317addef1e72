"""The shapes that a URDF draws, as yourdfpy reads them."""

from __future__ import annotations

import io

import numpy as np
import pytest
import yourdfpy

import gaitopt
from gaitopt.robots.files.drawn import drawn_shapes

LINK = '<robot name="r">{}<link name="l"><visual>{}</visual></link></robot>'


@pytest.mark.parametrize("name", ["wang2020", "a1", "anymal_c", "go2"])
def test_yourdfpy_draws_the_same(name: str) -> None:
    urdf = gaitopt.load_robot(name).urdf
    theirs = yourdfpy.URDF.load(
        io.BytesIO(urdf.encode()), build_scene_graph=False, load_meshes=False
    ).robot
    colours = {m.name: m.color for m in theirs.materials}
    expected = [(link.name, visual) for link in theirs.links for visual in link.visuals]
    found = drawn_shapes(urdf)
    assert len(found) == len(expected) > 0
    for ours, (link, visual) in zip(found, expected, strict=True):
        assert ours.link == link
        origin = np.eye(4) if visual.origin is None else visual.origin
        np.testing.assert_allclose(ours.origin, origin, atol=1e-14)
        kind = getattr(visual.geometry, ours.shape.tag)
        if ours.shape.tag == "box":
            assert ours.numbers("size", 3) == tuple(kind.size)
        elif ours.shape.tag == "mesh":
            assert ours.shape.get("filename") == kind.filename
            np.testing.assert_array_equal(
                np.ones(3) if ours.scale() is None else ours.scale(),
                np.ones(3) if kind.scale is None else kind.scale,
            )
        else:
            assert ours.numbers("radius", 1) == (kind.radius,)
        material = visual.material
        assert ours.material == (None if material is None else material.name)
        colour = None if material is None else material.color or colours.get(material.name)
        assert (ours.rgba is None) == (colour is None)
        if colour is not None:
            np.testing.assert_array_equal(ours.rgba, colour.rgba)


def test_a_colour_may_be_named_elsewhere() -> None:
    shape = '<geometry><sphere radius="1"/></geometry>'
    red = '<material name="red"><color rgba="1 0 0 1"/></material>'
    (named,) = drawn_shapes(LINK.format(red, shape + '<material name="red"/>'))
    assert named.rgba is not None and named.rgba.tolist() == [1.0, 0.0, 0.0, 1.0]
    (plain,) = drawn_shapes(LINK.format(red, shape))
    assert plain.rgba is None and plain.material is None


@pytest.mark.parametrize(
    ("visual", "words"),
    [
        ("", "link 'l' draws a shape that is none of box"),
        ("<geometry/>", "none of box, sphere, cylinder, mesh"),
        ("<geometry><cone/></geometry>", "none of box"),
        ('<geometry><box size="1 1 1"/></geometry><origin xyz="a b c"/>', "which are no numbers"),
    ],
)
def test_shapes_that_nobody_can_draw_are_told(visual: str, words: str) -> None:
    with pytest.raises(gaitopt.RobotError, match=words):
        drawn_shapes(LINK.format("", visual))


def test_a_box_has_three_sides() -> None:
    (box,) = drawn_shapes(LINK.format("", '<geometry><box size="1 2"/></geometry>'))
    with pytest.raises(gaitopt.RobotError, match="2 numbers in size, and needs 3"):
        box.numbers("size", 3)
