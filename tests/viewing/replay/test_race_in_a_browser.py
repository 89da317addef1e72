"""The race as people use it: keys, fingers, other windows, and eyes that see fewer colours."""

from __future__ import annotations

from collections.abc import Iterator
from io import BytesIO

import numpy as np
import pytest
from in_browser import Driven, driven, needs_browser

import gaitopt
from gaitopt import Plan
from gaitopt.viewing.replay.race import race_html

pytestmark = needs_browser
DESK = (1000, 600)
TIME = "window.gaitopt.state.time"
LABELS = ("[...document.querySelectorAll('.label:not(.foot):not([hidden])')]"
          ".map((e) => e.textContent)")  # fmt: skip


@pytest.fixture(scope="module")
def plans(wang: gaitopt.Quadruped) -> dict[str, Plan]:
    columns = gaitopt.s_columns(0, columns=2)
    options = {"timing": "velocity"}
    return {
        "the paper": gaitopt.plan_crawl(wang, columns, **options),
        "height": gaitopt.plan_crawl(wang, columns, objective="time", free="height", **options),
    }


@pytest.fixture(scope="module")
def desk(plans: dict[str, Plan], tmp_path_factory: pytest.TempPathFactory) -> Iterator[Driven]:
    folder = tmp_path_factory.mktemp("race")
    yield from driven(race_html(plans), folder, "paused&t=1&no-shadows", DESK)


def test_keys_go_through_the_race_and_labels_tell_the_standings(
    plans: dict[str, Plan], desk: Driven
) -> None:
    desk.press("End")
    longest = max(plan.duration for plan in plans.values())
    assert desk.value(TIME) == pytest.approx(longest, abs=1e-3)
    shown = " ".join(desk.value(LABELS))
    fast = plans["height"].duration
    assert f"{longest:.1f}" in shown and f"{longest / fast:.2f}" in shown
    desk.press("Home")
    assert desk.value(TIME) == 0.0 and "0 of 4 steps" in " ".join(desk.value(LABELS))
    desk.press(" ")
    assert desk.value("window.gaitopt.state.playing")
    desk.press(" ")
    assert not desk.value("window.gaitopt.state.playing")
    desk.press("?")
    assert desk.box("#help")["width"] > 100.0
    desk.press("Escape")
    assert desk.value("document.getElementById('help').hidden")
    assert desk.problems == []


def test_a_click_on_the_bar_goes_to_its_time(plans: dict[str, Plan], desk: Driven) -> None:
    box = desk.box("#strip")
    desk.click(box["left"] + 0.5 * box["width"], box["top"] + box["height"] / 2.0)
    longest = max(plan.duration for plan in plans.values())
    assert desk.value(TIME) == pytest.approx(0.5 * longest, abs=0.02 * longest)


@pytest.mark.parametrize("size", [(420, 800), (736, 420), (1600, 900)])
def test_it_fits_every_window(desk: Driven, size: tuple[int, int]) -> None:
    desk.browser.resize(size)
    for name in ("#bar", "#play", "#speed", "#view", "#follow", "#home", "#ask"):
        box = desk.box(name)
        assert box["left"] >= 0.0 and box["right"] <= size[0], name
        assert box["top"] >= 0.0 and box["bottom"] <= size[1], name
    assert desk.value("document.documentElement.scrollWidth") <= size[0]
    desk.browser.resize(DESK)


def test_fingers_turn_the_view(desk: Driven) -> None:
    desk.browser.resize(DESK, touch=True)
    eye = "window.gaitopt.viewer.camera.position.toArray()"
    before = desk.value(eye)
    desk.drag((500.0, 200.0), (600.0, 220.0))
    assert np.linalg.norm(np.subtract(desk.value(eye), before)) > 0.05
    desk.browser.resize(DESK)


@pytest.mark.parametrize("vision", ["protanopia", "deuteranopia", "tritanopia"])
def test_lanes_differ_as_the_colour_blind_see_them(desk: Driven, vision: str) -> None:
    """Chromium's own simulation, on the parts of the bar: one for each who arrives."""
    from matplotlib.image import imread

    desk.browser.call("Emulation.setEmulatedVisionDeficiency", type=vision)
    box = desk.box("#strip")
    image = np.asarray(imread(BytesIO(desk.browser.picture()))[..., :3])
    desk.browser.call("Emulation.setEmulatedVisionDeficiency", type="none")
    row = image[round(box["top"]) + 3, round(box["left"]) + 4 : round(box["right"]) - 4]
    assert np.linalg.norm(row[0] - row[-1]) > 0.2, vision
