"""Walks whose body goes where contact forces hold the robot, and not only where the margin is."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import gaitopt
from gaitopt import ForceLimits, Plan, Quadruped
from gaitopt.conventions import LEGS, rotation_z
from gaitopt.dynamics.contacts import ContactGround
from gaitopt.dynamics.feasible_region import feasible_regions
from gaitopt.dynamics.region.vertical import vertical_forces_hold
from gaitopt.errors import InfeasibleStepError, SolverError
from gaitopt.plan.com_margin import true_com
from gaitopt.plan.settings.crawl import CrawlSettings
from gaitopt.planners.phase_by_phase import demands, fitting_height, planner, standing_places

Array = NDArray[np.float64]
LARGE_RESERVE = ForceLimits(reserve=0.1)


def walk(name: str, forces: ForceLimits | None = None, **options: Any) -> Plan:
    robot = gaitopt.load_robot(name)
    columns = gaitopt.s_columns(0, columns=2, robot=robot)
    return gaitopt.plan_crawl(robot, columns, forces=forces, **options)


def forget_regions(monkeypatch: pytest.MonkeyPatch) -> None:
    """Plan as if nothing but the margin said where the body goes."""
    monkeypatch.setattr(standing_places, "half_planes_by_forces", lambda *_: {})


def held_back(plan: Plan) -> list[int]:
    """Steps whose target a side of the region sets."""
    return [p.step for p in plan.phases if any(x.kind == "forces" for x in p.limited_by)]


@pytest.fixture(scope="module")
def with_reserve() -> Plan:
    return walk("a1", LARGE_RESERVE, body_height=0.25)


def test_a_large_reserve_is_walked_and_certified(
    with_reserve: Plan, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert gaitopt.verify(with_reserve).outcome == "certified"
    assert with_reserve.margin > with_reserve.settings.stability_margin + 0.005
    assert held_back(with_reserve)
    forget_regions(monkeypatch)
    with pytest.raises(InfeasibleStepError, match="not even at rest"):
        walk("a1", LARGE_RESERVE)


def test_weak_joints_are_walked_and_certified(monkeypatch: pytest.MonkeyPatch) -> None:
    weak = ForceLimits(torque_share=0.3)
    plan = walk("b1", weak, body_height=0.57)
    assert gaitopt.verify(plan).outcome == "certified" and held_back(plan)
    forget_regions(monkeypatch)
    with pytest.raises(InfeasibleStepError, match="not even at rest"):
        walk("b1", weak)


def test_the_true_centre_of_mass_keeps_room_in_every_region(with_reserve: Plan) -> None:
    """Held against regions for the postures of the plan, computed one by one."""
    room = demands.ROOM * with_reserve.settings.stability_margin
    nearest = []
    for phase in with_reserve.phases:
        if phase.kind != "swing":
            continue
        times = np.linspace(phase.start, phase.end, 40)[1:-1]
        motion = with_reserve.at(times)
        region = gaitopt.feasible_region(
            with_reserve.robot, motion.feet[0], limits=LARGE_RESERVE, support=phase.support,
            posture=with_reserve.path.evaluate(times[:1])[0, :6],
        )  # fmt: skip
        nearest.append(region.margin(true_com(with_reserve.robot, motion.q)).min())
    # The planner keeps the room from smaller regions, with 2 % of all limits in hand.
    assert min(nearest) > standing_places.KEPT * room
    assert min(nearest) < 2.0 * room


def test_where_the_triangle_is_enough_nothing_changes(monkeypatch: pytest.MonkeyPatch) -> None:
    plan = walk("go2")
    assert not held_back(plan)
    forget_regions(monkeypatch)
    without = walk("go2")
    np.testing.assert_array_equal(plan.path.knots(), without.path.knots())


def test_the_heading_does_not_matter(with_reserve: Plan) -> None:
    turn, settings = rotation_z(2.0), with_reserve.settings
    assert isinstance(settings, CrawlSettings)
    places = with_reserve.footholds.array @ turn.T
    turned_footholds = gaitopt.Footholds(dict(zip(LEGS, places, strict=True)))
    turned = gaitopt.plan_crawl(
        with_reserve.robot, turned_footholds,
        replace(settings, heading=2.0),
    )  # fmt: skip
    np.testing.assert_allclose(
        [p.cog_end for p in turned.phases], [turn @ p.cog_end for p in with_reserve.phases],
        atol=1e-5,
    )  # fmt: skip


def test_the_body_centre_may_keep_the_margin_all_the_same() -> None:
    plan = walk("a1", LARGE_RESERVE, body_height=0.25, com="body")
    assert held_back(plan)
    assert gaitopt.verify(plan, collisions=False)["contact forces"].status == "ok"


def test_forces_that_hold_nowhere_are_told() -> None:
    with pytest.raises(InfeasibleStepError) as told:
        walk("anymal_c", ForceLimits(torque_share=0.3), body_height=0.44)
    assert told.value.conflicts == ("contact forces",)
    standing = "-".join(leg for leg in LEGS if leg != told.value.leg)
    for word in (f"step {told.value.step} ({told.value.leg}", standing, "torque_share 0.3",
                 "body_height 0.44", "take another"):  # fmt: skip
        assert word in told.value.message


def test_a_reserve_that_leaves_one_place_is_told() -> None:
    """With a third of the weight on each of three feet the region is a single place."""
    with pytest.raises(InfeasibleStepError, match=r"no place of the body .* reserve 0\.3333"):
        walk("a1", ForceLimits(reserve=1.0 / 3.0))


def test_the_error_is_that_of_the_height_that_fits_the_robot(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """At greater heights legs may become straight, which is another error."""
    robot = gaitopt.load_robot("a1")
    ground = gaitopt.s_columns(0, columns=2, robot=robot)
    heights: list[float] = []

    def refused(*given: Any, **more: Any) -> Plan:
        heights.append(given[2].body_height)
        if len(heights) > 1:
            raise SolverError("a leg is straight")
        raise InfeasibleStepError("no forces", step=3, leg="LF")

    monkeypatch.setattr(fitting_height, "plan_in_order", refused)
    with pytest.raises(InfeasibleStepError, match="no forces"):
        gaitopt.plan_crawl(robot, ground)
    assert heights[0] == robot.standing_height and len(set(heights)) == 7


def test_a_higher_body_that_fails_leaves_the_walk_that_was_found(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    robot = gaitopt.load_robot("a1")
    ground = gaitopt.s_columns(0, columns=2, robot=robot)
    tried, plan_at = [], planner.plan_in_order

    def only_first(*given: Any, **more: Any) -> Plan:
        tried.append(given[2].body_height)
        if len(tried) > 1:
            raise SolverError("a leg is straight")
        return plan_at(*given, **more)

    monkeypatch.setattr(fitting_height, "plan_in_order", only_first)
    plan = gaitopt.plan_crawl(robot, ground, forces=LARGE_RESERVE)
    assert len(tried) == 2 and plan.settings.body_height == tried[0] < tried[1]


def test_straighter_legs_are_tried_where_joints_are_weak() -> None:
    """At the standing height the walk is possible, but slower than with the body higher."""
    weak = ForceLimits(torque_share=0.4)
    plan = walk("b1", weak)
    low = walk("b1", weak, body_height=plan.robot.standing_height)
    assert plan.settings.body_height > low.settings.body_height
    assert plan.duration < low.duration


class TestVerticalForces:
    @staticmethod
    def stances(robot: Quadruped, count: int) -> tuple[Array, np.ndarray, Array, Array]:
        """Random feet, the flying leg, postures, and places of the COM in the triangle."""
        random = np.random.default_rng(0)
        legs = [robot.legs[name] for name in LEGS]
        feet = np.array([leg.hip + leg.axes[:, 1] * leg.lateral for leg in legs])
        feet = feet + random.uniform(-0.03, 0.03, (count, 4, 3))
        feet[..., 2] -= robot.standing_height
        flying = random.integers(0, 4, count)
        shares = random.dirichlet([2.0, 2.0, 2.0], (count, 2))
        others = np.array([[i for i in range(4) if i != f] for f in flying])
        corners = np.take_along_axis(feet[..., :2], others[..., None], axis=1)
        return feet, flying, np.zeros((count, 6)), shares @ corners

    @pytest.mark.parametrize(("name", "share"), [("go2", 0.9), ("anymal_c", 0.9), ("b1", 0.5)])
    def test_what_they_hold_is_in_the_region(self, name: str, share: float) -> None:
        """They are enough, and not always needed."""
        robot = gaitopt.load_robot(name)
        limits = ForceLimits(reserve=0.05, torque_share=share)
        feet, flying, postures, coms = self.stances(robot, 60)
        room = np.full(60, 0.01)
        held = vertical_forces_hold(robot, feet, flying, postures, coms, limits, room)
        standing = flying[:, None] != np.arange(4)
        regions = feasible_regions(robot, feet, limits=limits, standing=standing, postures=postures)
        margins = np.array([r.margin(c).min() for r, c in zip(regions, coms, strict=True)])
        assert held.any() and not held.all()
        # Of what the region holds half a millimetre may be missing.
        assert margins[held].min() >= room[0] - 5e-4

    def test_on_slopes_what_they_hold_is_in_the_region(self) -> None:
        """Normals up to 25 degrees from the vertical, and contacts with less friction."""
        robot = gaitopt.load_robot("go2")
        feet, flying, postures, coms = self.stances(robot, 80)
        random = np.random.default_rng(1)
        normals = np.dstack([random.uniform(-0.3, 0.3, (80, 4, 2)), np.ones((80, 4, 1))])
        normals /= np.linalg.norm(normals, axis=2, keepdims=True)
        ground = ContactGround(normals, random.uniform(0.4, 1.0, (80, 4)))
        limits, room = ForceLimits(reserve=0.05), np.full(80, 0.005)
        held = vertical_forces_hold(robot, feet, flying, postures, coms, limits, room, ground)
        standing = flying[:, None] != np.arange(4)
        regions = feasible_regions(
            robot, feet, normals, limits, standing, postures, grip=ground.grip
        )
        held_by = np.array(
            [not r.empty and r.margin(c).min() >= room[0] - 5e-4
             for r, c in zip(regions, coms, strict=True)]
        )  # fmt: skip
        assert held.any() and not held.all() and held_by[held].all()
        level = vertical_forces_hold(robot, feet, flying, postures, coms, limits, room)
        assert level.sum() > held.sum()

    def test_without_torque_limits_they_are_all_that_is_needed(self) -> None:
        """On level ground the region is the triangle of the least normal forces."""
        robot = gaitopt.load_robot("solo12", velocity_limits=10.0)
        feet, flying, postures, coms = self.stances(robot, 60)
        feet[..., 2] = feet[0, 0, 2]
        standing = flying[:, None] != np.arange(4)
        limits = ForceLimits(reserve=0.1)
        regions = feasible_regions(robot, feet, limits=limits, standing=standing, torques=False)
        margins = np.array([r.margin(c).min() for r, c in zip(regions, coms, strict=True)])
        for room in (0.0, 0.004):
            held = vertical_forces_hold(
                robot, feet, flying, postures, coms, limits, np.full(60, room)
            )
            np.testing.assert_array_equal(held, margins >= room)
