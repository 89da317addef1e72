"""Boxes with bounded accelerations: straight lines from rest to rest."""

from __future__ import annotations

import numpy as np
import pytest

import gaitopt
from gaitopt import Footholds, Plan, Quadruped, plan_route


@pytest.mark.parametrize("variant", [pytest.param("route", marks=pytest.mark.slow), "overlap"])
def test_a_box_with_bounded_accelerations_is_certified_and_costs_time(
    plans: dict[str, Plan], wang: Quadruped, short: Footholds, variant: str
) -> None:
    """The less the higher the limit."""
    fast, slow = (
        plan_route(wang, short, free=variant, acceleration_limit=a, timing="velocity")
        for a in (500.0, 6.0)
    )
    for plan in (fast, slow):
        gaitopt.verify(plan).raise_for_violations()
        assert plan.path.jumps(1).max() < 1e-6
    free = plans[variant].duration
    assert free < fast.duration < slow.duration < 1.25 * free
    times = np.linspace(0.0, slow.duration, 20001)
    largest = np.abs(slow.path.evaluate(times, 2)[:, 6:]).max()
    assert 5.7 < largest <= 6.0 * (1 + 1e-9)


def test_a_box_swing_is_at_rest_four_times(wang: Quadruped, short: Footholds) -> None:
    """With a still body: at lift-off, at both corners, and at touchdown."""
    plan = plan_route(wang, short, free="route", acceleration_limit=6.0, timing="velocity")
    for swing in plan.swings:
        times = np.linspace(swing.start, swing.end, 4001)
        speed = np.abs(plan.path.evaluate(times, 1)).max(axis=1)
        rests = np.flatnonzero((speed < 2e-2) & (np.gradient(speed) ** 2 < 1.0))
        groups = 1 + int((np.diff(times[rests]) > 0.05).sum())
        assert groups == 4


def test_without_steps_body_and_time_stand_still(wang: Quadruped) -> None:
    plan = plan_route(
        wang,
        gaitopt.s_columns(0, columns=1),
        free="route",
        acceleration_limit=6.0,
        timing="velocity",
    )
    assert plan.duration == 0.0
