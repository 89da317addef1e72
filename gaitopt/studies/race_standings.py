"""Results of a race: numbers and tables."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from rich.table import Table
from rich.text import Text

from gaitopt.certificate.certificate import Outcome
from gaitopt.conventions import FloatArray
from gaitopt.plan.plan import Plan
from gaitopt.plan.settings.base import VELOCITY
from gaitopt.studies.tables import as_text

SSM, PAPER, PHASES = "SSM baseline", "the paper", "phase by phase"
"""Names of the rows that are planned phase by phase. The last one is the paper's method timed by
contact forces."""

BOUND_WINDOW = 16
"""Steps of each part of the walk for which a lower bound is computed by itself. Chosen here: longer
parts give a slightly larger bound, in a time that grows with their length."""


@dataclass(frozen=True)
class Finish:
    """The result of one row on one terrain in numbers; unknown numbers are ``nan``.

    Attributes:
        seed: of the terrain; -1 for footholds of one's own.
        row: name of the row.
        time: duration of the plan [s].
        mean_speed: [m/s].
        bound: lower bound on the time of this row [s]; see
            :func:`gaitopt.planners.time_optimal.bound.route_bound`.
        solve_time: processor time for planning [s].
        margin: smallest stability margin [m]: of the body centre or the true COM, or of the ZMP
            where ``dynamic``.
        dynamic: whether the plan keeps its ZMP in the support polygon, and not its COG.
        verdict: the certificate's outcome, one of :class:`gaitopt.certificate.certificate.Outcome`;
            ``"unchecked"`` without a certificate, ``"failed"`` without a plan.
        message: what is violated, or why there is no plan, in one line.
    """

    seed: int
    row: str
    time: float = np.nan
    mean_speed: float = np.nan
    bound: float = np.nan
    solve_time: float = np.nan
    margin: float = np.nan
    dynamic: bool = False
    verdict: str = "failed"
    message: str = ""


@dataclass(frozen=True, eq=False)
class Standings:
    """The results of all rows on all terrains.

    Attributes:
        robot: name of the robot.
        steps: number of steps of the walks.
        rows: names of the rows.
        finishes: one for each terrain and row.
        plans: the plans on the first terrain, by their rows' names.
        timing: what bounds the speed of all rows but the paper's: ``"velocity"`` or ``"forces"``.
    """

    robot: str
    steps: int
    rows: tuple[str, ...]
    finishes: tuple[Finish, ...]
    plans: dict[str, Plan]
    timing: str = VELOCITY

    @cached_property
    def seeds(self) -> tuple[int, ...]:
        """Seeds of the terrains."""
        return tuple(dict.fromkeys(f.seed for f in self.finishes))

    def of(self, row: str) -> tuple[Finish, ...]:
        """The finishes of one row."""
        return tuple(f for f in self.finishes if f.row == row)

    def values(self, row: str, quantity: str) -> FloatArray:
        """An attribute of :class:`Finish` for each terrain ``(n,)``; ``nan`` where unknown."""
        found = {f.seed: float(getattr(f, quantity)) for f in self.of(row)}
        return np.array([found.get(seed, np.nan) for seed in self.seeds])

    def ratios(self, row: str, baseline: str = PAPER) -> FloatArray:
        """How many times faster a row is than ``baseline``, for each terrain ``(n,)``."""
        return np.asarray(self.values(baseline, "time") / self.values(row, "time"))

    def gaps(self, row: str) -> FloatArray:
        """By which share a row's time exceeds its lower bound, for each terrain ``(n,)``."""
        return np.asarray(self.values(row, "time") / self.values(row, "bound") - 1.0)

    @property
    def verdicts(self) -> dict[str, str]:
        """What certificates say of the plans on the first terrain, by their rows' names."""
        return {f.row: f.verdict for f in self.finishes if f.seed == self.seeds[0]}

    def table(self) -> Table:
        """The race as a table to print, with medians and ranges over several terrains."""
        return race_table(self)

    def __str__(self) -> str:
        return as_text(self.table(), 150)


NOT_VIOLATED = tuple(str(one) for one in Outcome if one is not Outcome.VIOLATED)
"""Outcomes in which nothing is violated."""
MOST_REASONS = 5
"""Reasons of failures and violations that are listed below the table: as many as fit on a
screen."""


