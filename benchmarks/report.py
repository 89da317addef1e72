"""Results as a table and as JSON."""

from __future__ import annotations

import os
import platform
from importlib.metadata import version
from typing import Any

from rich.table import Table

from benchmarks.measuring import Result

_PACKAGES = ("gaitopt", "numpy", "scipy", "casadi", "proxsuite", "pin")


def machine(pinned: bool) -> dict[str, Any]:
    """What the numbers were measured on, in general terms."""
    return {
        "cores": os.cpu_count(),
        "pinned to one core": pinned,
        "load at start": round(os.getloadavg()[0], 2) if hasattr(os, "getloadavg") else None,
        "processor": platform.machine(),
        "python": platform.python_version(),
        **{package: version(package) for package in _PACKAGES},
    }


def results_table(groups: dict[str, list[Result]], about: dict[str, Any]) -> Table:
    """All results, a section for each benchmark."""
    table = Table(title="gaitopt benchmarks", caption=_caption(about), caption_justify="left")
    table.add_column("", no_wrap=True)
    table.add_column("measured", min_width=24)
    for header in ("median", "min .. p90", "CPU", "unit", "goal", "limit", "ratio"):
        table.add_column(header, justify="right", no_wrap=True)
    for name, results in groups.items():
        for i, result in enumerate(results):
            last = i == len(results) - 1
            table.add_row("" if i else name, *_row(result), end_section=last)
    return table


def _row(result: Result) -> list[str]:
    shown = result.to_dict()
    spread = f"{_number(shown['min'])} .. {_number(shown['p90'])}" if len(result.values) > 1 else ""
    ratio = "" if result.ratio is None else f"{result.ratio:.3g} x"
    numbers = (result.cpu_median, result.goal, result.limit)
    cpu, goal, limit = ("" if x is None else _number(x) for x in numbers)
    median = _number(result.median)
    colour = _colour(result)
    if colour:
        median = f"[{colour}]{median}[/]"
    return [result.what, median, spread, cpu, result.unit, goal, limit, ratio]


def _colour(result: Result) -> str:
    """Green within goal and limit, judged by CPU time: other programs are not ours to blame."""
    median = result.median if result.cpu_median is None else result.cpu_median
    if result.limit is not None and median > result.limit:
        return "red"
    if result.goal is not None and median > result.goal:
        return "yellow"
    return "" if result.limit is None and result.goal is None else "green"


def _number(value: float) -> str:
    if value != 0.0 and abs(value) < 1e-3:
        return f"{value:.1e}"
    return f"{value:.0f}" if abs(value) >= 1000 else f"{value:.3g}"


def _caption(about: dict[str, Any]) -> str:
    machine = ", ".join(f"{key} {value}" for key, value in about.items())
    return (
        "median, min and p90 (of 100 runs, 90 are no slower) by the wall clock; CPU: median of the "
        "process's CPU time;\nratio: to ours in the same run, of CPU medians (COG to COG, LP to "
        f"LP, the rest to the whole plan)\n{machine}"
    )
