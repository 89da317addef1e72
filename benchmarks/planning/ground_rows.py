"""Time-optimal rows over footholds that were found on ground: how fast, and what judges say.

``python -m benchmarks.planning.ground_rows [--robots go2,anymal_c] [--rows route,swing,dynamic]``
finds a way over each ground, plans ``plan_route`` over its footholds, and prints a line for each
row: its duration and that of the walk that was found, the certificate, with ``--physics`` what
becomes of it in physics, and why the walk phase by phase was taken. ``--keep FOLDER`` keeps the
walks that were found, and takes those that are there. Exit code 1 when a plan is violated.
"""

from __future__ import annotations

import argparse
import sys
import time
import warnings
from collections.abc import Sequence
from pathlib import Path

import gaitopt
from gaitopt import FootholdsWarning, GaitoptError, Plan
from gaitopt.studies.robots import study_robot

ROBOTS = "go2,anymal_c"
GROUNDS = "rubble,hills,gaps,stairs_up,ramp"
ROWS = "route,swing,height,posture,dynamic"


def found_way(name: str, kind: str, given: argparse.Namespace) -> Plan:
    """The walk of the search over a ground, or the one that was kept."""
    keep = given.keep and given.keep / f"{name}-{kind}-{given.difficulty:g}-{given.seed}.npz"
    if keep and keep.exists():
        return gaitopt.load_plan(keep)
    robot = study_robot(name)
    ground = gaitopt.make_ground(
        kind, seed=given.seed, difficulty=given.difficulty, robot=robot, length=given.length
    )
    plan = gaitopt.plan_terrain(robot, ground, (given.length, 0.0))
    if keep:
        plan.save(keep)
    return plan


def told(plan: Plan, free: str, physics: bool) -> tuple[str, bool]:
    """What is to be told of a row over a walk's footholds, and whether it is violated."""
    began = time.process_time()
    try:
        row = gaitopt.plan_route(plan.robot, plan.footholds, free=free)
    except GaitoptError as error:
        return f"{type(error).__name__}: {error}", False
    seconds = time.process_time() - began
    certificate = gaitopt.verify(row)
    words = [
        f"{row.duration:6.2f} s", f"{plan.duration / row.duration:5.2f} times as fast",
        f"planned in {seconds:.1f} s", certificate.outcome,
        *(f"{c.name} {c.worst:.3g}" for c in certificate.violations),
    ]  # fmt: skip
    if physics:
        result = gaitopt.simulate(row)
        words.append("physics: " + ("passed" if result.passed else f"{result.failures}"))
    reason = getattr(row.record, "instead", None)
    return ", ".join(words) + (f" ({reason})" if reason else ""), not certificate.ok


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the lines."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.planning.ground_rows", description=__doc__
    )
    parser.add_argument("--robots", default=ROBOTS)
    parser.add_argument("--grounds", default=GROUNDS)
    parser.add_argument("--rows", default=ROWS)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--difficulty", type=float, default=0.5)
    parser.add_argument("--length", type=float, default=1.5, help="of the walk [m]")
    parser.add_argument("--physics", action="store_true")
    parser.add_argument("--keep", type=Path, metavar="FOLDER")
    given = parser.parse_args(arguments)
    violated = 0
    for name in given.robots.split(","):
        for kind in given.grounds.split(","):
            try:
                plan = found_way(name, kind, given)
            except GaitoptError as error:
                print(f"{name} {kind}: no way, {error}", flush=True)
                continue
            print(f"{name} {kind}: found {plan.duration:.2f} s", flush=True)
            for free in given.rows.split(","):
                with warnings.catch_warnings():
                    warnings.simplefilter("ignore", FootholdsWarning)
                    words, bad = told(plan, free, given.physics)
                violated += bad
                print(f"{name} {kind} {free:8} {words}", flush=True)
    return int(violated > 0)


if __name__ == "__main__":
    sys.exit(main())
