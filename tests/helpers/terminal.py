"""Commands in a terminal of 80 columns, and what is then on its screen.

The terminal is a real one for the command (a pty): it has a width, the command asks it whether
somebody looks, and Ctrl-C goes through it as from a keyboard. What the command writes is drawn as
a terminal draws it, so that tests see wrapped lines, and bars that are painted over.
"""

from __future__ import annotations

import contextlib
import fcntl
import os
import pty
import re
import select
import struct
import subprocess
import sys
import termios
import time
from dataclasses import dataclass, field
from pathlib import Path

COLUMNS, ROWS = 80, 50
LONGEST_CODE = 32
"""More letters than any code here has."""
CODE = re.compile(r"\x1b\[([?\d;]*)([A-Za-z])|\x1b\][^\x07]*\x07")


@dataclass
class Screen:
    """What is seen: all lines since the start, as if the terminal had no end."""

    lines: list[str] = field(default_factory=lambda: [""])
    row: int = 0
    column: int = 0
    wrapped: set[int] = field(default_factory=set)
    """Lines that go on in the next one because the terminal was too narrow."""
    pending: str = ""
    """The begin of a code whose end has not arrived."""

    def write(self, text: str) -> None:
        """Draw what a command writes."""
        text, self.pending, at = self.pending + text, "", 0
        while at < len(text):
            code = CODE.match(text, at)
            if code:
                self._obey(code[1] or "", code[2] or "")
                at = code.end()
                continue
            if text[at] == "\x1b" and len(text) - at < LONGEST_CODE:
                self.pending = text[at:]  # the rest of the code comes later
                return
            letter = text[at]
            at += 1
            if letter == "\r":
                self.column = 0
            elif letter == "\n":
                self._down()
            elif letter >= " ":
                self._put(letter)

    def _down(self) -> None:
        self.row += 1
        while len(self.lines) <= self.row:
            self.lines.append("")

    def _put(self, letter: str) -> None:
        if self.column == COLUMNS:
            self.wrapped.add(self.row)
            self._down()
            self.column = 0
        line = self.lines[self.row].ljust(self.column)
        self.lines[self.row] = line[: self.column] + letter + line[self.column + 1 :]
        self.column += 1

    def _obey(self, values: str, name: str) -> None:
        number = int(values) if values.isdigit() else None
        if name == "A":
            self.row = max(self.row - (number or 1), 0)
        elif name == "K":
            line = self.lines[self.row]
            self.lines[self.row] = "" if number == 2 else line[: self.column]
            self.wrapped.discard(self.row)

    @property
    def text(self) -> str:
        """All lines, without what is empty at their ends."""
        return "\n".join(line.rstrip() for line in self.lines).strip("\n")

    @property
    def broken(self) -> list[str]:
        """Words that the end of a line cuts in two."""
        found = []
        for row in sorted(self.wrapped):
            before, after = self.lines[row], self.lines[row + 1]
            if before[-1:].strip() and after[:1].strip():
                found.append(before.split()[-1] + after.split()[0])
        return found


@dataclass
class Run:
    """A command that has ended: its exit code, and what is on the screen."""

    code: int
    screen: Screen


def in_terminal(
    arguments: list[str], folder: Path, *, stop_after: str | None = None, patience: float = 600.0
) -> Run:
    """Run gaitopt in a terminal.

    Args:
        arguments: of the command.
        folder: where it runs.
        stop_after: once this is on the screen, Ctrl-C is pressed.
        patience: longest time that it may take [s], on a machine that does much else, too.
    """
    ours, theirs = pty.openpty()
    fcntl.ioctl(theirs, termios.TIOCSWINSZ, struct.pack("HHHH", ROWS, COLUMNS, 0, 0))
    environment = {k: v for k, v in os.environ.items() if k not in ("COLUMNS", "LINES", "NO_COLOR")}
    process = subprocess.Popen(
        [sys.executable, "-m", "gaitopt", *arguments], stdin=theirs, stdout=theirs, stderr=theirs,
        cwd=folder, env={**environment, "TERM": "xterm-256color"}, close_fds=True,
        # The terminal is the command's own, so that Ctrl-C reaches it.
        preexec_fn=_own_terminal,
    )  # fmt: skip
    os.close(theirs)
    screen, rest, end = Screen(), b"", time.monotonic() + patience
    try:
        while True:
            assert time.monotonic() < end, screen.text
            ready, _, _ = select.select([ours], [], [], 0.2)
            data = b""
            if ready:
                with contextlib.suppress(OSError):  # Linux: the other side is closed
                    data = os.read(ours, 1 << 16)
                if not data:
                    break
            # A letter may arrive in two parts.
            rest += data
            text = rest.decode("utf-8", "ignore")
            rest = rest[len(text.encode()) :]
            screen.write(text)
            if stop_after is not None and stop_after in screen.text:
                os.write(ours, b"\x03")
                stop_after = None
        return Run(process.wait(patience), screen)
    finally:
        if process.poll() is None:
            process.kill()
            process.wait()
        os.close(ours)


def _own_terminal() -> None:
    """Make the terminal on standard input that of a new session."""
    os.setsid()
    fcntl.ioctl(0, termios.TIOCSCTTY, 0)
