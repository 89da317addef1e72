"""Small plans of all planners and of several robots, by seed."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from functools import cache
from typing import Any, Final

import numpy as np

import gaitopt
from gaitopt import Footholds, Plan, Quadruped, RobotWarning

Maker = Callable[[np.random.Generator], Plan]
LONGER = ("wang2020", "a1", "go2", "anymal_c")


@cache
def robot(name: str) -> Quadruped:
    """A robot by name; solo12 with limits that its file does not state."""
    limits = {"velocity_limits": 10.0, "effort_limits": 2.5} if name == "solo12" else {}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RobotWarning)
        return gaitopt.load_robot(name, **limits)


def _any(rng: np.random.Generator, names: tuple[str, ...]) -> Quadruped:
    return robot(names[int(rng.integers(len(names)))])


def _columns(rng: np.random.Generator, which: Quadruped) -> Footholds:
    height = float(rng.choice([0.0, 0.0, 0.01])) * which.standing_height / 0.4
    return gaitopt.s_columns(int(rng.integers(1000)), columns=2, robot=which, height_jitter=height)


def _crawl(**options: Any) -> Maker:
    def make(rng: np.random.Generator) -> Plan:
        which = _any(rng, LONGER)
        return gaitopt.plan_crawl(which, _columns(rng, which), **options)

    return make


def _route(*frees: str, **options: Any) -> Maker:
    def make(rng: np.random.Generator) -> Plan:
        which, free = _any(rng, LONGER), frees[int(rng.integers(len(frees)))]
        return gaitopt.plan_route(which, _columns(rng, which), free=free, **options)

    return make


def _gait(kind: str, **options: Any) -> Maker:
    def make(rng: np.random.Generator) -> Plan:
        which = _any(rng, ("wang2020-fast", "a1", "go2", "anymal_c", "solo12"))
        schedule = getattr(gaitopt, kind)(0.5 if kind == "trot" else 1.0)
        speed = float(rng.uniform(0.05, 0.25)) * np.sqrt(which.standing_height)
        turn = float(rng.uniform(-0.3, 0.3))
        return gaitopt.plan_gait(which, schedule, velocity=(speed, 0.0), yaw_rate=turn,
                                 duration=0.3, **options)  # fmt: skip

    return make


def _stride(rng: np.random.Generator) -> Plan:
    which = _any(rng, ("frog1", "wang2020-fast"))
    board = gaitopt.rectangular_obstacle(0.03, float(rng.uniform(0.02, 0.04)))
    return gaitopt.plan_stride(which, board, approach=0, leave=0)


def _terrain(rng: np.random.Generator) -> Plan:
    """A walk over 1.5 m or more of ground of any kind, up to nearly the hardest.

    A robot that finds no way counts as refused.
    """
    which = robot(str(rng.choice(LONGER)))
    kind = str(rng.choice(gaitopt.ground_names()))
    # Ground about start and goal is flat. Ramps have a landing, and gaps need room.
    room = 2.5 if kind in ("ramp", "gaps") else 2.0
    length = max(1.5, room * (which.stance_size[0] + which.standing_height))
    ground = gaitopt.make_ground(kind, robot=which, length=length, seed=int(rng.integers(1000)),
                                 difficulty=float(rng.uniform(0.2, 0.9)))  # fmt: skip
    return gaitopt.plan_terrain(which, ground, (length, 0.0), start=(0.0, 0.0, 0.0))


def _from_state(rng: np.random.Generator) -> Plan:
    which = robot(str(rng.choice(["a1", "go2"])))
    first = gaitopt.plan_crawl(which, _columns(rng, which))
    instant = float(rng.uniform(0.05, 0.6)) * first.duration
    return gaitopt.plan_crawl(which, first.footholds_ahead(instant), start=first.state(instant))


FAMILIES: Final[dict[str, Maker]] = {
    "crawl, forces": _crawl(),
    "crawl, velocity": _crawl(timing="velocity"),
    "crawl, margin": _crawl(objective="margin"),
    "crawl, free order": _crawl(sequence="free"),
    "route, forces": _route("route", "swing", "height", "posture"),
    "route, velocity": _route("overlap", "swing", "height", "posture", timing="velocity"),
    "route, dynamic": _route("dynamic"),
    "trot, forces": _gait("trot"),
    "trot, velocity": _gait("trot", timing="velocity"),
    "walk, forces": _gait("walk"),
    "walk, velocity": _gait("walk", timing="velocity"),
    "stride": _stride,
    "terrain": _terrain,
    "from a state": _from_state,
}
"""What makes a plan from random numbers, by name."""
