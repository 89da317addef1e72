"""The explorer as people use it: in a browser, with the mouse and with keys.

Voila shows the notebook with its sliders as a page, with a kernel behind it.
"""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from in_browser import Driven, needs_browser

from gaitopt.viewing.replay.video.chromium import chromium

pytestmark = needs_browser

SIZE = (1100, 1000)
PATIENCE = 600.0
"""Seconds after which a page or a server that says nothing is given up, on a loaded machine too."""
SHOWN = "document.body !== null"
CODE = """import numpy as np, gaitopt
z = np.zeros((70, 50)); z[30:] = 0.03
ground = gaitopt.HeightMap(z, 0.02, (-0.5, -0.5))
gaitopt.explore(gaitopt.load_robot("go2"), ground, (0.3, 0.0), start=(0.0, 0.0, 0.0),
                width=1, width_limit=1)
"""


@pytest.fixture(scope="module")
def explorer(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Driven]:
    """A notebook with the explorer, on a server that only this machine reaches."""
    pytest.importorskip("voila", reason="needs pip install voila")
    folder = tmp_path_factory.mktemp("explorer")
    cell = {"cell_type": "code", "execution_count": None, "id": "a", "metadata": {}, "outputs": [],
            "source": CODE}  # fmt: skip
    kernel = {"name": "python3", "display_name": "Python 3", "language": "python"}
    book: dict[str, Any] = {"cells": [cell], "metadata": {"kernelspec": kernel}, "nbformat": 4,
                            "nbformat_minor": 5}  # fmt: skip
    (folder / "explorer.ipynb").write_text(json.dumps(book), "utf-8")
    # Of its own, so that nothing is written into the home of whoever runs the tests.
    env = {**os.environ, "JUPYTER_DATA_DIR": str(folder), "JUPYTER_CONFIG_DIR": str(folder)}
    with (folder / "log.txt").open("w") as log:
        server = subprocess.Popen(
            [sys.executable, "-m", "voila", str(folder / "explorer.ipynb"), "--no-browser",
             "--Voila.ip=127.0.0.1", "--Voila.log_level=INFO"], stdout=log, stderr=log, env=env,
        )  # fmt: skip
        try:
            address = _address(folder / "log.txt")
            with chromium() as browser:
                browser.open(address, SIZE, ready=SHOWN)
                page = Driven(browser)
                until(page, "all checks hold")
                yield page
        finally:
            server.terminate()
            server.wait(PATIENCE)


def _address(log: Path) -> str:
    """Where the server answers: it takes another port where one is in use."""
    end = time.monotonic() + PATIENCE
    while time.monotonic() < end:
        told = re.search(r"is running at:\s+(http://127\.0\.0\.1:\d+/)", log.read_text("utf-8"))
        if told:
            return told[1]
        time.sleep(0.2)
    raise AssertionError("the server did not start")


def text(page: Driven) -> str:
    return str(page.value("document.body.innerText"))


def handle(name: str) -> str:
    """The knob of the slider with a name."""
    return ("[...document.querySelectorAll('.widget-slider')].find(e => e.innerText.includes("
            f"{json.dumps(name)})).querySelector('.noUi-handle')")  # fmt: skip


def slide(page: Driven, name: str, share: float) -> None:
    """Click at a share of a slider's length until it stands elsewhere than before.

    The slider still moves for a moment after a click, and may not take another one then.
    """
    target = f"{handle(name)}.closest('.noUi-target').getBoundingClientRect().toJSON()"
    standing = f"{handle(name)}.getAttribute('aria-valuenow')"
    before, end = page.value(standing), time.monotonic() + PATIENCE
    while page.value(standing) == before:
        assert time.monotonic() < end, text(page)
        place = page.value(target)
        page.click(place["left"] + share * place["width"], place["top"] + place["height"] / 2.0)
        time.sleep(1.0)


def until(page: Driven, words: str) -> None:
    end = time.monotonic() + PATIENCE
    while words not in text(page):
        assert time.monotonic() < end, text(page)
        time.sleep(0.2)


def test_keys_move_the_goal_and_the_walk_is_shown_at_once(explorer: Driven) -> None:
    assert "go2" in text(explorer) and explorer.value("document.querySelectorAll('svg').length") > 0
    explorer.value(f"{handle('goal x')}.focus()")
    explorer.press("ArrowLeft")
    until(explorer, "0.250")
    until(explorer, "distance\t0.2")
    assert "all checks hold" in text(explorer)


def test_a_click_that_asks_for_too_much_says_why(explorer: Driven) -> None:
    # The far end of the slider is the edge of the map, where no foot can stand beyond the goal.
    slide(explorer, "goal x", 0.99)
    until(explorer, "no walk:")
    slide(explorer, "goal x", 0.55)
    until(explorer, "all checks hold")


def test_a_menu_plans_in_another_way(explorer: Driven) -> None:
    before = duration(explorer)
    explorer.value("document.querySelector('select').focus()")
    explorer.press("l")
    chosen = explorer.value("document.querySelector('select').selectedOptions[0].textContent")
    assert chosen.replace("\xa0", " ") == "largest margin"
    end = time.monotonic() + PATIENCE
    while duration(explorer) == before:
        assert time.monotonic() < end, text(explorer)
        time.sleep(0.2)
    assert "no walk:" not in text(explorer)


def duration(page: Driven) -> str:
    return text(page).split("duration\t")[1].split("\n")[0]
