"""Where the feet are: links, shapes, meshes, wheels, and what the user says."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
import trimesh
from robot_loading import feet_by_pinocchio, quiet, refusal, warnings_of
from robot_texts import (
    CORNERS,
    FOOT,
    LOWER,
    UPPER,
    collision,
    joint,
    leg,
    link,
    robot,
)  # fmt: skip

from gaitopt.conventions import LEGS
from gaitopt.errors import InputError, RobotError
from gaitopt.robots.catalog import load_robot

WHEEL = collision('<cylinder radius="0.08" length="0.04"/>', "0 0.05 0", "1.5707963267948966 0 0")


def wheeled(name: str, shape: str = WHEEL) -> str:
    plain = leg(name, foot=None)
    wheel = link(f"{name}_wheel", 0.3, shape)
    kind = '<limit effort="30" velocity="12"/>'
    return (
        plain
        + wheel
        + joint(
            f"{name}_spin",
            f"{name}_l2",
            f"{name}_wheel",
            f"0 0 {-LOWER}",
            "continuous",
            "0 1 0",
            kind,
        )
    )


def test_wheels_are_locked_and_stand_on_their_lowest_point() -> None:
    made = quiet(robot(changed={name: wheeled(name) for name in CORNERS}))
    assert len(made.joint_names) == 12 and made.foot_radius == pytest.approx(0.08)
    assert set(made.notes.locked) == {f"{name}_spin" for name in CORNERS}
    feet = feet_by_pinocchio(made, np.zeros(12))
    # The middle of the wheel is 0.05 m beside the lower leg.
    assert feet[0] == pytest.approx([0.2, 0.1 + 0.04 + 0.05, -UPPER - LOWER], abs=1e-12)


def test_a_leg_that_goes_on_below_its_fourth_joint_has_an_ankle_and_no_wheel() -> None:
    ankles = {
        name: leg(name, foot=None)
        + link(f"{name}_ankle", 0.1, collision('<sphere radius="0.02"/>'))
        + joint(f"{name}_j3", f"{name}_l2", f"{name}_ankle", "0 0 -0.12", "revolute", "0 1 0")
        + link(f"{name}_toe", 0.05, FOOT)
        + joint(f"{name}_end", f"{name}_ankle", f"{name}_toe", "0 0 -0.1")
        for name in CORNERS
    }
    made = quiet(robot(changed=ankles))
    assert made.notes.locked.keys() == {f"{name}_j3" for name in CORNERS}
    assert made.foot_radius == 0.03
    assert made.legs["LF"].lower == pytest.approx(0.22)


def test_wheel_whose_shape_is_missing_is_told() -> None:
    mesh = collision('<mesh filename="package://nowhere/wheel.dae"/>')
    text = robot(changed={name: wheeled(name, mesh) for name in CORNERS})
    assert any("radius of the feet is not known" in words for words in warnings_of(text))
    assert quiet(text, foot_radius=0.07).foot_radius == 0.07


ALONG = f"0 0 {-LOWER / 2}"
EDGE = 0.015 * np.sqrt(2.0)
"""From the middle of a cylinder's end, a radius of 15 mm above it, to the edge of the end [m]."""


@pytest.mark.parametrize(
    ("shape", "xyz", "length", "radius"),
    [
        (f'<cylinder radius="0.015" length="{LOWER}"/>', ALONG, LOWER - 0.015, EDGE),
        (f'<capsule radius="0.015" length="{LOWER}"/>', ALONG, LOWER, 0.015),
        ('<sphere radius="0.025"/>', f"0 0 {-LOWER}", LOWER, 0.025),
    ],
)
def test_leg_without_a_foot_link_ends_with_its_shape(
    shape: str, xyz: str, length: float, radius: float
) -> None:
    """The edge of a cylinder's end is farther from the middle of the foot than its side."""
    made = quiet(robot(foot=None, shank=collision(shape, xyz)))
    assert made.foot_radius == pytest.approx(radius, abs=1e-4)
    assert all(one.lower == pytest.approx(length, abs=1e-12) for one in made.legs.values())
    visual = collision(shape, xyz).replace("collision", "visual")
    assert quiet(robot(foot=None, shank=visual)).legs["LF"].lower == pytest.approx(length)


