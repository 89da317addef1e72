"""Worker processes of studies: gone when a study ends before its time."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager


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
