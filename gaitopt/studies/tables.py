"""Tables as text, and tables that grow line by line in a file."""

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


def as_text(table: Table, width: int = 140) -> str:
    """A table as plain text."""
    console = Console(file=io.StringIO(), width=width, color_system=None, legacy_windows=False)
    console.print(table)
    return console.file.getvalue()  # type: ignore[attr-defined,no-any-return]


@contextmanager
def appending(
    path: Path, columns: Sequence[str], *, anew: bool = False
) -> Iterator[Callable[[Mapping[str, Any]], None]]:
    """Append rows to a CSV file so that each is on disk, whole, before the next.

    Args:
        path: the file.
        columns: names of its columns.
        anew: begin the file with a header, whatever it held.

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


def one_line(words: object) -> str:
    """Words without line breaks, and not too many for a cell of a table."""
    return " ".join(str(words).split())[:500]
