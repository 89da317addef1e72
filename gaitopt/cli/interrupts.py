"""Ctrl-C: stops any command within a second, and leaves neither files nor processes behind.

Python turns Ctrl-C into an exception that runs where the program is. Libraries may swallow it, in
callbacks for instance. So a thread watches: where the program has not ended soon after the first
Ctrl-C, the thread ends it.
"""

from __future__ import annotations

import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Final

from gaitopt.files import remove_unfinished

PATIENCE: Final = 0.8
"""Time in which the program may end by itself [s]. Chosen: Ctrl-C works within a second."""
STOPPED: Final = 130
"""Exit code after Ctrl-C: 128 and the number of the signal, as shells have it."""
SIGNALS: Final = tuple(
    getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)
)
"""Signals that stop a command: Ctrl-C, ``kill``, and a terminal that was closed."""

_stopped = threading.Event()
_told = threading.Event()
_kept: list[Callable[[], str]] = []


@contextmanager
def keeping(words: Callable[[], str]) -> Iterator[None]:
    """Inside the block, say also what is kept when the program is stopped, and how to go on.

    Args:
        words: makes the sentence. It must need no import and no lock.
    """
    _kept.append(words)
    # An exception leaves the words: it may be that of Ctrl-C, which is told at the very end.
    yield
    _kept.clear()


def stop_on_signals() -> None:
    """From now on signals end the program in an orderly way, and soon in any case."""
    for number in SIGNALS:
        signal.signal(number, _stop)


def end_stopped() -> int:
    """Say that the program was stopped; the value is the exit code."""
    if not _told.is_set():
        _told.set()
        print(_farewell(), file=sys.stderr)
    # An exception out of exec(text), as dataclasses run it, lets Python end by the signal itself,
    # unless another text is run after it.
    exec("")
    return STOPPED


def was_stopped() -> bool:
    """Whether a signal came. Libraries may have turned its exception into another one."""
    return _stopped.is_set()


def _farewell() -> str:
    return "; ".join(["gaitopt: stopped", *(words() for words in _kept)])


def _stop(number: int, frame: FrameType | None) -> None:
    # Further signals are not needed, and would interrupt the clearing up.
    for each in SIGNALS:
        signal.signal(each, signal.SIG_IGN)
    _stopped.set()
    threading.Thread(target=_end_soon, daemon=True).start()
    signal.default_int_handler(number, frame)


def _end_soon() -> None:
    """End the program, once it had time to end by itself."""
    time.sleep(PATIENCE)
    # The program may be ending at this moment: nothing is imported, and no lock is asked for.
    workers = sys.modules.get("gaitopt.studies.workers")
    if workers is not None:
        workers.end_workers()
    beside = sys.modules.get("gaitopt.cli.results.beside")
    if beside is not None:
        beside.end_beside()
    processes = sys.modules.get("multiprocessing.process")
    for child in [] if processes is None else processes.active_children():
        child.terminate()
    remove_unfinished()
    if not _told.is_set():
        os.write(2, f"{_farewell()}\n".encode())
    os._exit(STOPPED)
