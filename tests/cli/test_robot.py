"""``gaitopt robot`` on files with odd names."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import pytest
import robot_texts
import trimesh
from typer.testing import Result


def test_names_that_look_like_markup_are_printed_as_they_are(
    command: Callable[..., Result], tmp_path: Path
) -> None:
    """A name and a kind of file may come from somebody else."""
    file = tmp_path / "robot.urdf"
    text = robot_texts.robot().replace('name="tester"', 'name="[/dog]"')
    file.write_text(text.replace("</robot>", '<gaitopt kind="[/kind]"/></robot>'))
    result = command("robot", str(file))
    assert result.exit_code == 0, result.output
    assert "[/dog]: 11.4 kg" in result.output and "read as [/kind]" in result.output


def test_text_of_a_robot_takes_the_place_of_its_file(command: Callable[..., Result]) -> None:
    result = command("robot", robot_texts.robot())
    assert result.exit_code == 0 and "tester: 11.4 kg" in result.output


def test_inertia_of_motors_is_told(command: Callable[..., Result]) -> None:
    result = command("robot", "wang2020", "--motor-inertia", "0.05")
    assert result.exit_code == 0
    assert "motors: inertia at the joints 0.05 kg m²" in result.output
    assert "motors:" not in command("robot", "wang2020").output


def test_torque_lines_are_told(command: Callable[..., Result]) -> None:
    result = command("robot", "wang2020", "--torque-line", "0.2", "0.5")
    assert result.exit_code == 0
    told = " ".join(result.output.split())
    assert "motors: whole torque up to 0.2 rad/s, and none at 0.5 rad/s, at 12 joints" in told


def test_help_says_how_the_two_speeds_are_written(command: Callable[..., Result]) -> None:
    """As it says them, they are taken."""
    told = " ".join(re.sub("[│ \n]+", " ", command("robot", "--help").output).split())
    assert "--torque-line FULL NONE" in told and "<float,float>" not in told
    pair = re.search(r"with a space between them \((\S+) (\S+)\)", told)
    assert pair is not None
    assert command("robot", "wang2020", "--torque-line", *pair.groups()).exit_code == 0


def test_how_legs_of_other_axes_are_solved_is_told(command: Callable[..., Result]) -> None:
    axes = ("1 0.2 0", "0 1 0.2", "0 1 0")
    told = " ".join(command("robot", robot_texts.robot(axes=axes)).output.split())
    assert "legs LF, LH, RH, RF: axes other than roll-pitch-pitch" in told
    assert "(numerical inverse kinematics, slower); not for plan_route" in told
    axes = ("0 1 0", "1 0 0", "0 1 0")
    told = " ".join(command("robot", robot_texts.robot(axes=axes)).output.split())
    assert "(closed form, as the first two axes meet or are parallel)" in told
    assert "axes other than" not in command("robot", robot_texts.robot()).output


def test_what_missing_meshes_cost_is_told(command: Callable[..., Result], tmp_path: Path) -> None:
    """Meshes to look at cost the drawing; those of collision shapes the check of collisions."""
    seen = '<{0}><geometry><mesh filename="{0}.stl"/></geometry></{0}>'
    words = "self-collisions: certificates leave them unchecked"

    def told(*kinds: str) -> str:
        text = robot_texts.robot().replace(
            '<link name="base">', '<link name="base">' + "".join(map(seen.format, kinds))
        )
        (tmp_path / "robot.urdf").write_text(text)
        return " ".join(command("robot", str(tmp_path / "robot.urdf")).output.split())

    looks = told("visual")
    assert "visual.stl (--package-folder; they cost the drawing only)" in looks
    assert words not in looks
    shapes = told("visual", "collision")
    assert "drawing only" not in shapes
    why = "because collision meshes are missing or cannot be read, those of base"
    assert f"{words}, {why}" in shapes
    # Found, the mesh becomes a hull, and nothing is left open.
    trimesh.creation.box(extents=[0.1, 0.1, 0.1]).export(tmp_path / "collision.stl")
    found = told("visual", "collision")
    assert "meshes: 1 of 2 found" in found and "they cost the drawing only" in found
    assert words not in found


@pytest.mark.parametrize("named", ["meshes/part.stl", "package://dog_description/meshes/part.stl"])
def test_meshes_of_a_user_s_file_are_found_beside_it(
    command: Callable[..., Result], tmp_path: Path, named: str
) -> None:
    """As `--meshes` finds those of the robots that come with a package."""
    package = tmp_path / "dog_description"
    (package / "meshes").mkdir(parents=True)
    trimesh.creation.box((0.3, 0.1, 0.1)).export(package / "meshes" / "part.stl")
    body = f'<visual><geometry><mesh filename="{named}"/></geometry></visual>'
    file = package / "dog.urdf"
    file.write_text(robot_texts.robot().replace('<link name="base">', f'<link name="base">{body}'))
    sizes = []
    for options in ((), ("--meshes",)):
        out = tmp_path / f"out{len(options)}"
        result = command("robot", str(file), *options, "--out", str(out))
        assert result.exit_code == 0, result.output
        sizes.append((out / "dog.html").read_text())
    assert sizes[0] != sizes[1]


def test_a_mesh_that_is_missing_costs_the_drawing_of_its_link(
    command: Callable[..., Result], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The others are in a folder of packages, given or named by ``ROS_PACKAGE_PATH``."""
    package = tmp_path / "packages" / "dog_meshes"
    package.mkdir(parents=True)
    trimesh.creation.box((0.3, 0.1, 0.1)).export(package / "there.stl")
    shape = '<visual><geometry><mesh filename="package://dog_meshes/{}.stl"/></geometry></visual>'
    body = shape.format("there") + shape.format("gone")
    file = tmp_path / "description" / "dog.urdf"
    file.parent.mkdir()
    file.write_text(robot_texts.robot().replace('<link name="base">', f'<link name="base">{body}'))

    def drawn(name: str, *options: str) -> Result:
        return command("robot", str(file), "--meshes", *options, "--out", str(tmp_path / name))

    refused = drawn("none")
    assert f"is not in {file.parent}" in str(refused.exception)
    given = drawn("given", "--package-folder", str(tmp_path / "packages"))
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(tmp_path / "packages"))
    named = drawn("named")
    assert given.exit_code == named.exit_code == 0, given.output + named.output
    other = tmp_path / "elsewhere" / "dog_meshes"
    other.mkdir(parents=True)
    trimesh.creation.box((0.1, 0.1, 0.2)).export(other / "gone.stl")
    both = drawn("both", "--package-folder", str(tmp_path / "elsewhere"))
    assert both.exit_code == 0, both.output
    pages = [(tmp_path / name / "dog.html").read_bytes() for name in ("given", "named", "both")]
    assert pages[0] == pages[1] and len(pages[2]) > len(pages[0])


def test_it_is_told_which_meshes_are_in_which_folder(
    command: Callable[..., Result], tmp_path: Path
) -> None:
    (tmp_path / "other").mkdir()
    for name in ("a.stl", "other/b.stl"):
        trimesh.creation.box((0.3, 0.1, 0.1)).export(tmp_path / name)
    shape = '<visual><geometry><mesh filename="{}"/></geometry></visual>'
    body = "".join(shape.format(name) for name in ("a.stl", "other/b.stl", "c.stl"))
    file = tmp_path / "dog.urdf"
    file.write_text(robot_texts.robot().replace('<link name="base">', f'<link name="base">{body}'))
    told = command("robot", str(file)).output.replace("\n", "")
    assert "meshes: 2 of 3 found" in told and "meshes that are missing: c.stl" in told
    assert f"in {tmp_path}: a.stl" in told and f"in {tmp_path / 'other'}: b.stl" in told
