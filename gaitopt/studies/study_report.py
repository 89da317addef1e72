"""The results of a study as a table and as a picture."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from rich.table import Table
from rich.text import Text

from gaitopt.conventions import FloatArray
from gaitopt.studies.tables import as_cell
from gaitopt.viewing.figures.common import plain
from gaitopt.viewing.figures.panels import Panels, panels

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Rows = Sequence[dict[str, str]]
"""Rows of a study's table, as text by column."""

_GROUP = ("robot", "objective", "speed", "stability_margin", "body_height")
"""Settings by which walks are grouped."""
STATES = ("ok", "infeasible", "violated", "fell", "too fast", "error")
"""Every status of :class:`gaitopt.studies.study.Row`."""
MOST_REASONS, LONGEST_REASON = 5, 160
"""Reasons that are listed below the table, and their most letters: what fits on a screen."""


def study_table(rows: Rows) -> Table:
    """A table of counts and medians, with a line for each group of settings."""
    table = Table(
        title=f"{len(rows)} {'walk' if len(rows) == 1 else 'walks'}",
        caption=Text(_reasons(rows)),
        caption_justify="left",
    )
    for header in ("robot", "objective", "speed", "margin [m]", "height [m]", "walks", *STATES,
                   "time [s]", "true COM [mm]"):  # fmt: skip
        table.add_column(
            Text(header), justify="left" if header in ("robot", "objective") else "right"
        )
    for group, members in _groups(rows).items():
        count = Counter(row["status"] for row in members)
        times, margins = _numbers(members, "duration"), 1e3 * _numbers(members, "com_margin")
        table.add_row(
            *(Text(part or "default") for part in group),
            str(len(members)),
            *(str(count[s]) for s in STATES),
            _range(times),
            f"{margins.min():.1f}" if margins.size else "",
        )
    return table


def plot_study(rows: Rows, axes: Sequence[Axes] | Panels | None = None) -> Panels:
    """Plot the distributions of durations and true-COM margins, and the number of each status.

    Args:
        rows: from :func:`gaitopt.studies.study.run_study`.
        axes: where to draw ``(3,)``; by default a new figure.

    Returns:
        The axes ``(3,)``: durations, margins, and results.

    Raises:
        InputError: there are more axes or fewer.
    """
    drawn = panels(None, (1, 3), 9.0, 3.2)[0] if axes is None else panels(axes, (3,), 0, 0)
    left, middle, right = drawn
    for group, members in _groups(rows).items():
        label = f"{plain(group[0])}, {plain(group[1])}, $S_0$ {plain(group[3])} m"
        for ax, name, scale in ((left, "duration", 1.0), (middle, "com_margin", 1e3)):
            values = np.sort(_numbers(members, name)) * scale
            if values.size:
                ax.step(values, np.arange(1, values.size + 1) / values.size, where="post",
                        label=label)  # fmt: skip
    left.set(xlabel="duration [s]", ylabel="share of walks", title="Duration")
    middle.set(xlabel="smallest margin of the true COM [mm]", title="Stability")
    for ax in (left, middle):
        ax.grid(alpha=0.3)
    if left.lines:
        left.legend(fontsize=7, loc="lower right")
    count = Counter(row["status"] for row in rows)
    bars = right.bar(STATES, [count[s] for s in STATES], color=["#2e9e5b", "#8a8a8a", "#d1383d",
                     "#e3b505", "#e07b39", "#5b3d99"])  # fmt: skip
    right.tick_params(axis="x", labelsize=7)
    right.bar_label(bars)
    right.set(ylabel="walks", title="Result")
    return drawn


def _groups(rows: Rows) -> dict[tuple[str, ...], list[dict[str, str]]]:
    """The rows by their settings."""
    groups: dict[tuple[str, ...], list[dict[str, str]]] = {}
    for row in rows:
        groups.setdefault(tuple(as_cell(row[name]) for name in _GROUP), []).append(row)
    return groups


def _numbers(rows: Rows, name: str) -> FloatArray:
    """One column's numbers; empty cells are left out."""
    return np.array([float(row[name]) for row in rows if row[name]])


def _range(values: FloatArray) -> str:
    """The median, with the smallest and the largest value in brackets."""
    if not values.size:
        return ""
    return f"{np.median(values):.1f} ({values.min():.1f} .. {values.max():.1f})"


def _reasons(rows: Rows) -> str:
    """The first reasons of walks that are not ok."""
    bad = [row for row in rows if row["status"] != "ok"]
    lines = [
        f"seed {r['seed']}: {r['status']}: {as_cell(r['message'])[:LONGEST_REASON]}"
        for r in bad[:MOST_REASONS]
    ]
    if len(bad) > MOST_REASONS:
        lines.append(f"and {len(bad) - MOST_REASONS} more")
    return "\n".join(lines)
