"""What ``plan_route`` refuses, and what ``plan_crawl`` passes on to it."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import gaitopt
from gaitopt import Footholds, Freedoms, InputError, Plan, Quadruped, RouteError, plan_route


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"free": "fast"}, "free must be one of route, overlap"),
        ({"free": ["overlap", "wings"]}, "free names 'wings'"),
        ({"free": ["dynamic"]}, "dynamic walk needs"),
        ({"free": ["swing"], "acceleration_limit": 5.0}, "needs 'overlap'"),
        ({"horizon": 1}, "horizon"),
        ({"horizon": 8.5}, "horizon must be a whole number"),
        ({"horizon": "8"}, "horizon must be a whole number"),
        ({"horizon": 10**9}, "horizon must be a whole number from 2 to 10000"),
        ({"stance_knots": 0}, "stance_knots must be a whole number"),
        ({"swing_knots": 2}, "swing_knots"),
        ({"iterations": 0}, "iterations must be a whole number"),
        ({"iterations": 2.5}, "iterations must be a whole number"),
        ({"acceleration_limit": 1e-9}, "more than 10 s to its velocity limit"),
        ({"acceleration_limit": np.nan}, "acceleration_limit must be a number"),
        ({"com": "mass"}, "com must be one of 'body', 'model', got 'mass'"),
        ({"com": "model", "acceleration_limit": 6.0}, "leave 'dynamic' and acceleration_limit out"),
        ({"com": "model", "free": "dynamic"}, "leave 'dynamic' and acceleration_limit out"),
    ],
)
@pytest.mark.parametrize("sequence", [("RH", "RF", "LH", "LF"), "free"])
def test_settings_are_checked_before_anything_is_planned(
    wang: Quadruped, options: dict[str, Any], words: str, sequence: Any
) -> None:
    far = gaitopt.s_columns(0, columns=3, forward=5.0)  # impossible: planning would say so
    with pytest.raises(InputError, match=words):
        plan_route(wang, far, sequence=sequence, **options, timing="velocity")


def test_robot_and_footholds_in_the_wrong_order_are_refused(
    wang: Quadruped, short: Footholds
) -> None:
    with pytest.raises(InputError, match="takes a Quadruped"):
        plan_route(short, wang, timing="velocity")  # type: ignore[arg-type]


def test_freedoms_may_be_named_in_any_order(wang: Quadruped, short: Footholds) -> None:
    """A set that is no variant has the names of what is free as its own."""
    plan = plan_route(wang, short, free={"height", "overlap"}, timing="velocity")
    assert plan.settings.free == Freedoms(overlap=True, height=True)
    assert plan.settings.free.variant == "overlap+height"
    assert np.ptp(plan.path.knots()[:, 2]) > 0.01
    gaitopt.verify(plan, collisions=False).raise_for_violations()


def test_plan_crawl_passes_options_on(wang: Quadruped, short: Footholds) -> None:
    plan = gaitopt.plan_crawl(
        wang, short, objective="time", acceleration_limit=6.0, horizon=4, timing="velocity"
    )
    assert plan.settings.acceleration_limit == 6.0 and plan.record.windows > 1
    with pytest.raises(InputError, match="go with the objective 'time'"):
        gaitopt.plan_crawl(wang, short, horizon=4, timing="velocity")


def test_plan_crawl_passes_the_kind_of_margin_on(
    wang: Quadruped, short: Footholds, com_plans: dict[str, Plan]
) -> None:
    plan = gaitopt.plan_crawl(
        wang, short, objective="time", free="swing", com="model", timing="velocity"
    )
    assert plan.duration == com_plans["swing"].duration
    with pytest.raises(InputError, match="go with the objective 'time'"):
        gaitopt.plan_crawl(wang, short, com="model", timing="velocity")


def test_the_walk_that_an_error_offers_says_whose_margin_it_keeps(
    wang: Quadruped, short: Footholds
) -> None:
    with pytest.raises(RouteError, match="its margin is that of the body centre"):
        plan_route(wang, short, free="swing", com="model", iterations=4, timing="velocity")
