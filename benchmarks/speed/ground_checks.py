"""How long the certificate takes to hold walks against the ground.

``python -m benchmarks.speed.ground_checks [--robots wang2020,go2]`` prints processor times: of the
walk over columns, of a walk of 3 m over hills on a map of cells of 2 cm, and of everything else
that the certificate looks at, without self-collisions and contact forces. Each is the best of
three.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Sequence
from time import process_time

import numpy as np

import gaitopt
from gaitopt.certificate.ground.checks import ground_checks
from gaitopt.certificate.trace import trace

ROBOTS = "wang2020,go2,anymal_c"
TIMES = 3
"""Repetitions, of which the best counts."""
STEP = 0.2
"""Step of the walk over hills, as a share of a leg's reach."""
LENGTH = 3.0
"""Length of this walk [m]."""


def best(task: Callable[[], object]) -> float:
    """Least processor time of a task [s]."""
    times = []
    for _ in range(TIMES):
        began = process_time()
        task()
        times.append(process_time() - began)
    return min(times)


def over_hills(robot: gaitopt.Quadruped) -> gaitopt.Plan:
    """A straight walk over low hills, with feet where they come to stand."""
    reach = float(np.mean([leg.reach for leg in robot.legs.values()]))
    ground = gaitopt.make_ground("hills", seed=0, difficulty=0.15, robot=robot, length=LENGTH + 1.5)
    size, (x, y) = robot.stance_size, (ground.extent[0][0] + 1.0, float(np.mean(ground.extent[1])))
    along = np.arange(0.0, LENGTH, STEP * reach)
    points, normals = {}, {}
    corners = {"LF": (1, 1), "LH": (-1, 1), "RH": (-1, -1), "RF": (1, -1)}
    for leg, (front, left) in corners.items():
        places = np.column_stack([x + along + front * size[0] / 2.0,
                                  np.full(len(along), y + left * size[1] / 2.0)])  # fmt: skip
        rest = ground.ball(places, robot.foot_radius)
        points[leg], normals[leg] = rest.centres, rest.normals
    footholds = gaitopt.Footholds(points, normals=normals, ground=ground)
    return gaitopt.plan_crawl(robot, footholds, timing="velocity")


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.speed.ground_checks")
    parser.add_argument("--robots", default=ROBOTS, help="names, with commas between them")
    chosen = parser.parse_args(arguments)
    print(f"{'robot':14} {'walk':8} {'steps':>5} {'ground [s]':>11} {'all else [s]':>13}")
    for name in chosen.robots.split(","):
        robot = gaitopt.load_robot(name)
        columns = gaitopt.s_columns(0, robot=robot)
        walks = {
            "columns": gaitopt.plan_crawl(robot, columns, timing="velocity"),
            "hills": over_hills(robot),
        }
        for kind, plan in walks.items():
            motion = trace(plan)
            ground = best(lambda plan=plan, motion=motion: ground_checks(plan, motion))
            whole = best(lambda plan=plan: gaitopt.verify(plan, collisions=False))
            steps = plan.footholds.steps
            print(f"{name:14} {kind:8} {steps:5} {ground:11.2f} {whole - ground:13.2f}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
