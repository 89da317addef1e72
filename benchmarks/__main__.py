"""The command: ``python -m benchmarks [--quick] [--json FILE] [NAME ...]``."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

from rich.console import Console

from benchmarks.measuring import Result, use_one_core
from benchmarks.report import machine, results_table
from benchmarks.table import fresh, outputs, planner, rivals, route, spline
from gaitopt.files import written_whole

BENCHMARKS: dict[str, Callable[[bool], list[Result]]] = {
    "plan": planner.measure_plan,
    "cog": planner.measure_cog,
    "growth": planner.measure_growth,
    "memory": fresh.measure_memory,
    "import": fresh.measure_import,
    "sample": outputs.measure_sample,
    "files": outputs.measure_files,
    "replay": outputs.measure_replay,
    "spline": spline.measure_spline,
    "route": route.measure_route,
    "obvious": rivals.measure_obvious,
}
_WIDTH = 136


def main(arguments: Sequence[str] | None = None) -> int:
    """Run benchmarks and print their table.

    Returns:
        Exit code: 1 when the obvious way found another walk than ours, which makes a comparison of
        their times worthless. No time, however long, makes a run fail.
    """
    options = _options(arguments)
    about = machine(use_one_core())
    groups = _measured(options.names or list(BENCHMARKS), options.quick)
    screen = Console()
    console = screen if screen.is_terminal else Console(width=_WIDTH)
    console.print(results_table(groups, about))
    if options.json:
        content = {name: [r.to_dict() for r in results] for name, results in groups.items()}
        _write(options.json, {"machine": about, "quick": options.quick, "results": content})
    broken = [r.what for results in groups.values() for r in results if r.broken]
    for what in broken:
        print(f"beyond its limit: {what}", file=sys.stderr)
    return int(bool(broken))


def _options(arguments: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks", description="Measure gaitopt's speed and memory on one core."
    )
    parser.add_argument(
        "names", nargs="*", metavar="NAME", help=f"of {', '.join(BENCHMARKS)}; all by default"
    )
    parser.add_argument("--quick", action="store_true", help="fewer repetitions, shorter walks")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the numbers there too")
    options = parser.parse_args(arguments)
    unknown = [name for name in options.names if name not in BENCHMARKS]
    if unknown:
        parser.error(f"no benchmark {', '.join(unknown)}; there are {', '.join(BENCHMARKS)}")
    return options


def _measured(names: list[str], quick: bool) -> dict[str, list[Result]]:
    """Run the benchmarks one after another, saying which on standard error."""
    groups = {}
    with Console(stderr=True).status("measuring") as status:
        for name in names:
            status.update(f"measuring {name}")
            groups[name] = BENCHMARKS[name](quick)
    return groups


def _write(path: Path, content: dict[str, object]) -> None:
    with written_whole(path) as stream:
        stream.write(json.dumps(content, indent=2, allow_nan=False) + "\n")


if __name__ == "__main__":
    sys.exit(main())
