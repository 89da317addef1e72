"""The race as a table."""

from __future__ import annotations

import numpy as np
from rich.markup import escape
from rich.table import Table

from gaitopt.conventions import FloatArray
from gaitopt.studies.race_standings import BOUND_WINDOW, PAPER, SSM, Standings

MOST_REASONS = 5
"""Reasons of failures and violations that are told below the table."""


def race_table(standings: Standings) -> Table:
    """Time, speed, ratios, gap to the bound, planning time, margin and certificate of every row.

    Over several terrains: medians, in brackets the least and the most, and the smallest margin. A
    column that would be empty is left out.
    """
    count = len(standings.seeds)
    spread = f", median (least .. most) of {count} terrains" if count > 1 else ""
    table = Table(
        title=f"{standings.robot}: the race over {standings.steps} steps{spread}",
        caption=_caption(standings), caption_justify="left", padding=(0, 1),
    )  # fmt: skip
    table.add_column("row", no_wrap=True)
    columns = {header: cells for header, cells in _columns(standings).items() if any(cells)}
    for header in columns:
        table.add_column(escape(header), justify="right", no_wrap=True)
    for row, cells in zip(standings.rows, zip(*columns.values(), strict=True), strict=True):
        table.add_row(row, *cells)
    return table


def _columns(standings: Standings) -> dict[str, list[str]]:
    """The cells of every column, a cell a row."""
    s, rows = standings, standings.rows
    return {
        "time [s]": [_median(s.values(row, "time"), None) for row in rows],
        "speed [mm/s]": [_median(1e3 * s.values(row, "mean_speed"), 2, False) for row in rows],
        "× the paper": [_median(s.ratios(row, PAPER), 2) for row in rows],
        "× SSM": [_median(s.ratios(row, SSM), 2, False) for row in rows],
        "gap [%]": [_median(100.0 * s.gaps(row), 1, False) for row in rows],
        "planning [s]": [_median(s.values(row, "solve_time"), 2, False) for row in rows],
        "margin [mm]": [_margin(s, row) for row in rows],
        "certificate": [_verdict(s, row) for row in rows],
    }


def _median(values: FloatArray, digits: int | None, spread: bool = True) -> str:
    """The median of what is known, and the least and the most of several.

    Args:
        digits: after the point; ``None`` for one, or two where numbers are below ten.
    """
    known = values[np.isfinite(values)]
    if not known.size:
        return ""
    if digits is None:
        digits = 1 if np.median(known) >= 10.0 else 2
    middle = f"{np.median(known):.{digits}f}"
    if len(values) == 1 or not spread:
        return middle
    return f"{middle} ({known.min():.{digits}f} .. {known.max():.{digits}f})"


def _margin(standings: Standings, row: str) -> str:
    """The smallest margin over all terrains."""
    margins = standings.values(row, "margin")
    if not np.isfinite(margins).any():
        return ""
    kind = " ZMP" if any(f.dynamic for f in standings.of(row)) else ""
    return f"{1e3 * float(np.nanmin(margins)):.1f}{kind}"


def _verdict(standings: Standings, row: str) -> str:
    """The certificate in one word, or how many plans of how many terrains are certified."""
    verdicts = [finish.verdict for finish in standings.of(row)]
    if len(verdicts) == 1 or set(verdicts) == {"unchecked"}:
        return verdicts[0]
    return f"{verdicts.count('certified')} of {len(verdicts)}"


def _caption(standings: Standings) -> str:
    lines = [
        "× the paper, × SSM: how many times less time than that row takes. "
        "planning: processor time. margin: the smallest."
    ]
    if any(np.isfinite(standings.gaps(row)).any() for row in standings.rows):
        lines.append(f"gap: to the least time of parts of {BOUND_WINDOW} steps, each by itself.")
    reasons: dict[tuple[int, str, str], list[str]] = {}
    for finish in standings.finishes:
        if finish.message:
            reasons.setdefault((finish.seed, finish.verdict, finish.message), []).append(finish.row)
    for (seed, verdict, message), rows in list(reasons.items())[:MOST_REASONS]:
        place = f", seed {seed}" if seed >= 0 else ""
        lines.append(escape(f"{', '.join(rows)}{place}: {verdict}: {message}"))
    if len(reasons) > MOST_REASONS:
        lines.append(f"and {len(reasons) - MOST_REASONS} more")
    return "\n".join(lines)
