"""Worker processes of studies: not more than cores, and gone when a study ends before its time."""

from __future__ import annotations

import os
import signal
import sys
import threading
import time
import warnings
from collections.abc import Callable, Generator, Iterable, Iterator
from contextlib import contextmanager
from typing import Any

from gaitopt.errors import InputError, StudyError
from gaitopt.inputs import as_text, check_count

LOOK_EVERY = 1.0
"""Time between two looks of a worker for the program that started it [s]. Chosen here."""

_watched: list[int] = []


def process_count(jobs: int) -> int:
    """How many processes to start: -1 for one on each core, and never more than cores.

    Raises:
        InputError: it is 0, below -1, or no whole number.
    """
    from joblib import cpu_count

    if isinstance(jobs, int) and jobs == -1:
        return int(cpu_count())
    try:
        return min(check_count("jobs", jobs, 1, sys.maxsize), int(cpu_count()))
    except InputError:
        raise InputError(
            "jobs must be -1, for one process on each core, or a whole number from 1, got "
            f"{as_text(jobs)}"
        ) from None


def on_all_cores(
    work: Callable[..., Any], arguments: Iterable[tuple[Any, ...]], jobs: int
) -> Generator[Any, None, None]:
    """Results of a function for many arguments, in any order, from worker processes.

    Args:
        work: the function.
        arguments: of each call.
        jobs: number of processes, as for :func:`process_count`; one works in this process.

    Raises:
        InputError: ``jobs`` is no number of processes.
        StudyError: a worker process was ended from outside.
    """
    from multiprocessing import resource_tracker

    from joblib import Parallel, delayed
    from joblib.externals.loky.backend.resource_tracker import ensure_running
    from joblib.externals.loky.process_executor import BrokenProcessPool

    parallel = Parallel(n_jobs=process_count(jobs), return_as="generator_unordered", batch_size=1)
    # A study that is stopped says so itself.
    warnings.filterwarnings("ignore", ".*tasks which were still being processed", UserWarning)
    with no_workers_left():
        with _deaf_children():
            # When they start, they let this thread, and so its children, hear Ctrl-C again.
            ensure_running()
            if os.name == "posix":
                resource_tracker.ensure_running()
        with _deaf_children():
            # Starts the processes; it does not wait for a result.
            results = parallel(delayed(_in_worker)(os.getpid(), work, each) for each in arguments)
        try:
            yield from results
        except BrokenProcessPool as error:
            raise StudyError(
                "a worker process was ended from outside; perhaps memory was short: give fewer "
                "processes (jobs)"
            ) from error


@contextmanager
def no_workers_left() -> Iterator[None]:
    """End the worker processes where the block ends with an error, or with Ctrl-C.

    joblib keeps workers for the next use, and they would outlive the program for minutes.
    """
    try:
        yield
    except BaseException:
        end_workers()
        raise


def end_workers() -> None:
    """End the worker processes of this program, if there are any.

    Nothing is imported: this may run while the program ends.
    """
    loky = sys.modules.get("joblib.externals.loky.reusable_executor")
    # Asking for the executor would start one.
    executor = None if loky is None else loky._executor
    if executor is not None:
        executor.shutdown(wait=False, kill_workers=True)


@contextmanager
def _deaf_children() -> Iterator[None]:
    """Processes that are started inside the block hear neither Ctrl-C nor a terminal that closes.

    Both reach all processes of a terminal. This program ends its workers by itself; they, and
    joblib's process that clears up, would only print what they were doing.
    """
    numbers = {getattr(signal, name) for name in ("SIGINT", "SIGHUP") if hasattr(signal, name)}
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, numbers)
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _in_worker(parent: int, work: Callable[..., Any], given: tuple[Any, ...]) -> Any:
    """Call a function in a worker process, which ends with the program that started it."""
    if os.getpid() != parent and not _watched:
        _watched.append(parent)
        # Libraries may have let this process hear Ctrl-C again.
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        threading.Thread(target=_end_with, args=(parent,), daemon=True).start()
    return work(*given)


def _end_with(parent: int) -> None:
    """End this process when its parent was ended, also by what no program can catch."""
    while os.getppid() == parent:
        time.sleep(LOOK_EVERY)
    os._exit(1)
