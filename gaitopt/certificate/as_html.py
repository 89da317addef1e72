"""A certificate as a coloured table, for notebooks."""

from __future__ import annotations

from collections.abc import Iterable
from html import escape
from math import isnan
from typing import Final

from gaitopt.certificate.check import Check, Verdict

TONES: Final = {Verdict.OK: "#1b7f4b", Verdict.VIOLATED: "#b3261e", Verdict.UNCHECKED: "#6b7280"}
"""Colours of verdicts: green, red and grey. The words beside them say the same."""


def certificate_html(robot: str, outcome: str, checks: Iterable[Check]) -> str:
    """The outcome, and every check with its worst value, as HTML; all names are escaped."""
    rows = "".join(map(_row, checks))
    head = "".join(
        f'<th style="text-align:left">{name}</th>'
        for name in ("check", "verdict", "worst", "limit", "where")
    )
    return (
        f"<b>{escape(robot)}: {escape(outcome)}</b>, judged at every "
        f"instant<table><tr>{head}</tr>{rows}</table>"
    )


def _row(check: Check) -> str:
    tone = TONES[check.status]
    verdict = str(check.status) if check.promised else f"{check.status} (not promised)"
    if check.status is Verdict.UNCHECKED:
        cells = ("", "", check.note)
    else:
        when = "" if isnan(check.when) else f"{check.when:.3f} s; "
        cells = (f"{check.worst:.3g} {check.unit}", f"{check.sense} {check.limit:.3g}",
                 f"{when}{check.about}")  # fmt: skip
    # Limits are short: they stay in one line.
    styles = ("text-align:left", "text-align:left;white-space:nowrap", "text-align:left")
    others = "".join(f'<td style="{style}">{escape(cell)}</td>'
                     for style, cell in zip(styles, cells, strict=True))  # fmt: skip
    return (
        f'<tr><td style="text-align:left">{escape(check.name)}</td>'
        f'<td style="text-align:left;color:{tone}"><b>{escape(verdict)}</b></td>{others}</tr>'
    )
