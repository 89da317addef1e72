"""Plans that the tests of new timings share: by joint velocities, and retimed."""

from __future__ import annotations

import pytest
from timings import ROBOTS, Pair, by_velocity

import gaitopt
from gaitopt import Quadruped


@pytest.fixture(scope="session")
def pairs() -> dict[str, Pair]:
    """Four steps of every robot."""
    old = {name: by_velocity(gaitopt.load_robot(name)) for name in ROBOTS}
    return {name: Pair(plan, gaitopt.retimed(plan)) for name, plan in old.items()}


@pytest.fixture(scope="session")
def smooth(wang: Quadruped) -> Pair:
    """Four steps along splines, with bounded joint accelerations."""
    plan = gaitopt.plan_route(
        wang, gaitopt.s_columns(0, columns=2), free="swing", com="model", timing="velocity",
        stability_margin=0.036, acceleration_limit=5.0,
    )  # fmt: skip
    return Pair(plan, gaitopt.retimed(plan))
