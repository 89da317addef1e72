"""Footholds as CSV text: one line a foothold, and the columns' radius in a comment on top.

::

    # column radius [m]: 0.02
    leg,step,x,y,z
    LF,0,0.2,0.15,0.0

Text that stands on open ground has no such comment. Further columns, which may be left out, are
those of :mod:`gaitopt.terrain.foothold_columns`.
"""

from __future__ import annotations

import csv
import io
import re
from typing import IO

from gaitopt.conventions import LEGS
from gaitopt.errors import FootholdsError
from gaitopt.robots.leg_names import leg_named
from gaitopt.terrain.foothold_columns import (
    FURTHER,
    GROUPS,
    FootholdTable,
    Row,
    further_cells,
    table_of,
)

HEADER = ("leg", "step", "x", "y", "z")
FARTHEST = 1e6
"""Coordinates beyond this are taken for a mistake [m]."""
RADIUS_COMMENT = "column radius [m]:"
"""What a comment with the columns' radius begins with."""

# A spreadsheet may put a comment in quotation marks, and commas after it.
_COMMENTS = re.compile(r"(?:[ \t\"]*#[^\n]*(?:\n|$))*")


def write_footholds(stream: IO[str], table: FootholdTable) -> None:
    """Write footholds as CSV; every number is written so that reading gives it back exactly.

    Args:
        stream: an open text file.
        table: the footholds.
    """
    if table.radius is not None:
        stream.write(f"# {RADIUS_COMMENT} {table.radius!r}\n")
    writer = csv.writer(stream, lineterminator="\n")
    columns = further_cells(table)
    writer.writerow([*HEADER, *columns])
    for leg, places in table.points.items():
        for step, place in enumerate(places):
            further = [cells[leg][step] for cells in columns.values()]
            writer.writerow([leg, step, *(repr(float(c)) for c in place), *further])


def parse_footholds(text: str, name: str) -> FootholdTable:
    """Read CSV text.

    Args:
        text: comments, which begin with ``#``; then the header; then the footholds.
        name: of the file, for messages.

    Raises:
        FootholdsError: a line is wrong, or a step is missing; the message names it.
    """
    comments, rest = _split_comments(text)
    radius = _radius(comments, name)
    reader = csv.reader(io.StringIO(rest))
    found: dict[str, dict[int, Row]] = {}

    def line() -> str:
        return f"{name}, line {len(comments) + reader.line_num}"

    try:
        header = [c.strip().lower() for c in next(reader, [])]
        _check_header(header, f"{name}, line {len(comments) + 1}")
        for row in reader:
            if row and any(cell.strip() for cell in row):
                _parse_row(row, header, line(), found)
    except csv.Error as error:
        raise FootholdsError(f"{line()}: {error}") from error
    for leg, steps in found.items():
        gap = next((k for k in range(len(steps)) if k not in steps), None)
        if gap is not None:
            raise FootholdsError(f"{name}: leg {leg} has no step {gap}; steps count 0, 1, 2, ...")
    rows = {leg: [steps[k] for k in range(len(steps))] for leg, steps in found.items()}
    return table_of(rows, header[len(HEADER) :], radius)


def _check_header(header: list[str], where: str) -> None:
    """Refuse a header with columns that are unknown, there twice, or without their group."""
    further = header[len(HEADER) :]
    if tuple(header[: len(HEADER)]) != HEADER:
        raise FootholdsError(
            f"{where}: the header must be {','.join(HEADER)}, got "
            f"{','.join(header)[:80] or 'nothing'}"
        )
    unknown = [name for name in further if name not in FURTHER]
    if unknown:
        raise FootholdsError(
            f"{where}: the column {unknown[0][:20]!r} is unknown; after {','.join(HEADER)} there "
            f"may be {','.join(FURTHER)}"
        )
    if len(set(further)) < len(further):
        raise FootholdsError(f"{where}: a column is there twice")
    for group in GROUPS:
        if 0 < len(set(group) & set(further)) < len(group):
            raise FootholdsError(f"{where}: the columns {','.join(group)} go together")


def _split_comments(text: str) -> tuple[list[str], str]:
    """The comment lines that ``text`` begins with, and what follows them."""
    found = _COMMENTS.match(text)
    above = found.group() if found else ""
    lines = above.split("\n")
    return (lines if lines[-1] else lines[:-1]), text[len(above) :]


def _radius(comments: list[str], name: str) -> float | None:
    """The radius that one of the ``comments`` names [m]."""
    radius = None
    for number, comment in enumerate(comments, 1):
        said = re.sub(r"\s+", " ", comment.strip(' \t\r"#,'))
        if not said.lower().startswith(RADIUS_COMMENT):
            continue
        try:
            value = float(said[len(RADIUS_COMMENT) :])
        except ValueError:
            value = -1.0
        if not 0.0 < value < FARTHEST or radius is not None:
            problem = "is no positive length" if radius is None else "stands there twice"
            raise FootholdsError(f"{name}, line {number}: the column radius {problem}")
        radius = value
    return radius


def _parse_row(
    row: list[str], header: list[str], where: str, found: dict[str, dict[int, Row]]
) -> None:
    """Add the foothold of a row to those that were ``found``: by leg, then by step."""
    if len(row) != len(header):
        raise FootholdsError(
            f"{where}: {len(row)} fields where {len(header)} are needed ({','.join(header)})"
        )
    name, step_text, *cells = (cell.strip() for cell in row)
    leg = leg_named(name)
    if leg is None:
        raise FootholdsError(
            f"{where}: leg {name[:20]!r} is unknown; legs are {', '.join(LEGS)} (FL, RL, RR, FR "
            "and front_left are understood, too)"
        )
    try:
        step = int(step_text)
    except ValueError:
        raise FootholdsError(f"{where}: step {step_text[:20]!r} is no whole number") from None
    place = [_parsed(axis, text, where) for axis, text in zip("xyz", cells[:3], strict=True)]
    further = {
        column: _parsed(column, text, where) if text else None
        for column, text in zip(header[len(HEADER) :], cells[3:], strict=True)
    }
    if step < 0 or step in found.setdefault(leg, {}):
        problem = "is negative" if step < 0 else "stands there twice"
        raise FootholdsError(f"{where}: step {step} of leg {leg} {problem}")
    found[leg][step] = Row(place, further, where)


def _parsed(column: str, text: str, where: str) -> float:
    """The number in a field.

    Raises:
        FootholdsError: it is none, or too large.
    """
    try:
        value = float(text)
    except ValueError:
        raise FootholdsError(f"{where}: {column} is {text[:20]!r}, no number") from None
    if not abs(value) <= FARTHEST:
        raise FootholdsError(
            f"{where}: {column} is {text[:20]}; it must be finite and below {FARTHEST:g} m"
        )
    return value
