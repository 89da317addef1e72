"""Searches that follow one another: other ways of walking, wider beams, and the refusal."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import gaitopt
from gaitopt import HeightMap, TerrainError
from gaitopt.planners.over_terrain.beam.ending import Ending
from gaitopt.planners.over_terrain.course import course_through
from gaitopt.planners.over_terrain.failure import no_way
from gaitopt.planners.over_terrain.result import TerrainSearch
from gaitopt.planners.over_terrain.search import Search
from gaitopt.planners.over_terrain.settings import LONGER, TerrainSettings
from gaitopt.planners.over_terrain.setup import first_layer, result_of, search_for, with_settings
from gaitopt.planners.over_terrain.states import Found
from gaitopt.planners.over_terrain.ways.kinds import SHORT_STANCES, STEP_SHARES, ways_of
from gaitopt.planners.over_terrain.ways.outcomes import ended_of
from gaitopt.planners.over_terrain.ways.room_to_stand import no_room
from gaitopt.planners.over_terrain.ways.tries import ASIDE, OVER

GO2 = gaitopt.load_robot("go2")
START = (0.0, 0.0, 0.0)
QUICK = {"step_length": 0.12, "stance": 1.0, "width": 1, "width_limit": 8}


def wall(at: int = 48) -> HeightMap:
    z = np.zeros((80, 60))
    z[at : at + 4] = 0.6
    return HeightMap(z, 0.02, (-0.6, -0.6))


def test_ways_of_walking_that_are_tried() -> None:
    usual = TerrainSettings.for_robot(GO2)
    lengths = [way.step_length / usual.step_length for way in ways_of(usual, {})]
    assert np.allclose(lengths, [*STEP_SHARES, *(step for step, _ in SHORT_STANCES)], atol=1e-3)
    assert [way.stance for way in ways_of(usual, {})][3:] == [s for _, s in SHORT_STANCES]
    # What was asked for is not changed.
    asked = {"step_length": 0.1, "stance": 0.9}
    assert len(ways_of(TerrainSettings.for_robot(GO2, **asked), asked)) == 1
    steps = {"step_length": 0.1}
    ways = ways_of(TerrainSettings.for_robot(GO2, **steps), steps)
    assert {way.step_length for way in ways} == {0.1} and len(ways) == 1 + len(SHORT_STANCES)


def test_a_short_stance_has_its_feet_nearer_to_one_another() -> None:
    flat = gaitopt.make_ground("flat", robot=GO2, length=0.9)
    search = search_for(GO2, flat, (0.3, 0.0), START, TerrainSettings.for_robot(GO2))
    short = with_settings(search, TerrainSettings.for_robot(GO2, stance=0.5))
    feet, near = (first_layer(s).feet[0] for s in (search, short))
    assert np.ptp(near[:, 0]) == pytest.approx(0.5 * np.ptp(feet[:, 0]), abs=0.021)
    assert np.allclose(near[:, 1], feet[:, 1])


def test_before_it_refuses_the_search_tries_its_widest_beam() -> None:
    # A goal with a yaw, so that no way round is looked for.
    found = gaitopt.search_terrain(GO2, wall(), (0.7, 0.0, 0.0), start=START, **QUICK)
    assert not found.complete and not found.course.blocked
    assert found.width == found.settings.width_limit == 8


@pytest.mark.parametrize("post", [False, True])
def test_where_all_ways_end_it_looks_beside_more_finely_and_wider_before_it_refuses(
    monkeypatch: pytest.MonkeyPatch, post: bool
) -> None:
    # Two ways of walking, so that it is quick.
    ways = "gaitopt.planners.over_terrain.ways."
    monkeypatch.setattr(ways + "tries.NARROW", 1)
    monkeypatch.setattr(ways + "kinds.STEP_SHARES", (1.0, 0.7))
    monkeypatch.setattr(ways + "kinds.SHORT_STANCES", ())
    looked: list[tuple[bool, int, bool]] = []
    run, ends = Search.run, dict[float, Found]()

    def told(self: Search, *arguments: Any) -> Found:
        settings = self.judge.settings
        aside = bool(np.abs(self.course.poses[:, 1]).max() > 0.0)
        looked.append((self.fine, settings.width_limit, aside))
        # No look gets over the wall; that of each way with the narrow beam stands for all.
        if settings.step_length not in ends:
            ends[settings.step_length] = run(self, *arguments)
        return ends[settings.step_length]

    monkeypatch.setattr(Search, "run", told)
    ground = wall(45)
    if post:
        z = ground.z.copy()
        z[60:63, 33:36] = 0.05
        ground = HeightMap(z, ground.resolution, ground.origin)
    with pytest.raises(TerrainError) as caught:
        gaitopt.choose_footholds(GO2, ground, (0.7, 0.0, 0.0), start=START, width=1)
    found, widest = caught.value.search, TerrainSettings.width_limit
    assert found.ways == 2 and found.spread < TerrainSettings.for_robot(GO2).step_length
    assert "2 ways of walking were tried" in str(caught.value)
    assert f"ended within {found.spread:.2f} m of one another" in str(caught.value)
    # A wall is the same beside the course, and is not looked at there. With a post it is not.
    beside = [(False, 1, True)] * len(ASIDE) if post else []
    fine, wide = ([(f, w, False)] * 2 for f, w in ((True, 1), (False, widest)))
    # At last the three that got farthest go on from before their dead ends, 12 and 24 steps back.
    onward = 3 * 2
    assert looked[:-onward] == 2 * [(False, 1, False), *beside] + fine + wide
    # None of them ended early, so the refusal says nothing of time or tries.
    assert found.ended is Ending.EXHAUSTED and not found.late
    assert "may be a way" not in str(caught.value) and len(str(caught.value)) < 500


def test_other_stances_without_a_stand_at_the_start_are_left_out() -> None:
    """A trench where front and hind feet of shorter stances would begin, and a wall ahead."""
    x, y = np.meshgrid(np.arange(-0.6, 1.1, 0.02), np.arange(-0.6, 0.6, 0.02), indexing="ij")
    z = np.where(np.abs(x) < 0.15, -0.3, 0.01 * np.sign(y) * (x > 0.3)) + 0.8 * (x > 0.5)
    ground = HeightMap(z, 0.02, (-0.6, -0.6))
    with pytest.raises(TerrainError):
        gaitopt.choose_footholds(
            GO2, ground, (0.7, 0.0, 0.0), start=START, step_length=0.12, width=1, freedom=0.03
        )


def test_a_course_beside_another_one_leads_between_the_same_ends() -> None:
    course = course_through(START, [(2.0, 0.0), (2.0, 2.0)], feet=0.2, smoothing=0.4)
    beside = course.beside(0.1, 0.3)
    assert np.allclose(beside.poses[[0, -1]], course.poses[[0, -1]])
    assert np.allclose(beside.poses[:, 2], course.poses[:, 2])
    moved = beside.poses[:, :2] - course.poses[:, :2]
    whole = (course.progress >= 0.3) & (course.progress <= course.length - 0.3)
    assert np.allclose(np.linalg.norm(moved[whole], axis=1), 0.1)
    # It lies to the left: it is inside of a turn to the left.
    assert beside.at(1.0)[1] == pytest.approx(0.1)
    assert beside.at(course.length - 0.5)[0] == pytest.approx(1.9)
    assert np.allclose(course.beside(-0.1, 0.3).poses + beside.poses, 2.0 * course.poses)


@pytest.mark.slow
def test_stones_that_are_crossed_beside_the_straight_course() -> None:
    robot = gaitopt.load_robot("wang2020")
    stones = gaitopt.make_ground("stepping_stones", seed=20, length=3.0, difficulty=1.0,
                                 robot=robot)  # fmt: skip
    settings = TerrainSettings.for_robot(robot, step_length=0.11, width_limit=6)
    search = search_for(robot, stones, (3.0, 0.0), START, settings)
    straight = search.run([first_layer(search)], most=10**6)
    assert not straight.complete and straight.ended is Ending.EXHAUSTED
    height = robot.standing_height
    beside = replace(search, course=search.course.beside(-0.25 * height, OVER * height))
    assert beside.run([first_layer(beside)], most=10**6).complete


def test_what_is_open_about_a_refusal(flat_search: TerrainSearch) -> None:
    def ended(ending: Ending, **others: Any) -> TerrainSearch:
        return replace(flat_search, ended=ending, **others)

    done, late, many = (ended(e) for e in (Ending.EXHAUSTED, Ending.TIME, Ending.TRIES))
    wide = replace(flat_search.settings, width_limit=400)
    assert ended_of([done, done]) is Ending.EXHAUSTED
    assert ended_of([late, done]) is Ending.EXHAUSTED  # the later one looked at all of it
    assert ended_of([done, late]) is Ending.TIME
    assert ended_of([many]) is Ending.TRIES and ended_of([many, late]) is Ending.TIME
    assert ended_of([late, many]) is Ending.TIME
    # What looks less finely, with a narrower beam, elsewhere or in another way covers nothing.
    assert ended_of([ended(Ending.TIME, fine=True), done]) is Ending.TIME
    assert ended_of([ended(Ending.TIME, settings=wide), done]) is Ending.TIME
    assert ended_of([ended(Ending.TIME, course=flat_search.course.beside(0.1, 0.1)), done]) is (
        Ending.TIME
    )
    short = replace(flat_search.settings, stance=0.7)
    assert ended_of([ended(Ending.TIME, settings=short), done]) is Ending.TIME


@pytest.fixture(scope="module")
def flat_search() -> TerrainSearch:
    flat = gaitopt.make_ground("flat", robot=GO2, length=0.9)
    return gaitopt.search_terrain(GO2, flat, (0.1, 0.0), start=START, width=1)


def test_tries_that_were_used_up_are_told() -> None:
    search = search_for(GO2, wall(), (0.7, 0.0, 0.0), START, TerrainSettings.for_robot(GO2))
    few = search.run([first_layer(search)], most=0)
    assert few.ended is Ending.TRIES and not few.late
    said = str(no_way(result_of(search, few, 0.0)))
    assert "its tries were used up, so there may be a way" in said


@pytest.mark.parametrize("name", ["go2", "wang2020"])
def test_a_wall_has_no_room_to_stand_and_rubble_and_stairs_have(name: str) -> None:
    robot = gaitopt.load_robot(name)
    settings = TerrainSettings.for_robot(robot)
    z = np.zeros((120, 80))
    z[70:75] = 0.9
    high = HeightMap(z, 0.02, (-0.7, -0.8))
    way = search_for(robot, high, (1.5, 0.0), START, settings)
    place = no_room(way.judge, way.stands, way.course)
    assert place is not None and 0.0 < place[0] < 0.8
    for kind in ("rubble", "stairs"):
        ground = gaitopt.make_ground(kind, robot=robot, length=1.2, difficulty=1.0)
        way = search_for(robot, ground, (1.2, 0.0), START, settings)
        assert no_room(way.judge, way.stands, way.course) is None


def test_where_a_wall_is_across_the_whole_map_it_says_so_and_looks_no_wider() -> None:
    with pytest.raises(TerrainError, match="no way round is seen on the map") as caught:
        gaitopt.choose_footholds(GO2, wall(), (0.7, 0.0), start=START, **QUICK)
    found = caught.value.search
    assert found.course.blocked and found.width == 4 and found.ways == 1
    assert found.ended is Ending.WALLED and found.wall is not None
    assert "its time was over" not in str(caught.value)
    assert "another goal or start" in str(caught.value)


def test_all_searches_together_end() -> None:
    settings = TerrainSettings.for_robot(GO2)
    assert settings.longest_in_all(3.0) == LONGER * settings.longest(3.0)
    given = TerrainSettings.for_robot(GO2, time_limit=7.0)
    assert given.longest_in_all(3.0) == given.longest(3.0) == 7.0


@pytest.mark.slow
def test_anymal_c_goes_up_stairs_of_17_cm_with_a_short_stance() -> None:
    robot = gaitopt.load_robot("anymal_c")
    stairs = gaitopt.make_ground("stairs_up", robot=robot, length=3.0, riser=0.17, tread=0.28)
    way = {"step_length": 0.1655, "width_limit": 24}
    level = gaitopt.search_terrain(robot, stairs, (3.0, 0.0), start=START, stance=1.0, **way)
    assert not level.complete
    short = gaitopt.search_terrain(robot, stairs, (3.0, 0.0), start=START, stance=0.7, **way)
    assert short.complete
    feet = short.footholds
    assert all(feet[leg][-1, 2] - feet[leg][0, 2] > 1.0 for leg in gaitopt.LEGS)


def test_a_refusal_says_that_the_edge_of_the_map_is_near() -> None:
    """hyq's trunk is 1.5 m long: where it turns on a map of 1.5 m it comes beyond the edge."""
    hyq = gaitopt.load_robot("hyq")
    way = {"start": START, "step_length": 0.3, "stance": 1.0, "width": 1, "width_limit": 1}
    narrow = HeightMap(np.zeros((121, 61)), 0.02, (-1.2, -0.6))
    with pytest.raises(TerrainError, match=r"the map's edge is 0.60 m from the body"):
        gaitopt.choose_footholds(hyq, narrow, (0.0, 0.0, 1.0), **way)
    wide = HeightMap(np.zeros((121, 121)), 0.02, (-1.2, -1.2))
    assert gaitopt.search_terrain(hyq, wide, (0.0, 0.0, 1.0), **way).complete


def test_a_refusal_says_that_points_near_the_body_are_unknown() -> None:
    """A cloud of points leaves holes; the trunk would be above the one in the middle."""
    z = np.zeros((121, 121))
    z[60, 60] = np.nan
    holed = HeightMap(z, 0.02, (-1.2, -1.2))
    way = {"start": START, "step_length": 0.2, "stance": 1.0, "width": 1, "width_limit": 1}
    with pytest.raises(TerrainError, match=r"unknown at 1 of its points within .*\(filled\)"):
        gaitopt.choose_footholds(GO2, holed, (0.4, 0.0), **way)
    assert gaitopt.search_terrain(GO2, holed.filled(), (0.4, 0.0), **way).complete
