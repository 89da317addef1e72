"""Walks of eight steps that many tests of the time-optimal planner share."""

from __future__ import annotations

import pytest

import gaitopt
from gaitopt import Footholds, Plan, Quadruped, plan_route
from gaitopt.plan.settings.freedoms import VARIANTS


@pytest.fixture(scope="session")
def short() -> Footholds:
    """Footholds of two cycles, eight steps."""
    return gaitopt.s_columns(3, columns=3)


@pytest.fixture(scope="session")
def plans(wang: Quadruped, short: Footholds) -> dict[str, Plan]:
    """The plan of every variant over these footholds."""
    return {
        variant: plan_route(wang, short, free=variant, timing="velocity") for variant in VARIANTS
    }


@pytest.fixture(scope="session")
def com_plans(wang: Quadruped, short: Footholds) -> dict[str, Plan]:
    """The same of all static variants, with the margin of the true centre of mass."""
    return {
        variant: plan_route(wang, short, free=variant, com="model", timing="velocity")
        for variant, free in VARIANTS.items()
        if not free.dynamic
    }
