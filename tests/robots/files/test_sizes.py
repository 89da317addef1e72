"""Files in other units than metres and kilograms: told when they are read; `scale` cures them."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
import trimesh
from robot_loading import quiet, refusal, warnings_of
from robot_texts import LOWER, MASS, UPPER, collision, joint, link, robot

import gaitopt
from gaitopt.errors import InputError
from gaitopt.robots.catalog import robot_names


def in_unit(text: str, unit: float) -> str:
    """A URDF in metres, written in another unit [m]."""

    def scaled(attributes: tuple[str, ...], power: int, text: str) -> str:
        def numbers(match: re.Match[str]) -> str:
            values = [repr(float(x) / unit**power) for x in match.group(2).split()]
            return f'{match.group(1)}{" ".join(values)}"'

        return re.sub(rf'(\b(?:{"|".join(attributes)})=")([^"]*)"', numbers, text)

    bare = re.sub(r"<axis[^>]*>", lambda m: m.group().replace("xyz", "direction"), text)
    bare = scaled(("xyz", "size", "radius", "length"), 1, bare)
    bare = scaled(("ixx", "iyy", "izz", "ixy", "ixz", "iyz"), 2, bare)
    return bare.replace("direction", "xyz")


BOXES = collision('<box size="0.03 0.04 0.2"/>', "0 0 -0.1", "0 0.1 0")


@pytest.mark.parametrize("unit", [0.001, 0.01, 0.0254])
def test_a_file_in_another_unit_is_the_same_robot_with_scale(unit: float) -> None:
    metres, other = quiet(robot(shank=BOXES)), quiet(in_unit(robot(shank=BOXES), unit), scale=unit)
    assert other.standing_height == metres.standing_height
    assert other.foot_radius == pytest.approx(metres.foot_radius, rel=1e-12)
    for leg in gaitopt.LEGS:
        np.testing.assert_allclose(other.legs[leg].hip, metres.legs[leg].hip, rtol=1e-12)
        assert other.legs[leg].lower == pytest.approx(metres.legs[leg].lower, rel=1e-12)
    # All masses, centres of mass and inertias, by Pinocchio.
    q = np.concatenate([np.zeros(6), [1.0], metres.standing_joints()])
    ours, theirs = (pin.crba(made.model, made.model.createData(), q) for made in (other, metres))
    np.testing.assert_allclose(ours, theirs, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("unit", [0.001, 0.01, 100.0])
def test_unreal_sizes_are_told_with_their_cure(unit: float) -> None:
    (told,) = warnings_of(in_unit(robot(), unit))
    assert "no walking robot" in told and f"give scale={unit:g} (" in told
    assert not warnings_of(in_unit(robot(), unit), scale=unit)
    assert not warnings_of(robot())


def test_errors_of_files_with_unreal_sizes_tell_them_too() -> None:
    """Legs of 0.3 mm have no feet that could be told from their ankles."""
    told = refusal(in_unit(robot(), 1000.0))
    assert "no link lies beyond joint" in told and "give scale=1000 (" in told
    assert quiet(in_unit(robot(), 1000.0), scale=1000.0).mass == pytest.approx(MASS)


def test_places_that_are_too_far_away_for_a_robot_name_the_cure() -> None:
    text = robot(link("tail") + joint("end", "base", "tail", "-2 0 0"))
    assert "give scale=" in refusal(in_unit(text, 0.001))
    assert quiet(in_unit(text, 0.001), scale=0.001).legs["LF"].lower == pytest.approx(LOWER)


def test_meshes_are_scaled_with_the_file(tmp_path: Path) -> None:
    """A mesh in millimetres; its hull is that of the box in metres."""
    box = trimesh.creation.box(extents=[30.0, 40.0, 200.0])
    box.export(tmp_path / "shank.stl")
    mesh = collision('<mesh filename="shank.stl"/>', "0 0 -0.1")
    (tmp_path / "robot.urdf").write_text(in_unit(robot(shank=mesh), 0.001))
    made = quiet(tmp_path / "robot.urdf", scale=0.001)
    corners = np.array(made.notes.hulls[0][1]).reshape(-1, 3)
    np.testing.assert_allclose(np.ptp(corners, axis=0), [0.03, 0.04, 0.2], atol=1e-5)


def test_masses_in_grams_are_told() -> None:
    grams = re.sub(r'mass value="([^"]*)"', lambda m: f'mass value="{1e3 * float(m[1])}"', robot())
    (told,) = warnings_of(grams)
    assert "is no walking robot's mass" in told and "give masses= in kg" in told


def test_real_robots_have_real_sizes() -> None:
    for name in robot_names():
        assert not [text for text in warnings_of(name) if "no walking robot" in text], name


def test_scale_is_for_files_as_they_came() -> None:
    """What gaitopt has written is in metres, and so is an MJCF."""
    written = quiet(in_unit(robot(foot=None, shank=BOXES), 0.001), scale=0.001).urdf
    assert quiet(written).legs["LF"].upper == pytest.approx(UPPER)
    with pytest.raises(InputError, match="scale is for the file as it came"):
        quiet(written, scale=0.001)
    with pytest.raises(InputError, match="an MJCF is in metres"):
        quiet("<mujoco/>", scale=0.001)
    with pytest.raises(InputError, match="scale must be"):
        quiet(robot(), scale=0.0)
