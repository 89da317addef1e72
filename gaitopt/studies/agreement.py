"""Whether planner, certificate and physics agree on the walks of a study.

Three parts judge a walk, each by itself. The planner refuses it, warns, or says nothing. The
certificate certifies it, finds it violated, or promises nothing of physics. In physics it passes or
fails. They disagree where

- a walk is certified and fails in physics,
- a walk is violated and passes in physics: the certificate is the stricter one,
- a walk is violated and the planner did not warn.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from rich.table import Table
from rich.text import Text

from gaitopt.conventions import TextEnum
from gaitopt.studies.tables import as_cell

MOST_NAMED, LONGEST = 10, 160
"""Disagreements that are named below the table, and their most letters: what fits on a screen."""
HEADERS = ("robot", "walks", "planned", "warned", "certified", "violated", "passed", "disagree")


class Disagreement(TextEnum):
    """How two judges of a walk disagree. Members equal their texts."""

    FAILED = "certified, and fails in physics"
    STRICTER = "violated, and passes in physics"
    SILENT = "violated, and the planner did not warn"


@dataclass(frozen=True)
class Agreement:
    """How the judges of one robot's walks agree.

    Attributes:
        robot: whose walks.
        counts: how many walks there are, and how many were planned, warned of, certified, violated,
            and passed.
        named: the walks on which they disagree, with their reasons.
    """

    robot: str
    counts: Mapping[str, int]
    named: tuple[str, ...]


def disagreements(row: Mapping[str, str]) -> tuple[Disagreement, ...]:
    """How the judges of one walk disagree, from its row of a study."""
    found = []
    if row["outcome"] == "certified" and row["passed"] == "False":
        found.append(Disagreement.FAILED)
    if row["outcome"] == "violated" and row["passed"] == "True":
        found.append(Disagreement.STRICTER)
    if row["outcome"] == "violated" and not row["warned"]:
        found.append(Disagreement.SILENT)
    return tuple(found)


def agreements(rows: Sequence[Mapping[str, str]]) -> list[Agreement]:
    """One for each robot, in the order of the rows."""
    robots: dict[str, list[Mapping[str, str]]] = {}
    for row in rows:
        robots.setdefault(row["robot"], []).append(row)
    found = []
    for robot, own in robots.items():
        counts = Counter(
            walks=len(own),
            planned=sum(bool(row["duration"]) for row in own),
            warned=sum(bool(row["warned"]) for row in own),
            certified=sum(row["outcome"] == "certified" for row in own),
            violated=sum(row["outcome"] == "violated" for row in own),
            passed=sum(row["passed"] == "True" for row in own),
        )
        named = tuple(_named(row) for row in own if disagreements(row))
        found.append(Agreement(as_cell(robot), counts, named))
    return found


def agreement_table(rows: Sequence[Mapping[str, str]]) -> Table:
    """A line for each robot, and below it the walks on which the judges disagree, by name."""
    found = agreements(rows)
    named = [text for each in found for text in each.named]
    lines = [text[:LONGEST] for text in named[:MOST_NAMED]]
    if len(named) > MOST_NAMED:
        lines.append(f"and {len(named) - MOST_NAMED} more")
    judged = sum(bool(row["outcome"] and row["passed"]) for row in rows)
    agreed = f"planner, certificate and physics agree on all {judged} walks that all three judged"
    if not judged:
        agreed = "no walk was judged by all three"
    caption = Text("\n".join(lines) or agreed)
    table = Table(title="walk, verify, simulate", caption=caption, caption_justify="left")
    for header in HEADERS:
        table.add_column(Text(header), justify="left" if header == "robot" else "right")
    for each in found:
        cells = [str(each.counts[name]) for name in HEADERS[1:-1]]
        table.add_row(Text(each.robot), *cells, str(len(each.named)))
    return table


def _named(row: Mapping[str, str]) -> str:
    """A walk on which judges disagree, and why."""
    what = "; ".join(disagreements(row))
    free = f", {as_cell(row['free'])}" if row["free"] else ""
    return f"{as_cell(row['robot'])}{free}, seed {row['seed']}: {what}: {as_cell(row['message'])}"
