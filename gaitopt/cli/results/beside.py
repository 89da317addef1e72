"""A process that draws a run's figures while this one certifies the plan and writes its replay.

It is started before the plan is made, and imports Matplotlib meanwhile. Functions and arguments go
to it, and what they return comes back, as pickles through pipes of its own. It hears no Ctrl-C: it
is ended with the command, and ends by itself when its pipe is closed.
"""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import Any, Final

from gaitopt.errors import GaitoptError

_LENGTH: Final = 8
"""Bytes that tell how long the pickle after them is."""
_CODE: Final = (
    "import sys; sys.path[:] = {path!r}; from gaitopt.cli.results.beside import serve; serve()"
)

_running: list[subprocess.Popen[bytes]] = []


class Beside:
    """A process beside this one, which does one thing at a time."""

    def __init__(self) -> None:
        self._process = subprocess.Popen(
            [sys.executable, "-c", _CODE.format(path=sys.path)],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, start_new_session=True,
        )  # fmt: skip
        _running.append(self._process)

    def begin(self, work: Callable[..., Any], *arguments: Any) -> Callable[[], Any]:
        """Let the process call a function; the value returns what that one does, and waits for it.

        Where the process is lost, the function is called in this one.
        """
        assert self._process.stdin is not None
        data = pickle.dumps((work, arguments))
        try:
            self._process.stdin.write(len(data).to_bytes(_LENGTH, "little") + data)
            self._process.stdin.flush()
        except OSError:
            return lambda: work(*arguments)

        def finished() -> Any:
            assert self._process.stdout is not None
            try:
                told, value = _received(self._process.stdout)
            except (EOFError, OSError, pickle.UnpicklingError):
                return work(*arguments)
            if told:
                return value
            raise value

        return finished

    def close(self) -> None:
        """End the process."""
        self._process.kill()
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


def end_beside() -> None:
    """End all these processes; nothing is imported, as the program may be ending."""
    for process in _running:
        process.kill()


def serve() -> None:
    """The process: calls one function after the other, until its pipe is closed."""
    from matplotlib.backends import backend_agg  # noqa: F401
    from matplotlib.figure import Figure  # noqa: F401
    from scipy import interpolate  # noqa: F401

    import gaitopt.viewing.figures.crawl_figures  # noqa: F401

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
