"""A lock on a table: two studies that append to one table at the same time are refused."""

from __future__ import annotations

import os
import socket
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from importlib.util import find_spec
from pathlib import Path

from gaitopt.errors import InputError
from gaitopt.files import what_no_file_is

MOST_READ = 200
"""Most letters that are read of the words about a lock's holder."""


@contextmanager
def locked(table: Path) -> Iterator[None]:
    """Hold the lock of a table inside the block.

    The lock is that of the operating system on a file beside the table, ``.NAME.lock``, so it ends
    with the process that holds it, whatever ends this process: a file that is left over locks
    nothing. The file tells who holds the lock.

    Raises:
        InputError: another process holds the lock; the message tells which. Or the file cannot be
            made.
    """
    if find_spec("fcntl") is None:  # not POSIX
        yield
        return
    path = table.with_name(f".{table.name}.lock")
    handle = _held(path, table)
    try:
        with suppress(OSError):  # On a full disk the lock holds all the same.
            os.ftruncate(handle, 0)
            os.write(handle, _myself().encode())
        yield
    finally:
        # Only its holder removes the file, and while it still holds the lock.
        path.unlink(missing_ok=True)
        os.close(handle)


def _held(path: Path, table: Path) -> int:
    """The open file of a lock that is held now."""
    import fcntl

    while True:
        handle = _open(path, table)
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            holder = _holder(handle)
            os.close(handle)
            raise InputError(
                f"another study writes to {table}: {holder}; wait until it ends, stop it, or name "
                "another table"
            ) from None
        except OSError:
            return handle  # A file system without locks: it is up to the user.
        with suppress(OSError):
            if path.stat().st_ino == os.fstat(handle).st_ino:
                return handle
        os.close(handle)  # Its last holder has just removed it.


def _open(path: Path, table: Path) -> int:
    """Open the file of a lock."""
    special = what_no_file_is(path)
    if special:
        raise InputError(f"cannot lock the table {table}: {path} is {special}; remove it")
    try:
        return os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o666)
    except OSError as error:
        raise InputError(
            f"cannot write the table {table}: {error.strerror or error}; give a path in a folder "
            "that exists and that you may write to"
        ) from error


def _myself() -> str:
    since = time.strftime("%Y-%m-%d %H:%M:%S")
    return f"process {os.getpid()} on {socket.gethostname()}, since {since}"


def _holder(handle: int) -> str:
    """Who holds a lock, in its own words."""
    try:
        words = os.pread(handle, MOST_READ, 0).decode("utf-8", "replace")
    except OSError:
        words = ""
    return " ".join(w for w in words.split() if w.isprintable()) or "a process that left no name"
