"""How fast robots without roll joints walk and trot straight ahead with contact forces.

``python -m benchmarks.speed.straight_gaits`` prints the fastest speed of each gait, in steps of
0.05 m/s, at which a metre is planned, violates no promise, and passes in physics.
"""

from __future__ import annotations

import sys
import warnings

import gaitopt

ROBOTS = ("solo8", "quadruped")
GAITS = (("trot", 0.4, 0.6), ("trot", 0.5, 0.6), ("trot", 0.5, 0.7), ("walk", 2.0, 0.85))
STEP, MOST = 0.05, 0.8


def works(robot: gaitopt.Quadruped, schedule: gaitopt.GaitSchedule, speed: float) -> bool:
    """Whether a gait is planned, certified as far as limits are known, and passes."""
    try:
        plan = gaitopt.plan_gait(robot, schedule, velocity=speed, distance=1.0)
    except gaitopt.GaitoptError:
        return False
    return not gaitopt.verify(plan).violations and gaitopt.simulate(plan).passed


def main() -> int:
    """Print the table."""
    warnings.simplefilter("ignore", gaitopt.RobotWarning)
    print("| robot | gait | cycle [s] | duty factor | fastest [m/s] |\n|---|---|---|---|---|")
    for name in ROBOTS:
        robot = gaitopt.load_robot(name)
        for gait, cycle, duty in GAITS:
            schedule = getattr(gaitopt, gait)(cycle, duty)
            fastest = 0.0
            for k in range(1, round(MOST / STEP) + 1):
                if not works(robot, schedule, k * STEP):
                    break
                fastest = k * STEP
            print(f"| {name} | {gait} | {cycle} | {duty} | {fastest:.2f} |", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
