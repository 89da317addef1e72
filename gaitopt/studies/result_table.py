"""Tables of results that may be damaged: rows that are whole, and numbers of lines that are not."""

from __future__ import annotations

import csv
import re
import types
import typing
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, NamedTuple

from gaitopt.errors import InputError, StudyWarning, warn
from gaitopt.files import read_bounded, written_whole

LARGEST: Final = 1_000_000_000
"""Largest table that is read [bytes]. Chosen here: a row has about 300, so three million rows."""
MOST_TOLD: Final = 10
"""Most lines whose numbers are told."""
_KEY = re.compile(r"[0-9a-f]{16}")


@dataclass(frozen=True)
class Columns:
    """Columns of a table: the key, the fields of a job, and those of its result.

    Attributes:
        job, row: dataclasses of plain values.
    """

    job: type[Any]
    row: type[Any]

    @property
    def kinds(self) -> dict[str, Any]:
        """Types of the columns by name, without the key."""
        return {**_hints(self.job), **_hints(self.row)}

    @property
    def names(self) -> tuple[str, ...]:
        """Names of all columns."""
        return ("key", *self.kinds)


class StoredRow(NamedTuple):
    """A row of a table: the number of its line, and its cells by column."""

    line: int
    cells: dict[str, str]


def rows_so_far(path: Path, columns: Columns) -> dict[str, StoredRow]:
    """The rows of a table by their keys; a table that is not there yet is made.

    A last line without an end is deleted from the file. Other lines that are no rows stay there,
    and are told by a :class:`gaitopt.errors.StudyWarning` with their numbers.

    Raises:
        InputError: the table cannot be read or written, or is none of this study.
    """
    header = ",".join(columns.names).encode()
    if not path.exists():
        with written_whole(path, binary=True) as stream:
            stream.write(header + b"\n")
        return {}
    data = read_bounded(path, LARGEST, InputError)
    *lines, rest = data.split(b"\n")
    if not lines or lines[0].rstrip(b"\r") != header:
        other = "is no table of a study"
        if lines and lines[0].startswith(b"key,"):
            other = "has other columns: it is of another study, or of another version of gaitopt"
        raise InputError(f"{path} {other}; name another file, or remove it")
    if rest:
        with written_whole(path, binary=True) as stream:
            stream.write(data[: len(data) - len(rest)])
    kinds, rows, wrong = columns.kinds, dict[str, StoredRow](), []
    for number, line in enumerate(lines[1:], 2):
        row = _row(line, kinds)
        if row is None:
            wrong.append(number)
        else:
            rows[row["key"]] = StoredRow(number, row)
    tell_wrong(path, wrong)
    return rows


def tell_wrong(path: Path, wrong: Sequence[int], why: str = "damaged") -> None:
    """Tell the numbers of lines that do not count."""
    if not wrong:
        return
    more = f" and {len(wrong) - MOST_TOLD} more" if len(wrong) > MOST_TOLD else ""
    which = ", ".join(map(str, wrong[:MOST_TOLD])) + more
    warn(
        f"{path}: line{'s' * (len(wrong) > 1)} {which}: {why}, and not counted; what belongs there "
        "is computed again",
        StudyWarning,
    )


def _row(line: bytes, kinds: Mapping[str, Any]) -> dict[str, str] | None:
    """A line as a row; ``None`` where it is none."""
    try:
        # Line by line: a stray quotation mark cannot swallow the lines below.
        (cells,) = csv.reader([line.decode("utf-8")], strict=True)
        key, *values = cells
        row = dict(zip(kinds, values, strict=True))
    except (ValueError, csv.Error):
        return None
    whole = _KEY.fullmatch(key) and all(_fits(row[name], kind) for name, kind in kinds.items())
    return {"key": key, **row} if whole else None


def _fits(cell: str, kind: Any) -> bool:
    """Whether a cell can be a value of this type; anything can be a text."""
    options = typing.get_args(kind) if _is_union(kind) else (kind,)
    if not set(options) <= {float, int, bool, type(None)}:
        return True
    if not cell:
        return type(None) in options
    if bool in options:
        return cell in ("True", "False")
    try:
        float(cell) if float in options else int(cell)
    except ValueError:
        return False
    return True


def _is_union(kind: Any) -> bool:
    return typing.get_origin(kind) in (typing.Union, types.UnionType)


def _hints(kind: type[Any]) -> dict[str, Any]:
    return typing.get_type_hints(kind)
