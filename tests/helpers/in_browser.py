"""Pages in a browser without a window, for tests; skipped where there is none."""

from __future__ import annotations

import json
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from gaitopt.viewing.replay.video import chromium as module
from gaitopt.viewing.replay.video.chromium import NAMES, Chromium, chromium

module.PATIENCE = 600.0  # A machine that does much else draws slowly: that is no fault.
HAS_BROWSER = any(shutil.which(name) for name in NAMES)
needs_browser = pytest.mark.skipif(not HAS_BROWSER, reason="no Chromium on the PATH")

WATCH = """<script>
window.problems = [];
for (const name of ["error", "warn"]) {
  const old = console[name];
  console[name] = (...a) => { window.problems.push(name + ": " + a.join(" ")); old(...a); };
}
window.addEventListener("error", (e) => window.problems.push(String(e.message)));
document.addEventListener("securitypolicyviolation",
  (e) => window.problems.push("blocked: " + e.blockedURI + " " + e.violatedDirective));
</script>"""
"""Keeps what goes wrong in a page."""

CODES = {"ArrowLeft": 37, "ArrowRight": 39, "Escape": 27, " ": 32, "Home": 36, "End": 35}


class Driven:
    """A page that is used as people use it: keys, clicks, fingers."""

    def __init__(self, browser: Chromium) -> None:
        self.browser = browser

    def value(self, script: str) -> Any:
        """An expression's value, once the page has drawn what was asked for."""
        return self.browser.run(
            "new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => "
            f"done({script}))))"
        )

    def press(self, key: str) -> None:
        """Press and release a key."""
        text = {"text": key} if len(key) == 1 else {}
        code = CODES.get(key, ord(key.upper()) if len(key) == 1 else 0)
        for kind in ("keyDown", "keyUp"):
            more = text if kind == "keyDown" else {}
            self.browser.call("Input.dispatchKeyEvent", type=kind, key=key,
                              windowsVirtualKeyCode=code, **more)  # fmt: skip

    def click(self, x: float, y: float) -> None:
        """Click somewhere in the window [pixels]."""
        for kind in ("mousePressed", "mouseReleased"):
            self.browser.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left",
                              clickCount=1)  # fmt: skip

    def drag(self, start: tuple[float, float], end: tuple[float, float]) -> None:
        """Draw a finger along a line."""
        point = [{"x": start[0], "y": start[1]}]
        self.browser.call("Input.dispatchTouchEvent", type="touchStart", touchPoints=point)
        (x0, y0), (x1, y1) = start, end
        for part in (0.25, 0.5, 0.75, 1.0):
            point = [{"x": x0 + part * (x1 - x0), "y": y0 + part * (y1 - y0)}]
            self.browser.call("Input.dispatchTouchEvent", type="touchMove", touchPoints=point)
        self.browser.call("Input.dispatchTouchEvent", type="touchEnd", touchPoints=[])

    def box(self, selector: str) -> dict[str, float]:
        """Where an element is: left, top, right, bottom, width, height [pixels]."""
        found = self.value(f"document.querySelector({json.dumps(selector)}).getBoundingClientRect()"
                           ".toJSON()")  # fmt: skip
        return dict(found)

    @property
    def problems(self) -> list[str]:
        """What the page complained of."""
        return [p for p in self.value("window.problems") if "GL Driver" not in p]


def driven(
    page: str, folder: Path, hash_: str, size: tuple[int, int], *, touch: bool = False
) -> Iterator[Driven]:
    """A page's text in a browser, which is ended afterwards."""
    file = folder / "driven.html"
    file.write_text(page.replace("<body>", "<body>" + WATCH), "utf-8")
    with chromium() as browser:
        browser.open(f"{file.as_uri()}#{hash_}", size, touch=touch)
        yield Driven(browser)
