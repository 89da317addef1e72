"""Random instants of plans, handed back to their planner as a state.

``python -m benchmarks.physics.from_state [--instants 100] [--seed 0] [--physics]`` takes plans, ten
of them by default and twenty with ``--cases all``, and random instants of each. The plan from each
instant's state must continue position, velocity and contacts, and the certificate must hold. What
is refused is counted, with its reason. With ``--physics`` all plans that are certified are
simulated, too. Of walks over footholds the table also says by how much plans from their instants
take longer than what was left of the walk. Exit code 1 when a plan jumps, is not certified, or
fails in physics.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections import Counter
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from rich.console import Console
from rich.table import Table

import gaitopt
from gaitopt import LEGS, Plan, State
from gaitopt.errors import InfeasibleStateError
from gaitopt.robots.rotations import rpy_to_matrix

JUMP, RATE_JUMP = 1e-9, 1e-7
"""Largest jumps of a column [m, rad], and of a rate of the base or of a leg in the air [m/s,
rad/s]: rounding, which short pieces of a path make larger for rates."""
SLIDING = 1e-5
"""Largest speed of the standing feet of a state [m/s]: those of plans slide by a micrometre, and
those of the plan from a state do not, so that the rates of their joints differ by that."""

CERTIFIED = "certified"

Again = Callable[[Plan, float, State], Plan]


def _walk(planner: Callable[..., Plan]) -> tuple[Callable[[str], Plan], Again]:
    """A walk over two columns a leg, and the same from an instant of it."""

    def first(name: str) -> Plan:
        robot = gaitopt.load_robot(name)
        return planner(robot, gaitopt.s_columns(0, columns=2, robot=robot))

    def again(plan: Plan, instant: float, state: State) -> Plan:
        return planner(plan.robot, plan.footholds_ahead(instant), start=state)

    return first, again


def _gait(schedule: Callable[[float], gaitopt.GaitSchedule], cycle: float,
          speed: float) -> tuple[Callable[[str], Plan], Again]:  # fmt: skip
    """A gait, and the same from an instant of it."""

    def first(name: str) -> Plan:
        return gaitopt.plan_gait(
            gaitopt.load_robot(name), schedule(cycle), velocity=speed, duration=0.5
        )

    def again(plan: Plan, instant: float, state: State) -> Plan:
        return gaitopt.plan_gait(
            plan.robot, schedule(cycle), velocity=0.5 * speed, duration=0.2, start=state
        )

    return first, again


def _stride() -> tuple[Callable[[str], Plan], Again]:
    """A walk over an obstacle, and the same from an instant of it before the first foot crosses."""

    def first(name: str) -> Plan:
        robot = gaitopt.load_robot(name)
        return gaitopt.plan_stride(robot, gaitopt.rectangular_obstacle(0.015, 0.02), leave=0)

    def again(plan: Plan, instant: float, state: State) -> Plan:
        return gaitopt.plan_stride(plan.robot, plan.settings.obstacles[0], leave=0, start=state)

    return first, again


def _before_crossing(plan: Plan) -> float:
    """When the first foot of a stride lifts off that is to cross the obstacle [s]."""
    crosses = [s.start for s in plan.swings if s.foot_start[0] * s.foot_end[0] < 0.0]
    return min(crosses, default=plan.duration)


Case = tuple[str, tuple[Callable[[str], Plan], Again]]

CASES: dict[str, Case] = {
    "crawl of a1": ("a1", _walk(gaitopt.plan_crawl)),
    "crawl of anymal_c": ("anymal_c", _walk(gaitopt.plan_crawl)),
    "crawl of wang2020": ("wang2020", _walk(gaitopt.plan_crawl)),
    "route of a1": ("a1", _walk(gaitopt.plan_route)),
    "route of go1": ("go1", _walk(gaitopt.plan_route)),
    "route of wang2020": ("wang2020", _walk(gaitopt.plan_route)),
    "trot of a1": ("a1", _gait(gaitopt.trot, 0.5, 0.4)),
    "trot of anymal_c": ("anymal_c", _gait(gaitopt.trot, 0.5, 0.4)),
    "walk of a1": ("a1", _gait(gaitopt.walk, 1.0, 0.15)),
    "trot of go1": ("go1", _gait(gaitopt.trot, 0.4, 0.3)),
}
"""Ten plans: walks over footholds, at once and phase by phase, and gaits on two feet and three."""
MORE: dict[str, Case] = {
    "crawl of go2": ("go2", _walk(gaitopt.plan_crawl)),
    "crawl of hyq": ("hyq", _walk(gaitopt.plan_crawl)),
    "crawl of laikago": ("laikago", _walk(gaitopt.plan_crawl)),
    "route of anymal_c": ("anymal_c", _walk(gaitopt.plan_route)),
    "route of go2": ("go2", _walk(gaitopt.plan_route)),
    "trot of go2": ("go2", _gait(gaitopt.trot, 0.5, 0.4)),
    "trot of hyq": ("hyq", _gait(gaitopt.trot, 0.5, 0.4)),
    "walk of anymal_c": ("anymal_c", _gait(gaitopt.walk, 1.0, 0.15)),
    "stride of a1": ("a1", _stride()),
    "stride of go2": ("go2", _stride()),
}
"""Ten others, of more robots and planners. Instants of strides are those before a foot crosses."""
ALL = "all"


def judged(plan: Plan, state: State) -> str:
    """What became of a plan from a state."""
    begin = plan.at([0.0])
    off = np.abs(plan.path.evaluate([0.0])[0] - state.columns)
    off[5] = abs((off[5] + np.pi) % (2.0 * np.pi) - np.pi)
    if off.max() > JUMP:
        return "JUMPS"
    if velocity_jumps(plan, state):
        return "ITS VELOCITY JUMPS"
    stands = tuple(leg for leg, on in zip(LEGS, begin.contacts[0], strict=True) if on)
    if plan.entry and stands != state.support:
        return "ITS CONTACTS JUMP"
    found = gaitopt.verify(plan)
    return CERTIFIED if found.outcome == CERTIFIED else f"VIOLATED: {found.violations[0].name}"


def velocity_jumps(plan: Plan, state: State) -> bool:
    """Whether the velocity at a plan's begin is another one than that of the state."""
    robot = plan.robot
    jump = plan.path.evaluate([0.0], 1)[0] - state.column_rates
    if np.abs(jump[:6]).max() > RATE_JUMP:
        return True
    to_world = rpy_to_matrix(state.columns[3:6]) @ robot.body_axes
    for leg, own in robot.leg_columns.items():
        change = jump[6:][list(own)]
        if leg not in state.support and np.abs(change).max() > RATE_JUMP:
            return True
        slid = to_world @ robot.legs[leg].jacobian(state.q[7:][list(own)]) @ change
        if np.linalg.norm(slid) > SLIDING:
            return True
    return False


