"""What legs cost whose axes are not roll-pitch-pitch.

``python -m benchmarks.speed.legs [--robot NAME] [--columns N]`` plans the default walk of a robot,
of the same robot with hip axes that toe out by ten degrees (the first two axes of a leg meet: a
closed form), and of the same with thigh axes that are tilted by ten degrees (they do not meet:
numerical inverse kinematics). It prints processor time, the duration of the walk, and whether
certificate and physics agree.
"""

from __future__ import annotations

import argparse
import re
import statistics
import sys
import time
import warnings
from collections.abc import Sequence

import numpy as np

import gaitopt

TILT = np.radians(10.0)
"""By how much axes are turned [rad]."""
TIMES = 3
"""How often each walk is planned; the median is printed."""


def tilted(robot: gaitopt.Quadruped, joint: int, about: int) -> gaitopt.Quadruped:
    """The robot with one joint of each leg turned, left and right as mirror images.

    Args:
        robot: with joint frames that are parallel to the body's at zero.
        joint: number of the joint within the leg.
        about: axis of the body about which its axis is turned, 0 for x to 2 for z.
    """
    text = robot.urdf
    for name, leg in robot.legs.items():
        side = 1.0 if name.startswith("L") else -1.0
        side *= -1.0 if about == 2 and name.endswith("H") else 1.0
        axis = re.compile(
            rf'(<joint[^>]*name="{leg.joints[joint]}".*?<axis\s+xyz=")([^"]*)(".*?</joint>)', re.S
        )
        found = axis.search(text)
        assert found is not None
        old = np.array(found[2].split(), dtype=float)
        one, other = (i for i in range(3) if i != about)
        turn = np.eye(3)
        turn[[one, other], [one, other]] = np.cos(TILT)
        turn[other, one], turn[one, other] = side * np.sin(TILT), -side * np.sin(TILT)
        new = " ".join(map(repr, (turn @ old).tolist()))
        text = text[: found.start(2)] + new + text[found.end(2) :]
    return gaitopt.load_robot(text)


def line(label: str, robot: gaitopt.Quadruped, columns: int) -> str:
    """A line of the table."""
    footholds = gaitopt.s_columns(0, columns=columns, robot=robot)
    used = []
    for _ in range(TIMES):
        begin = time.process_time()
        plan = gaitopt.plan_crawl(robot, footholds)
        used.append(time.process_time() - begin)
    kept = "kept" if gaitopt.verify(plan, collisions=False).ok else "violated"
    physics = "passed" if gaitopt.simulate(plan).passed else "missed footholds"
    leg = robot.legs["LF"]
    points = leg.forward(robot.standing_joints()[list(robot.leg_columns["LF"])])
    points = points + np.random.default_rng(0).uniform(-0.02, 0.02, (10_000, 3))
    begin = time.process_time()
    leg.inverse(points)
    each = (time.process_time() - begin) / len(points)
    planning = statistics.median(used)
    return (
        f"| {label} | {1e6 * each:.2g} | {planning:.2g} | {plan.duration:.1f} | {kept} | "
        f"{physics} |"
    )


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--robot", default="go2")
    parser.add_argument("--columns", type=int, default=17)
    given = parser.parse_args(arguments)
    warnings.simplefilter("ignore", gaitopt.RobotWarning)
    robot = gaitopt.load_robot(given.robot)
    print("| legs | inverse, a place [µs] | planning [s] | walk [s] | promises | physics |")
    print("|---|---|---|---|---|---|")
    for label, other in (
        ("roll-pitch-pitch", robot),
        ("hips toe out: the first two axes meet", tilted(robot, 0, 2)),
        ("thighs tilted: numerical", tilted(robot, 1, 0)),
    ):
        print(line(label, other, given.columns), flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
