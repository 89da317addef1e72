"""Walks over columns in physics, without and with limbs that touch.

``python -m benchmarks.physics.limbs``

Columns are level, or their tops differ by up to 5 % of the legs' length up and down. The
certificate of each walk says whether limbs and trunk are clear of the columns.
"""

from __future__ import annotations

import argparse
import warnings

import numpy as np

import gaitopt
from gaitopt import Plan, SimulationSettings

ROBOTS = "a1,go1,go2,anymal_c,anymal,hyq,b1,laikago,solo12,wang2020"
CLEAR = "legs and trunk clear of the ground"
TOPS = 0.05


def main() -> None:
    """Print one line for each walk."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--robots", default=ROBOTS)
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--columns", type=int, default=17)
    asked = parser.parse_args()
    warnings.simplefilter("ignore")
    for name in asked.robots.split(","):
        robot = gaitopt.load_robot(name)
        reach = float(np.mean([leg.reach for leg in robot.legs.values()]))
        for seed in range(asked.seeds):
            for kind, tops in (("level", 0.0), ("uneven", TOPS * reach)):
                columns = gaitopt.s_columns(
                    seed, columns=asked.columns, robot=robot, height_jitter=tops
                )
                try:
                    told = _told(gaitopt.plan_crawl(robot, columns))
                except gaitopt.GaitoptError as error:
                    told = f"refused: {str(error)[:100]}"
                print(f"{name} {seed} {kind}: {told}", flush=True)


def _told(plan: Plan) -> str:
    """What certificate and physics say of a walk."""
    alone = gaitopt.simulate(plan, SimulationSettings(limbs=False))
    whole = gaitopt.simulate(plan)
    checks = gaitopt.verify(plan, collisions=False).checks
    clear = next((str(check.status) for check in checks if check.name == CLEAR), "not checked")
    same = np.array_equal(alone.motion.q, whole.motion.q)
    return (
        f"balls {alone.verdict}; with limbs {whole.verdict}"
        f"{' (the same to the last bit)' if same else ''}; touched: "
        f"{', '.join(whole.bumps) or 'none'}; certificate, limbs: {clear}"
    )


if __name__ == "__main__":
    main()
