"""A walk under disturbances: pushes, slippery ground, low columns, wrong masses, late sensors.

``python -m gaitopt.studies.disturbances`` prints the tables of ``docs/physics_table.md``.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from typing import Any

import numpy as np

from gaitopt.conventions import GRAVITY, LEGS
from gaitopt.plan.phase import Phase
from gaitopt.plan.plan import Plan
from gaitopt.plan.settings.base import VELOCITY
from gaitopt.planners.crawl import plan_crawl
from gaitopt.robots.catalog import load_robot
from gaitopt.simulation.result import SimulationResult
from gaitopt.simulation.settings import Push, SimulationSettings
from gaitopt.simulation.simulate import simulate
from gaitopt.terrain.columns import s_columns

PUSH_TIME = 0.5
"""Duration of a push [s]. Chosen here: much shorter than a swing of wang2020, which takes 3 s."""

PUSH_FORCES = (6.0, 9.0, 12.0, 15.0, 20.0, 25.0, 30.0, 40.0, 60.0, 80.0)
"""Forces that are tried one after the other until the walk fails [N]. Chosen for wang2020, which
weighs 25 kg: a steady force of 12 N uses up a margin of 20 mm (:func:`static_push`)."""

SHORTEST_PHASE = 0.1
"""Phases that are shorter are not pushed in [s]: stance phases in which the body hardly moves."""

DIRECTIONS = {"+x": (1, 0, 0), "-x": (-1, 0, 0), "+y": (0, 1, 0), "-y": (0, -1, 0)}
"""Directions of pushes in the world."""


@dataclass(frozen=True)
class PushLimit:
    """The largest push in one phase and direction that a walk survives.

    Attributes:
        kind, leg: of the phase: ``"swing"`` of that leg, or the ``"stance"`` before it.
        direction: of the push: a key of :data:`DIRECTIONS`.
        survived: the largest force with which the walk was finished with each foot on its foothold
            [N]; 0 where the smallest force was already too large.
        failed: the next larger force, with which it failed [N]; infinite where it never failed.
        reason: how it failed.
    """

    kind: str
    leg: str
    direction: str
    survived: float
    failed: float
    reason: str


@dataclass(frozen=True)
class Outcome:
    """The result of a walk under one disturbance."""

    name: str
    result: SimulationResult

    @property
    def verdict(self) -> str:
        """The result in a few words."""
        return describe(self.result)


def describe(result: SimulationResult) -> str:
    """``"survived"``, or what went wrong first."""
    if result.succeeded:
        return "survived"
    if not result.finished:
        return f"{result.status} at step {result.steps_done + 1}"
    missed = result.missed[0]
    return f"missed {len(result.missed)}, first step {missed.step + 1} {missed.leg}"


def static_push(plan: Plan) -> float:
    """The steady sideways force that moves the ZMP by the planned margin: ``m g S0 / h`` [N]."""
    height = plan.settings.body_height + plan.robot.foot_radius
    return plan.robot.mass * GRAVITY * plan.settings.stability_margin / height


def push_settings(phase: Phase, direction: str, force: float) -> SimulationSettings:
    """Settings with a push in the middle of a phase.

    Args:
        phase: in which the robot is pushed.
        direction: a key of :data:`DIRECTIONS`.
        force: of the push [N].
    """
    start = max(phase.start + 0.5 * phase.duration - 0.5 * PUSH_TIME, phase.start)
    x, y, z = (force * c for c in DIRECTIONS[direction])
    return SimulationSettings(pushes=(Push(start, PUSH_TIME, (x, y, z)),))


def push_limit(
    plan: Plan, phase: Phase, direction: str, forces: Sequence[float] = PUSH_FORCES
) -> PushLimit:
    """Simulate pushes with larger and larger forces in one phase, until the walk fails.

    Args:
        plan: the walk.
        phase, direction: of the push, as for :func:`push_settings`.
        forces: to try, in increasing order [N].
    """
    survived = 0.0
    for force in forces:
        result = simulate(plan, push_settings(phase, direction, force))
        if not result.succeeded:
            return PushLimit(phase.kind, phase.leg, direction, survived, force, describe(result))
        survived = force
    return PushLimit(phase.kind, phase.leg, direction, survived, np.inf, "")


def push_phases(plan: Plan) -> list[Phase]:
    """For each leg one swing phase and one stance phase before a swing, in the middle of the walk.

    Phases shorter than :data:`SHORTEST_PHASE` are not taken; a kind of phase of which there is no
    longer one is left out.
    """
    found: list[Phase] = []
    for leg in LEGS:
        for kind in ("stance", "swing"):
            phases = [p for p in plan.phases if p.kind == kind and p.leg == leg]
            long_enough = [p for p in phases if p.duration > SHORTEST_PHASE]
            if long_enough:
                found.append(long_enough[len(long_enough) // 2])
    return found


def disturbances(plan: Plan) -> dict[str, SimulationSettings]:
    """All disturbances of the table except pushes, by name.

    Their sizes are chosen here: from those that a robot must always expect to those with which
    walks begin to fail.
    """
    middle = len(plan.footholds) // 2
    cases = {
        "none": SimulationSettings(),
        "friction 0.6": SimulationSettings(friction=0.6),
        "friction 0.4": SimulationSettings(friction=0.4),
        "friction 0.2": SimulationSettings(friction=0.2),
        "body 5 % heavier": SimulationSettings(body_mass_factor=1.05),
        "body 5 % lighter": SimulationSettings(body_mass_factor=0.95),
        "legs 5 % heavier": SimulationSettings(leg_mass_factor=1.05),
        "legs 5 % lighter": SimulationSettings(leg_mass_factor=0.95),
        "body 5 % heavier, legs 5 % lighter": SimulationSettings(
            body_mass_factor=1.05, leg_mass_factor=0.95
        ),
        "sensing delay 10 ms": SimulationSettings(sensing_delay=0.010),
        "sensing delay 20 ms": SimulationSettings(sensing_delay=0.020),
        "sensing delay 40 ms": SimulationSettings(sensing_delay=0.040),
    }
    for error in (-0.005, -0.010, -0.020, 0.005):
        for leg in LEGS:
            name = f"column {1e3 * abs(error):g} mm too {'low' if error < 0 else 'high'}, {leg}"
            cases[name] = SimulationSettings(column_errors=((leg, middle, error),))
    cases["friction 0.6, 5 mm low (all four legs), masses +5 %, 10 ms"] = SimulationSettings(
        friction=0.6, body_mass_factor=1.05, leg_mass_factor=1.05, sensing_delay=0.010,
        column_errors=tuple((leg, middle, -0.005) for leg in LEGS),
    )  # fmt: skip
    return cases


def simulate_disturbances(plan: Plan, jobs: int = 1) -> list[Outcome]:
    """Simulate the plan under each of :func:`disturbances`, in ``jobs`` processes."""
    cases = disturbances(plan)
    results = _results(simulate, [(plan, settings) for settings in cases.values()], jobs)
    return [Outcome(name, result) for name, result in zip(cases, results, strict=True)]


def push_limits(
    plan: Plan, jobs: int = 1, forces: Sequence[float] = PUSH_FORCES
) -> list[PushLimit]:
    """All push limits: in each of :func:`push_phases`, in each direction, in ``jobs`` processes."""
    work = [(plan, p, d, tuple(forces)) for p in push_phases(plan) for d in DIRECTIONS]
    return _results(push_limit, work, jobs)


def table(outcomes: Iterable[Outcome], limits: Iterable[PushLimit], plan: Plan) -> str:
    """Two tables in Markdown: walks under disturbances, and the largest pushes."""
    lines = [
        "| disturbance | outcome | tilt [deg] | landing error [mm] | least COM margin [mm] | "
        "joint velocity |",
        "|---|---|---|---|---|---|",
    ]
    for o in outcomes:
        r = o.result
        lines.append(
            f"| {o.name} | {o.verdict} | {np.degrees(r.tilt):.2f} | {1e3 * r.landing_error:.1f} | "
            f"{1e3 * r.smallest_margin:.1f} | {r.rate_use:.0%} |"
        )
    lines += [
        "",
        f"Pushes of {PUSH_TIME} s, largest force survived / first that was not [N]; the static "
        f"prediction m g S0 / h is {static_push(plan):.1f} N:",
        "",
        f"| phase | {' | '.join(DIRECTIONS)} |",
        "|---|" + "---|" * len(DIRECTIONS),
    ]
    rows: dict[str, dict[str, str]] = {}
    for limit in limits:
        name = f"{limit.kind} {'before ' if limit.kind == 'stance' else ''}{limit.leg}"
        failed = "-" if np.isinf(limit.failed) else f"{limit.failed:g}"
        rows.setdefault(name, {})[limit.direction] = f"{limit.survived:g} / {failed}"
    for name, cells in rows.items():
        lines.append(f"| {name} | " + " | ".join(cells.get(d, "") for d in DIRECTIONS) + " |")
    return "\n".join(lines)


def _results(function: Callable[..., Any], work: list[tuple[Any, ...]], jobs: int) -> list[Any]:
    """The function's results for a list of arguments, computed in ``jobs`` processes."""
    if jobs <= 1:
        return [function(*item) for item in work]
    with ProcessPoolExecutor(jobs) as pool:
        return list(pool.map(function, *zip(*work, strict=True)))


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the tables: 64 steps of wang2020 under each disturbance, and pushes during 8 steps."""
    parser = argparse.ArgumentParser(description=main.__doc__)
    parser.add_argument("--seed", type=int, default=0, help="of the terrain")
    parser.add_argument("--margin", type=float, default=0.02, help="stability margin S0 [m]")
    parser.add_argument("--jobs", type=int, default=1, help="processes")
    options = parser.parse_args(arguments)
    robot = load_robot("wang2020")
    plan, short = (
        plan_crawl(
            robot,
            s_columns(options.seed, columns=n),
            stability_margin=options.margin,
            timing=VELOCITY,
        )
        for n in (17, 3)
    )
    outcomes = simulate_disturbances(plan, options.jobs)
    print(table(outcomes, push_limits(short, options.jobs), plan))


if __name__ == "__main__":
    main()
