"""Numbers of the wrong count in shapes that are only drawn are found when a robot is loaded."""

from __future__ import annotations

import pytest

import gaitopt
from gaitopt.errors import RobotError
from gaitopt.robots.catalog import own_urdf


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("<box size=", '<box size="0.1 0.2" old=', "give 3 lengths"),
        ("<box size=", "<box old=", "give 3 lengths"),
        ("<visual>", '<visual><origin xyz="0 0"/>', "give 3 numbers"),
        ("<visual>", '<visual><origin rpy="0 0 0 0"/>', "give 3 numbers"),
    ],
)
def test_a_drawn_shape_without_all_its_numbers_is_refused(old: str, new: str, words: str) -> None:
    text = own_urdf("wang2020").read_text("utf-8")
    begin = text.index("<visual")
    assert old in text[begin:] or "<visual>" in text
    changed = text[:begin] + text[begin:].replace(old, new, 1)
    assert changed != text
    with pytest.raises(RobotError, match=words):
        gaitopt.load_robot(changed)
