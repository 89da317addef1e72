"""The results of a study of made grounds as a table and as a picture."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from rich.table import Table
from rich.text import Text

from gaitopt.conventions import FloatArray
from gaitopt.studies.study_report import LONGEST_REASON, MOST_REASONS, Rows
from gaitopt.studies.tables import as_cell
from gaitopt.viewing.figures.common import plain
from gaitopt.viewing.figures.panels import Panels, panels

if TYPE_CHECKING:
    from matplotlib.axes import Axes

GROUP = ("robot", "terrain", "difficulty", "sizes", "friction", "physics_friction")
"""What walks of a line of the table have in common."""
STAGES = ("solvable", "found", "planned", "certified", "passed")
"""How far a walk may get, by column of the study's table."""


class Standing(NamedTuple):
    """A line of the table.

    Attributes:
        group: values of :data:`GROUP`.
        walks: how many there are.
        counts: how many are solvable, found, planned, certified and passed; ``None`` where no walk
            was looked at.
        rates: processor time of the search for each metre, of walks whose footholds were found
            ``(n,)`` [s/m].
        speeds: of the plans ``(n,)`` [m/s].
    """

    group: tuple[str, ...]
    walks: int
    counts: dict[str, int | None]
    rates: FloatArray
    speeds: FloatArray

    @property
    def ground(self) -> str:
        """The ground in words."""
        _, terrain, difficulty, sizes, friction, in_physics = self.group
        words = f"{terrain} {sizes}" if sizes else f"{terrain} {float(difficulty):g}"
        words += f", friction {float(friction):g}" if friction else ""
        return f"{words}, {float(in_physics):g} in physics" if in_physics else words


def standings(rows: Rows) -> list[Standing]:
    """The lines of the table, in the order of the walks."""
    groups: dict[tuple[str, ...], list[dict[str, str]]] = {}
    for row in rows:
        groups.setdefault(tuple(as_cell(row[name]) for name in GROUP), []).append(row)
    found = []
    for group, members in groups.items():
        counts: dict[str, int | None] = {}
        for stage in STAGES:
            looked = [row[stage] for row in members if row[stage]]
            counts[stage] = sum(value == "True" for value in looked) if looked else None
        done = [row for row in members if row["found"] == "True"]
        rates = [float(row["search_time"]) / float(row["metres"]) for row in done]
        speeds = [float(row["mean_speed"]) for row in done if row["mean_speed"]]
        found.append(
            Standing(group, len(members), counts, np.array(rates), np.array(speeds))
        )  # fmt: skip
    return found


def terrain_table(rows: Rows) -> Table:
    """A table of counts and of the time of the search, with a line for each robot and ground."""
    table = Table(
        title=f"{len(rows)} {'walk' if len(rows) == 1 else 'walks'}",
        caption=Text(_caption(rows)),
        caption_justify="left",
    )
    for header in ("robot", "ground", "walks", *STAGES, "search [s/m]", "95 % [s/m]",
                   "speed [mm/s]"):  # fmt: skip
        left = header in ("robot", "ground")
        table.add_column(Text(header), justify="left" if left else "right")
    for line in standings(rows):
        table.add_row(*(Text(cell) for cell in cells(line)))
    return table


def terrain_markdown(rows: Rows) -> str:
    """The same table in Markdown, without the reasons."""
    head = ("robot", "ground", "walks", *STAGES, "search, median [s/m]", "95 % [s/m]",
            "speed, median [mm/s]")  # fmt: skip
    lines = [f"| {' | '.join(head)} |", "|---" * len(head) + "|"]
    lines += [f"| {' | '.join(cells(line))} |" for line in standings(rows)]
    return "\n".join(lines)


def cells(line: Standing) -> list[str]:
    """The cells of a line."""
    counts = ["" if line.counts[s] is None else str(line.counts[s]) for s in STAGES]
    rates = ["", ""]
    if line.rates.size:
        rates = [f"{np.median(line.rates):.2f}", f"{np.percentile(line.rates, 95):.2f}"]
    speed = f"{1e3 * np.median(line.speeds):.0f}" if line.speeds.size else ""
    return [line.group[0], line.ground, str(line.walks), *counts, *rates, speed]


def plot_terrain_study(rows: Rows, axes: Sequence[Axes] | Panels | None = None) -> Panels:
    """Plot how far the walks got, and the time of the search.

    Args:
        rows: from :func:`gaitopt.studies.terrain_study.run_terrain_study`.
        axes: where to draw ``(2,)``; by default a new figure.

    Returns:
        The axes ``(2,)``: how far the walks got, and the time of the search.

    Raises:
        InputError: there are more axes or fewer.
    """
    drawn = panels(None, (1, 2), 9.0, 3.4)[0] if axes is None else panels(axes, (2,), 0, 0)
    left, right = drawn
    lines = standings(rows)
    wide = 0.8 / max(len(lines), 1)
    for k, line in enumerate(lines):
        shares = [100.0 * (line.counts[stage] or 0) / line.walks for stage in STAGES]
        label = f"{plain(line.group[0])}, {plain(line.ground)}"
        left.bar(np.arange(len(STAGES)) + wide * (k + 0.5) - 0.4, shares, wide, label=label)
        rates = np.sort(line.rates)
        if rates.size:
            right.step(rates, np.arange(1, rates.size + 1) / rates.size, where="post", label=label)
    left.set_xticks(range(len(STAGES)), STAGES)
    left.set(ylabel="walks [%]", title="How far they got", ylim=(0.0, 105.0))
    right.set(xlabel="processor time of the search [s/m]", ylabel="share of walks", title="Search")
    right.grid(alpha=0.3)
    if lines:
        left.legend(fontsize=7, loc="lower left")
    return drawn


def _caption(rows: Rows) -> str:
    """What the columns are, and why walks failed."""
    lines = [
        "solvable: the search finds footholds to the goal, if need be with the beam --widest.",
        "search: processor time of those that were found, median and 95th percentile.",
    ]
    bad = [row for row in rows if row["status"] != "ok"]
    count: Counter[str] = Counter(row["status"] for row in bad)
    if count:
        lines.append("not ok: " + ", ".join(f"{status} {n}" for status, n in count.most_common()))
    lines += [reason(row) for row in bad[:MOST_REASONS]]
    if len(bad) > MOST_REASONS:
        lines.append(f"and {len(bad) - MOST_REASONS} more: see the column message of the table")
    return "\n".join(lines)


def reason(row: dict[str, str]) -> str:
    """Why a walk failed, in a line."""
    where = f"{row['robot']}, {row['terrain']}, seed {row['seed']}"
    why = row["causes"] or row["message"]
    if row["failed_step"]:
        why = f"step {row['failed_step']} ({row['failed_leg']}): {why}"
    return f"{where}: {row['status']}: {why}"[:LONGEST_REASON]


def failures(rows: Sequence[dict[str, str]]) -> list[str]:
    """A line for each walk that failed."""
    return [reason(row) for row in rows if row["status"] != "ok"]