def test_a_collision_box_across_the_leg_is_no_lower_leg() -> None:
    """A box that somebody typed along the knee's axis; the visual shape says where the leg ends."""
    across = collision(f'<box size="0.03 {LOWER} 0.03"/>', f"0 {LOWER / 2} 0")
    along = collision(f'<capsule radius="0.015" length="{LOWER}"/>', ALONG)
    made = quiet(robot(foot=None, shank=across + along.replace("collision", "visual")))
    assert all(one.lower == pytest.approx(LOWER, abs=1e-12) for one in made.legs.values())
    assert made.foot_radius == pytest.approx(0.015)


def test_shapes_that_urdf_does_not_know_are_written_in_those_it_does(
    capfd: pytest.CaptureFixture[str],
) -> None:
    capsule = collision('<capsule radius="0.015" length="0.2"/>', "0 0 -0.1", "0.1 0 0")
    made = quiet(robot(shank=capsule + collision('<cone radius="1" length="1"/>')))
    assert "<capsule" not in made.urdf and "<cone" not in made.urdf
    shapes = pin.buildGeomFromUrdfString(made.model, made.urdf, pin.GeometryType.COLLISION)
    first = [s for s in shapes.geometryObjects if "LF_l2" in s.name]
    places = np.array([s.placement.translation for s in first])
    turn = np.array([0.0, -np.sin(0.1), np.cos(0.1)])
    middle = np.array([0.0, 0.0, -0.1])
    expected = [middle, middle - 0.1 * turn, middle + 0.1 * turn]
    np.testing.assert_allclose(places, expected, rtol=0, atol=1e-12)
    assert "Could not parse" not in capfd.readouterr().err


def test_box_is_as_thick_as_its_end() -> None:
    made = quiet(robot(foot=None, shank=collision(f'<box size="0.02 0.02 {LOWER}"/>', ALONG)))
    assert np.hypot(0.01, 0.01) < made.foot_radius < np.sqrt(3.0) * 0.01  # edge, corner
    tip = made.legs["LF"].lower + 0.01
    assert tip == pytest.approx(LOWER, abs=2e-3)


def ball_on_a_stick(path: Path, centre: float, radius: float) -> None:
    """A mesh of a lower leg with a ball at its end, as STL."""
    ball = trimesh.creation.icosphere(subdivisions=3, radius=radius)
    ball.apply_translation([0.0, 0.0, centre])
    stick = trimesh.creation.box(extents=[0.01, 0.01, abs(centre)])
    stick.apply_translation([0.0, 0.0, centre / 2.0])
    trimesh.util.concatenate([ball, stick]).export(path)


@pytest.mark.parametrize("name", ["package://tester/meshes/shank.stl", "../meshes/shank.stl",
                                  "package://meshes/shank.stl", "shank.stl",
                                  "file://$(find tester)/meshes/shank.stl",
                                  "$(find-pkg-share tester)/meshes/shank.stl"])  # fmt: skip
def test_mesh_of_a_leg_without_a_foot_link_is_found_and_measured(tmp_path: Path, name: str) -> None:
    """Beside the file, above it, and with or without the name of its package."""
    folder = tmp_path / "tester"
    for inside in ("urdf", "meshes"):
        (folder / inside).mkdir(parents=True)
    home = folder / ("urdf" if name == "shank.stl" else "meshes")
    ball_on_a_stick(home / "shank.stl", -LOWER, 0.02)
    file = folder / "urdf" / "mine.urdf"
    file.write_text(robot(foot=None, shank=collision(f'<mesh filename="{name}"/>')))
    made = quiet(file)
    assert made.name == "mine"
    assert made.foot_radius == pytest.approx(0.02, abs=5e-4)
    assert made.legs["LF"].lower == pytest.approx(LOWER, abs=1e-3)


