"""Reading and writing files so that damaged or unfinished ones do no harm."""

from __future__ import annotations

import os
import shutil
import stat
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Any

from gaitopt.errors import GaitoptError, InputError

StrPath = str | os.PathLike[str]

MOST_PRINTED = 10_000
"""Most bytes that are kept of what a library prints: error messages quote 300 characters of it."""


_UNFINISHED: set[Path] = set()
"""Temporary files and folders that are being written now."""


@contextmanager
def unfinished(path: Path) -> Iterator[None]:
    """Keep in mind that a temporary file or folder has to go if the program is ended."""
    _UNFINISHED.add(path)
    try:
        yield
    finally:
        _UNFINISHED.discard(path)


def remove_unfinished() -> None:
    """Remove what is being written now: for programs that end at once."""
    for path in tuple(_UNFINISHED):
        if path.is_dir():
            shutil.rmtree(path, ignore_errors=True)
        else:
            path.unlink(missing_ok=True)


def what_no_file_is(path: StrPath) -> str:
    """What lies at a path and is no regular file: ``"a pipe"``, for instance; or nothing.

    Reading a pipe may wait for ever, reading a device may never end, and a file that is written in
    place of a device takes it away from the whole machine.
    """
    try:
        mode = Path(path).stat().st_mode
    except (OSError, ValueError, TypeError):
        return ""  # It is not there, or whoever opens it says what is wrong.
    kinds = {stat.S_IFIFO: "a pipe", stat.S_IFCHR: "a device", stat.S_IFBLK: "a device",
             stat.S_IFSOCK: "a socket"}  # fmt: skip
    return kinds.get(stat.S_IFMT(mode), "")


@contextmanager
def written_whole(path: StrPath, *, binary: bool = False) -> Iterator[IO[Any]]:
    """Open a file for writing that appears at ``path`` complete, or not at all.

    The content is written to a temporary file in the same folder, which replaces ``path`` when the
    block ends without an error.

    Args:
        path: the file. Where it is a symbolic link, the file that it points to is replaced.
        binary: whether the stream takes bytes instead of text.

    Raises:
        InputError: the folder does not exist or cannot be written to, or a pipe or a device is
            there.
    """
    try:
        target = Path(os.path.realpath(path))
    except (TypeError, ValueError):
        what = repr(path[:100]) if isinstance(path, str) else f"a {type(path).__name__}"
        raise InputError(f"the path of a file must be a text or a path, got {what}") from None
    special = what_no_file_is(target)
    if special or not target.name:
        raise InputError(f"cannot write {path}: it is {special or 'no file'}; give another path")
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
            else os.fdopen(handle, "w", encoding="utf-8", errors="backslashreplace", newline="")
        )
        with unfinished(temporary), opened as stream:
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
    """Catch what C++ libraries print to stderr inside the block.

    Some, such as urdfdom, print their errors there whatever the caller does with them.

    Returns:
        A function that gives the text, once the block has ended.
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
            words.append(kept.read(MOST_PRINTED).decode("utf-8", "replace"))


def read_bounded(path: StrPath, limit: int, error: type[GaitoptError]) -> bytes:
    """Read a file that may come from somebody else, up to a largest size.

    Args:
        path: the file.
        limit: largest size that is read [bytes].
        error: type of the error that is raised.

    Raises:
        GaitoptError: of the type ``error``: the file is missing, unreadable or larger than
            ``limit``.
    """
    try:
        source = Path(path)
    except TypeError:
        what = f"a {type(path).__name__}"
        raise error(f"the path of a file must be a text or a path, got {what}") from None
    special = what_no_file_is(source)
    if special:
        raise error(f"cannot read {source}: it is {special}, and no file; save it as a file first")
    try:
        with source.open("rb") as stream:
            data = stream.read(limit + 1)
    except (OSError, ValueError) as cause:
        raise error(f"cannot read {source}: {getattr(cause, 'strerror', '') or cause}") from cause
    if len(data) > limit:
        raise error(f"{source} is larger than {limit / 1e6:.0f} MB, the most that is read")
    return data
