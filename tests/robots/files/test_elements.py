"""Elements of a robot file that no URDF has: told when it is read, so that none is lost unseen."""

from __future__ import annotations

import pytest
from robot_loading import refusal, warnings_of
from robot_texts import BODY_MASS, inertial, robot

PLAIN = robot()
TOLD = "elements that no URDF has are not read: "


@pytest.mark.parametrize(
    ("old", "new", "place"),
    [
        ("</robot>", "<wobble/></robot>", "<wobble> in <robot>"),
        ('<link name="base">', '<link name="base"><colision/>', "<colision> in link base"),
        ("<axis", "<dynamik/><axis", "<dynamik> in joint "),
        ("<geometry>", "<geometry><cone/>", "<cone> in <geometry> of <collision> of link "),
        ("<mass", "<maß/><mass", "<maß> in <inertial> of link base"),
    ],
)
def test_an_element_that_no_urdf_has_is_told_with_its_place(old: str, new: str, place: str) -> None:
    told = [text for text in warnings_of(PLAIN.replace(old, new, 1)) if TOLD in text]
    assert len(told) == 1 and place in told[0]


def test_elements_of_simulators_and_of_other_namespaces_are_no_matter() -> None:
    others = (
        '<gazebo reference="base"><odd/></gazebo><transmission><odd/></transmission>'
        '<ros2_control><odd/></ros2_control><x:odd xmlns:x="http://example.org"/></robot>'
    )
    inside = '<link name="base"><contact><lateral_friction value="1"/></contact>'
    changed = PLAIN.replace("</robot>", others).replace('<link name="base">', inside)
    assert changed != PLAIN and warnings_of(changed) == warnings_of(PLAIN)


def test_an_error_that_a_misspelt_element_may_explain_names_it() -> None:
    mass = inertial(BODY_MASS)
    said = refusal(PLAIN.replace(mass, mass.replace("inertial>", "inertal>"), 1))
    assert "link base moves and has no mass" in said and "<inertal> in link base" in said


def test_many_are_counted() -> None:
    many = "".join(f"<part{n}/>" for n in range(50))
    (told,) = [t for t in warnings_of(PLAIN.replace("</robot>", many + "</robot>")) if TOLD in t]
    assert "and 44 more" in told
