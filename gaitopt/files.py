"""Reading and writing files so that a bad or a broken one does no harm."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Any

from gaitopt.errors import GaitoptError, InputError

StrPath = str | os.PathLike[str]


@contextmanager
def written_whole(path: StrPath, *, binary: bool = False) -> Iterator[IO[Any]]:
    """Open a file that appears at ``path`` complete, or not at all.

    The content goes to a temporary file in the same folder, which replaces ``path`` when the
    block ends without an error.

    Raises:
        InputError: the folder does not exist or cannot be written to.
    """
    # Through a link, so that the link stays and its target is written.
    target = Path(os.path.realpath(path))
    try:
        handle, name = tempfile.mkstemp(prefix=f".{target.name}.", dir=target.parent)
    except OSError as error:
        raise InputError(
            f"cannot write {path}: {error.strerror or error}; give a path in a folder that "
            "exists and that you may write to"
        ) from error
    temporary = Path(name)
    try:
        opened = (
            os.fdopen(handle, "wb")
            if binary
            else os.fdopen(handle, "w", encoding="utf-8", newline="")
        )
        with opened as stream:
            yield stream
        temporary.chmod(0o666 & ~_umask())
        temporary.replace(target)
    except OSError as error:
        raise InputError(f"cannot write {path}: {error.strerror or error}") from error
    finally:
        temporary.unlink(missing_ok=True)


def _umask() -> int:
    mask = os.umask(0o077)
    os.umask(mask)
    return mask


@contextmanager
def silenced_stderr() -> Iterator[Callable[[], str]]:
    """Keep what C++ libraries print to stderr in the meantime; the value gives it as text.

    urdfdom reports errors there, on lines of its own, whatever the caller does with them.
    """
    try:
        before = os.dup(2)
    except OSError:  # No stderr at all, as in some programs without a terminal.
        yield lambda: ""
        return
    words: list[str] = []
    with tempfile.TemporaryFile() as kept:
        os.dup2(kept.fileno(), 2)
        try:
            yield lambda: "".join(words)
        finally:
            os.dup2(before, 2)
            os.close(before)
            kept.seek(0)
            words.append(kept.read(10_000).decode("utf-8", "replace"))


def read_bounded(path: StrPath, limit: int, error: type[GaitoptError]) -> bytes:
    """The bytes of a file that came from somebody else.

    Args:
        path: the file.
        limit: the most bytes that are read [bytes].
        error: the type raised when the file is missing, unreadable or larger than ``limit``.
    """
    source = Path(path)
    try:
        with source.open("rb") as stream:
            data = stream.read(limit + 1)
    except (OSError, ValueError) as cause:
        raise error(f"cannot read {source}: {getattr(cause, 'strerror', '') or cause}") from cause
    if len(data) > limit:
        raise error(f"{source} is larger than {limit / 1e6:.0f} MB, the most that is read")
    return data
