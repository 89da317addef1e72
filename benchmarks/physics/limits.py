"""What holds walks with forces back: their paths in other times, with one limit given up.

``python -m benchmarks.physics.limits [--seeds 3] [--robots go2,a1] [--walks default,swing]
[--columns 5] [--margin 0.02] [--rows rows.csv]`` prints a table. Its first time is that of the
plan. *Joint velocities* is the least time in which joints can follow the path: the integral over
the plan of the largest share of a joint's velocity limit, whatever its timing. No forces can make
the walk along this path faster. *Held by joints* is the share of the plan's time in which a joint
turns at its limit. The other times are those of :func:`gaitopt.retimed` along the same path:
without a reserve on standing feet, with a friction of 1, with all of the torque, and with all
three. *In swings* is the share of the time in which a foot flies. *Without forces* is the walk of
the same margin of the true centre of mass and the same body height that is planned and timed by
joint velocities alone (``timing="velocity"``): what lies between it and the plan is all that
forces, and a path that has no corners, take. There is none for ``dynamic``, whose balance are
forces. All are medians.

With the rows of ``python -m benchmarks.physics.forces --sweep`` (``--rows``) a second table
compares the time that the fastest fixed speed takes in physics with four times of the walk, terrain
by terrain: its own in physics; that of the plan, as if physics waited for nothing; that along the
path with all three limits given up; and the last one with what physics waits for the plan. No
timing along this path can exceed the last two.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

import gaitopt
from benchmarks.physics.force_rows import COLUMNS, SWEEP, RowFile, benchmark_robot

ASKED = gaitopt.ForceLimits()
"""What walks are planned with."""
GIVEN_UP = {
    "reserve 0": replace(ASKED, reserve=0.0, reserve_on_four=0.0),
    "friction 1": replace(ASKED, friction=1.0),
    "all torque": replace(ASKED, torque_share=1.0),
    "all three": replace(
        ASKED, reserve=0.0, reserve_on_four=0.0, friction=1.0, torque_share=1.0
    ),
}  # fmt: skip
"""The same with less asked, by name."""
STEP = 1e-3
"""Time between the instants at which joint velocities are looked at [s]."""
AT_LIMIT = 0.99
"""Share of a joint's velocity limit from which the joint counts as held."""


def by_joints(plan: gaitopt.Plan) -> tuple[float, float]:
    """Least time of the path by joint velocities alone [s], and the share of time at a limit."""
    count = max(int(plan.duration / STEP), 1)
    middles = (np.arange(count) + 0.5) * (plan.duration / count)
    limits = plan.robot.model.velocityLimit[6:]
    use = np.abs(plan.at(middles).v[:, 6:]) / limits
    largest = use.max(axis=1)
    return float(largest.mean()) * plan.duration, float((largest >= AT_LIMIT).mean())


def numbers(plan: gaitopt.Plan) -> list[float]:
    """The numbers of a line of the table."""
    flying = sum(phase.end - phase.start for phase in plan.phases if phase.flying)
    least, held = by_joints(plan)
    others = [gaitopt.retimed(plan, limits).duration for limits in GIVEN_UP.values()]
    return [plan.duration, least, 100.0 * held, *others, 100.0 * flying / plan.duration]


def without_forces(plan: gaitopt.Plan, walk: str) -> float:
    """Duration of the walk that is planned and timed by joint velocities alone [s]; or NaN."""
    if walk == "dynamic":
        return float("nan")
    settings = plan.settings
    asked: dict[str, Any] = {"timing": "velocity", "com": "model",
             "body_height": settings.body_height,
             "stability_margin": settings.stability_margin}  # fmt: skip
    if walk == "default":
        return gaitopt.plan_crawl(plan.robot, plan.footholds, **asked).duration
    return gaitopt.plan_route(plan.robot, plan.footholds, free=walk, **asked).duration


RATIOS = ("in physics", "without waiting", "at most along this path", "at most, with waiting")
"""What the second table compares with the fastest fixed speed."""


def ratios(rows: RowFile, robot: str, walk: str, least: dict[int, float]) -> list[float]:
    """Medians over terrains of how much faster a walk is than the fastest fixed speed in physics.

    Args:
        rows: with walks of fixed speeds and the walk in physics.
        robot, walk: which.
        least: the least time along its path by terrain [s].

    Returns:
        The four ratios of :data:`RATIOS`, and over how many terrains; nothing without rows.
    """
    found = []
    for seed, shortest in least.items():
        fixed = rows.rows.get((seed, robot, SWEEP))
        row = rows.rows.get((seed, robot, walk))
        if fixed is None or row is None or not (fixed.passed and row.passed):
            continue
        waited = row.walked - row.duration
        times = np.array([row.walked, row.duration, shortest, shortest + waited])
        found.append(fixed.walked / times)
    return [*np.median(found, axis=0).tolist(), len(found)] if found else []


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the table."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.physics.limits", description=__doc__
    )
    parser.add_argument("--seeds", type=int, default=3, help="terrains of each robot")
    parser.add_argument("--robots", default="go2,a1,anymal_c,wang2020", help="joined by commas")
    parser.add_argument("--walks", default="default", help="default, and variants of plan_route")
    parser.add_argument("--columns", type=int, default=COLUMNS, help="columns a leg")
    parser.add_argument("--margin", type=float, help="stability margin [m]")
    parser.add_argument("--rows", help="CSV file of benchmarks.physics.forces with --sweep")
    options = parser.parse_args(arguments)
    margin = {} if options.margin is None else {"stability_margin": options.margin}
    head = ["robot", "walk", "plan [s]", "joint velocities [s]", "held by joints [%]",
            *(f"{name} [s]" for name in GIVEN_UP), "in swings [%]",
            "without forces [s]"]  # fmt: skip
    rows, compared = RowFile(options.rows), []
    print(f"| {' | '.join(head)} |\n|{'---|' * len(head)}")
    for name in options.robots.split(","):
        robot = benchmark_robot(name)
        for walk in options.walks.split(","):
            lines, least = [], {}
            for seed in range(options.seeds):
                footholds = gaitopt.s_columns(seed, columns=options.columns, robot=robot)
                if walk == "default":
                    plan = gaitopt.plan_crawl(robot, footholds, **margin)
                else:
                    plan = gaitopt.plan_route(robot, footholds, free=walk, **margin)
                lines.append([*numbers(plan), without_forces(plan, walk)])
                least[seed] = lines[-1][6]
            cells = [f"{x:.0f}" if column in (2, 7) else f"{x:.2f}"
                     for column, x in enumerate(np.median(lines, axis=0))]  # fmt: skip
            print(f"| {' | '.join([name, walk, *cells])} |", flush=True)
            compared.append((name, walk, ratios(rows, name, walk, least)))
    if options.rows:
        print(f"\n| robot | walk | {' | '.join(f'x {text}' for text in RATIOS)} | terrains |")
        print(f"|{'---|' * (3 + len(RATIOS))}")
        for name, walk, found in compared:
            cells = [f"{x:.2f}" for x in found[:-1]] + [f"{x}" for x in found[-1:]]
            print(f"| {' | '.join([name, walk, *cells])} |")
    return 0


if __name__ == "__main__":
    sys.exit(main())
