"""Walks over height maps: from the ground to a plan that the certificate and physics accept."""

from __future__ import annotations

import itertools
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from matplotlib import cbook

import gaitopt
from gaitopt import LEGS, HeightMap, InputError, TerrainError
from gaitopt.control.build import build_reference
from gaitopt.control.gains import ControlGains
from gaitopt.plan.record import RouteRecord
from gaitopt.plan.rolled_feet import first_rolling_step
from gaitopt.planners.over_terrain.beam.ending import Ending
from gaitopt.planners.over_terrain.links.rolling import PLANNED
from gaitopt.planners.over_terrain.pairs import Cause
from gaitopt.planners.over_terrain.planned_forces import FRICTION_SHARE
from gaitopt.planners.over_terrain.settings import TerrainSettings
from gaitopt.planners.over_terrain.setup import first_layer, result_of, search_for
from gaitopt.planners.over_terrain.ways.arrival import off_goal
from gaitopt.retiming.retimed import LARGEST_LIFT

GO2 = gaitopt.load_robot("go2")
LENGTH = 0.9


def ground(name: str, **options: Any) -> HeightMap:
    return gaitopt.make_ground(name, robot=GO2, length=LENGTH, **options)


@pytest.fixture(scope="module")
def rubble() -> gaitopt.Plan:
    return gaitopt.plan_terrain(GO2, ground("rubble", difficulty=0.5), (LENGTH, 0.0),
                                start=(0.0, 0.0, 0.0))  # fmt: skip


def test_a_walk_over_rubble_is_certified(rubble: gaitopt.Plan) -> None:
    assert gaitopt.verify(rubble).outcome == "certified"
    assert rubble.footholds.ground == ground("rubble", difficulty=0.5)
    assert np.ptp(np.concatenate([rubble.footholds[leg][:, 2] for leg in LEGS])) > 0.02


def test_physics_crosses_it_and_nothing_but_feet_touches_the_ground(rubble: gaitopt.Plan) -> None:
    result = gaitopt.simulate(rubble)
    assert result.passed and not result.bumps


def test_a_continuous_walk_goes_over_the_footholds_that_were_found(rubble: gaitopt.Plan) -> None:
    """The body tilts with the ground while it moves on, and the ground is judged as well."""
    plan = gaitopt.plan_route(GO2, rubble.footholds, free="dynamic")
    assert isinstance(plan.record, RouteRecord) and plan.record.instead is None
    certificate = gaitopt.verify(plan, collisions=False)
    certificate.raise_for_violations()
    assert "legs and trunk clear of the ground" in [check.name for check in certificate.checks]
    assert rubble.duration / plan.duration > 1.4


def test_the_body_is_not_thrown_up_and_down(rubble: gaitopt.Plan) -> None:
    """Forces alone allowed 39 m/s^2 on such ground, and a foot that had just landed slid."""
    times = np.linspace(0.0, rubble.duration, 20_000)
    up = rubble.path.evaluate(times, 2)[:, 2]
    assert np.abs(up).max() == pytest.approx(LARGEST_LIFT, rel=0.01)


def test_the_body_ends_at_the_goal_and_faces_ahead(rubble: gaitopt.Plan) -> None:
    goal, last = np.array([LENGTH, 0.0]), rubble.phases[-1]
    assert off_goal(rubble, goal) < 1e-6
    assert last.kind == "stance" and last.support == LEGS and last.duration > 0.1
    assert abs(rubble.path.evaluate(np.array([rubble.duration]))[0, 5]) < 1e-6
    # In the last swing it was where three feet hold it.
    assert np.linalg.norm(last.cog_start[:2] - goal) > 0.02


def test_the_body_ends_as_near_to_the_goal_as_it_gets(monkeypatch: pytest.MonkeyPatch) -> None:
    """Something is in its way from 60 % of it on, and then everywhere."""
    ends = []
    for most in (0.6, 0.0):

        def clear(limbs: object, poses: np.ndarray, *_: object, most: float = most) -> bool:
            left = np.linalg.norm(poses[:, :2] - [0.2, 0.0], axis=1)
            return bool(left[-1] >= (1.0 - most) * left[0])

        monkeypatch.setattr("gaitopt.planners.over_terrain.ways.arrival._clear", clear)
        plan = gaitopt.plan_terrain(*FEW_STEPS, start=(0.0, 0.0, 0.0))
        ends.append(off_goal(plan, np.array([0.2, 0.0])))
    assert plan.phases[-1].kind == "swing" and ends[1] > 0.02
    assert ends[0] == pytest.approx(0.5 * ends[1], abs=1e-6)


