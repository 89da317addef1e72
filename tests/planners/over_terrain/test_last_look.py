"""What the search asks of steps that it would keep: links apart, and forces that hold the robot."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest

import gaitopt
from gaitopt import HeightMap
from gaitopt.dynamics.contacts import ForceLimits
from gaitopt.planners.over_terrain.last_look import LastLook, box_swing
from gaitopt.planners.over_terrain.links.beside_trunk import BETWEEN_LINKS, BesideTrunk
from gaitopt.planners.over_terrain.links.limbs import Limbs
from gaitopt.planners.over_terrain.links.link_spheres import link_spheres
from gaitopt.planners.over_terrain.links.rolling import at_rest
from gaitopt.planners.over_terrain.pairs import Cause
from gaitopt.planners.over_terrain.search import Search
from gaitopt.planners.over_terrain.settings import TerrainSettings
from gaitopt.planners.over_terrain.setup import first_layer, search_for
from gaitopt.planners.over_terrain.states import Candidate, Kept, Layer
from gaitopt.planners.over_terrain.surfaces import Surfaces
from gaitopt.robots.collisions.pairs import CollisionPairs

LF, LH, RH, RF = range(4)


@lru_cache
def on_slope(name: str, angle: float) -> tuple[Search, Layer]:
    """A search up a slope [rad], and its first state."""
    robot = gaitopt.load_robot(name)
    x = np.arange(-1.0, 1.5, 0.02)
    slope = HeightMap(np.tile(np.tan(angle) * x[:, None], (1, 100)), 0.02, (-1.0, -1.0))
    settings = TerrainSettings.for_robot(robot, friction=0.7)
    search = search_for(robot, slope, (0.5, 0.0), (0.0, 0.0, 0.0), settings)
    return search, first_layer(search)


def step_of(layer: Layer, leg: int, by: tuple[float, float], body: tuple[float, ...]) -> Candidate:
    """A step on level ground, with the body moved by x, y, z [m], roll, pitch and yaw [rad]."""
    target = layer.feet[0, leg] + np.array([*by, 0.0])
    return Candidate(0.0, 0, 0, leg, target, layer.body[0] + np.array(body), 0.03, layer.rolled[0],
                     0.0)  # fmt: skip


def looked_at(search: Search, layer: Layer, step: Candidate) -> Counter[Cause]:
    refused: Counter[Cause] = Counter()
    kept = search.last.kept(layer, [step], refused)
    assert kept[0] == (refused.total() == 0)
    return +refused


def test_a_step_in_which_links_touch_is_refused() -> None:
    """The body of wang2020 goes sideways until a thigh that stands is at the trunk."""
    search, layer = on_slope("wang2020", 0.0)
    aside = step_of(layer, LF, (0.1, 0.0), (0.0, -0.05, 0.0, 0.0, 0.0, 0.0))
    assert not looked_at(search, layer, aside)
    far = step_of(layer, LF, (0.1, 0.0), (0.0, -0.22, 0.0, 0.0, 0.0, 0.0))
    assert looked_at(search, layer, far)[Cause.TOUCH] == 1


def test_a_step_that_forces_do_not_allow_is_refused() -> None:
    """Up a slope of tangent 0.36 a friction of 0.6 holds the robot and one of 0.3 does not."""
    search, layer = on_slope("go2", 0.35)
    step = step_of(layer, LF, (0.0, 0.0), (-0.04, -0.04, -0.015, 0.0, 0.0, 0.0))
    for friction, refused in ((0.6, 0), (0.3, 1)):
        last = replace(search.last, limits=ForceLimits(friction=friction, sides=16))
        found = looked_at(replace(search, last=last), layer, step)
        assert found[Cause.FORCE] == refused and not found[Cause.TOUCH]
    # The centre of mass is outside of the three feet.
    ahead = step_of(layer, LF, (0.0, 0.0), (0.05, 0.05, 0.018, 0.0, 0.0, 0.0))
    assert looked_at(search, layer, ahead)[Cause.FORCE] == 1


@pytest.mark.parametrize("name", ["wang2020", "anymal_c", "a1"])
def test_thighs_beside_the_trunk(name: str) -> None:
    """The table says what exact distances say, save for a few that are next to the limit."""
    robot = gaitopt.load_robot(name)
    shapes, table = CollisionPairs.of(robot), BesideTrunk.of(robot)
    assert shapes is not None
    thigh = robot.model.getJointId(robot.legs["RH"].joints[1])
    solids = shapes.geometry.geometryObjects
    pairs = [
        k
        for k, pair in enumerate(shapes.geometry.collisionPairs)
        if {solids[pair.first].parentJoint, solids[pair.second].parentJoint} == {1, thigh}
    ]
    standing = robot.standing_joints()[robot.leg_joint_columns].reshape(4, 3)
    angles = np.tile(standing, (100, 1, 1))
    angles[:, RH] += np.random.default_rng(3).uniform(-1.2, 1.2, (100, 3))
    gaps = shapes.distances(angles.reshape(100, 12), pairs).min(axis=1)
    clear = table.clear(RH, angles[:, RH])
    assert clear[gaps > 2.0 * BETWEEN_LINKS].all() and not clear[gaps < -BETWEEN_LINKS].any()
    assert (clear == (gaps >= BETWEEN_LINKS)).mean() > 0.95
    assert table.clear(RH, standing[RH])


def test_only_what_would_be_kept_is_looked_at() -> None:
    _, layer = on_slope("go2", 0.0)
    steps = [step_of(layer, LF, (0.0, 0.0), (0.0,) * 6)._replace(cost=float(k)) for k in range(20)]
    asked: list[float] = []

    def look(some: list[Candidate]) -> np.ndarray:
        asked.extend(step.cost for step in some)
        return np.array([step.cost % 2 == 0 for step in some])

    kept = Kept(3, look)  # type: ignore[arg-type]
    for step in reversed(steps):
        kept.add(step)
    assert [step.cost for step in kept.settled()] == [0.0, 2.0, 4.0]
    assert max(asked) <= 6.0 and len(asked) == len(set(asked))


def test_a_shank_that_goes_through_an_edge_while_its_foot_rises_is_refused() -> None:
    """anymal_c lifts a hind foot by 0.22 m up stairs: clear below, halfway up and above.

    A quarter of the way up its shank is in the edge of the next tread.
    """
    robot = gaitopt.load_robot("anymal_c")
    heights = np.where(np.arange(1.4, 2.6, 0.02) < 2.01, 0.85, 1.02)
    stairs = HeightMap(np.tile(heights[:, None], (1, 50)), 0.02, (1.4, -0.5))
    radii = np.append(link_spheres(robot).radii, robot.foot_radius)
    limbs = Limbs.of(robot, Surfaces.of(stairs, radii, robot.foot_radius), 0.013)
    start, end = np.array([1.96, -0.28, 0.88]), np.array([2.12, -0.28, 1.05])
    body = np.array([[2.2138, -0.0031, 1.481, -0.0544, -0.282, 0.0]])
    way = box_swing(start, end, 0.0516, 0.06 * robot.standing_height)
    clear = limbs.leg_clear(RH, way[:, None], np.repeat(body, len(way), axis=0))
    halves = limbs.leg_clear(RH, np.array([[start, (start + way[8]) / 2.0, way[8]]]), body)
    assert halves.all() and not clear[:3].any() and clear[3:].all()
    feet = np.repeat(start[None], 4, axis=0)[None]
    none, zero = np.array([-1]), np.zeros(1)
    layer = Layer(
        feet,
        np.full((1, 4), -1),
        body,
        np.zeros((1, 4), int),
        zero,
        none,
        none,
        zero,
        at_rest(1),
        zero,
    )
    step = Candidate(0.0, 0, 0, RH, end, body[0], 0.0516, layer.rolled[0], 0.0)
    last = LastLook.of(robot, limbs, np.zeros((1, 3)), ForceLimits())
    refused: Counter[Cause] = Counter()
    assert not last.kept(layer, [step], refused)[0] and +refused == {Cause.LIMB: 1}
