"""What each kind of limit costs a walk along splines: the multipliers of its problem, added up.

``python -m benchmarks.planning.prices [--robot wang2020] [--walks swing,height] [--columns 17]
[--margin 0.02] [--seeds 1]`` prints a table. A multiplier tells how much time a walk would save if
its row asked for a little less, so these are derivatives, and hold near the walk that was found:
for each step the milliseconds for one millimetre less of swing height, of clearance and of the
margin, for one percent faster joints, and for joint accelerations one percent higher. The last two
are what the accelerations cost as a whole, about lift-offs and touchdowns and elsewhere, if that
falls as the inverse of their limit. All are means over the terrains.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

import gaitopt
from gaitopt.optimize.route.dynamic_layout import interval_times
from gaitopt.planners.time_optimal.build import build_route
from gaitopt.planners.time_optimal.flights import Flights, height_rows, smooth_apex_knots
from gaitopt.planners.time_optimal.smooth.build import build_smooth
from gaitopt.planners.time_optimal.smooth.guess import rough_guess
from gaitopt.planners.time_optimal.smooth.rounds import FoundMotion, best_motion
from gaitopt.planners.time_optimal.smooth.window import SmoothWindow
from gaitopt.planners.time_optimal.walk import Route, prepare_route

MILLI = 1e-3
"""Milliseconds, and millimetres."""
PERCENT = 0.01
"""One percent."""
HEAD = ("spline [s]", "swing height [ms/mm]", "clearance [ms/mm]", "margin [ms/mm]",
        "joint velocities [ms/%]", "accelerations about loads [ms]", "elsewhere [ms]")  # fmt: skip


def found_walk(route: Route) -> FoundMotion:
    """The walk along splines as the planner finds it, before it is timed by forces."""
    knots, base = build_route(route)
    problem = build_smooth(base, knots, route)
    poses, spans = rough_guess(route, problem.time_unit)
    window = SmoothWindow.whole(route, replace(problem, poses=poses), knots, spans)
    return best_motion(window)[0]


def prices(robot: gaitopt.Quadruped, footholds: gaitopt.Footholds, walk: str, margin: float,
           height: float) -> list[float]:  # fmt: skip
    """The numbers of a line of the table for one terrain.

    Args:
        robot, footholds: the walk.
        walk: a variant that keeps a static margin.
        margin: the stability margin [m].
        height: of the body [m].
    """
    settings = gaitopt.RouteSettings.for_robot(
        robot, free=walk, stability_margin=margin, body_height=height
    )
    route = prepare_route(robot, footholds, settings)
    motion = found_walk(route)
    solution = motion.solutions[-1]
    problem, flights = solution.problem, Flights.of(motion.motion.knots)
    parts = problem.split_dynamic(solution.multipliers)
    single = np.empty(len(problem.row_order))
    single[problem.row_order] = problem.split(parts.static).single
    rows = height_rows(problem.rows)
    apex = np.isin(
        problem.rows.knot[rows],
        np.concatenate(smooth_apex_knots(flights.lift_off, settings.swing_knots)),
    )
    spans = problem.unpack(solution.x)[1]
    each = np.append(spans, spans[-1:])[:, None]
    # Rows are counted in time units: so is the objective, and their quotient has none.
    bent = (parts.accelerations * problem.acceleration_limits * each).sum(axis=(0, 2))
    bent = problem.time_unit * bent
    about = np.zeros(len(bent), dtype=bool)
    for ends in (flights.lift_off, flights.touchdown):
        about[np.clip(ends[:, None] + [-1, 0, 1], 0, len(about) - 1)] = True
    fast = parts.velocities[:, :-1] * problem.interval_velocity_limits
    quick = (fast * interval_times(spans)[:, None]).sum()
    unit = problem.time_unit / route.count
    return [
        float(motion.motion.times[-1]), unit * single[rows][apex].sum(),
        unit * single[rows][~apex].sum(), unit * single[len(problem.rows.knot) :].sum(),
        unit * quick * PERCENT / MILLI, unit * bent[about].sum() / MILLI,
        unit * bent[~about].sum() / MILLI,
    ]  # fmt: skip


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the table."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.planning.prices", description=__doc__
    )
    parser.add_argument("--robot", default="wang2020")
    parser.add_argument("--walks", default="swing,height", help="variants, joined by commas")
    parser.add_argument("--columns", type=int, default=17, help="columns a leg")
    parser.add_argument("--margin", type=float, default=0.02, help="stability margin [m]")
    parser.add_argument("--height", type=float, default=0.4, help="body height [m]")
    parser.add_argument("--seeds", type=int, default=1, help="terrains")
    options = parser.parse_args(arguments)
    robot = gaitopt.load_robot(options.robot)
    print(f"| walk | {' | '.join(HEAD)} |\n|{'---|' * (1 + len(HEAD))}")
    for walk in options.walks.split(","):
        found = [
            prices(robot, gaitopt.s_columns(seed, columns=options.columns, robot=robot), walk,
                   options.margin, options.height)
            for seed in range(options.seeds)
        ]  # fmt: skip
        cells = [f"{x:.2f}" for x in np.mean(found, axis=0)]
        print(f"| {walk} | {' | '.join(cells)} |", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
