"""What kind of file a text is, and texts that would keep a careless reader busy."""

from __future__ import annotations

from pathlib import Path

import pytest
from robot_loading import quiet
from robot_texts import MASS, MJCF_MASS, mjcf, robot

from gaitopt.errors import RobotError
from gaitopt.robots.catalog import load_robot


@pytest.mark.parametrize("comment", ["<sdf>", "<mujoco>", "<robot>", "<xacro:if>"])
def test_comments_do_not_tell_the_kind_of_a_file(comment: str) -> None:
    urdf = quiet(f"<!-- made from {comment} -->{robot()}")
    model = quiet(f"<!-- made from {comment} -->{mjcf()}")
    assert urdf.notes.kind == "urdf" and urdf.mass == pytest.approx(MASS)
    assert model.notes.kind == "mjcf" and model.mass == pytest.approx(MJCF_MASS)


def test_sdf_is_refused_by_its_name() -> None:
    with pytest.raises(RobotError, match="this is SDF"):
        load_robot('<?xml version="1.0"?><!-- <robot> --><sdf version="1.7"/>')


@pytest.mark.parametrize("text", ["", " \n\t\n"])
def test_empty_files_are_called_so(text: str, tmp_path: Path) -> None:
    file = tmp_path / "mine.urdf"
    file.write_text(text)
    with pytest.raises(RobotError, match=r"^mine: the file is empty"):
        load_robot(file)


def test_two_links_of_one_name_are_told_as_such() -> None:
    """Not as a link that is missing, which the joint of the other one names."""
    text = robot().replace('<link name="RF_l0"', '<link name="LF_l0"')
    with pytest.raises(RobotError, match="2 links have the name LF_l0; rename all but one"):
        load_robot(text)


DEEP = "<x>" * 3000 + "</x>" * 3000


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (robot(DEEP), "more than 200 elements inside one another"),
        (robot() + "<!--" * 200_000, "no well-formed XML"),
        (robot().replace('name="tester"', 'name="' + "${" * 200_000), "no well-formed XML"),
        (f'<!DOCTYPE robot [<!ENTITY a "b">]>{robot()}', "declares a document type or entities"),
        (f"{robot()}\0", "no well-formed XML"),
    ],
)
def test_texts_made_to_do_harm_are_refused(text: str, words: str) -> None:
    """In a tenth of a second; work that grew with the square of the length would take minutes."""
    with pytest.raises(RobotError, match=words):
        load_robot(text)


def test_a_namespace_of_the_outermost_element_does_not_matter() -> None:
    """Drake's LittleDog names the schema of its elements."""
    spaced = robot().replace("<robot ", '<robot xmlns="http://drake.mit.edu" ', 1)
    assert quiet(spaced).mass == pytest.approx(MASS)
    assert 'xmlns="http://drake' not in quiet(spaced).urdf


def test_what_stands_before_the_declaration_does_not_matter() -> None:
    """Some files begin with an empty line or a comment, where XML wants its declaration."""
    plain = '<?xml version="1.0"?>\n' + robot()
    assert quiet("\n<!-- a robot -->\n" + plain).sha256 == quiet(plain).sha256


def test_a_file_of_many_comments_without_a_declaration_is_read_at_once() -> None:
    """Looked for was what stands before ``<?xml``; without one the search did not end."""
    comments = "<!-- a comment -->\n" * 60
    made = quiet(comments + robot() + comments)
    assert made.legs.keys() == quiet(robot()).legs.keys()
    declared = quiet(comments + '<?xml version="1.0"?>\n' + robot())
    assert declared.mass == made.mass