def test_feet_stand_on_the_ground_where_the_layers_allow_it(rubble: gaitopt.Plan) -> None:
    footholds, ground_map = rubble.footholds, rubble.footholds.ground
    assert ground_map is not None and footholds.normals is not None
    layers = gaitopt.ground_layers(ground_map, robot=GO2)
    for leg in LEGS:
        contact = ground_map.ball(footholds[leg][:, :2], GO2.foot_radius)
        assert np.allclose(contact.centres, footholds[leg], atol=1e-9)
        assert np.allclose(contact.normals, footholds.normals[leg], atol=1e-9)
        assert all(layers.footing(p[:2]) == "steppable" for p in footholds[leg])


def test_something_is_left_of_the_friction_and_of_the_landing_radius(rubble: gaitopt.Plan) -> None:
    limits, settings = rubble.settings.promised_forces, TerrainSettings.for_robot(rubble.robot)
    assert limits is not None and 0.0 < limits.transfer_time < 0.1
    assert limits.friction == pytest.approx(FRICTION_SHARE * settings.friction)
    assert first_rolling_step(rubble, PLANNED) is None
    # The controller's reference is off the footholds by as much as the plan was judged to be.
    reference = build_reference(rubble, ControlGains.for_plan(rubble), 0.006)
    times = 0.006 * (np.arange(len(reference)) - reference.lead) + reference.ahead
    clock, largest = reference.clock.plan_time(times), 0.0
    for swing in rubble.swings:
        leg = LEGS.index(swing.leg)
        later = [s.start for s in rubble.swings if s.leg == swing.leg and s.start > swing.start]
        until = min([*later, rubble.duration]) - 1e-6
        own = reference.feet[(clock > swing.end + 1e-6) & (clock < until), leg]
        away = np.linalg.norm((own - swing.foot_end)[:, :2], axis=1)
        largest = max(largest, float(away.max(initial=0.0)))
    assert first_rolling_step(rubble, largest + 3e-4) is None
    assert first_rolling_step(rubble, largest - 3e-4) is not None


def test_the_same_ground_gives_the_same_walk() -> None:
    maps = [ground("rubble", difficulty=0.5) for _ in range(2)]
    one, two = (
        gaitopt.choose_footholds(GO2, m, (LENGTH, 0.0), start=(0.0, 0.0, 0.0)) for m in maps
    )
    assert one == two


def test_moves_of_a_tenth_of_a_micrometre_begin_and_end_at_rest() -> None:
    """The body moves that little before some swings, and jumped to its speed."""
    hills = gaitopt.make_ground("hills", seed=0, difficulty=0.3, robot=GO2, length=1.0)
    plan = gaitopt.plan_terrain(GO2, hills, (0.6, 0.0), start=(0.0, 0.0, 0.0))
    assert plan.path.jumps(1).max() < 1e-9


def test_a_gap_is_stepped_over() -> None:
    z = np.zeros((120, 80))
    z[52:58] = -0.5  # 0.12 m, a third of the stance's length, in the way of all feet
    wide = HeightMap(z, 0.02, (-0.6, -0.8))
    search = gaitopt.search_terrain(GO2, wide, (LENGTH, 0.0), start=(0.0, 0.0, 0.0))
    assert search.complete
    assert min(search.footholds[leg][:, 2].min() for leg in LEGS) > 0.0
    assert np.isclose(search.metres, LENGTH)


def test_go2_walks_down_stairs_of_12_cm() -> None:
    stairs = gaitopt.make_ground("stairs_down", robot=GO2, length=0.9, riser=0.12)
    search = gaitopt.search_terrain(GO2, stairs, (0.75, 0.0), start=(0.0, 0.0, 0.0))
    assert search.complete
    assert all(search.footholds[leg][-1, 2] < search.footholds[leg][0, 2] - 0.11 for leg in LEGS)


def test_a_walk_sideways_and_one_that_turns_on_the_spot() -> None:
    flat = HeightMap(np.zeros((90, 90)), 0.02, (-0.9, -0.9))
    aside = gaitopt.choose_footholds(GO2, flat, (0.0, 0.2, 0.0), start=(0.0, 0.0, 0.0))
    for leg in LEGS:
        assert np.allclose(aside[leg][-1, :2] - aside[leg][0, :2], [0.0, 0.2], atol=0.06)
    assert aside.postures is not None and np.allclose(aside.postures[:, 3], 0.0)
    turn = gaitopt.plan_terrain(GO2, flat, (0.0, 0.0, 0.6), start=(0.0, 0.0, 0.0))
    assert turn.footholds.postures is not None
    assert turn.footholds.postures[-1, 3] == pytest.approx(0.6)
    assert gaitopt.verify(turn).outcome == "certified"


