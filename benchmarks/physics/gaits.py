"""Gaits by velocity on all robots: with contact forces or not, and what physics makes of them.

``python -m benchmarks.physics.gaits [--gaits trot,trot60] [--robots a1,go2] [--velocity] [--speed
1.5]`` prints a table. Trots are walked for 1.5 m at full speed, ``wang2020-fast`` at 0.3 m/s and
others at 0.5 m/s; pronks, bounds and paces for 0.9 m at 0.3 m/s; gaits with three feet for 0.3 m at
0.1 m/s. With ``--velocity`` the same gaits are planned without forces, with ``--speed`` at another
speed, and with ``--shift`` feet land at most so far beside their footholds [m]
(``ControlGains.foothold_shift``).
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from time import process_time

import gaitopt
from gaitopt.control.gains import ControlGains

ROBOTS = ("wang2020-fast", "a1", "go1", "go2", "b1", "laikago", "anymal", "anymal_c", "hyq",
          "solo12")  # fmt: skip
"""wang2020's joints are too slow for these gaits."""
GAITS = {
    "trot": gaitopt.trot(0.5),
    "trot60": gaitopt.trot(0.5, 0.6),
    "trot40": gaitopt.trot(0.5, 0.4),
    "pronk": gaitopt.pronk(0.5),
    "bound": gaitopt.bound(0.3),
    "bound40": gaitopt.bound(0.3, 0.4),
    "pace": gaitopt.pace(0.4),
    "quasi-static": gaitopt.quasi_static(1.0),
    "walk": gaitopt.walk(1.6),
}
"""Gaits by their names here; the number is the duty factor in per cent."""
SLOW, FAST, WANG = 0.1, 0.5, 0.3
"""Speeds of gaits on three feet, of trots, and of trots of wang2020-fast and all other gaits
[m/s]."""
DISTANCE, LASTING = 1.5, 3.0
"""Way at full speed of trots [m], and time at full speed of all others [s]."""


def line(
    name: str, gait: str, timing: str, other: float | None = None, shift: float | None = None
) -> str:
    """The table's line of one walk; ``other`` takes the place of its usual speed [m/s].

    ``shift`` takes the place of how far feet may usually land beside their footholds [m].
    """
    robot = gaitopt.load_robot(name)
    trots = gait.startswith("trot")
    speed = SLOW if gait in ("quasi-static", "walk") else WANG
    if trots and name != "wang2020-fast":
        speed = FAST
    speed = speed if other is None else other
    began = process_time()
    try:
        plan = gaitopt.plan_gait(
            robot,
            GAITS[gait],
            velocity=speed,
            timing=timing,
            distance=DISTANCE if trots else LASTING * speed,
        )
    except gaitopt.GaitoptError as error:
        return f"| {name} | {gait} | {speed} | refused: {error} |"
    planning = process_time() - began
    began = process_time()
    certificate = gaitopt.verify(plan, collisions=False, forces=gaitopt.ForceLimits())
    checking = process_time() - began
    gains = None if shift is None else ControlGains.for_plan(plan, foothold_shift=shift)
    result = gaitopt.simulate(plan, gains=gains)
    forces = certificate["contact forces"].status
    missed = f"{len(result.missed)} of {result.steps}"
    return (
        f"| {name} | {gait} | {speed} | {forces} | {planning:.1f} | {checking:.1f} | "
        f"{result.status} | {missed} | {57.3 * result.tilt:.1f} | {1e3 * result.body_error:.0f} |"
    )


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--gaits", default="trot", help=f"some of {', '.join(GAITS)}")
    parser.add_argument("--robots", default=",".join(ROBOTS))
    parser.add_argument("--velocity", action="store_true", help="plan without forces")
    parser.add_argument("--speed", type=float, help="at full speed [m/s]")
    parser.add_argument("--shift", type=float, help="of footholds at the most [m]")
    asked = parser.parse_args(arguments)
    print("| robot | gait | m/s | forces | planned [s] | checked [s] | physics | feet beside their "
          "places | tilt [deg] | body error [mm] |")  # fmt: skip
    print("|---|---|---|---|---|---|---|---|---|---|")
    for gait in asked.gaits.split(","):
        for name in asked.robots.split(","):
            timing = "velocity" if asked.velocity else "forces"
            print(line(name, gait, timing, asked.speed, asked.shift))
            sys.stdout.flush()


if __name__ == "__main__":
    main()
