"""Where the time of the paper's plan goes, and what of it could not be left out.

``python -m benchmarks.speed.plan`` plans the main job of the benchmarks many times and prints its
processor time, also as a multiple of a fixed workload in the same run, and that of its parts, both
within a plan and repeated by themselves. Then it does alone what any such plan needs: the legs'
inverse kinematics at all knots, their forward kinematics between knots, by which the knots are
chosen, two looks at each COG problem, and the objects of which the plan consists. Their sum is a
floor: each runs with all that it needs in the processor's caches, and nothing chooses, checks or
joins.
"""

from __future__ import annotations

import importlib
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np

import gaitopt
from benchmarks import walks
from benchmarks.measuring import least_time, timed, use_one_core, workload
from gaitopt.conventions import made
from gaitopt.motion.path import MotionPath
from gaitopt.optimize.cog.solver import CogWorkspace
from gaitopt.plan.phase import CogEvidence, Limit, Phase
from gaitopt.plan.plan import Plan
from gaitopt.robots.whole_body import feet_in_body, joints_from_feet_in_body

ROUNDS = 50
HOME = "gaitopt.planners.phase_by_phase"
PARTS = {
    "COG problems: built and solved": f"{HOME}.targets:_optimise",
    "knots of stances": f"{HOME}.timing:_stance_moves",
    "knots of swings": f"{HOME}.timing:_swing_moves",
    "the path": f"{HOME}.timing:_joined",
    "phases with their margins and limits": f"{HOME}.timing:crawl_phases",
    "whether legs or trunk touch": f"{HOME}.fitting_height:plan_touches",
    "limbs in columns": "gaitopt.plan.limbs_in_columns:_found",
    "feet that roll": "gaitopt.planners.phase_by_phase.beside_columns:foot_rolling_off",
}
"""Parts of a plan, and the functions that do them; each is called once."""


class Part(NamedTuple):
    """Processor time of a part of the main job.

    Attributes:
        within: in a plan, mean [s].
        alone: repeated with the same arguments, so that all is in the processor's caches, least
            [s].
    """

    within: float
    alone: float


def whole() -> Plan:
    """The main job."""
    robot, terrain = walks.robot(), walks.terrain(walks.MAIN_STEPS)
    return gaitopt.plan_crawl(robot, terrain, timing="velocity")


def parts() -> dict[str, Part]:
    """Processor times of each part of the main job."""
    spent, calls = dict.fromkeys(PARTS, 0.0), dict[str, Callable[[], Any]]()
    kept = []
    for what, where in PARTS.items():
        module, name = where.split(":")
        home = importlib.import_module(module)
        function = getattr(home, name)
        kept.append((home, name, function))
        setattr(home, name, _counted(function, what, spent, calls))
    try:
        for _ in range(ROUNDS):
            whole()
    finally:
        for home, name, function in kept:
            setattr(home, name, function)
    return {
        what: Part(total / ROUNDS, least_time(calls[what], ROUNDS)) for what, total in spent.items()
    }


def _counted(
    function: Callable[..., Any], what: str, spent: dict[str, float],
    calls: dict[str, Callable[[], Any]],
) -> Callable[..., Any]:  # fmt: skip
    """The function, whose processor time is added to what was spent; its last call is kept."""

    def call(*arguments: Any, **options: Any) -> Any:
        calls[what] = partial(function, *arguments, **options)
        begin = time.process_time()
        try:
            return function(*arguments, **options)
        finally:
            spent[what] += time.process_time() - begin

    return call


def floor(plan: Plan) -> dict[str, float]:
    """Least processor times of what a plan cannot do without, each alone [s]."""
    robot, path = plan.robot, plan.path
    joints = path.coefficients[-1][:, 6:]
    starts = np.searchsorted(path.times, [phase.start for phase in plan.phases[1::2]])
    ends = np.searchsorted(path.times, [phase.end for phase in plan.phases[1::2]])
    flies = np.zeros(len(joints), dtype=np.bool_)
    for first, last in zip(starts, ends, strict=True):
        flies[first:last] = True
    standing, flying = joints[~flies], joints[flies]
    feet, leg = feet_in_body(robot, standing), robot.legs["LF"]
    foot = leg.forward(flying[:, list(robot.leg_columns["LF"])])
    workspace, problems = CogWorkspace(), _problems(plan)
    looks = [(workspace.call(p.formulation), p) for p in problems]

    def objects() -> object:
        phases = [
            made(
                Phase,
                **{
                    **vars(phase),
                    "limited_by": tuple(made(Limit, **vars(limit)) for limit in phase.limited_by),
                    "evidence": phase.evidence and made(CogEvidence, **vars(phase.evidence)),
                },
            )
            for phase in plan.phases
        ]
        return replace(plan, phases=tuple(phases))

    def look() -> None:
        for call, problem in looks * 2:
            call(problem.parameters[:2], problem.parameters, np.zeros(len(problem.names)))

    each = {
        "inverse kinematics, four legs in stances": lambda: joints_from_feet_in_body(robot, feet),
        "forward kinematics between the same": lambda: feet_in_body(robot, standing),
        "both, of the leg that swings": lambda: leg.forward(leg.inverse(foot)),
        "two looks at each COG problem": look,
        "phases, limits, evidence and plan": objects,
        "the path, from its numbers": lambda: MotionPath(path.times, path.coefficients),
    }
    return {what: least_time(call, ROUNDS) for what, call in each.items()}


def _problems(plan: Plan) -> list[Any]:
    """The COG problems of a plan."""
    return [gaitopt.build_cog_problem(**given) for given in walks.cog_arguments(plan)]


def main(arguments: Sequence[str] | None = None) -> int:
    """Print all times."""
    use_one_core()
    unit, times = workload(), timed(whole, ROUNDS, warm_up=3)
    print(f"Fixed workload {1e3 * unit:.1f} ms. The plan: median {1e3 * times.median:.1f} ms, "
          f"least {1e3 * min(times.cpu):.1f} ms, {times.median / unit:.2f} workloads.")  # fmt: skip
    found = parts()
    within, alone = (sum(part[k] for part in found.values()) for k in range(2))
    print(f"Parts, within a plan {1e3 * within:.1f} ms, repeated alone {1e3 * alone:.1f} ms:")
    for what, part in found.items():
        print(f"  {1e3 * part.within:5.2f} ms, {1e3 * part.alone:5.2f} ms  {what}")
    least = floor(whole())
    print(f"What no plan can leave out, alone, at least {1e3 * sum(least.values()):.1f} ms:")
    for what, spent in least.items():
        print(f"  {1e3 * spent:5.2f} ms  {what}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
