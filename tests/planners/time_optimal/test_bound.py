"""Lower bounds on the time of a walk."""

from __future__ import annotations

import numpy as np
import pytest

import gaitopt
from gaitopt import Footholds, InputError, Plan, Quadruped
from gaitopt.planners.time_optimal.bound import route_bound


def test_bounds_lie_below_the_plan_and_grow_with_the_windows(plans: dict[str, Plan]) -> None:
    """A window over the whole walk leaves out its start only."""
    plan = plans["swing"]
    bounds = [route_bound(plan, window).sum() for window in (1, 4, 8)]
    assert np.all(np.diff(bounds) > 0)
    assert bounds[-1] < plan.duration < 1.25 * bounds[-1]


def test_bounds_hold_for_the_true_centre_of_mass(com_plans: dict[str, Plan]) -> None:
    plan = com_plans["swing"]
    assert 0.8 * plan.duration < route_bound(plan, 8).sum() < plan.duration


def test_bounds_hold_for_a_dynamic_walk(plans: dict[str, Plan]) -> None:
    """Without its balance and its acceleration limits: far below."""
    plan = plans["dynamic"]
    assert 0.3 * plan.duration < route_bound(plan, 8).sum() < plan.duration


def test_bounds_are_refused_for_other_plans_and_no_window(
    plans: dict[str, Plan], wang: Quadruped, short: Footholds
) -> None:
    with pytest.raises(InputError, match="window"):
        route_bound(plans["swing"], 0)
    with pytest.raises(InputError, match="route_bound takes"):
        route_bound(gaitopt.plan_crawl(wang, short, timing="velocity"))
