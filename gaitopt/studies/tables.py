"""Tables as text, and tables in files to which lines are appended."""

from __future__ import annotations

import csv
import io
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

from gaitopt.errors import InputError

LONGEST_TEXT = 500
"""Most letters of a cell. Chosen here: most messages of errors are shorter."""


def as_text(table: Table, width: int = 140) -> str:
    """A table as plain text, ``width`` letters wide."""
    console = Console(file=io.StringIO(), width=width, color_system=None, legacy_windows=False)
    console.print(table)
    return console.file.getvalue()  # type: ignore[attr-defined,no-any-return]


@contextmanager
def appending(
    path: Path, columns: Sequence[str], *, anew: bool = False
) -> Iterator[Callable[[Mapping[str, Any]], None]]:
    """A function that appends a row to a CSV file.

    Each row is completely on disk before the function returns.

    Args:
        path: the file.
        columns: names of its columns.
        anew: replace the file by one with only a header.

    Raises:
        InputError: the file cannot be written.
    """
    try:
        stream = path.open("w" if anew else "a", encoding="utf-8", newline="")
    except OSError as error:
        raise InputError(f"cannot write the table {path}: {error.strerror or error}") from error
    with stream:
        writer = csv.DictWriter(stream, columns, lineterminator="\n")
        if anew:
            writer.writeheader()

        def append(row: Mapping[str, Any]) -> None:
            writer.writerow(row)
            stream.flush()
            os.fsync(stream.fileno())

        yield append


def one_line(text: object) -> str:
    """A text without line breaks, shortened for a cell of a table."""
    return " ".join(str(text).split())[:LONGEST_TEXT]
