"""The planner: a whole plan, how its time grows, and the COG problems in it."""

from __future__ import annotations

from functools import partial
from typing import Any, Literal

import numpy as np

import gaitopt
from benchmarks import walks
from benchmarks.measuring import Result, Timing, timed
from gaitopt.optimize.cog.solver import CogWorkspace

Objective = Literal["distance", "margin"]

MOST_GROWTH = 1.1
"""Largest power of the steps that still counts as linear: clocks and caches make noise."""
_ROUNDS = {16: 100, 64: 50, 256: 15, 1024: 5, 4096: 3}


def plan_time(steps: int, rounds: int) -> Timing:
    """Times of planning a walk of so many steps."""
    robot, terrain = walks.robot(), walks.terrain(steps)
    return timed(
        lambda: gaitopt.plan_crawl(robot, terrain, timing="velocity"), rounds, min(rounds, 3)
    )


def measure_plan(quick: bool) -> list[Result]:
    """The main job: plan 64 steps."""
    timing = plan_time(walks.MAIN_STEPS, rounds=10 if quick else 100)
    what = f"plan_crawl, {walks.MAIN_STEPS} steps"
    return [timing.result("plan", what, "ms", goal=10.0, limit=30.0)]


def measure_growth(quick: bool) -> list[Result]:
    """Times of longer and longer walks, and the power of the steps with which they grow."""
    sizes = [n for n in _ROUNDS if n <= 256] if quick else list(_ROUNDS)
    timings = {n: plan_time(n, 3 if quick else _ROUNDS[n]) for n in sizes}
    results = [t.result(f"growth-{n}", f"plan_crawl, {n} steps", "ms") for n, t in timings.items()]
    return [*results, *(_power(timings, n) for n in (sizes[0], sizes[len(sizes) // 2]))]


def _power(timings: dict[int, Timing], first: int) -> Result:
    """The fitted ``p`` of walks of ``first`` steps and more."""
    sizes = [n for n in timings if n >= first]
    times = [timings[n].median for n in sizes]
    power = float(np.polyfit(np.log(sizes), np.log(times), 1)[0])
    what = f"p in time ~ steps^p, {sizes[0]} to {sizes[-1]} steps"
    return Result(f"growth-power-{first}", what, "", (power,), limit=MOST_GROWTH)


def measure_cog(quick: bool) -> list[Result]:
    """One COG problem: each of the main job's in turn, several rounds."""
    rounds = 2 if quick else 20
    arguments, workspace = walks.cog_arguments(walks.plan()), CogWorkspace()
    results = []
    objectives: tuple[Objective, ...] = ("distance", "margin")
    for objective in objectives:
        problems = [gaitopt.build_cog_problem(**a, objective=objective) for a in arguments]
        solves = [partial(gaitopt.solve_cog, problem, workspace) for problem in problems]
        both = [partial(_build_and_solve, a, objective, workspace) for a in arguments]
        results += [
            timed(solves, rounds).result(f"cog-{objective}-solve", f"solve_cog, {objective}", "µs"),
            timed(both, rounds).result(
                f"cog-{objective}-build", f"build_cog_problem + solve_cog, {objective}", "µs"
            ),
        ]
    return results


def _build_and_solve(
    arguments: dict[str, Any], objective: Objective, workspace: CogWorkspace
) -> gaitopt.CogSolution:
    return gaitopt.solve_cog(gaitopt.build_cog_problem(**arguments, objective=objective), workspace)
