"""Plans that several tests of the certificate share."""

from __future__ import annotations

import pytest

import gaitopt
from gaitopt import Plan, Quadruped


@pytest.fixture(scope="session")
def slow(wang: Quadruped) -> Plan:
    """A walk with gentle accelerations: static forces make almost all of it."""
    footholds = gaitopt.s_columns(0, columns=2)
    return gaitopt.plan_crawl(
        wang, footholds, objective="time", free="route", acceleration_limit=2.0, timing="velocity"
    )