def race_table(standings: Standings) -> Table:
    """Time, speed, ratios, gap to the bound, planning time, margin and certificate of every row.

    Over several terrains it shows medians, with the smallest and the largest value in brackets, and
    the smallest margin. Empty columns are left out.
    """
    count = len(standings.seeds)
    spread = f", median (least .. most) of {count} terrains" if count > 1 else ""
    table = Table(
        title=Text(f"{standings.robot}: the race over {standings.steps} steps{spread}"),
        caption=Text(_caption(standings)), caption_justify="left", padding=(0, 1),
    )  # fmt: skip
    table.add_column("row", no_wrap=True)
    columns = {header: cells for header, cells in _columns(standings).items() if any(cells)}
    for header in columns:
        table.add_column(Text(header), justify="right", no_wrap=True)
    for row, cells in zip(standings.rows, zip(*columns.values(), strict=True), strict=True):
        table.add_row(row, *cells)
    return table


def _columns(standings: Standings) -> dict[str, list[str]]:
    """The cells of every column by its header, one cell for each row."""
    s, rows = standings, standings.rows
    return {
        "time [s]": [_median(s.values(row, "time"), None) for row in rows],
        "speed [mm/s]": [_median(1e3 * s.values(row, "mean_speed"), 2, False) for row in rows],
        "× the paper": [_median(s.ratios(row, PAPER), 2) for row in rows],
        "× SSM": [_median(s.ratios(row, SSM), 2, False) for row in rows],
        "gap [%]": [_median(100.0 * s.gaps(row), 1, False) for row in rows],
        "planning [s]": [_median(s.values(row, "solve_time"), 2, False) for row in rows],
        "margin [mm]": [_smallest_margin(s, row) for row in rows],
        "checks hold": [_verdict(s, row) for row in rows],
    }


def _median(values: FloatArray, digits: int | None, spread: bool = True) -> str:
    """The median of the known values as text, with their range where there are several.

    Args:
        values: one for each terrain ``(n,)``.
        digits: after the point; ``None`` for one, or two where numbers are below ten.
        spread: whether to show the range.
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


def _smallest_margin(standings: Standings, row: str) -> str:
    """The smallest margin over all terrains [mm]."""
    margins = standings.values(row, "margin")
    if not np.isfinite(margins).any():
        return ""
    kind = " ZMP" if any(f.dynamic for f in standings.of(row)) else ""
    return f"{1e3 * float(np.nanmin(margins)):.1f}{kind}"


def _verdict(standings: Standings, row: str) -> str:
    """The certificate's outcome; over several terrains the number of those without violation.

    Where forces are promised it is the number of each outcome.
    """
    verdicts = [finish.verdict for finish in standings.of(row)]
    if len(verdicts) == 1 or set(verdicts) == {"unchecked"}:
        return verdicts[0]
    if standings.timing != VELOCITY:
        return ", ".join(f"{count} {told}" for told, count in Counter(verdicts).most_common())
    return f"{sum(verdict in NOT_VIOLATED for verdict in verdicts)} of {len(verdicts)}"


def _caption(standings: Standings) -> str:
    """What the columns are, and why walks failed."""
    lines = [
        "SSM: the body's centre goes to the largest static stability margin before every step.",
        "× the paper, × SSM: time of that row divided by this row's. "
        "planning: processor time. margin: the smallest.",
    ]
    if standings.timing != VELOCITY:
        lines.append(
            f"{PAPER}: timed by joint velocities, as published; nothing is said of forces. All "
            "other rows are timed by contact forces."
        )
    if any(np.isfinite(standings.gaps(row)).any() for row in standings.rows):
        lines.append(
            f"gap: time over its lower bound, which is computed for parts of {BOUND_WINDOW} steps."
        )
    reasons: dict[tuple[int, str, str], list[str]] = {}
    for finish in standings.finishes:
        if finish.message:
            reasons.setdefault((finish.seed, finish.verdict, finish.message), []).append(finish.row)
    for (seed, verdict, message), rows in list(reasons.items())[:MOST_REASONS]:
        place = f", seed {seed}" if seed >= 0 else ""
        lines.append(f"{', '.join(rows)}{place}: {verdict}: {message}")
    if len(reasons) > MOST_REASONS:
        lines.append(f"and {len(reasons) - MOST_REASONS} more")
    return "\n".join(lines)
