"""Robots and plans that many tests share; loaded once."""

from __future__ import annotations

import pytest
from hypothesis import settings

import gaitopt
from gaitopt import Footholds, Plan, Quadruped

# On a loaded machine a single example may take long: that is no fault of the code.
settings.register_profile("patient", deadline=None)
settings.load_profile("patient")


@pytest.fixture(scope="session")
def wang() -> Quadruped:
    return gaitopt.load_robot("wang2020")


@pytest.fixture(scope="session")
def columns() -> Footholds:
    return gaitopt.s_columns(0)


@pytest.fixture(scope="session")
def plan(wang: Quadruped, columns: Footholds) -> Plan:
    """The main job: the paper's method over the 64 steps of the first random terrain."""
    return gaitopt.plan_crawl(wang, columns, timing="velocity")


@pytest.fixture(scope="session")
def short_plan(wang: Quadruped) -> Plan:
    """Two cycles, eight steps."""
    return gaitopt.plan_crawl(wang, gaitopt.s_columns(3, columns=3), timing="velocity")


@pytest.fixture(scope="session")
def a1_walk() -> Plan:
    """Four steps of a1, as fast as forces allow."""
    robot = gaitopt.load_robot("a1")
    return gaitopt.plan_crawl(robot, gaitopt.s_columns(0, columns=2, robot=robot))