def test_a_wall_is_no_way_and_the_error_says_why() -> None:
    z = np.zeros((120, 80))
    z[70:75] = 0.6
    with pytest.raises(TerrainError, match="no way over the ground was found") as caught:
        gaitopt.plan_terrain(GO2, HeightMap(z, 0.02, (-0.6, -0.8)), (1.5, 0.0),
                             start=(0.0, 0.0, 0.0), width_limit=6)  # fmt: skip
    error = caught.value
    assert error.search.footholds.steps == error.step < error.search.steps
    assert error.leg in LEGS and sum(error.refused.values()) > 0
    assert f"after {error.step} of {error.search.steps} steps the next one ({error.leg})" in str(
        error
    )
    assert "what may help" in str(error)


def test_a_walk_over_a_real_map_is_certified() -> None:
    """The Jacksboro fault in Tennessee, 90 m shrunk to 2 cm, twice as steep as it is."""
    with cbook.get_sample_data("jacksboro_fault_dem.npz") as dem:
        metres = dem["elevation"][100:230, 160:270].astype(np.float64)
    hills = HeightMap(2.0 * 0.02 / 90.0 * (metres - metres.min()), 0.02, (-0.7, -1.1))
    plan = gaitopt.plan_terrain(GO2, hills, (0.4, 0.0), start=(0.0, 0.0, 0.0))
    assert np.ptp(np.concatenate([plan.footholds[leg][:, 2] for leg in LEGS])) > 0.06
    assert gaitopt.verify(plan).outcome == "certified"


def test_more_time_gives_a_walk_that_costs_no_more() -> None:
    stones = ground("rubble", difficulty=0.8, seed=3)
    way = GO2, stones, (0.5, 0.0)
    usual, longer = (
        gaitopt.search_terrain(
            *way, start=(0.0, 0.0, 0.0), width=1, width_limit=4, time_budget=budget
        )
        for budget in (0.0, 60.0)
    )
    assert usual.complete and longer.complete and longer.cost < usual.cost
    assert longer.settings.width > usual.settings.width


def test_a_budget_that_is_too_small_for_a_better_walk_leaves_the_first_one() -> None:
    walks = [gaitopt.search_terrain(*FEW_STEPS, start=(0.0, 0.0, 0.0), time_budget=budget)
             for budget in (0.0, 1e-6)]  # fmt: skip
    assert all(walk.complete for walk in walks)
    assert walks[0].cost == walks[1].cost


def test_a_search_makes_no_more_tries_than_it_may() -> None:
    search = search_for(GO2, ground("rubble", difficulty=0.5), (LENGTH, 0.0), (0.0, 0.0, 0.0),
                        TerrainSettings.for_robot(GO2))  # fmt: skip
    found = search.run([first_layer(search)], most=200)
    assert not found.complete and 200 < found.work < 500 and len(found.layers) > 2
    assert found.ended is Ending.TRIES and not found.late
    full = search.run([first_layer(search)])
    assert full.complete and full.work < search.effort


