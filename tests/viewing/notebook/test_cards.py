"""What notebooks show: pictures and lines, with every name escaped, and nothing heavy."""

from __future__ import annotations

import dataclasses
import re
import subprocess
import sys
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest

import gaitopt
from gaitopt import Plan, Quadruped
from gaitopt.robots.files.notes import Notes
from gaitopt.viewing.colours import LEG_COLOURS
from gaitopt.viewing.notebook import cards, pictures
from gaitopt.viewing.notebook.standing import standing_lines

EVIL = '<script>alert("x")</script>'


def svg_of(card: str) -> ElementTree.Element:
    found = re.search(r"<svg.*?</svg>", card, re.DOTALL)
    assert found is not None
    return ElementTree.fromstring(found.group())


def dots(svg: ElementTree.Element, colour: str) -> list[tuple[float, float]]:
    return [
        (float(each.attrib["cx"]), float(each.attrib["cy"]))
        for each in svg.iter("{http://www.w3.org/2000/svg}circle")
        if each.attrib["fill"] == colour
    ]


def test_a_plan_shows_its_footholds_where_they_are(short_plan: Plan) -> None:
    card = cards.plan_card(short_plan)
    svg = svg_of(card)
    for leg, colour in LEG_COLOURS.items():
        drawn, true = np.array(dots(svg, colour)), short_plan.footholds[leg][:, :2]
        assert len(drawn) == len(true)
        # The same shape: one scale, y upwards.
        motion = short_plan.knots()
        along = np.concatenate([motion.feet[..., 0].ravel(), motion.cog[:, 0]])
        scale = float(svg.attrib["width"]) / np.ptp(along)
        ratio = np.diff(drawn, axis=0) / (np.diff(true, axis=0) * [1.0, -1.0])
        assert np.nanmax(np.abs(ratio / ratio.flat[0] - 1.0)) < 0.05
        assert 0.5 * scale < ratio.flat[0] <= scale
    for words in ("wang2020", f"{short_plan.duration:.2f} s", "steps", "joint limits only"):
        assert words in card


def test_a_standing_robot_has_its_feet_on_the_ground(wang: Quadruped) -> None:
    trunk, legs = standing_lines(wang)
    height = trunk[0, 2] - np.array([line[-1, 2] for line in legs.values()])
    assert height == pytest.approx(np.full(4, wang.standing_height), abs=1e-6)
    assert [len(line) for line in legs.values()] == [4, 4, 4, 4]
    for words in ("25 kg", "LF_HFE", "75 N m", "balls of 15 mm"):
        assert words in cards.robot_card(wang)


def test_light_is_high_on_a_map_of_the_ground() -> None:
    import base64
    from io import BytesIO

    from PIL import Image

    z = np.zeros((40, 30))
    z[30:, :] = 0.2
    z[:3, :3] = np.nan
    ground = gaitopt.HeightMap(z, 0.02, (0.0, 0.0))
    card = cards.ground_card(ground)
    url = re.search(r"base64,([^\"]+)", card)
    assert url is not None
    grey = np.array(Image.open(BytesIO(base64.b64decode(url.group(1)))))
    # The image has x to the right and y upwards.
    assert grey.shape == (30, 40)
    assert grey[10, 35] > grey[10, 20] and grey[-1, 0] == 255


def test_names_of_files_are_escaped(short_plan: Plan) -> None:
    robot = dataclasses.replace(short_plan.robot, name=EVIL)
    plan = dataclasses.replace(short_plan, robot=robot)
    certificate = gaitopt.verify(plan, collisions=False)
    for text in (cards.plan_card(plan), cards.robot_card(robot), certificate._repr_html_()):
        assert "<script" not in text and "&lt;script&gt;" in text


def test_a_certificate_shows_verdicts_in_colours_and_words(short_plan: Plan) -> None:
    text = gaitopt.verify(short_plan, collisions=False)._repr_html_()
    assert re.search(r"color:#1b7f4b\"><b>ok</b>", text)
    assert "slip of standing feet" in text and "kinematics only" in text


def test_pictures_of_long_walks_stay_small() -> None:
    many = gaitopt.s_columns(0, columns=300, forward=40.0)
    assert len(pictures.footholds_picture(many)) < 100_000


@pytest.mark.parametrize(
    "value", ["plan", "robot", "footholds", "certificate", "leg", "path", "notes"]
)
def test_what_is_printed_fits_into_a_line(short_plan: Plan, value: str) -> None:
    shown: dict[str, Any] = {
        "plan": short_plan, "robot": short_plan.robot, "footholds": short_plan.footholds,
        "certificate": gaitopt.verify(short_plan, collisions=False),
        "leg": short_plan.robot.legs["LF"], "path": short_plan.path,
        "notes": short_plan.robot.notes,
    }  # fmt: skip
    for each in (shown[value], *short_plan.phases[:2], short_plan.swings[0], short_plan.knots()):
        assert len(repr(each)) < 120 and "\n" not in repr(each)


def test_a_certificate_counts_the_checks_that_are_needed(short_plan: Plan) -> None:
    found = gaitopt.verify(short_plan, collisions=False)
    needed = [check for check in found.checks if check.promised]
    kept = sum(check.status == "ok" for check in needed)
    assert len(needed) < len(found.checks)
    assert f"{found.outcome}, {kept} of {len(needed)} checks hold" in repr(found)


def test_notes_of_a_robot_print_as_lines() -> None:
    notes = Notes("xacro", done=("feet: radius 22 mm",), warnings=("no masses; give masses=",))
    assert str(notes).splitlines() == [
        "read as xacro", "feet: radius 22 mm", "warning: no masses; give masses="]  # fmt: skip
    assert repr(notes) == "Notes('xacro', guesses: 1, warnings: 1)"


def test_robots_are_equal_where_their_files_are(wang: Quadruped) -> None:
    again = gaitopt.load_robot("wang2020")
    assert again == wang and hash(again) == hash(wang)
    assert again != gaitopt.load_robot("wang2020-fast")
    assert again != gaitopt.load_robot("wang2020", velocity_limits=0.2)
    again.model.velocityLimit[8] *= 2.0
    assert again != wang
    assert wang != "wang2020"


def test_ipython_shows_cards() -> None:
    """In a process of its own: IPython is asked what it shows of each object."""
    code = (
        "from IPython.core.interactiveshell import InteractiveShell\n"
        "shell = InteractiveShell.instance()\n"
        "import gaitopt\n"
        "robot = gaitopt.load_robot('wang2020')\n"
        "columns = gaitopt.s_columns(0, columns=2)\n"
        "flat = gaitopt.make_ground('flat', robot=robot)\n"
        "plan = gaitopt.plan_crawl(robot, columns, timing='velocity')\n"
        "for each in (robot, columns, flat, plan, gaitopt.verify(plan, collisions=False)):\n"
        "    shown, _ = shell.display_formatter.format(each)\n"
        "    print(type(each).__name__, shown['text/html'].count('<table'))\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True,
                          timeout=600, check=False)  # fmt: skip
    assert done.stdout.split("\n")[:-1] == [
        f"{name} 1" for name in ("Quadruped", "Footholds", "HeightMap", "Plan", "Certificate")
    ], done.stderr
