"""The free gait, against all orders that there are and the certificate."""

from __future__ import annotations

from itertools import permutations
from pathlib import Path

import pytest

import gaitopt
from gaitopt import LEGS, Footholds, InfeasibleStepError, Quadruped, plan_crawl
from gaitopt.conventions import rotation_z
from gaitopt.gait.crawl import CRAWL_SEQUENCES, WANG_SEQUENCE
from gaitopt.plan.settings.crawl import CrawlSettings
from gaitopt.planners.free_order.search import find_order
from gaitopt.terrain.columns import s_columns

MARGIN = 0.03
"""A margin with which the true COM is inside the support, too [m]."""


def one_step_each(seed: int, forward: float) -> Footholds:
    """Columns with one step for every leg, scattered so widely that some orders fail."""
    return s_columns(seed, columns=2, forward=forward, jitter=0.08)


def certified_durations(wang: Quadruped, terrain: Footholds) -> dict[tuple[str, ...], float]:
    """Durations of the walks of all 24 orders that are possible and certified."""
    found = {}
    for order in permutations(LEGS):
        try:
            plan = plan_crawl(
                wang, terrain, sequence=order, stability_margin=MARGIN, timing="velocity",
                body_height=wang.standing_height,
            )  # fmt: skip
        except InfeasibleStepError:
            continue
        if gaitopt.verify(plan).ok:
            found[order] = plan.duration
    return found


@pytest.mark.parametrize(
    ("seed", "forward"), [(0, 0.15), pytest.param(2, 0.3, marks=pytest.mark.slow)]
)
def test_no_order_of_all_that_there_are_is_faster(
    wang: Quadruped, seed: int, forward: float
) -> None:
    terrain = one_step_each(seed, forward)
    durations = certified_durations(wang, terrain)
    plan = plan_crawl(wang, terrain, sequence="free", stability_margin=MARGIN, timing="velocity")
    assert durations, "the terrain is too hard to tell anything"
    assert gaitopt.verify(plan).ok
    assert plan.duration == pytest.approx(min(durations.values()), rel=1e-3)


def test_search_finds_an_order_exactly_where_there_is_one(wang: Quadruped) -> None:
    """Strides at which some terrains are possible and some are not."""
    settings = CrawlSettings(stability_margin=MARGIN, timing="velocity")
    outcomes = set()
    for seed in (6, 9):  # none of the 24 orders is possible, and two are
        terrain = one_step_each(seed, 0.38)
        any_order = bool(certified_durations(wang, terrain))
        found = find_order(wang, terrain, settings).complete
        outcomes.add(any_order)
        assert found >= any_order, seed
        if found and not any_order:  # possible, but the true COM or a thigh is in the way
            plan = plan_crawl(
                wang, terrain, sequence="free", stability_margin=MARGIN, timing="velocity"
            )
            assert not gaitopt.verify(plan).ok
    assert outcomes == {True, False}


def test_a_free_order_rescues_a_walk_that_the_fixed_order_cannot_do(wang: Quadruped) -> None:
    terrain = one_step_each(2, 0.35)
    with pytest.raises(InfeasibleStepError, match="step 1 "):
        plan_crawl(wang, terrain, stability_margin=0.05, timing="velocity")
    plan = plan_crawl(wang, terrain, stability_margin=0.05, sequence="free", timing="velocity")
    assert gaitopt.verify(plan).ok
    assert isinstance(plan.record, gaitopt.CrawlRecord) and plan.record.free_order_gain is None