def fails_in_physics(plan: Plan) -> str:
    """Why a plan fails in physics; empty where it passes."""
    result = gaitopt.simulate(plan)
    if result.passed:
        return ""
    peak = f"joint velocity {100.0 * result.rate_use:.0f} %"
    return f"FAILS IN PHYSICS: {result.status}, {len(result.missed)} missed, {peak}"


class Outcomes(NamedTuple):
    """What became of random instants of a plan.

    Attributes:
        found: how often which outcome.
        seconds: mean processor time of planning [s].
        later: by how much each plan ends later than the one before would have [s].
        left: what was left of that one at each instant [s].
    """

    found: Counter[str]
    seconds: float
    later: list[float]
    left: list[float]


def outcomes(
    name: str, instants: int, seed: int = 0, *, physics: bool = False, tell: bool = False
) -> Outcomes:
    """What became of random instants of one of the plans; ``tell`` prints what is refused."""
    robot, (first, again) = (CASES | MORE)[name]
    plan, found, spent = first(robot), Counter[str](), 0.0
    later, left = [], []
    latest = _before_crossing(plan) if name.startswith("stride") else plan.duration
    for instant in np.random.default_rng(seed).uniform(0.0, latest, instants).tolist():
        state, begin = plan.state(instant), time.process_time()
        try:
            other = again(plan, instant, state)
        except InfeasibleStateError as error:
            found[f"refused: {error.limit}"] += 1
            if tell:
                print(f"{name}, {instant:.6f} s: {error}", file=sys.stderr)
            spent += time.process_time() - begin
        else:
            spent += time.process_time() - begin
            left.append(plan.duration - instant)
            later.append(other.duration - left[-1])
            outcome = judged(other, state)
            if physics and outcome == CERTIFIED:
                outcome = fails_in_physics(other) or outcome
            found[outcome] += 1
    return Outcomes(found, spent / instants, later, left)


def main(arguments: Sequence[str] | None = None) -> int:
    """Print a table; 1 when a plan jumps or is not certified."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.physics.from_state")
    parser.add_argument("--instants", type=int, default=100)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--physics", action="store_true")
    parser.add_argument("--tell", action="store_true", help="print what is refused")
    known = [*CASES, *MORE]
    parser.add_argument("--cases", nargs="*", choices=[*known, ALL], default=list(CASES))
    asked = parser.parse_args(arguments)
    table = Table("plan", "certified", "other outcomes", "planned in [s]", "later by [s]", "of [s]")
    faults = 0
    for name in known if ALL in asked.cases else asked.cases:
        found, seconds, later, left = outcomes(
            name, asked.instants, asked.seed, physics=asked.physics, tell=asked.tell
        )
        good = found.pop(CERTIFIED, 0)
        faults += sum(n for what, n in found.items() if not what.startswith("refused"))
        others = "; ".join(f"{n} {what}" for what, n in found.most_common())
        # Gaits go on in another way and for another time.
        walks = name.startswith(("crawl", "route")) and len(later) > 0
        told = [f"{np.mean(each):.2f}" if walks else "" for each in (later, left)]
        table.add_row(name, f"{good} of {asked.instants}", others, f"{seconds:.2f}", *told)
    Console(width=120).print(table)
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
