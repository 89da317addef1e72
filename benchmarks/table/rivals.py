"""Ours beside the obvious way, in the same run and with the same answers."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

import gaitopt
from benchmarks import walks
from benchmarks.measuring import Result, Timing, timed
from benchmarks.table import obvious
from benchmarks.table.planner import plan_time
from gaitopt import Plan
from gaitopt.conventions import FloatArray
from gaitopt.optimize.cog.solver import CogWorkspace

COG_AGREEMENT = 1e-5
"""Largest distance allowed between the COG targets of the two ways [m]."""
TIME_AGREEMENT = 1.0
"""Largest difference allowed between the durations of the two walks [%]."""


class _Race(NamedTuple):
    """Times of ours and of the obvious way over one walk, and how far their answers are apart."""

    steps: int
    programs: int
    our_cog: Timing
    our_plan: Timing
    anew: Timing
    once: Timing
    speeds: Timing
    cog_apart: float
    time_apart: float


def measure_obvious(quick: bool) -> list[Result]:
    """IPOPT for every COG and a linear program for every sample, beside ours."""
    race = _race(8 if quick else walks.MAIN_STEPS, quick)
    n, cog, plan = race.steps, race.our_cog.median, race.our_plan.median
    whole = Timing(*(tuple(x + np.median(y) for x in times)
                     for times, y in zip(race.speeds, race.anew, strict=True)))  # fmt: skip
    return [
        race.our_cog.result("ours-cog", f"ours: {n} COG problems, built and solved", "ms"),
        race.anew.result("obvious-cog-anew", f"{n} COG problems, IPOPT built anew (Opti)", "ms",
                         ratio=race.anew.median / cog),
        race.once.result("obvious-cog-once", f"{n} COG problems, IPOPT built once (nlpsol)", "ms",
                         ratio=race.once.median / cog),
        race.our_plan.result("ours-plan", f"ours: the whole plan, {n} steps", "ms"),
        race.speeds.result("obvious-speeds", f"IK and an LP a sample: {race.programs} LPs", "ms",
                           ratio=race.speeds.median / plan),
        whole.result("obvious-plan", f"the obvious way: IPOPT anew, LPs, {n} steps", "ms",
                     ratio=whole.median / plan),
        Result("cog-apart", "COG targets of both ways: farthest apart", "m",
               (race.cog_apart,), limit=COG_AGREEMENT, must_hold=True),
        Result("time-apart", "durations of both walks: difference", "%",
               (race.time_apart,), limit=TIME_AGREEMENT, must_hold=True),
        *_one_program(200 if quick else 2000),
    ]  # fmt: skip


def _one_program(rounds: int) -> list[Result]:
    """How much of an LP's time is HiGHS, and how much the way to it."""
    leg, along = walks.robot().legs["LF"], np.array([1.0, 0.0, 0.0])
    jacobian, limits = leg.jacobian(np.array([0.1, 0.5, -1.2])), leg.velocity_limits
    far = timed(lambda: obvious.program(jacobian, along, limits), rounds)
    near = timed(
        lambda: gaitopt.solve_speed_lp(gaitopt.build_speed_lp(jacobian, along, limits)), rounds
    )
    return [
        near.result("lp-ours", "one LP by solve_speed_lp (CasADi, HiGHS)", "µs"),
        far.result("lp-obvious", "one LP by linprog (SciPy, HiGHS)", "µs",
                   ratio=far.median / near.median),
    ]  # fmt: skip


def _race(count: int, quick: bool) -> _Race:
    robot, walk = walks.robot(), walks.plan(count)
    steps, samples = obvious.steps_of(walk.footholds), intervals(walk)
    parametric = obvious.parametric_cog()
    ours = np.array([walk.phases[0].cog_start, *(p.cog_end for p in walk.phases[::2])])
    found = [obvious.walk_cogs(robot, steps, f) for f in (obvious.cog_anew, parametric)]
    durations: list[float] = []
    return _Race(
        steps=count,
        programs=sum(4 * stance + swing for stance, swing in samples),
        our_cog=timed(lambda: our_cogs(walk), 5 if quick else 20),
        our_plan=plan_time(count, 5 if quick else 20),
        anew=timed(lambda: obvious.walk_cogs(robot, steps, obvious.cog_anew), 1 if quick else 5),
        once=timed(lambda: obvious.walk_cogs(robot, steps, parametric), 2 if quick else 10),
        speeds=timed(
            lambda: durations.append(obvious.walk_time(robot, steps, found[0], samples)),
            rounds=1 if quick else 3,
            warm_up=0,
        ),
        cog_apart=max(float(np.linalg.norm(cogs - ours, axis=1).max()) for cogs in found),
        time_apart=100.0 * abs(durations[0] / walk.duration - 1.0),
    )


def our_cogs(walk: Plan) -> FloatArray:
    """The COG targets of a walk by ours, one problem after the other ``(S, 2)`` [m]."""
    workspace = CogWorkspace()
    places: list[FloatArray] = []
    for arguments in walks.cog_arguments(walk):
        if places:
            arguments["start"] = places[-1]
        solution = gaitopt.solve_cog(gaitopt.build_cog_problem(**arguments), workspace)
        places.append(solution.position)
    return np.array(places)


def intervals(walk: Plan) -> list[tuple[int, int]]:
    """For each step the intervals between the plan's knots in its stance phase and its swing."""
    starts = np.searchsorted(walk.path.times, [p.start for p in walk.phases])
    counts = np.diff(np.append(starts, len(walk.path.times) - 1)).tolist()
    return list(zip(counts[::2], counts[1::2], strict=True))
