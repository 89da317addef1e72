"""Steps that fit the treads of stairs."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import gaitopt
from gaitopt import HeightMap
from gaitopt.planners.over_terrain.course import course_through
from gaitopt.planners.over_terrain.search import Search
from gaitopt.planners.over_terrain.settings import TerrainSettings
from gaitopt.planners.over_terrain.setup import along, first_layer, search_for, with_settings
from gaitopt.planners.over_terrain.ways.treads import Stairs, fitted_ways, stairs_along

GO2 = gaitopt.load_robot("go2")
START = (0.0, 0.0, 0.0)
ASIDE, RISER = 0.14, 0.05


def stairs(*edges: float, turned: float = 0.0, riser: float = 0.1) -> HeightMap:
    """Ground that rises at lines across the direction ``turned``, and falls at negative ones."""
    x, y = np.meshgrid(np.arange(-0.6, 2.6, 0.02), np.arange(-1.0, 1.0, 0.02), indexing="ij")
    way = np.cos(turned) * x + np.sin(turned) * y
    z = sum(np.sign(edge) * riser * (way > abs(edge)) for edge in edges)
    return HeightMap(z, 0.02, (-0.6, -1.0))


def found(ground: HeightMap, start: tuple[float, ...], goal: tuple[float, ...]) -> list[Stairs]:
    course = course_through(start, goal, feet=0.24, smoothing=0.48)
    return stairs_along(ground, course, ASIDE, RISER)


def search_over(ground: HeightMap, length: float = 2.0) -> Search:
    return search_for(GO2, ground, (length, 0.0), START, TerrainSettings.for_robot(GO2))


def test_stairs_are_seen_with_their_treads_up_and_down() -> None:
    ground = stairs(0.51, 0.81, 1.11, -1.61, -1.91, -2.21)
    up, down = found(ground, START, (2.4, 0.0))
    assert (up.first, up.last, up.tread) == pytest.approx((0.51, 1.11, 0.3), abs=0.011)
    assert (down.first, down.last, down.tread) == pytest.approx((1.61, 2.21, 0.3), abs=0.011)
    assert (up.up, down.up) == (True, False) and not up.turned
    assert up.riser == pytest.approx(0.1, abs=1e-9)
    # From the other side they are the same stairs, seen the other way round.
    back = found(ground, (2.4, 0.0, np.pi), (0.0, 0.0, np.pi))
    assert [some.up for some in back] == [True, False]
    assert back[0].first == pytest.approx(2.4 - down.last, abs=0.021)
    # A body that goes backward sees them turned.
    assert [some.turned for some in found(ground, (2.4, 0.0, 0.0), (0.0, 0.0, 0.0))] == [True] * 2


@pytest.mark.parametrize(
    ("ground", "goal"),
    [
        (stairs(0.5, 0.8, 1.1, riser=0.04), (2.0, 0.0)),  # low ones need no care
        (stairs(0.5, 0.8), (2.0, 0.0)),  # one tread
        (stairs(0.5, 0.7, 1.2), (2.0, 0.0)),  # of different depths
        (stairs(0.5, -0.8, 1.1, -1.4), (2.0, 0.0)),  # up and down in turn
        (stairs(0.5, 0.8, 1.1, turned=0.6), (2.0, 0.0)),  # met aslant: sides at other places
        (stairs(0.5, 0.8, 1.1), (2.0, 0.0, 0.5)),  # the body turns on them
    ],
)
def test_other_ground_has_no_stairs(ground: HeightMap, goal: tuple[float, ...]) -> None:
    assert not found(ground, START, goal)


@pytest.mark.parametrize("name", ["flat", "rubble", "stepping_stones", "hills", "gaps", "ramp"])
def test_grounds_without_stairs_have_no_fitted_ways(name: str) -> None:
    assert not fitted_ways(
        search_over(gaitopt.make_ground(name, seed=3, robot=GO2, length=2.0)), {}
    )


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_all_feet_stand_alike_on_every_tread(sign: float) -> None:
    edges = np.array([0.51, 0.81, 1.11, 1.41])
    search = search_over(stairs(*(sign * edges)))
    ways = fitted_ways(search, {})
    assert len(ways) == 4 and ways[0].high
    for way in ways:
        step = way.settings.step_length
        assert step == pytest.approx(0.15, abs=0.006)  # half a tread
        fitting = along(with_settings(search, way.settings), way.course)
        marks = way.course.marks
        assert marks is not None and marks[0] == 0.0 and marks[-1] == way.course.length
        assert fitting.cycles == len(marks) - 1
        assert (np.diff(marks) > 0.0).all() and np.diff(marks).max() < 1.06 * step
        places = np.array(
            [[fitting.usual(leg, k)[0] for k in range(len(marks))] for leg in range(4)]
        )
        over = (places > edges[0]) & (places < edges[-1])
        # From the edge below, and from the other side on the way down.
        beyond = np.mod(sign * (places[over] - edges[0]), step) / step
        assert np.ptp(np.mod(beyond - beyond[0] + 0.5, 1.0)) < 0.15
        # Twice on each tread, with every foot.
        assert over.sum() == pytest.approx(4 * 2 * (len(edges) - 1), abs=2)


@pytest.mark.parametrize("ahead", [0.5, -0.5])
def test_the_base_may_be_ahead_of_all_hips_or_behind_them(ahead: float) -> None:
    search = search_over(stairs(0.51, 0.81, 1.11, 1.41), 2.4)
    hips = search.judge.hips + np.array([ahead, 0.0])
    moved = replace(search, judge=replace(search.judge, hips=hips))
    for way, usual in zip(fitted_ways(moved, {}), fitted_ways(search, {}), strict=True):
        assert way.settings == usual.settings and way.course.marks is not None
        assert (np.diff(way.course.marks) > 0.0).all()


def test_hips_nearer_than_half_a_step_have_no_fitted_ways() -> None:
    search = search_over(stairs(0.5, 0.8, 1.1))
    near = replace(search, judge=replace(search.judge, hips=search.judge.hips * [0.1, 1.0]))
    assert not fitted_ways(near, {})


def test_what_was_asked_for_is_not_changed() -> None:
    search = search_over(stairs(0.5, 0.8, 1.1))
    assert not fitted_ways(search, {"step_length": 0.12})
    ways = fitted_ways(search, {"stance": 1.0})
    assert ways and {way.settings.stance for way in ways} == {1.0}


def test_steep_stairs_are_climbed_without_a_dead_end() -> None:
    """Usual steps drift over the treads, to where no leg reaches from."""
    robot = gaitopt.load_robot("wang2020")
    ground = gaitopt.make_ground("stairs_up", seed=20, difficulty=1.0, robot=robot, length=2.2)
    narrow = TerrainSettings.for_robot(robot, width_limit=6)
    search = search_for(robot, ground, (2.2, 0.0), START, narrow)
    assert not search.run([first_layer(search)], most=10**6).complete
    way = fitted_ways(search, {})[0]
    fitting = along(with_settings(search, way.settings), way.course)
    assert fitting.run([first_layer(fitting)], most=10**6).complete