def test_a_search_ends_in_the_middle_of_a_layer_when_its_time_is_over(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Each look at the clock is a second here. A layer of a wide beam takes many of them."""
    clock = itertools.count()
    monkeypatch.setattr("gaitopt.planners.over_terrain.search.thread_time", lambda: next(clock))
    settings = TerrainSettings.for_robot(GO2, width=60)
    search = search_for(GO2, ground("rubble", difficulty=0.5), (LENGTH, 0.0), (0.0, 0.0, 0.0),
                        settings)  # fmt: skip
    found = search.run([first_layer(search)], until=10.0)
    assert found.late and not found.complete and 20 < next(clock) < 40
    whole = search.run([first_layer(search)], until=1e9)
    assert whole.complete and not whole.late and next(clock) > 100


def test_a_search_without_time_says_so() -> None:
    with pytest.raises(TerrainError, match=r"its time was over, 0 s, so there may be a way"):
        gaitopt.choose_footholds(GO2, ground("flat"), (LENGTH, 0.0), start=(0.0, 0.0, 0.0),
                                 time_limit=0.0)  # fmt: skip


@pytest.mark.parametrize(
    ("options", "seconds"),
    [({}, 10.0), ({"width_limit": 384}, 20.0), ({"time_budget": 60.0}, 60.0),
     ({"time_budget": 0.5}, 10.0),
     ({"time_budget": 60.0, "time_limit": 5.0}, 5.0)],
)  # fmt: skip
def test_how_long_a_search_over_three_metres_may_take(
    options: dict[str, Any], seconds: float
) -> None:
    assert TerrainSettings.for_robot(GO2, **options).longest(3.0) == seconds


def refusing(errors: list[gaitopt.GaitoptError]) -> Any:
    """``plan_crawl`` that first raises some errors."""

    def planned(*arguments: Any, **options: Any) -> gaitopt.Plan:
        if errors:
            raise errors.pop(0)
        return gaitopt.plan_crawl(*arguments, **options)

    return planned


FEW_STEPS = (GO2, HeightMap(np.zeros((80, 80)), 0.02, (-0.7, -0.8)), (0.2, 0.0))


def test_steps_that_a_solver_did_not_solve_are_not_made_again(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    errors: list[gaitopt.GaitoptError] = [
        gaitopt.SolverError("step 3 (LF): not to its tolerance", step=3),
        gaitopt.RouteError("residuals", (5, 6), None, ""),
        gaitopt.SolverError("after the last step", step=-1),
    ]
    usual = gaitopt.choose_footholds(*FEW_STEPS, start=(0.0, 0.0, 0.0))
    monkeypatch.setattr("gaitopt.planners.over_terrain.walks.plan_crawl", refusing(errors))
    plan = gaitopt.plan_terrain(*FEW_STEPS, start=(0.0, 0.0, 0.0))
    assert not errors and plan.footholds != usual
    order = plan.footholds.order
    assert order is not None and order == usual.order
    for step in (0, 3, 5):
        leg, made = order[step], order[: step + 1].count(order[step])
        assert np.linalg.norm(plan.footholds[leg][made] - usual[leg][made]) > 0.01


def test_an_error_of_the_planner_that_names_no_step_becomes_one_clear_error(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("gaitopt.planners.over_terrain.walks.plan_crawl",
                        refusing([gaitopt.SolverError("no solution")] * 2))  # fmt: skip
    with pytest.raises(TerrainError, match=r"the whole of it.*no solution") as told:
        gaitopt.plan_terrain(*FEW_STEPS, start=(0.0, 0.0, 0.0))
    assert told.value.step == -1 and told.value.leg == "" and told.value.search.complete


def test_a_walk_goes_round_a_wall_through_its_gap() -> None:
    z = np.zeros((110, 110))
    z[56:59, :62] = 0.5  # at x = 0.52 m, from the right side to y = 0.24 m
    wall = HeightMap(z, 0.02, (-0.6, -1.0))
    search = gaitopt.search_terrain(GO2, wall, (1.1, 0.1), start=(0.0, 0.0, 0.0))
    assert search.complete and search.metres > 1.3
    assert np.allclose(search.course.poses[-1, :2], [1.1, 0.1])
    x, y = search.course.poses[:, :2].T
    assert y[np.abs(x - 0.54) < 0.04].min() > 0.24 + GO2.stance_size[1] / 2.0


def test_a_start_without_ground_is_refused() -> None:
    z = np.full((120, 80), np.nan)
    z[60:] = 0.0
    with pytest.raises(InputError, match="at the start there is no ground to stand on"):
        gaitopt.plan_terrain(GO2, HeightMap(z, 0.02, (-0.6, -0.8)), (1.5, 0.0),
                             start=(0.0, 0.0, 0.0))  # fmt: skip


@pytest.mark.parametrize("detours", [True, False])
def test_a_map_on_which_no_foot_may_stand_is_refused(detours: bool) -> None:
    """Such as a map of mountains in metres, on a grid of some centimetres."""
    z = np.tile(np.arange(60.0)[:, None], (1, 60))
    with pytest.raises(InputError, match="no foot may stand anywhere on the map"):
        gaitopt.search_terrain(GO2, HeightMap(z, 0.02, (-0.6, -0.6)), (0.4, 0.0),
                               start=(0.0, 0.0, 0.0), detours=detours)  # fmt: skip


def test_a_step_that_was_refused_is_not_made_again() -> None:
    settings = TerrainSettings.for_robot(GO2)
    search = search_for(GO2, ground("rubble", difficulty=0.5), (LENGTH, 0.0), (0.0, 0.0, 0.0),
                        settings)  # fmt: skip
    first = result_of(search, search.run([first_layer(search)]), 0.0)
    leg = LEGS.index(first.order[5])
    stand = int(first.stands[6, leg])
    other = replace(search, banned=frozenset({(5, leg, stand)}))
    second = result_of(other, other.run([first_layer(other)]), 0.0)
    assert second.complete and second.order[5] == first.order[5]
    assert int(second.stands[6, leg]) != stand


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"step_lenght": 0.1}, "did you mean step_length"),
        ({"step_length": -1.0}, "step_length"),
        ({"friction": 0.0}, "friction"),
        ({"width": 0}, "width"),
    ],
)
def test_wrong_settings_are_refused(options: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError, match=words):
        gaitopt.choose_footholds(GO2, ground("flat"), (LENGTH, 0.0), start=(0.0, 0.0, 0.0),
                                 **options)  # fmt: skip


def test_causes_have_words() -> None:
    assert all(len(str(cause)) > 10 for cause in Cause)


def test_joints_that_are_too_weak_are_told_by_the_search() -> None:
    with pytest.warns(gaitopt.RobotWarning):
        weak = gaitopt.load_robot("go2", effort_limits=4.0)
    flat = HeightMap(np.zeros((80, 80)), 0.02, (-0.7, -0.8))
    found = gaitopt.search_terrain(weak, flat, (0.15, 0.0), start=(0.0, 0.0, 0.0), width_limit=6)
    assert not found.complete and found.footholds.steps == 0
    assert max(found.refused, key=found.refused.__getitem__) is Cause.FORCE


def test_shorter_steps_are_tried_where_all_walks_are_refused(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """No walk of eight steps is allowed: the one that comes out has shorter ones."""
    told: list[tuple[int, int]] = []

    def planned(robot: gaitopt.Quadruped, over: gaitopt.Footholds, **options: Any) -> gaitopt.Plan:
        if over.steps == 8:
            raise gaitopt.SolverError("step 0 (LF): not to its tolerance", step=0)
        told.clear()
        return gaitopt.plan_crawl(robot, over, **options)

    monkeypatch.setattr("gaitopt.planners.over_terrain.walks.plan_crawl", planned)
    monkeypatch.setattr("gaitopt.planners.over_terrain.walks.MOST_PLANS", 1)
    walk = gaitopt.plan_terrain(
        *FEW_STEPS, start=(0.0, 0.0, 0.0), progress=lambda *n: told.append(n)
    )
    assert walk.footholds.steps == 12 and told[-1] == (12, 12)  # of the walk, too
    with pytest.raises(TerrainError, match=r"\(8 steps\), and no walk over them: step 0 \("):
        gaitopt.plan_terrain(*FEW_STEPS, start=(0.0, 0.0, 0.0), step_length=0.1485)


def test_other_ways_are_tried_where_all_walks_over_the_first_one_are_refused(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Usual and shorter steps are refused; a walk with a shorter stance is not."""
    refused = gaitopt.SolverError("step 0 (LF): not to its tolerance", step=0)
    monkeypatch.setattr("gaitopt.planners.over_terrain.walks.MOST_PLANS", 1)
    name = "gaitopt.planners.over_terrain.walks.plan_crawl"
    monkeypatch.setattr(name, refusing([refused] * 5))
    way: dict[str, Any] = {"start": (0.0, 0.0, 0.0), "width_limit": 6}
    usual = gaitopt.choose_footholds(*FEW_STEPS, **way)
    walk = gaitopt.plan_terrain(*FEW_STEPS, **way)
    lengths = [float(over["LF"][0, 0] - over["LH"][0, 0]) for over in (usual, walk.footholds)]
    assert lengths[1] < 0.8 * lengths[0] and gaitopt.verify(walk).ok
    # A search that is handed over is not walked once more where the others begin anew.
    monkeypatch.setattr(name, refusing([refused] * 99))
    search = gaitopt.search_terrain(*FEW_STEPS, **way)
    words = r"steps of 0.1039 and 0.0742 m were tried, too; so were \d+ other ways to the goal"
    with pytest.raises(TerrainError, match=words) as caught:
        gaitopt.plan_terrain(*FEW_STEPS, **way, search=search)
    assert caught.value.search.stands.shape == search.stands.shape


def test_usual_values_of_other_options_leave_the_usual_forces() -> None:
    """The command line gives all of its options, also where they are the usual ones."""
    way = {"start": (0.0, 0.0, 0.0), "search": gaitopt.search_terrain(*FEW_STEPS)}
    usual = gaitopt.plan_terrain(*FEW_STEPS, **way)
    given = gaitopt.plan_terrain(*FEW_STEPS, timing="forces", objective="distance", **way)
    assert usual.settings.promised_forces == given.settings.promised_forces
    assert usual.duration == given.duration
