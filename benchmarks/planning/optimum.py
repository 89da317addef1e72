"""Whether another solver, from other first guesses, finds faster time-optimal walks than ours.

``python -m benchmarks.planning.optimum [--rows swing,height,posture] [--steps 16] [--starts 5]``
gives the problem of each row to IPOPT, in CasADi with exact derivatives: once from our first guess,
and then from guesses that are shaken at random. It prints how long IPOPT's walks take over ours,
at their knots. The problems are not convex, so this is no proof; but where no start leads to a
faster walk, what is missing to a lower bound is the bound's fault.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Sequence

import numpy as np

from benchmarks import walks
from benchmarks.table.route import rival
from gaitopt.conventions import FloatArray
from gaitopt.interior_point.solver import minimise
from gaitopt.optimize.route.problem import RouteProblem
from gaitopt.plan.settings.time_optimal import RouteSettings
from gaitopt.planners.time_optimal.build import build_route
from gaitopt.planners.time_optimal.walk import prepare_route

SHAKEN = np.array([0.03, 0.03, 0.03, 0.1, 0.1, 0.1, 0.02, 0.02, 0.02])
"""Standard deviation of what is added to each entry of a pose: body, its angles, foot [m, rad]."""
LONGER = (0.5, 4.0)
"""Factors of the times of a shaken guess."""


def shaken(problem: RouteProblem, seed: int) -> tuple[FloatArray, FloatArray]:
    """Poses and times of the first guess, with noise on all that is unknown."""
    poses, times = problem.unpack(problem.first_guess())
    if not seed:
        return poses, times
    rng = np.random.default_rng(seed)
    noise = rng.normal(size=problem.numbering.size)
    poses = poses + SHAKEN * np.where(problem.unknown >= 0, _spread(problem, noise), 0.0)
    return poses, times * rng.uniform(*LONGER, size=len(times))


def _spread(problem: RouteProblem, noise: FloatArray) -> FloatArray:
    """Noise of all unknowns at the poses that they are part of ``(K, 9)``."""
    out = np.zeros(problem.poses.shape)
    out[:, problem.free_columns] = problem.of_poses(noise)
    return out


def main(arguments: Sequence[str] | None = None) -> int:
    """Print what was found."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.planning.optimum", description=__doc__
    )
    parser.add_argument("--rows", default="swing,height,posture", help="joined by commas")
    parser.add_argument("--steps", type=int, default=16)
    parser.add_argument("--starts", type=int, default=5)
    asked = parser.parse_args(arguments)
    for row in asked.rows.split(","):
        settings = RouteSettings.for_robot(walks.robot(), free=row, timing="velocity")
        route = prepare_route(walks.robot(), walks.terrain(asked.steps), settings)
        problem = build_route(route)[1]
        ours = minimise(problem, problem.first_guess(), barrier=problem.first_barrier)
        best = float(problem.linear_cost @ ours.x) * problem.time_unit
        print(f"{row}, {asked.steps} steps: ours {best:.3f} s at the knots, {ours.status}",
              flush=True)  # fmt: skip
        for seed in range(asked.starts):
            begin, where = time.process_time(), "our guess" if not seed else f"shaken, {seed}"
            solve, found = rival("ipopt", problem, shaken(problem, seed))
            solve()
            cpu, share = time.process_time() - begin, found() / best
            print(f"  IPOPT from {where}: {share:.5f} times ours, {cpu:.1f} s of processor time",
                  flush=True)  # fmt: skip
    return 0


if __name__ == "__main__":
    sys.exit(main())
