"""A process that reads the robot's shapes and draws a run's figures while this one plans.

It is started before the plan is made, and imports meanwhile what takes long: yourdfpy, with trimesh
and scipy, and Matplotlib. Functions and arguments go to it, and what they return comes back, as
pickles through pipes of its own. It hears no Ctrl-C: it is ended with the command, and ends by
itself when its pipe is closed.
"""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
import warnings
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import partial
from queue import SimpleQueue
from threading import Thread
from typing import Any, Final

from gaitopt.errors import GaitoptError, RobotWarning

_LENGTH: Final = 8
"""Bytes that tell how long the pickle after them is."""
_CODE: Final = (
    "import sys; sys.path[:] = {path!r}; from gaitopt.cli.results.beside import serve; serve()"
)

_running: list[subprocess.Popen[bytes]] = []


@dataclass(eq=False)
class _Answer:
    """What the process says to one thing that it was asked for.

    Attributes:
        work, arguments: the function, and what it is called with.
        known: whether the answer has come.
        value: what the function returned, or the error that it raised.
        good: whether it returned.
    """

    work: Callable[..., Any]
    arguments: tuple[Any, ...]
    known: bool = False
    value: Any = None
    good: bool = True


class Beside:
    """A process beside this one, which does one thing after the other."""

    def __init__(self) -> None:
        self._process = subprocess.Popen(
            [sys.executable, "-c", _CODE.format(path=sys.path)],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, start_new_session=True,
        )  # fmt: skip
        _running.append(self._process)
        self._waiting: deque[_Answer] = deque()
        # A pipe takes little before it is read: this process must not wait for that one's imports.
        self._outbox: SimpleQueue[bytes] = SimpleQueue()
        self._sender = Thread(target=self._send, daemon=True)
        self._sender.start()

    def begin(self, work: Callable[..., Any], *arguments: Any) -> Callable[[], Any]:
        """Let the process call a function; the value returns what that one does, and waits for it.

        Where the process is lost, the function is called in this one.
        """
        answer = _Answer(work, arguments)
        self._waiting.append(answer)
        self._outbox.put(pickle.dumps((work, arguments)))
        return partial(self._value, answer)

    def _value(self, answer: _Answer) -> Any:
        """What a function returned, or the error that it raised."""
        while self._waiting and not answer.known:
            self._receive()
        if not answer.known:
            return answer.work(*answer.arguments)
        if answer.good:
            return answer.value
        raise answer.value

    def _receive(self) -> None:
        """Wait for the next answer, which is that to the oldest question."""
        assert self._process.stdout is not None
        answer = self._waiting.popleft()
        try:
            answer.good, answer.value = _received(self._process.stdout)
        except (EOFError, OSError, pickle.UnpicklingError):
            self._waiting.clear()
        else:
            answer.known = True

    def _send(self) -> None:
        """Send what is put into the outbox, until that is nothing, or the process is lost."""
        assert self._process.stdin is not None
        while data := self._outbox.get():
            try:
                self._process.stdin.write(len(data).to_bytes(_LENGTH, "little") + data)
                self._process.stdin.flush()
            except OSError:
                return

    def close(self) -> None:
        """End the process."""
        self._process.kill()
        self._outbox.put(b"")
        self._sender.join()
        for pipe in filter(None, (self._process.stdin, self._process.stdout)):
            # What was not sent goes with the process.
            with suppress(OSError):
                pipe.close()
        self._process.wait()
        if self._process in _running:
            _running.remove(self._process)


@contextmanager
def beside(wanted: bool) -> Iterator[Beside | None]:
    """A process beside this one, which ends with the block; ``None`` where no core is left for it.

    Args:
        wanted: whether there is something to do for it.
    """
    if not wanted or _cores() < 2:
        yield None
        return
    process = Beside()
    try:
        yield process
    finally:
        process.close()


def prepare_figures() -> None:
    """Import what figures need, before there is a plan to draw."""
    from matplotlib.backends import backend_agg  # noqa: F401
    from matplotlib.figure import Figure  # noqa: F401

    import gaitopt.viewing.figures.crawl_figures  # noqa: F401


def end_beside() -> None:
    """End all these processes; nothing is imported, as the program may be ending."""
    for process in _running:
        process.kill()


def serve() -> None:
    """The process: calls one function after the other, until its pipe is closed."""
    # The command has told what is to be said of the robot.
    warnings.simplefilter("ignore", RobotWarning)
    # What libraries print must not come between the pickles.
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    while True:
        try:
            work, arguments = _received(sys.stdin.buffer)
        except EOFError:
            return
        try:
            answer = (True, work(*arguments))
        except GaitoptError as error:
            answer = (False, error)
        data = pickle.dumps(answer)
        answers.write(len(data).to_bytes(_LENGTH, "little") + data)
        answers.flush()


def _received(pipe: Any) -> Any:
    """The next pickle out of a pipe.

    Raises:
        EOFError: the pipe was closed, so that there is nothing to unpickle.
        pickle.UnpicklingError: it was closed in the middle.
    """
    head = pipe.read(_LENGTH)
    data = pipe.read(int.from_bytes(head, "little")) if len(head) == _LENGTH else b""
    return pickle.loads(data)


def _cores() -> int:
    """Cores on which this process may run."""
    affinity = getattr(os, "sched_getaffinity", None)
    return len(affinity(0)) if affinity is not None else os.cpu_count() or 1
