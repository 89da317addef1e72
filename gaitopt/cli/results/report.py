"""What a command says: lines and tables for people, or one JSON document for programs."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gaitopt.cli.results.documents import plain
from gaitopt.cli.support import print_files, terminal

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table


@dataclass
class Report:
    """Collects what a command has to say.

    Attributes:
        as_json: whether a program reads it: then nothing is printed before :meth:`end`.
        document: what the program gets.
    """

    as_json: bool
    document: dict[str, Any] = field(default_factory=dict)

    def say(self, text: str) -> None:
        """Print a line of rich's markup, for people."""
        if not self.as_json:
            terminal().print(text)

    def table(self, table: Table) -> None:
        """Print a table, for people."""
        if not self.as_json:
            print_table(table)

    def files(self, files: Mapping[Path, str]) -> None:
        """Name files that were written, and say what each is, in rich's markup."""
        from rich.text import Text

        plainly = {str(path): Text.from_markup(what).plain for path, what in files.items()}
        self.document.setdefault("files", {}).update(plainly)
        if not self.as_json:
            print_files(files)

    def add(self, **values: Any) -> None:
        """Put values into the document."""
        self.document.update({name: plain(value) for name, value in values.items()})

    def end(self) -> None:
        """Print the document, for programs."""
        if self.as_json:
            print(json.dumps(self.document, indent=1, allow_nan=False))


def print_table(table: Table) -> None:
    """Print a table; row by row where words would have to be cut to fit it into the terminal."""
    # Names of robots come from files: brackets in them are no markup.
    console = terminal(markup=False)
    if fit_columns(table, console):
        console.print(table)
        return
    for text in as_records(table):
        console.print(text)


def fit_columns(table: Table, console: Console) -> bool:
    """Give a table's columns widths with which no word is cut, if the terminal is wide enough.

    rich itself takes width from the widest columns first, also where these cannot spare it.

    Returns:
        Whether it is wide enough.
    """
    least, most = _column_widths(table)
    _, right, _, left = table.padding
    borders = len(least) * (left + right + 1) - 1 + (2 if table.show_edge else 0)
    spare = console.width - borders - sum(least)
    if spare < 0:
        return False
    wanted = sum(most) - sum(least)
    for column, low, high in zip(table.columns, least, most, strict=True):
        share = 1.0 if wanted <= spare else spare / wanted
        column.width = low + int(share * (high - low))
    return True


def _column_widths(table: Table) -> tuple[list[int], list[int]]:
    """Of each column the length of its longest word, and of its longest line."""
    from rich.text import Text

    least, most = [], []
    for column in table.columns:
        lines = [
            line
            for cell in (column.header, *column.cells)
            for line in Text(str(cell)).plain.split("\n")
        ]
        longest = max(map(len, lines))
        words = max((len(word) for line in lines for word in line.split()), default=0)
        least.append(longest if column.no_wrap else words)
        most.append(longest)
    return least, most


def as_records(table: Table) -> Iterator[Any]:
    """A table row by row: the first cell as a headline, the others below it with their headers."""
    from rich.padding import Padding
    from rich.text import Text

    if table.title:
        yield table.title
    first, *others = [(str(c.header), [str(cell) for cell in c.cells]) for c in table.columns]
    for row, name in enumerate(first[1]):
        yield Text(name, style="bold")
        told = [(header, cells[row]) for header, cells in others if cells[row].strip()]
        lines = "; ".join(f"{header} {' '.join(cell.split())}" for header, cell in told)
        yield Padding(Text(lines), (0, 0, 0, 2))
    if table.caption:
        yield table.caption
