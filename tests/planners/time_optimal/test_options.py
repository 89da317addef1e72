"""What ``plan_route`` refuses, and what ``plan_crawl`` passes on to it."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import gaitopt
from gaitopt import (
    Footholds,
    ForceLimits,
    Freedoms,
    InputError,
    Plan,
    Quadruped,
    RouteError,
    plan_route,
)
from gaitopt.plan.settings.freedoms import VARIANTS


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
        ({"com": "mass"}, "com must be one of body, model, got 'mass'"),
        ({"timing": "power"}, "timing must be one of forces, velocity, got 'power'"),
        (
            {"forces": ForceLimits(), "timing": "velocity"},
            "forces are limits of the timing 'forces'",
        ),
    ],
)
@pytest.mark.parametrize("sequence", [("RH", "RF", "LH", "LF"), "free"])
def test_settings_are_checked_before_anything_is_planned(
    wang: Quadruped, options: dict[str, Any], words: str, sequence: Any
) -> None:
    far = gaitopt.s_columns(0, columns=3, forward=5.0)  # impossible: planning would say so
    with pytest.raises(InputError, match=words):
        plan_route(wang, far, sequence=sequence, **{"timing": "velocity", **options})


def test_robot_and_footholds_in_the_wrong_order_are_refused(
    wang: Quadruped, short: Footholds
) -> None:
    with pytest.raises(InputError, match="robot must be a Quadruped, got a "):
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


@pytest.mark.parametrize("com", ["model", "body"])
def test_the_walk_that_an_error_offers_keeps_the_margin_that_was_asked_for(
    wang: Quadruped, short: Footholds, com: str
) -> None:
    with pytest.raises(RouteError, match=r"phase by phase, which \(.* s\) is in .plan$") as caught:
        plan_route(wang, short, free="swing", com=com, iterations=4, timing="velocity")
    offered = caught.value.plan
    assert offered is not None and offered.settings.com == com
    gaitopt.verify(offered, collisions=False).raise_for_violations()


@pytest.mark.parametrize("free", VARIANTS)
@pytest.mark.parametrize("limit", [None, 6.0])
def test_whose_margin_is_kept_goes_with_every_variant(free: str, limit: float | None) -> None:
    limited = {"acceleration_limit": 6.0 if free == "dynamic" else limit}
    for timing, default in (("velocity", "body"), ("forces", "model")):
        for com in ("body", "model"):
            if (free, timing, com) == ("dynamic", "velocity", "model"):
                with pytest.raises(InputError, match="that of the body centre; leave com out"):
                    gaitopt.RouteSettings(free=free, timing=timing, com=com, **limited)
                continue
            assert gaitopt.RouteSettings(free=free, timing=timing, com=com, **limited).com == com
        assert gaitopt.RouteSettings(free=free, timing=timing, **limited).com == default


def test_a_true_centre_of_mass_that_would_leave_the_feet_keeps_the_margin() -> None:
    """hyq's comes to lie 40 mm beside the body's centre, farther than its margin of 27 mm."""
    hyq = gaitopt.load_robot("hyq")
    few = gaitopt.s_columns(0, columns=3, robot=hyq)
    asked = plan_route(hyq, few, timing="velocity", com="body")
    assert asked.settings.com == "body" and gaitopt.com_margin(asked)[1].min() < 0.0
    plan = plan_route(hyq, few, timing="velocity")
    assert plan.settings.com == "model"
    assert gaitopt.com_margin(plan)[1].min() > plan.settings.stability_margin - 1e-6
