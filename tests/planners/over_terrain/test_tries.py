"""Searches that follow one another: other ways of walking, wider beams, and the refusal."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import gaitopt
from gaitopt import HeightMap, TerrainError
from gaitopt.planners.over_terrain.search import Search
from gaitopt.planners.over_terrain.settings import LONGER, TerrainSettings
from gaitopt.planners.over_terrain.setup import first_layer, search_for, with_settings
from gaitopt.planners.over_terrain.states import Found
from gaitopt.planners.over_terrain.ways.tries import SHORT_STANCES, STEP_SHARES, ways_of

GO2 = gaitopt.load_robot("go2")
START = (0.0, 0.0, 0.0)
QUICK = {"step_length": 0.12, "stance": 1.0, "width": 1, "width_limit": 8}


def wall() -> HeightMap:
    z = np.zeros((80, 60))
    z[48:52] = 0.6
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


def test_where_all_ways_end_at_one_place_it_looks_more_finely_and_wider_before_it_refuses(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    # Two ways of walking, so that it is quick.
    tries = "gaitopt.planners.over_terrain.ways.tries."
    for name, value in (("NARROW", 1), ("STEP_SHARES", (1.0, 0.7)), ("SHORT_STANCES", ())):
        monkeypatch.setattr(tries + name, value)
    looked: list[tuple[bool, int]] = []
    run, ends = Search.run, dict[float, Found]()

    def told(self: Search, *arguments: Any) -> Found:
        settings = self.judge.settings
        looked.append((self.fine, settings.width_limit))
        # No look gets over the wall; that of each way with the narrow beam stands for all.
        if settings.step_length not in ends:
            ends[settings.step_length] = run(self, *arguments)
        return ends[settings.step_length]

    monkeypatch.setattr(Search, "run", told)
    said = r"2 ways of walking .* were tried, which ended within 0\.\d\d m of one another"
    with pytest.raises(TerrainError, match=said) as caught:
        gaitopt.choose_footholds(GO2, wall(), (0.7, 0.0, 0.0), start=START, width=1)
    found, widest = caught.value.search, TerrainSettings.width_limit
    assert found.ways == 2 and found.spread < TerrainSettings.for_robot(GO2).step_length
    assert looked == [(False, 1)] * 2 + [(True, 1)] * 2 + [(False, widest)] * 2


def test_where_a_wall_is_across_the_whole_map_it_says_so_and_looks_no_wider() -> None:
    with pytest.raises(TerrainError, match="no way round is seen on the map") as caught:
        gaitopt.choose_footholds(GO2, wall(), (0.7, 0.0), start=START, **QUICK)
    assert caught.value.search.course.blocked and caught.value.search.width == 4
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