def test_an_order_in_which_legs_touch_gives_way_to_one_in_which_they_do_not(
    wang: Quadruped,
) -> None:
    """RH is to step so far ahead that, in the paper's order, it meets RF, which still stands."""
    length, width = wang.stance_size
    corners = {"LF": (1, 1), "LH": (-1, 1), "RH": (-1, -1), "RF": (1, -1)}
    strides = {"LF": 0.22, "LH": 0.22, "RH": 0.36, "RF": 0.22}
    terrain = Footholds({
        leg: [[x * length / 2 + k * strides[leg], y * width / 2, 0.0] for k in range(2)]
        for leg, (x, y) in corners.items()
    })  # fmt: skip
    low = wang.standing_height
    fixed = gaitopt.verify(
        plan_crawl(wang, terrain, stability_margin=0.03, timing="velocity", body_height=low)
    )
    assert [check.name for check in fixed.violations] == ["self-collision"]
    plan = plan_crawl(wang, terrain, stability_margin=0.03, sequence="free", timing="velocity")
    order = plan.settings.swing_legs(2)
    assert order is not None and order.index("RF") < order.index("RH")
    assert gaitopt.verify(plan).ok


def test_the_gain_is_told_and_the_order_saved(wang: Quadruped, tmp_path: Path) -> None:
    terrain = s_columns(0, columns=3)
    fixed, plan = (
        plan_crawl(wang, terrain, timing="velocity"),
        plan_crawl(wang, terrain, sequence="free", timing="velocity"),
    )
    gain = 1.0 - plan.duration / fixed.duration
    assert gain > 0.0 and plan.record.free_order_gain == pytest.approx(gain)
    assert len(plan.settings.to_dict()["sequence"]) == terrain.steps
    plan.save(tmp_path / "free.npz")
    again = gaitopt.load_plan(tmp_path / "free.npz")
    assert again.settings == plan.settings and gaitopt.verify(again).ok


def test_the_order_is_the_same_whichever_way_the_walk_faces(wang: Quadruped) -> None:
    terrain, turn = s_columns(1, columns=2), 0.7
    turned = Footholds(
        {leg: terrain[leg] @ rotation_z(turn).T for leg in LEGS}, radius=terrain.radius
    )
    straight = find_order(wang, terrain, CrawlSettings(timing="velocity"))
    found = find_order(wang, turned, CrawlSettings(heading=turn, timing="velocity"))
    assert found.legs == straight.legs
    assert found.duration == pytest.approx(straight.duration, rel=1e-6)


def test_the_estimated_time_is_near_that_of_the_plan(wang: Quadruped) -> None:
    terrain = s_columns(2, columns=3)
    order = find_order(wang, terrain, CrawlSettings(timing="velocity"))
    plan = plan_crawl(wang, terrain, sequence=order.legs, timing="velocity")
    assert order.complete and order.duration == pytest.approx(plan.duration, rel=5e-3)


def test_impossible_terrain_says_how_far_any_order_gets(wang: Quadruped) -> None:
    terrain = s_columns(0, columns=3, forward=2.0)
    with pytest.raises(InfeasibleStepError, match=r"no other order gets beyond step \d of 8"):
        plan_crawl(wang, terrain, sequence="free", timing="velocity")


def test_standing_still_needs_no_order(wang: Quadruped) -> None:
    plan = plan_crawl(wang, s_columns(0, columns=1), sequence="free", timing="velocity")
    assert not plan.phases and plan.settings.to_dict()["sequence"] == list(WANG_SEQUENCE)


def test_a_time_optimal_walk_takes_the_fastest_of_all_orders(wang: Quadruped) -> None:
    """Of the six cycles and the order that the search finds phase by phase."""
    terrain = s_columns(0, columns=2)
    found = find_order(wang, terrain, CrawlSettings(timing="velocity")).legs
    orders = [*CRAWL_SEQUENCES, found]
    plans = [
        gaitopt.plan_route(wang, terrain, free="swing", sequence=order, timing="velocity")
        for order in orders
    ]
    free = gaitopt.plan_route(wang, terrain, free="swing", sequence="free", timing="velocity")
    assert gaitopt.verify(free).ok
    certified = [plan.duration for plan in plans if gaitopt.verify(plan).ok]
    assert free.duration == pytest.approx(min(certified), rel=1e-9)
    assert free.record.orders_feasible == len(orders)
