"""Random plans of every planner, certified; and refusals judged by somebody else.

``python -m benchmarks.planning.certify [--count 1000] [--family crawl|gait]`` plans over random
terrains and commands, many of them too hard. Whatever is planned must be certified. Whatever is
refused must be impossible by a check that shares nothing with the planner: for a crawl's step a
fine grid of body positions, none of which may be possible; for a gait that breaks a velocity limit
the certificate of the same motion on joints without limits. And the velocity that a refusal offers
must be certified. Exit code 1 when anything of this fails.
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from collections.abc import Callable, Sequence
from typing import Literal

import numpy as np
from rich.console import Console
from rich.progress import track
from rich.table import Table

import gaitopt
from gaitopt import LEGS, InfeasibleSpeedError, InfeasibleStepError, Quadruped
from gaitopt.gait.crawl import WANG_SEQUENCE
from gaitopt.plan.settings.base import VELOCITY
from gaitopt.robots.urdf_text import with_velocity_limit

FREE = 1e4
"""A velocity limit that limits nothing [rad/s]."""
LEG_LENGTH = 0.57
"""Upper and lower leg of wang2020, Table I [m]."""


def crawl_case(seed: int) -> str:
    """What became of one random terrain and crawl."""
    rng = np.random.default_rng([seed, 1])
    robot = gaitopt.load_robot("wang2020")
    terrain = gaitopt.s_columns(
        seed, columns=5, jitter=rng.uniform(0.0, 0.05), amplitude=rng.uniform(0.0, 0.15)
    )
    margin, height = rng.uniform(0.0, 0.09), rng.uniform(0.33, 0.5)
    objective: Literal["distance", "margin"] = "margin" if rng.integers(2) else "distance"
    try:
        plan = gaitopt.plan_crawl(robot, terrain, objective=objective, stability_margin=margin,
                                  body_height=height, timing="velocity")  # fmt: skip
    except InfeasibleStepError as error:
        if not all(name.startswith(("margin", "reach")) for name in error.conflicts):
            return "refused: " + error.conflicts[0].split()[0]
        possible = _possible_place(robot, terrain, error.step, margin, height)
        return "WRONGLY REFUSED" if possible else "refused, and no place is possible"
    checks = gaitopt.verify(plan, collisions=False)
    # With margins below what the legs' masses need the true COM may leave: that is told, too.
    broken = [c.name for c in checks.violations if not (c.name == "margin of the true COM"
                                                        and margin < 0.02)]  # fmt: skip
    if broken:
        return f"VIOLATED: {broken[0]}"
    return "certified" if checks.ok else "planned; the true COM leaves its support (S0 < 20 mm)"


def _possible_place(
    robot: Quadruped, terrain: gaitopt.Footholds, step: int, margin: float, height: float
) -> bool:
    """Whether any body position of a grid allows the step, half a millimetre inside everything."""
    counts = {leg: (step + 3 - WANG_SEQUENCE.index(leg)) // 4 for leg in LEGS}
    feet = {leg: terrain[leg][counts[leg]] for leg in LEGS}
    leg = WANG_SEQUENCE[step % 4]
    target = terrain[leg][counts[leg] + 1]
    middle = np.mean([p[:2] for p in feet.values()], axis=0)
    line = np.arange(-0.3, 0.3, 0.002)
    x, y = (c.ravel() for c in np.meshgrid(middle[0] + line, middle[1] + line))
    good = np.ones(len(x), dtype=bool)
    corners = [feet[other] for other in LEGS if other != leg]
    (ax, ay), (bx, by) = (corners[k][:2] - corners[0][:2] for k in (1, 2))
    turn = np.sign(ax * by - ay * bx)
    for a, b in ((0, 1), (1, 2), (2, 0)):
        along = corners[b][:2] - corners[a][:2]
        side = along[0] * (y - corners[a][1]) - along[1] * (x - corners[a][0])
        good &= turn * side / np.hypot(*along) >= margin + 5e-4
    ground = terrain.array[..., 2].mean()
    for name, foot in [*feet.items(), (leg, target)]:
        hip = robot.legs[name].hip - robot.centre
        gap = np.stack([x + hip[0] - foot[0], y + hip[1] - foot[1],
                        np.full(len(x), ground + height + hip[2] - foot[2])])  # fmt: skip
        good &= np.linalg.norm(gap, axis=0) <= LEG_LENGTH - 5e-4
    return bool(good.any())


def gait_case(seed: int) -> str:
    """What became of one random robot and command."""
    rng = np.random.default_rng([seed, 2])
    name = ("wang2020-fast", "a1", "anymal_c", "solo12")[int(rng.integers(4))]
    robot = gaitopt.load_robot(name)
    kind = ("trot", "walk", "quasi_static", "pace", "bound", "wave")[int(rng.integers(6))]
    duty = {"trot": rng.uniform(0.35, 0.7), "walk": rng.uniform(0.75, 0.9),
            "quasi_static": rng.uniform(0.5, 0.75), "pace": rng.uniform(0.4, 0.6),
            "bound": rng.uniform(0.4, 0.6), "wave": rng.uniform(0.55, 0.9)}[kind]  # fmt: skip
    schedule = getattr(gaitopt, kind)(float(rng.uniform(0.4, 2.0)), float(duty))
    # Froude's scale: speeds in proportion to the root of the leg's length.
    scale = np.sqrt(robot.standing_height)
    velocity = rng.uniform([-0.4, -0.3], [0.8, 0.3]) * scale
    swing = list(gaitopt.SWING_CURVES)[int(rng.integers(len(gaitopt.SWING_CURVES)))]
    rate = float(rng.uniform(-0.8, 0.8))
    try:
        plan = gaitopt.plan_gait(robot, schedule, velocity=tuple(velocity), yaw_rate=rate,
                                 duration=schedule.cycle_time, swing=swing,
                                 timing=VELOCITY)  # fmt: skip
    except InfeasibleSpeedError as error:
        kind_of = error.limit.split()[0]
        if kind_of == "velocity":
            free = Quadruped.from_urdf(with_velocity_limit(robot.urdf, FREE), name)
            moved = gaitopt.plan_gait(free, schedule, velocity=tuple(velocity), yaw_rate=rate,
                                      duration=schedule.cycle_time, swing=swing,
                                      timing=VELOCITY)  # fmt: skip
            worst = gaitopt.verify(moved, free, collisions=False)["joint velocities"]
            if worst.worst * FREE <= robot.velocity_limits.min():
                return "WRONGLY REFUSED"
        if error.fastest is None or error.velocity is None or error.yaw_rate is None:
            return f"refused ({kind_of}): not even on the spot"
        slower = gaitopt.plan_gait(
            robot, schedule, velocity=error.velocity, yaw_rate=error.yaw_rate,
            duration=schedule.cycle_time, swing=swing, timing=VELOCITY,
        )  # fmt: skip
        if not gaitopt.verify(slower, collisions=False).ok:
            return "VIOLATED: the velocity that was offered"
        return f"refused ({kind_of}); the velocity offered is certified"
    checks = gaitopt.verify(plan, collisions=False)
    return "certified" if checks.ok else f"VIOLATED: {checks.violations[0].name}"


FAMILIES: dict[str, Callable[[int], str]] = {"crawl": crawl_case, "gait": gait_case}


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the families and print what became of their cases."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.planning.certify", description=__doc__
    )
    parser.add_argument("--count", type=int, default=1000, help="cases a family")
    parser.add_argument("--first", type=int, default=0, help="first seed")
    parser.add_argument("--family", choices=sorted(FAMILIES), action="append")
    options = parser.parse_args(arguments)
    table = Table(title=f"{options.count} random cases a family, seeds from {options.first}")
    for header in ("family", "what became of them", "cases"):
        table.add_column(header)
    bad = 0
    seeds = range(options.first, options.first + options.count)
    for name in options.family or list(FAMILIES):
        found = Counter(FAMILIES[name](seed) for seed in track(seeds, name, transient=True))
        for outcome, number in found.most_common():
            table.add_row(name, outcome, str(number))
            bad += number if outcome[:4].isupper() else 0
    Console().print(table)
    return int(bad > 0)


if __name__ == "__main__":
    sys.exit(main())
