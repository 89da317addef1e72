"""The robot, the terrains and the plans that the benchmarks share."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import gaitopt
from gaitopt import Footholds, Plan, Quadruped

MAIN_STEPS = 64
"""Steps of the main job, the walk of the paper."""


@lru_cache(maxsize=1)
def robot() -> Quadruped:
    """The robot of the paper."""
    return gaitopt.load_robot("wang2020")


@lru_cache(maxsize=8)
def terrain(steps: int = MAIN_STEPS, seed: int = 0) -> Footholds:
    """S-shaped columns for a walk of ``steps`` steps, each as long as the paper's."""
    return gaitopt.s_columns(seed, columns=steps // 4 + 1)


@lru_cache(maxsize=4)
def plan(steps: int = MAIN_STEPS) -> Plan:
    """The plan over :func:`terrain`."""
    return gaitopt.plan_crawl(robot(), terrain(steps), timing="velocity")


def cog_arguments(walk: Plan) -> list[dict[str, Any]]:
    """For each step of a plan the arguments of ``build_cog_problem``, read off the plan alone."""
    feet = {leg: walk.footholds[leg][0] for leg in gaitopt.LEGS}
    found = []
    for stance, swing in zip(walk.phases[::2], walk.phases[1::2], strict=True):
        found.append(
            {
                "robot": walk.robot,
                "feet": dict(feet),
                "height": float(stance.cog_end[2]),
                "start": stance.cog_start[:2],
                "swing": stance.leg,
                "foothold": swing.foot_end,
                "stability_margin": walk.settings.stability_margin,
            }
        )
        feet[swing.leg] = swing.foot_end
    return found
