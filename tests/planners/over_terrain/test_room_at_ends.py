"""Goals and starts at which no body can stand: refused before anything is searched."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import gaitopt
from gaitopt import HeightMap, TerrainError
from gaitopt.optimize.route.centre_of_mass import MassDistribution
from gaitopt.planners.over_terrain.beam.ending import Ending
from gaitopt.planners.over_terrain.search import Search
from gaitopt.planners.over_terrain.settings import TerrainSettings
from gaitopt.planners.over_terrain.setup import first_layer, search_for
from gaitopt.planners.over_terrain.ways.kinds import ways_of
from gaitopt.planners.over_terrain.ways.room_at_ends import (
    _com_box,
    no_room_at_ends,
)

GO2 = gaitopt.load_robot("go2")
FLAT = HeightMap(np.zeros((101, 91)), 0.02, (-0.7, -0.9))
"""It reaches to x = 1.3 m."""


def asked(name: str, goal: tuple[float, ...], start: tuple[float, ...]) -> Ending | None:
    robot = gaitopt.load_robot(name)
    settings = TerrainSettings.for_robot(robot)
    search = search_for(robot, FLAT, goal, start, settings)
    none = no_room_at_ends(search, ways_of(settings, {}))
    return None if none is None else none[0]


@pytest.mark.parametrize("name", ["go2"])
def test_a_goal_or_start_at_the_edge_has_no_room_and_one_with_room_has(name: str) -> None:
    assert asked(name, (1.3, 0.0), (0.2, 0.0, 0.0)) is Ending.NO_GOAL
    assert asked(name, (0.2, 0.0), (-0.7, 0.0, 0.0)) in (None, Ending.NO_START)
    assert asked(name, (0.4, 0.0), (0.2, 0.0, 0.0)) is None


def test_nothing_is_searched_and_the_error_tells_how_far_the_goal_must_move(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(Search, "run", lambda *_, **__: pytest.fail("a search was made"))
    told = r"cannot stand at the goal \(1.3, 0\).*edge is 0.00 m.*move the goal by (0\.\d+) m"
    with pytest.raises(TerrainError, match=told) as refused:
        gaitopt.choose_footholds(GO2, FLAT, (1.3, 0.0), start=(0.6, 0.0, 0.0))
    error = refused.value
    assert error.step == 0 and error.search.ended is Ending.NO_GOAL and "\n" not in str(error)
    far = float(str(error).split("move the goal by ")[1].split()[0])
    assert asked("go2", (1.3 - far, 0.0), (0.2, 0.0, 0.0)) is None


def test_a_goal_in_the_middle_of_unknown_ground_has_no_room_until_it_is_filled() -> None:
    z = FLAT.z.copy()
    z[55:] = np.nan
    holed = replace(FLAT, z=z)
    with pytest.raises(TerrainError, match=r"cannot stand at the goal.*unknown at .*\(filled\)"):
        gaitopt.choose_footholds(GO2, holed, (0.6, 0.0), start=(0.0, 0.0, 0.0))
    settings = TerrainSettings.for_robot(GO2)
    search = search_for(GO2, holed.filled(), (0.6, 0.0), (0.0, 0.0, 0.0), settings)
    assert no_room_at_ends(search, ways_of(settings, {})) is None


def test_goals_that_are_found_stay_found_where_the_map_ends_right_before_the_trunk() -> None:
    """The map is cut as near to what a search ended with as trunk and feet allow."""
    settings = TerrainSettings.for_robot(GO2, width_limit=6)
    goal, start = (0.88, 0.0), (0.6, 0.0, 0.0)
    search = search_for(GO2, FLAT, goal, start, settings)
    found = search.run([first_layer(search)])
    assert found.complete
    bodies, feet = found.layers[-1].body, found.layers[-1].feet
    for cut in range(1, 40):
        ground = HeightMap(FLAT.z[:-cut], FLAT.resolution, FLAT.origin)
        (_, edge), _ = ground.extent
        if edge < goal[0]:
            break
        nearer = search_for(GO2, ground, goal, start, settings)
        stands = nearer.judge.limbs.trunk_stands_clear(bodies)
        if not (stands & (feet[..., 0].max(axis=1) < edge - 0.05)).any():
            break
        assert no_room_at_ends(nearer, ways_of(settings, {})[:1]) is None
    assert cut > 3


@pytest.mark.parametrize("name", ["go2", "wang2020"])
def test_the_centre_of_mass_is_in_its_box_for_all_angles(name: str) -> None:
    masses = MassDistribution.of(gaitopt.load_robot(name))
    joints = np.random.default_rng(0).uniform(-np.pi, np.pi, (20_000, 4, 3))
    com = masses.com_in_body(joints)
    low, high, spread = _com_box(masses)
    assert (com >= low).all() and (com <= high).all()
    assert np.linalg.norm(com, axis=1).max() <= spread