def test_meshes_are_looked_for_in_given_folders_and_ros_package_path(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "dog" / "meshes").mkdir(parents=True)
    ball_on_a_stick(tmp_path / "dog" / "meshes" / "shank.stl", -LOWER, 0.02)
    mesh = collision('<mesh filename="package://dog/meshes/shank.stl"/>')
    text = robot(foot=None, shank=mesh)
    assert "no shape of LF_l2 tells where it ends" in refusal(text)
    assert quiet(text, package_folders=[tmp_path]).foot_radius == pytest.approx(0.02, abs=5e-4)
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path))
    assert quiet(text).foot_radius == pytest.approx(0.02, abs=5e-4)


@pytest.mark.parametrize("name", ["absent", "file", "x" * 5000, "null \0"])
def test_package_folders_that_are_not_there_are_refused(tmp_path: Path, name: str) -> None:
    (tmp_path / "file").write_text("no folder")
    with pytest.raises(InputError, match="package_folders: there is no folder"):
        load_robot(robot(), package_folders=[tmp_path, tmp_path / name])


def roller(path: Path, radius: float, tilt: float = 0.0) -> None:
    """A mesh of a lower leg whose end is a drum, with its axis along that of the knee."""
    drum = trimesh.creation.cylinder(radius=radius, height=0.004, sections=128)
    drum.apply_transform(trimesh.transformations.rotation_matrix(np.pi / 2 + tilt, [1, 0, 0]))
    drum.apply_translation([0.03, 0.0, -LOWER])
    stick = trimesh.creation.box(extents=[0.01, 0.01, 0.9 * LOWER])
    stick.apply_translation([0.0, 0.0, -0.45 * LOWER])
    trimesh.util.concatenate([drum, stick]).export(path)


def test_foot_that_rolls_has_the_radius_on_which_it_rolls(tmp_path: Path) -> None:
    """A drum ahead of the leg's line: its edge is farther away than its lowest line."""
    roller(tmp_path / "shank.stl", 0.02)
    mesh = collision('<mesh filename="shank.stl"/>')
    (tmp_path / "robot.urdf").write_text(robot(foot=None, shank=mesh))
    made = quiet(tmp_path / "robot.urdf")
    assert made.foot_radius == pytest.approx(0.02, abs=5e-4)
    feet = feet_by_pinocchio(made, np.zeros(12))
    assert feet[0] == pytest.approx([0.23, 0.14, -UPPER - LOWER], abs=1e-3)


def test_foot_link_without_shapes_takes_those_of_its_leg(tmp_path: Path) -> None:
    """Its frame is the drum's axis."""
    roller(tmp_path / "shank.stl", 0.02)
    mesh = collision('<mesh filename="shank.stl"/>')
    text = robot(foot="", shank=mesh).replace(f'xyz="0 0 {-LOWER}"', f'xyz="0.03 0 {-LOWER}"')
    (tmp_path / "robot.urdf").write_text(text)
    made = quiet(tmp_path / "robot.urdf")
    assert made.foot_radius == pytest.approx(0.02, abs=5e-4)
    assert made.legs["LF"].foot == "LF_foot"


def test_small_balls_only_mark_a_place() -> None:
    dot = '<visual><geometry><sphere radius="0.001"/></geometry></visual>'
    (words,) = warnings_of(robot(foot=dot))
    assert "radius of the feet is not known" in words
    assert load_robot(robot(foot=dot.replace("0.001", "0.01"))).foot_radius == 0.01


def test_ball_beside_the_foot_link_is_the_foot() -> None:
    """The foot frame is the ball's centre, wherever the link's origin is."""
    made = quiet(robot(foot=collision('<sphere radius="0.03"/>', "0 0 0.02")))
    assert made.legs["LF"].lower == pytest.approx(LOWER - 0.02, abs=1e-12)
    assert made.foot_radius == 0.03


def test_lowest_of_several_balls_is_the_foot() -> None:
    balls = collision('<sphere radius="0.012"/>', "0 0 0.013") + FOOT
    made = load_robot(robot(foot=balls))
    assert made.foot_radius == 0.03 and made.legs["LF"].lower == pytest.approx(LOWER)


