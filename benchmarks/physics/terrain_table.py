"""The table of results over made grounds, by robot and ground: found, certified, passed.

``python -m benchmarks.physics.terrain_table --seeds 20 --write docs/terrain_table.md``

Each walk is a row of a CSV file (``--rows``): a run that was stopped goes on where the file ends.
The table, the failures one by one, and the command are written into the page between its marks.
With ``--so-far`` nothing is run: what is in the file is printed.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from benchmarks.speed.terrain import ROBOTS
from gaitopt.errors import InputError
from gaitopt.files import written_whole
from gaitopt.planners.over_terrain.settings import TerrainSettings
from gaitopt.studies.result_table import rows_so_far
from gaitopt.studies.terrain_report import STAGES, failures, standings, terrain_markdown
from gaitopt.studies.terrain_study import (
    TERRAIN_COLUMNS,
    WIDEST,
    TerrainWalk,
    run_terrain_study,
    terrain_grid,
)

GROUNDS = ("rubble", "stepping_stones", "hills", "gaps", "stairs", "stairs_up", "stairs_down",
           "ramp:0.7")  # fmt: skip
"""Grounds of the table, with their friction where it is not the usual one."""
BEGIN, END = "<!-- results: begin -->", "<!-- results: end -->"
"""Marks in the page."""


def walks_of(options: argparse.Namespace) -> list[TerrainWalk]:
    """The walks of the table, seed by seed: what is there of a table is balanced over the rest."""
    return [
        walk for k in range(options.seeds + options.slippery)
        for walk in walks_with(options.first + k, options, slippery=k >= options.seeds)
    ]  # fmt: skip


def walks_with(seed: int, options: argparse.Namespace, *, slippery: bool) -> list[TerrainWalk]:
    """The walks with one seed, with the friction of the ground in physics, too, or the usual."""
    walks = []
    for ground in options.grounds.split(","):
        name, _, friction = ground.partition(":")
        own = float(friction) if friction else None
        for given in options.robots.split(","):
            robot, _, difficulty = given.partition(":")
            walks += terrain_grid(
                [seed], robots=[robot], terrains=[name],
                difficulties=[float(difficulty or options.difficulty)], length=options.length,
                friction=own, exhaustive=options.widest, simulate=not options.no_physics,
                physics_friction=(own or TerrainSettings.friction) if slippery else None,
            )  # fmt: skip
    return walks


def report(rows: Sequence[dict[str, str]], command: str) -> str:
    """What is written into the page: the command, the table and the failures."""
    rows = sorted(rows, key=_line)
    lines = [f"```\n{command}\n```", "", terrain_markdown(rows), "", summary(rows)]
    failed = failures(rows)
    if failed:
        lines += ["", "What failed:", "", *(f"- {_plain(text)}" for text in failed)]
    return "\n".join(lines)


def summary(rows: Sequence[dict[str, str]]) -> str:
    """How far all walks got, and the time of the search, in words."""
    counts = {stage: sum(row[stage] == "True" for row in rows) for stage in STAGES}
    rates = [rate for line in standings(rows) for rate in line.rates]
    words = ", ".join(f"{count} {stage}" for stage, count in counts.items())
    if not rates:
        return f"Of {len(rows)} grounds {words}."
    return (
        f"Of {len(rows)} grounds {words}. The search takes {np.median(rates):.2f} s of processor "
        f"time a metre in the median, and {np.percentile(rates, 95):.2f} s at the 95th percentile."
    )


def _line(row: dict[str, str]) -> tuple[int, str, str, int]:
    """Where a row belongs: robots as they are listed, walks with the usual physics first."""
    robots = [*ROBOTS, row["robot"]]
    grounds = [name.partition(":")[0] for name in GROUNDS]
    kind = [*grounds, row["terrain"]].index(row["terrain"])
    return robots.index(row["robot"]), row["physics_friction"], f"{kind:02d}", int(row["seed"])


def write(page: Path, text: str) -> None:
    """Put a text between the marks of a page.

    Raises:
        InputError: the page has no such marks.
    """
    whole = page.read_text("utf-8")
    before, begin, rest = whole.partition(BEGIN)
    _, end, after = rest.partition(END)
    if not begin or not end:
        raise InputError(f"{page} needs a line {BEGIN} and, below it, a line {END}")
    with written_whole(page) as stream:
        stream.write(f"{before}{BEGIN}\n\n{text}\n\n{END}{after}")


def command_of(given: Sequence[str]) -> str:
    """The command that prints the same table, without where files lie and how many processes."""
    kept, skip = [], False
    for text in given:
        name = text.partition("=")[0]
        if not skip and name not in ("--rows", "--write", "--jobs", "--so-far"):
            kept.append(text)
        skip = not skip and name in ("--rows", "--write", "--jobs") and "=" not in text
    return " ".join(["python -m benchmarks.physics.terrain_table", *kept])


def _plain(text: str) -> str:
    """A text without what Markdown and HTML would read as marks."""
    return text.replace("<", "&lt;").replace("_", "\\_").replace("*", "\\*")


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the table, and write it into a page."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.physics.terrain_table",
                                     description=__doc__)  # fmt: skip
    parser.add_argument("--seeds", type=int, default=20, help="grounds of each kind")
    parser.add_argument("--slippery", type=int, default=0,
                        help="further grounds of each kind, slippery in physics, too")  # fmt: skip
    parser.add_argument("--first", type=int, default=0, help="the first seed")
    parser.add_argument("--difficulty", type=float, default=1.0, help="of the grounds, 0 to 1")
    parser.add_argument("--length", type=float, default=3.0, help="from start to goal [m]")
    parser.add_argument("--robots", default=",".join(ROBOTS),
                        help="names, joined by commas; go2:0.5 has its own difficulty")  # fmt: skip
    parser.add_argument("--grounds", default=",".join(GROUNDS),
                        help="names, joined by commas; ramp:0.7 has the friction 0.7")  # fmt: skip
    parser.add_argument("--widest", type=int, default=WIDEST,
                        help="width of a second search where there is no way; 0: no")  # fmt: skip
    parser.add_argument("--no-physics", action="store_true", help="without physics")
    parser.add_argument("--jobs", type=int, default=-1, help="processes; -1: on all cores")
    parser.add_argument("--rows", type=Path, default=Path("terrain_table.csv"),
                        help="CSV file with a row for each walk")  # fmt: skip
    parser.add_argument("--so-far", action="store_true", help="print the rows that are there")
    parser.add_argument("--write", type=Path, help="page that the table is written into")
    given = list(sys.argv[1:] if arguments is None else arguments)
    options = parser.parse_args(given)
    if options.so_far:
        rows = [row.cells for row in rows_so_far(options.rows, TERRAIN_COLUMNS).values()]
    else:
        rows = run_terrain_study(
            walks_of(options), options.rows, jobs=options.jobs,
            progress=lambda done, total: print(f"{done} of {total}", file=sys.stderr, flush=True),
        )  # fmt: skip
    text = report(rows, command_of(given))
    print(text)
    if options.write is not None:
        write(options.write, text)
    return 0


if __name__ == "__main__":
    sys.exit(main())
