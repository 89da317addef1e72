"""How much faster another path would be: walks with exact timings along one path after another.

``python -m benchmarks.planning.paths [--robots go2,a1,anymal_c] [--walks swing,dynamic]
[--seeds 1] [--columns 5] [--rounds 6]`` takes continuous walks before their pace is looked at, and
improves the path of the body round by round (``paced.faster``; planners take
:data:`paced.ROUNDS` rounds). Each path is judged by the timing with exact forces, torques and
reserve (:func:`gaitopt.retimed`). A round is kept where it is faster, and the last table column
tells what friction, torques and reserve cost along the last path: its time with the three limits of
``benchmarks.physics.limits`` given up. Times are medians over the terrains.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence

import numpy as np

import gaitopt
from benchmarks.physics.force_rows import COLUMNS, benchmark_robot
from benchmarks.physics.limits import GIVEN_UP
from gaitopt.errors import InfeasibleStepError, SolverError
from gaitopt.plan.settings.time_optimal import RouteSettings
from gaitopt.planners.time_optimal.continuous import paced, planner
from gaitopt.planners.time_optimal.continuous.body import BalancedMotion, balanced
from gaitopt.planners.time_optimal.walk import prepare_route


def times(robot: gaitopt.Quadruped, walk: str, seed: int, columns: int, rounds: int) -> list[float]:
    """Times [s] of the first path and after each round; with three limits given up on first and
    last."""
    footholds = gaitopt.s_columns(seed, columns=columns, robot=robot)
    route = prepare_route(robot, footholds, RouteSettings.for_robot(robot, free=walk))
    found = balanced(route, planner._first_motion(route, 1.0))
    best = first = planner._timed(route, found, 0.0)
    out = [first.duration]
    for _ in range(rounds):
        other = paced.faster(route, found.motion)
        if other is not None:
            found = BalancedMotion(other.motion, found.solutions)
            best = _faster(best, route, found)
        out.append(best.duration)
    free = GIVEN_UP["all three"]
    return [*out, *(gaitopt.retimed(plan, free).duration for plan in (first, best))]


def _faster(best: gaitopt.Plan, route: planner.Route, found: BalancedMotion) -> gaitopt.Plan:
    """The faster one of a plan and the plan of a motion, if it has one."""
    try:
        plan = planner._timed(route, found, 0.0)
    except (InfeasibleStepError, SolverError):
        return best
    return min(best, plan, key=lambda one: one.duration)


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the table."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.planning.paths", description=__doc__
    )
    parser.add_argument("--robots", default="go2,a1,anymal_c", help="joined by commas")
    parser.add_argument("--walks", default="swing,dynamic", help="joined by commas")
    parser.add_argument("--seeds", type=int, default=1, help="terrains of each robot")
    parser.add_argument("--columns", type=int, default=COLUMNS, help="columns a leg")
    parser.add_argument("--rounds", type=int, default=6)
    asked = parser.parse_args(arguments)
    head = ["robot", "walk", "balance alone [s]", *(f"{n + 1}" for n in range(asked.rounds)),
            "all three, first path [s]", "all three, last path [s]"]  # fmt: skip
    print(f"| {' | '.join(head)} |\n|{'---|' * len(head)}")
    for name in asked.robots.split(","):
        robot = benchmark_robot(name)
        for walk in asked.walks.split(","):
            lines = [times(robot, walk, seed, asked.columns, asked.rounds)
                     for seed in range(asked.seeds)]  # fmt: skip
            cells = [f"{x:.2f}" for x in np.median(lines, axis=0)]
            print(f"| {' | '.join([name, walk, *cells])} |", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
