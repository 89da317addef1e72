"""Walks along splines with other constants: how fast they are, and whether physics accepts them.

``python -m benchmarks.planning.turns [CONSTANTS ...] [--walks swing,height] [--columns 17]
[--seeds 1] [--margin 0.02] [--no-physics] [--certificate]``

Each of the CONSTANTS is a set of values by name, as in ``RAMPS=(0.003,0.002);LOAD_TIME=0.02``;
names are those of ``python -m benchmarks.planning.constants``. The walks are planned with the
constants as they are, and then with each set. A line tells how many times as fast as the paper's
method a walk is (the row ``the paper`` of ``gaitopt race``), how fast joint velocities alone would
let it follow its path, and the processor time of planning. From physics it tells the largest
velocity of a joint, as a share of its limit, and what was missed. Numbers are medians over the
terrains, but the velocity is the largest.
"""

from __future__ import annotations

import argparse
import ast
import sys
from collections.abc import Sequence
from contextlib import ExitStack
from time import process_time
from typing import NamedTuple

import numpy as np

import gaitopt
from benchmarks.physics.limits import by_joints
from benchmarks.planning.constants import changed
from gaitopt.errors import InputError

HEAD = (
    "constants", "walk", "x the paper", "x by joints", "planning [ms a step]", "certified",
    "passed", "joint velocity", "missed",
)  # fmt: skip


class Raced(NamedTuple):
    """One walk against the paper's method.

    Attributes:
        ratio: how many times as fast it is.
        by_joints: how many times as fast it would be by joint velocities alone, along its path.
        planning: processor time a step [s].
        certified: whether it is; ``None`` where this was not looked at.
        passed, peak, missed: whether it passed in physics, the largest velocity of a joint there as
            a share of its limit, and how many footholds were missed; ``None`` without physics.
    """

    ratio: float
    by_joints: float
    planning: float
    certified: bool | None = None
    passed: bool | None = None
    peak: float | None = None
    missed: int | None = None


def raced(
    robot: gaitopt.Quadruped, footholds: gaitopt.Footholds, walk: str, margin: float,
    height: float, *, physics: bool, certificate: bool,
) -> Raced:  # fmt: skip
    """One walk against the paper's method.

    Args:
        robot, footholds: the race's.
        walk: a variant of ``plan_route``.
        margin: the stability margin of both [m].
        height: of the body, of both [m].
        physics: whether to walk it.
        certificate: whether to certify it.
    """
    paper = gaitopt.plan_crawl(
        robot, footholds, timing="velocity", stability_margin=margin, body_height=height
    ).duration
    began = process_time()
    plan = gaitopt.plan_route(
        robot, footholds, free=walk, stability_margin=margin, body_height=height
    )
    planning = (process_time() - began) / len(plan.swings)
    found = Raced(paper / plan.duration, paper / by_joints(plan)[0], planning)
    if certificate:
        found = found._replace(certified=gaitopt.verify(plan).outcome == "certified")
    if physics:
        report = gaitopt.simulate(plan)
        found = found._replace(
            passed=report.passed, peak=report.rate_use, missed=len(report.missed)
        )
    return found


def line(label: str, walk: str, rows: Sequence[Raced]) -> str:
    """A line of the table for one walk over some terrains."""
    ratio, joints, planning = np.median([row[:3] for row in rows], axis=0)

    def of(values: Sequence[bool | None]) -> str:
        return "" if None in values else f"{sum(map(bool, values))} of {len(rows)}"

    peaks = [row.peak for row in rows if row.peak is not None]
    missed = [row.missed for row in rows if row.missed is not None]
    cells = (
        label, walk, f"{ratio:.4f}", f"{joints:.4f}", f"{1e3 * planning:.0f}",
        of([row.certified for row in rows]), of([row.passed for row in rows]),
        f"{max(peaks):.0%}" if peaks else "", f"{sum(missed)}" if missed else "",
    )  # fmt: skip
    return f"| {' | '.join(cells)} |"


def values_of(text: str) -> dict[str, object]:
    """Constants by name from ``NAME=VALUE;NAME=VALUE``.

    Raises:
        InputError: a part is not of this form, or a value is no Python literal.
    """
    out: dict[str, object] = {}
    for part in filter(None, text.split(";")):
        name, _, value = part.partition("=")
        try:
            out[name.strip()] = ast.literal_eval(value.strip())
        except (ValueError, SyntaxError) as error:
            raise InputError(f"{part!r} is not NAME=VALUE with a Python literal") from error
    return out


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the table."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.planning.turns", description=__doc__
    )
    parser.add_argument("constants", nargs="*", help="sets such as 'LOAD_TIME=0.02;KINK=0.01'")
    parser.add_argument("--walks", default="swing,height", help="variants, joined by commas")
    parser.add_argument("--columns", type=int, default=17, help="columns a leg")
    parser.add_argument("--first", type=int, default=0, help="seed of the first terrain")
    parser.add_argument("--seeds", type=int, default=1, help="terrains")
    parser.add_argument("--margin", type=float, default=0.02, help="stability margin [m]")
    parser.add_argument("--height", type=float, default=0.4, help="body height [m]")
    parser.add_argument("--no-physics", action="store_true", help="do not walk")
    parser.add_argument("--certificate", action="store_true", help="certify")
    options = parser.parse_args(arguments)
    try:
        sets = [("as they are", {}), *((text, values_of(text)) for text in options.constants)]
    except InputError as error:
        parser.error(str(error))
    robot = gaitopt.load_robot("wang2020")
    print(f"| {' | '.join(HEAD)} |\n|{'---|' * len(HEAD)}", flush=True)
    for label, values in sets:
        with ExitStack() as stack:
            for name, value in values.items():
                stack.enter_context(changed(name, value))
            for walk in options.walks.split(","):
                rows = [
                    raced(robot, gaitopt.s_columns(seed, columns=options.columns), walk,
                          options.margin, options.height, physics=not options.no_physics,
                          certificate=options.certificate)
                    for seed in range(options.first, options.first + options.seeds)
                ]  # fmt: skip
                print(line(label, walk, rows), flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
