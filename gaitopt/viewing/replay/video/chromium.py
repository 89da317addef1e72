"""A Chromium without a window, driven through its DevTools protocol over two pipes.

Pipes instead of the usual socket: nobody else on this machine can reach the browser, and no package
is needed.
"""

from __future__ import annotations

import json
import os
import select
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final

from gaitopt.errors import MissingPackageError, SolverError

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome",
         "microsoft-edge")  # fmt: skip
"""Programs that are looked for on the PATH."""
FLAGS = (
    "--headless", "--no-sandbox", "--enable-unsafe-swiftshader", "--use-angle=swiftshader",
    "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-sync", "--hide-scrollbars",
    "--disable-background-networking", "--disable-component-update", "--mute-audio",
)  # fmt: skip
"""Of a browser that draws without a graphics card and asks nothing of the network. The page that is
opened is our own and may load nothing (its content security policy), so it needs no sandbox, which
root and many containers do not have."""
SEND, RECEIVE = 3, 4
"""The browser reads commands from this file, and writes answers to that one."""
STARTER = """
import os, sys
r, w = int(sys.argv[1]), int(sys.argv[2])
a, b = os.dup(r), os.dup(w)
while a in (3, 4) or b in (3, 4):
    a, b = os.dup(a), os.dup(b)
os.dup2(a, 3); os.dup2(b, 4)
os.execv(sys.argv[3], sys.argv[3:])
"""
"""Gives the two pipes the numbers that Chromium expects, and becomes Chromium."""
PATIENCE = 60.0
"""Longest wait for an answer [s]: a page of a long walk takes some seconds to load."""


def find_browser() -> str:
    """The path of a Chromium.

    Raises:
        MissingPackageError: there is none on the PATH.
    """
    for name in NAMES:
        found = shutil.which(name)
        if found is not None:
            return found
    raise MissingPackageError(
        "no Chromium or Chrome on the PATH to draw the video: install one ('apt install chromium')"
    )


READY: Final = "document.body !== null && document.body.dataset.ready === 'yes'"
"""What a replay sets when it is drawn."""


class Chromium:
    """A running browser with one page."""

    def __init__(self, process: subprocess.Popen[bytes], send: int, receive: int) -> None:
        self._process, self._send, self._receive = process, send, receive
        self._number, self._buffer, self._session = 0, b"", ""

    def open(
        self, address: str, size: tuple[int, int], *, touch: bool = False, ready: str = READY
    ) -> None:
        """Open a page in a window of ``size`` [pixels], and wait until it is ready.

        With ``touch`` it is that of a telephone. ``ready`` is an expression of JavaScript that is
        true when the page is ready; by default what replays say of themselves.
        """
        target = self.call("Target.createTarget", url="about:blank")["targetId"]
        session = self.call("Target.attachToTarget", targetId=target, flatten=True)
        self._session = str(session["sessionId"])
        self.call("Page.enable")
        self.resize(size, touch=touch)
        self.call("Page.navigate", url=address)
        end = time.monotonic() + PATIENCE
        while self.run(ready) is not True:
            if time.monotonic() > end:
                raise SolverError(f"the browser did not draw the page within {PATIENCE:.0f} s")
            time.sleep(0.05)

    def resize(self, size: tuple[int, int], *, touch: bool = False) -> None:
        """Give the window another size [pixels]."""
        self.call("Emulation.setDeviceMetricsOverride", width=size[0], height=size[1],
                  deviceScaleFactor=1, mobile=touch)  # fmt: skip
        self.call("Emulation.setTouchEmulationEnabled", enabled=touch, maxTouchPoints=2)

    def run(self, script: str) -> Any:
        """The value of an expression of JavaScript in the page.

        Raises:
            SolverError: it throws an error.
        """
        found = self.call("Runtime.evaluate", expression=script, returnByValue=True,
                          awaitPromise=True)  # fmt: skip
        if "exceptionDetails" in found:
            raise SolverError(f"the page's script failed: {found['exceptionDetails']}")
        return found["result"].get("value")

    def picture(self) -> bytes:
        """The page as it is drawn now, as a PNG file."""
        import base64

        return base64.b64decode(self.call("Page.captureScreenshot", format="png")["data"])

    def call(self, method: str, **values: Any) -> dict[str, Any]:
        """Call a method of the DevTools protocol and wait for its answer.

        Raises:
            SolverError: the browser refuses, has ended, or does not answer.
        """
        self._number += 1
        message: dict[str, Any] = {"id": self._number, "method": method, "params": values}
        if self._session:
            message["sessionId"] = self._session
        try:
            os.write(self._send, json.dumps(message).encode() + b"\0")
        except OSError as error:
            raise SolverError(f"the browser has ended: {error}") from error
        end = time.monotonic() + PATIENCE
        while True:
            answer = self._read(end)
            if answer.get("id") == self._number:
                if "error" in answer:
                    raise SolverError(f"the browser refuses {method}: {answer['error']}")
                return dict(answer["result"])

    def _read(self, end: float) -> dict[str, Any]:
        """The next message of the browser."""
        while b"\0" not in self._buffer:
            ready, _, _ = select.select([self._receive], [], [], max(end - time.monotonic(), 0.0))
            data = os.read(self._receive, 1 << 20) if ready else b""
            if not data:
                raise SolverError("the browser has ended, or does not answer")
            self._buffer += data
        text, _, self._buffer = self._buffer.partition(b"\0")
        return dict(json.loads(text))

    def end(self) -> None:
        """End the browser."""
        self._session = ""
        try:
            self.call("Browser.close")
            self._process.wait(10.0)
        except (SolverError, subprocess.TimeoutExpired):
            self._process.kill()
            self._process.wait()
        os.close(self._send)
        os.close(self._receive)


@contextmanager
def chromium() -> Iterator[Chromium]:
    """A browser, which is ended afterwards.

    Raises:
        MissingPackageError: there is no Chromium on the PATH, or this is no POSIX system.
        SolverError: it does not start.
    """
    browser = find_browser()
    if os.name != "posix":
        raise MissingPackageError("videos are drawn on Linux and macOS only: record the screen")
    theirs_in, ours_out = os.pipe()
    ours_in, theirs_out = os.pipe()
    with tempfile.TemporaryDirectory(prefix="gaitopt-", ignore_cleanup_errors=True) as folder:
        process = subprocess.Popen(
            [sys.executable, "-c", STARTER, str(theirs_in), str(theirs_out), browser, *FLAGS,
             "--remote-debugging-pipe", f"--user-data-dir={Path(folder) / 'profile'}"],
            pass_fds=(theirs_in, theirs_out), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        )  # fmt: skip
        os.close(theirs_in)
        os.close(theirs_out)
        driven = Chromium(process, ours_out, ours_in)
        try:
            yield driven
        finally:
            driven.end()
