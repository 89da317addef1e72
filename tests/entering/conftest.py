"""Plans whose instants are handed back."""

from __future__ import annotations

import pytest

import gaitopt
from gaitopt import Plan


@pytest.fixture(scope="session")
def a1_route() -> Plan:
    """Four steps of a1, all in one optimisation: its body moves while feet fly."""
    robot = gaitopt.load_robot("a1")
    return gaitopt.plan_route(robot, gaitopt.s_columns(0, columns=2, robot=robot))


@pytest.fixture(scope="session")
def wang_walk() -> Plan:
    """Four steps of wang2020, whose joints are slow."""
    return gaitopt.plan_crawl(gaitopt.load_robot("wang2020"), gaitopt.s_columns(0, columns=2))
