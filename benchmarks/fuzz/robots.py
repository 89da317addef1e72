"""Robot files with faults: loaded, planned for and drawn."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np

import gaitopt
from benchmarks.fuzz.calls import folder
from benchmarks.fuzz.mutations import mutated
from benchmarks.fuzz.outcome import HALF, REFUSED, Outcome, holds_nan, outcome
from gaitopt.robots.catalog import own_urdf

CASES = 10_000
FARTHEST = 1e4
"""Places of feet of a robot that is taken lie within this [m]."""


def cases() -> list[int]:
    """Seeds of the faults."""
    return list(range(CASES))


@cache
def _text() -> str:
    return own_urdf("wang2020").read_text("utf-8")


def run(case: int) -> Outcome:
    """Load a robot with faults, walk two steps of columns, and write the replay."""
    path = folder() / "robot.urdf"
    text = mutated(_text(), case)
    try:
        path.write_bytes(text.encode("utf-8", "surrogatepass"))
    except ValueError:
        return Outcome(REFUSED, "not a text")
    before = set(folder().iterdir())
    found = outcome(lambda: _walk(path, case), _nonsense)
    after = set(folder().iterdir()) - before
    for made in after:
        made.unlink()
    if found.kind == REFUSED and after:
        return Outcome(HALF, ", ".join(made.name for made in after))
    return found


def _walk(path: Any, case: int) -> Any:
    robot = gaitopt.load_robot(path)
    if case % 4:
        return robot, None
    plan = gaitopt.plan_crawl(
        robot, gaitopt.s_columns(0, columns=2, robot=robot), timing="velocity"
    )
    certificate = gaitopt.verify(plan, collisions=False)
    gaitopt.replay(plan, folder() / "robot.html")
    return robot, (plan.duration, certificate.ok)


def _nonsense(result: Any) -> str:
    robot, walked = result
    places = np.array([leg.hip for leg in robot.legs.values()])
    if not np.isfinite(places).all() or np.abs(places).max() > FARTHEST:
        return "hips beyond all measure"
    if not 0.0 <= robot.mass < 1e6:
        return f"a mass of {robot.mass}"
    limits = np.array([leg.velocity_limits for leg in robot.legs.values()])
    if holds_nan(limits) or (limits <= 0.0).any():
        return "velocity limits that are none"
    return "a walk that is none" if walked and not 0.0 < walked[0] < 1e7 else ""
