"""Tables as text, and tables in files to which lines are appended."""

from __future__ import annotations

import csv
import io
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO, Any

from rich.console import Console
from rich.table import Table

from gaitopt.errors import InputError
from gaitopt.files import what_no_file_is
from gaitopt.robots.xml_text import shown

FORMULAS = ("=", "+", "-", "@")
"""What a formula of a spreadsheet begins with."""
LONGEST_TEXT = 500
"""Most letters of a cell. Chosen here: most messages of errors are shorter."""


def as_text(table: Table, width: int = 140) -> str:
    """A table as plain text, ``width`` letters wide."""
    console = Console(file=io.StringIO(), width=width, color_system=None, legacy_windows=False,
                      markup=False)  # fmt: skip
    console.print(table)
    return console.file.getvalue()  # type: ignore[attr-defined,no-any-return]


@contextmanager
def appending(
    path: Path, columns: Sequence[str], *, anew: bool = False
) -> Iterator[Callable[[Mapping[str, Any]], None]]:
    """A function that appends a row to a CSV file.

    Each row is completely on disk before the function returns. A row that cannot be written leaves
    nothing of itself.

    Args:
        path: the file.
        columns: names of its columns.
        anew: replace the file by one with only a header.

    Raises:
        InputError: the file cannot be written, when it is opened or later.
    """
    special = what_no_file_is(path)
    if special:
        raise InputError(f"cannot write the table {path}: it is {special}; name another file")
    try:
        # Without a buffer: what cannot be written is not tried again when the file is closed.
        stream = path.open("wb" if anew else "ab", buffering=0)
    except OSError as error:
        raise InputError(f"cannot write the table {path}: {error.strerror or error}") from error
    with stream:

        def append(row: Mapping[str, Any]) -> None:
            _append(stream, path, csv_line([row[name] for name in columns]))

        if anew:
            _append(stream, path, csv_line(columns))
        yield append


def csv_line(cells: Sequence[Any]) -> bytes:
    """A line of a CSV file; cells hold no line breaks, so that a line is a row."""
    line = io.StringIO()
    csv.writer(line, lineterminator="\n").writerow(
        as_cell(cell) if isinstance(cell, str) else cell for cell in cells
    )
    return line.getvalue().encode("utf-8", "replace")


def as_cell(text: str) -> str:
    """A text as a cell of a table: in one line, without what terminals and spreadsheets obey.

    Names of robots and files come from others. What a spreadsheet would take for a formula begins
    with an apostrophe; numbers do not change.
    """
    cell = shown(" ".join(text.split()))
    if cell[:1] in FORMULAS and not _is_number(cell):
        cell = f"'{cell}"
    return cell


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def _append(stream: IO[bytes], path: Path, line: bytes) -> None:
    """Write a line, whole or not at all."""
    begin = stream.seek(0, os.SEEK_END)
    try:
        written = 0
        while written < len(line):
            written += stream.write(line[written:])
        os.fsync(stream.fileno())
    except OSError as error:
        with suppress(OSError):
            stream.truncate(begin)
        raise InputError(
            f"cannot write the table {path}: {error.strerror or error}; all rows before this one "
            "are kept, and the same command goes on after them"
        ) from error


def one_line(text: object) -> str:
    """A text without line breaks, shortened for a cell of a table."""
    return " ".join(str(text).split())[:LONGEST_TEXT]
