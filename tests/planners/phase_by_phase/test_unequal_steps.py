"""Walks whose legs step in any order, unequally often, and with swings of their own heights."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest

import gaitopt
from gaitopt import LEGS, Footholds, InputError, Plan, Quadruped, plan_crawl, plan_route

ORDER = ("RH", "RF", "LH", "LF", "RF", "LF", "RH", "RF")
"""LF steps twice, LH once, RH twice, RF three times."""


def unequal(heights: bool = True) -> Footholds:
    """The first columns of a terrain, as many of each leg as :data:`ORDER` asks for."""
    columns = gaitopt.s_columns(0, columns=4)
    steps = {leg: ORDER.count(leg) for leg in LEGS}
    lifts = {leg: 0.03 + 0.01 * np.arange(steps[leg]) for leg in LEGS}
    return Footholds(
        {leg: columns[leg][: steps[leg] + 1] for leg in LEGS}, columns.radius, order=ORDER,
        swing_heights=lifts if heights else None,
    )  # fmt: skip


@pytest.fixture(scope="module")
def walk(wang: Quadruped) -> Plan:
    return plan_crawl(wang, unequal(), timing="velocity")


def with_heights(plan: Plan, heights: Mapping[str, np.ndarray]) -> Plan:
    """The same motion over footholds that ask for other swing heights."""
    stored = plan.footholds.with_(swing_heights=heights)
    return Plan(plan.robot, stored, plan.settings, plan.phases, plan.path, plan.record)


def test_legs_step_in_the_order_of_the_footholds(walk: Plan) -> None:
    assert [s.leg for s in walk.swings] == list(ORDER)
    for leg in LEGS:
        own = [s for s in walk.swings if s.leg == leg]
        assert [s.index for s in own] == list(range(ORDER.count(leg)))
        np.testing.assert_array_equal(own[-1].foot_end, walk.footholds[leg][-1])
    np.testing.assert_allclose(
        walk.at([walk.duration]).feet[0], [walk.footholds[leg][-1] for leg in LEGS], atol=1e-6
    )
    assert gaitopt.verify(walk).ok


def test_every_foot_rises_by_the_height_of_its_own_swing(walk: Plan) -> None:
    for swing in walk.swings:
        instants = np.linspace(swing.start, swing.end, 4001)
        top = walk.at(instants).feet[:, LEGS.index(swing.leg), 2].max()
        higher = max(swing.foot_start[2], swing.foot_end[2])
        assert top - higher == pytest.approx(0.03 + 0.01 * swing.index, abs=1e-4)


def test_the_certificate_holds_every_swing_to_its_own_height(walk: Plan) -> None:
    heights = {leg: np.array(h) for leg, h in unequal().swing_heights.items()}  # type: ignore[union-attr]
    heights["RF"][2] += 0.002
    certificate = gaitopt.verify(with_heights(walk, heights))
    (check,) = certificate.violations
    assert check.name == "swing height" and check.worst == pytest.approx(-0.002, abs=1e-6)
    assert check.where == "step 7 (RF)"


def test_an_order_of_the_footholds_is_as_good_as_the_same_sequence(wang: Quadruped) -> None:
    columns = gaitopt.s_columns(3, columns=3)
    order = ("LH", "LF", "RH", "RF", "LH", "RH", "LF", "RF")
    one = plan_crawl(wang, columns.with_(order=order), timing="velocity")
    other = plan_crawl(wang, columns, sequence=order, timing="velocity")
    np.testing.assert_array_equal(one.path.coefficients[-1], other.path.coefficients[-1])
    asked = plan_crawl(
        wang, columns.with_(order=order), sequence="RH, RF, LH, LF", timing="velocity"
    )
    assert [s.leg for s in asked.swings] == ["RH", "RF", "LH", "LF"] * 2


def test_an_order_with_other_numbers_of_steps_is_refused(wang: Quadruped) -> None:
    asked = r"ask for 8 steps \(LF 2, LH 1, RH 2, RF 3\); give an order with as many steps"
    with pytest.raises(InputError, match=f"is a cycle in which .* {asked}"):
        plan_crawl(wang, unequal(), sequence="RH, RF, LH, LF")
    with pytest.raises(InputError, match=rf"has 3 steps \(LF 0, LH 1, RH 1, RF 1\).* {asked}"):
        plan_crawl(wang, unequal(), sequence=("RH", "RF", "LH"))


def test_a_free_order_takes_every_leg_onto_all_of_its_footholds(wang: Quadruped) -> None:
    columns, order = gaitopt.s_columns(0, columns=3), ("RH", "RF", "LF", "RF")
    footholds = Footholds(
        {leg: columns[leg][: order.count(leg) + 1] for leg in LEGS}, columns.radius, order=order
    )
    plan = plan_crawl(wang, footholds, sequence="free", timing="velocity")
    assert sorted(s.leg for s in plan.swings) == sorted(order)
    assert gaitopt.verify(plan).ok


def test_the_time_optimal_walk_steps_in_the_order_too(wang: Quadruped) -> None:
    plan = plan_route(wang, unequal(heights=False), free="overlap", timing="velocity")
    assert [s.leg for s in plan.swings] == list(ORDER) and gaitopt.verify(plan).ok


@pytest.mark.parametrize("free", ["overlap", "swing"])
def test_time_optimal_swings_rise_as_high_as_their_own_heights(wang: Quadruped, free: str) -> None:
    """Along boxes exactly, along free curves at least."""
    plan = plan_route(wang, unequal(), free=free, timing="velocity")
    assert gaitopt.verify(plan).ok
    for swing in plan.swings:
        instants = np.linspace(swing.start, swing.end, 2001)
        top = plan.at(instants).feet[:, LEGS.index(swing.leg), 2].max()
        over = top - max(swing.foot_start[2], swing.foot_end[2]) - 0.03 - 0.01 * swing.index
        assert -1e-4 < over < (1e-6 if free == "overlap" else 0.02)


def test_a_continuous_walk_rises_as_high_as_its_swings_are_to() -> None:
    a1 = gaitopt.load_robot("a1")
    columns = gaitopt.s_columns(0, columns=2, robot=a1)
    heights = {leg: [0.05 + 0.01 * i] for i, leg in enumerate(LEGS)}
    plan = plan_route(a1, columns.with_(swing_heights=heights))
    certificate = gaitopt.verify(plan)
    assert plan.record.to_dict().get("instead") is None
    assert certificate.ok, certificate.report()
    assert certificate["swing height"].worst > -1e-6


def test_forces_time_such_a_walk_and_its_file_keeps_it(wang: Quadruped, tmp_path: Path) -> None:
    plan = plan_crawl(wang, unequal())
    assert gaitopt.verify(plan).ok
    plan.save(tmp_path / "walk.npz")
    again = gaitopt.load_plan(tmp_path / "walk.npz")
    assert again.footholds == plan.footholds and again.settings == plan.settings