def test_foot_may_be_named_and_placed() -> None:
    text = robot(foot=None)
    with pytest.raises(RobotError, match=r"feet=\{'LF': "):
        load_robot(text)
    feet = {name: (f"{name}_l2", (0.0, 0.0, -0.2)) for name in LEGS}
    made = quiet(text, feet=feet, foot_radius=0.015)
    assert made.legs["RH"].lower == pytest.approx(0.2) and made.foot_radius == 0.015
    with pytest.raises(InputError, match="is no link beyond the last joint of leg LF"):
        quiet(robot(), feet={"LF": "base"})
    with pytest.raises(InputError, match="feet: LF: give the name of a link"):
        load_robot(text, feet={"LF": 3})


def test_point_feet_are_warned_about() -> None:
    (words,) = warnings_of(robot(foot=""))
    assert (
        words
        == "tester: the radius of the feet is not known, so they are points; give foot_radius="
    )
    assert not warnings_of(robot(foot=""), foot_radius=0.01)


def test_a_foot_elsewhere_than_on_the_other_side_is_told_with_the_option() -> None:
    """Shapes of Aibo's file lie beside its legs, on each side in other places."""
    short = {"LF": leg("LF").replace(f"0 0 {-LOWER}", f"0 0 {-0.7 * LOWER}")}
    (told,) = [w for w in quiet(robot(changed=short)).notes.warnings if "both sides" in w]
    assert told.startswith("the feet of LF and RF are 154 and 220 mm from their last joints")
    assert "give feet={'LF': ('link', (x, y, z)), ...}" in told
    assert not any("both sides" in w for w in quiet(robot()).notes.warnings)


def test_a_large_ball_of_the_file_is_the_foot_as_it_is() -> None:
    """Its radius is a third of the lower leg; ends of other shapes count for less than that."""
    short = collision('<sphere radius="0.075"/>', f"0 0 {-LOWER}")
    made = quiet(robot(foot=None, shank=short))
    assert made.foot_radius == pytest.approx(0.075)
    assert made.legs["LF"].lower == pytest.approx(LOWER)
    blunt = collision('<cylinder radius="0.075" length="0.2"/>', f"0 0 {0.1 - LOWER}")
    assert quiet(robot(foot=None, shank=blunt)).foot_radius < 0.075


def test_meshes_are_found_in_the_folder_that_a_urdf_names_for_mujoco(tmp_path: Path) -> None:
    """``<mujoco><compiler meshdir=...>``, where file names stand without their folders."""
    (tmp_path / "meshes" / "stl").mkdir(parents=True)
    (tmp_path / "urdf").mkdir()
    stick = trimesh.creation.capsule(radius=0.02, height=LOWER - 0.02)
    stick.apply_translation([0.0, 0.0, -stick.bounds[1, 2] + 0.02])
    stick.export(tmp_path / "meshes" / "stl" / "shank.stl")
    # A screw on the lower leg is the only link beyond the knee.
    shank = collision('<mesh filename="here/shank.stl"/>')
    text = robot(foot="", shank=shank).replace(f'xyz="0 0 {-LOWER}"', 'xyz="0 0.005 -0.05"')
    text = text.replace("_foot", "_screw")
    named = text.replace("</robot>", '<mujoco><compiler meshdir="../meshes/stl"/></mujoco></robot>')
    (tmp_path / "urdf" / "dog.urdf").write_text(named)
    made = quiet(tmp_path / "urdf" / "dog.urdf")
    assert made.foot_radius == pytest.approx(0.02, rel=0.02)
    assert made.legs["LF"].lower == pytest.approx(LOWER - 0.02, abs=1e-3)
    # Where it is missing, feet that nothing else tells may end elsewhere.
    words = [w for w in warnings_of(text) if "the radius of the feet is not known" in w]
    assert len(words) == 1 and "may end elsewhere" in words[0] and "here/shank.stl" in words[0]
