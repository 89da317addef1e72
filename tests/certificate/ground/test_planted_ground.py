"""Walks over known ground keep clear of it; each planted fault is found by its check."""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Callable
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from numpy.typing import NDArray

import gaitopt
from gaitopt import LEGS, Footholds, HeightMap, MotionPath, Plan, Quadruped
from gaitopt.certificate.certificate import Certificate
from gaitopt.certificate.ground.checks import ground_checks
from gaitopt.certificate.ground.pillars import Pillars
from gaitopt.certificate.trace import Motion, trace
from gaitopt.certificate.verify import verify
from gaitopt.plan.phase import Phase

Array = NDArray[np.float64]

FEET = "feet on the ground"
NORMALS = "normals of footholds"
FLYING = "flying feet clear of the ground"
LIMBS = "legs and trunk clear of the ground"
CELL = 0.02


def judged(plan: Plan) -> Certificate:
    return verify(plan, collisions=False)


def flat(height: float = 0.0, low: float = -0.6, high: float = 0.8) -> HeightMap:
    count = round((high - low) / CELL) + 1
    return HeightMap(np.full((count, count), height), CELL, (low, low))


def on(plan: Plan, ground: HeightMap | None, **changes: Any) -> Plan:
    """The plan on another ground."""
    return dataclasses.replace(plan, footholds=plan.footholds.with_(ground=ground, **changes))


@pytest.fixture(scope="module")
def walk(wang: Quadruped) -> Plan:
    """Eight steps on a flat map, on which feet stand as balls."""
    points = gaitopt.s_columns(3, columns=3).raised(wang.foot_radius).points
    footholds = Footholds(points, ground=flat())
    return gaitopt.plan_crawl(wang, footholds, timing="velocity")


@pytest.fixture(scope="module")
def motion(walk: Plan) -> Motion:
    return trace(walk)


def test_a_walk_on_a_flat_map_is_clear_of_it(walk: Plan) -> None:
    found = judged(walk)
    assert found.ok
    assert found[FEET].worst < 1e-4 and found[NORMALS].worst < 1e-9
    assert -1e-4 < found[FLYING].worst <= 0.0
    assert found["swing clearance"].worst == pytest.approx(walk.settings.swing_height, abs=5e-4)
    assert found[LIMBS].worst > 4e-3
    with pytest.raises(gaitopt.UnknownNameError):
        found["flying feet above ground"]


@pytest.mark.parametrize("name", ["go2", "anymal_c"])
def test_walks_of_other_robots_are_clear_of_flat_ground(name: str) -> None:
    """Meshes by their hulls, and cylinders with balls."""
    robot = gaitopt.load_robot(name)
    columns = gaitopt.s_columns(0, columns=2, robot=robot)
    ground = flat(-robot.foot_radius, -1.0, 1.0)
    plan = gaitopt.plan_crawl(robot, Footholds(columns.points, ground=ground), timing="velocity")
    for each in (plan, on(plan, None, radius=columns.radius)):
        found = judged(each)
        assert found.ok and found[LIMBS].worst > 1e-3


def test_on_a_slope_feet_touch_beside_their_lowest_point(wang: Quadruped) -> None:
    """The same walk on the same ramp, with balls that are raised along its normal, and along z."""
    slope = 0.2
    normal = np.array([-slope, 0.0, 1.0]) / np.hypot(slope, 1.0)
    level = gaitopt.s_columns(3, columns=2).points
    x = flat().x
    ground = HeightMap(np.broadcast_to(slope * x[:, None], (len(x), len(x))), CELL, (-0.6, -0.6))
    touching = {leg: np.column_stack([p[:, :2], slope * p[:, 0]]) for leg, p in level.items()}
    raised = {leg: p + wang.foot_radius * normal for leg, p in touching.items()}
    normals = {leg: np.tile(normal, (len(p), 1)) for leg, p in level.items()}
    plan = gaitopt.plan_crawl(
        wang, Footholds(raised, ground=ground, normals=normals), timing="velocity"
    )
    found = judged(plan)
    assert found[FEET].worst < 1e-4 and found[NORMALS].worst < 1e-9
    assert found[FLYING].status == "ok"
    # Vertical normals, as without any, are 11 degrees off; a ball that is raised along z is
    # r (1 / cos - 1) = 0.3 mm too high.
    assert judged(on(plan, ground, normals=None))[NORMALS].worst == pytest.approx(np.arctan(slope))
    deeper = ground.with_heights(ground.z + 0.0021)
    assert judged(on(plan, deeper))[FEET].worst == pytest.approx(
        0.0021 / np.hypot(slope, 1.0), abs=1e-4
    )


def ground_two_millimetres_higher(plan: Plan) -> Plan:
    return on(plan, flat(0.002))


def ground_two_millimetres_lower(plan: Plan) -> Plan:
    return on(plan, flat(-0.002))


def normals_that_lean(plan: Plan) -> Plan:
    lean = np.array([np.sin(0.06), 0.0, np.cos(0.06)])
    counts = plan.footholds.counts
    return on(plan, flat(), normals={leg: np.tile(lean, (counts[leg], 1)) for leg in LEGS})


def foothold_off_the_map(plan: Plan) -> Plan:
    last = max(float(p[:, 0].max()) for p in plan.footholds.points.values())
    return on(plan, flat(high=round((last - 0.01) / CELL) * CELL))


def foothold_on_unknown_ground(plan: Plan) -> Plan:
    ground = flat()
    z = ground.z.copy()
    i, j = np.round((plan.footholds["LH"][1, :2] + 0.6) / CELL).astype(int)
    z[i, j] = np.nan
    return on(plan, ground.with_heights(z))


def trunk_above_unknown_ground(plan: Plan) -> Plan:
    ground = flat()
    z = ground.z.copy()
    z[30, 30] = np.nan
    return on(plan, ground.with_heights(z))


def spike_under_a_flying_foot(plan: Plan) -> Plan:
    """One point of the map that reaches 2 mm into a foot, which flies over it."""
    swing = plan.swings[2]
    time = swing.start + 0.5 * swing.duration
    foot = plan.at([time]).feet[0, LEGS.index(swing.leg)]
    return on(plan, spike(foot[:2], foot[2] - plan.robot.foot_radius + 0.002))


def spike_into_the_trunk(plan: Plan) -> Plan:
    trunk = plan.at([0.5 * plan.duration]).q[0, :3]
    # Half the height of the box in the middle is 50 mm.
    return on(plan, spike(trunk[:2], trunk[2] - 0.05 + 0.002))


def spike(place: Array, top: float, cell: float = 0.02) -> HeightMap:
    """A flat map with one point that is higher."""
    around = 50
    z = np.zeros((2 * around + 1, 2 * around + 1))
    z[around, around] = top
    return HeightMap(z, cell, place - cell * around)


@pytest.mark.parametrize(
    ("plant", "check", "words"),
    [
        (ground_two_millimetres_higher, FEET, ""),
        (ground_two_millimetres_higher, FLYING, ""),
        (ground_two_millimetres_lower, FEET, ""),
        (normals_that_lean, NORMALS, "foothold"),
        (foothold_off_the_map, FEET, "unknown or off the map"),
        (foothold_off_the_map, NORMALS, "foothold"),
        (foothold_on_unknown_ground, FEET, "LH on ground that is unknown"),
        (trunk_above_unknown_ground, LIMBS, "base above ground that is unknown"),
        (spike_under_a_flying_foot, FLYING, "away from both ends"),
        (spike_under_a_flying_foot, "swing clearance", ""),
        (spike_into_the_trunk, LIMBS, "base"),
    ],
)
def test_a_planted_fault_is_found(
    walk: Plan, motion: Motion, plant: Callable[[Plan], Plan], check: str, words: str
) -> None:
    (found,) = [c for c in ground_checks(plant(walk), motion) if c is not None and c.name == check]
    assert found.status == "violated"
    assert words in found.where


def dip(wang: Quadruped, depth: float, ground: HeightMap) -> Plan:
    """A foot that flies along one quadratic piece of a path, down to ``depth`` in its middle.

    Samples at both ends of the piece see it 50 mm above the ground.
    """
    start = gaitopt.s_columns(0, columns=2).raised(wang.foot_radius)
    first = {leg: p[:1] for leg, p in start.points.items()}
    places = {**first, "LF": np.repeat(first["LF"], 2, axis=0)}
    base = np.array([np.mean([p[0, 0] for p in first.values()]), 0.0, 0.4])

    def joints(height: float) -> Array:
        values = np.zeros(6 + len(wang.joint_names))
        values[:3] = base - wang.centre
        for leg in LEGS:
            foot = places[leg][0] + np.array([0.0, 0.0, height if leg == "LF" else 0.0])
            values[6 + np.array(wang.leg_columns[leg])] = wang.legs[leg].inverse(foot - values[:3])
        return values

    high, low = joints(0.05), joints(depth)
    # high + s (low - high) with s = 4 t (1 - t), highest power first.
    coefficients = np.stack([-4.0 * (low - high), 4.0 * (low - high), high])[:, None]
    cog, foot = tuple(base), tuple(places["LF"][0])
    phase = Phase("swing", "LF", 0, 0.0, 1.0, cog, cog, ("LH", "RH", "RF"), foot, foot, 0.0)
    return Plan(
        wang, Footholds(places, ground=ground, order=["LF"]),
        gaitopt.CrawlSettings(sequence=("LF",)),
        (phase,), MotionPath(np.array([0.0, 1.0]), coefficients),
    )  # fmt: skip


@pytest.mark.parametrize("depth", [-0.002, 0.002])
def test_a_foot_in_the_ground_between_samples(wang: Quadruped, depth: float) -> None:
    found = judged(dip(wang, depth, flat()))[FLYING]
    assert found.status == ("violated" if depth < 0.0 else "ok")
    if depth < 0.0:
        assert found.worst == pytest.approx(depth, abs=2e-4)
        assert found.when == pytest.approx(0.5, abs=0.05)


def shank_at(plan: Plan, time: float) -> tuple[Any, Any]:
    """Place and shape of the cylinder that is LF's shank, by Pinocchio."""
    robot = plan.robot
    data = robot.model.createData()
    pin.forwardKinematics(robot.model, data, plan.at([time]).q[0])
    geometry = pin.buildGeomFromUrdfString(robot.model, robot.urdf, pin.GeometryType.COLLISION)
    (shank,) = [g for g in geometry.geometryObjects if g.name.startswith("LF_SHANK")]
    return data.oMi[shank.parentJoint] * shank.placement, shank.geometry


@pytest.mark.parametrize("into", [0.002, -0.002])
def test_a_shank_in_the_ground_between_samples(wang: Quadruped, into: float) -> None:
    """A spike below the shank of a foot that flies low in the middle of one piece of its path.

    The shank is a cylinder of 9 mm; a plumb line through its leaning axis leaves it below the axis
    by the radius over the cosine of how far the axis rises.
    """
    plan = dip(wang, 0.01, flat())
    at, shank = shank_at(plan, 0.5)
    axis = at.rotation[:, 2] * np.sign(at.rotation[2, 2])
    # 60 mm above the lower end of the cylinder.
    point = at.translation + axis * (0.06 - shank.halfLength)
    lowest = point[2] - shank.radius / np.hypot(axis[0], axis[1])
    ground = spike(point[:2], lowest + into, cell=0.01)
    found = judged(on(plan, ground))[LIMBS]
    assert found.status == ("violated" if into > 0.0 else "ok")
    assert "SHANK" in found.where
    # The tip is 2 mm away on the plumb line, and a little nearer or farther beside it.
    assert 0.001 < abs(found.worst) < 0.0022
    assert found.when == pytest.approx(0.5, abs=0.07)


def test_a_foot_dragged_through_a_higher_column(wang: Quadruped) -> None:
    """Another leg's column that stands where a foot flies by, 20 mm higher than the foot."""
    columns = gaitopt.s_columns(3, columns=3)
    plan = gaitopt.plan_crawl(wang, columns, timing="velocity")
    assert judged(plan).ok
    swing = next(s for s in plan.swings if s.leg == "RF")
    foot = plan.at([swing.start + 0.5 * swing.duration]).feet[0, LEGS.index("RF")]
    points = {leg: p.copy() for leg, p in columns.points.items()}
    points["LH"][2] = foot + np.array([0.0, 0.0, 0.02])
    found = judged(dataclasses.replace(plan, footholds=columns.with_(points=points)))
    assert found[FLYING].status == "violated"
    assert found[FLYING].where.startswith("RF")
    assert found["swing clearance"].status == "violated"
    # The column's top is 20 mm above the lowest point of the ball, which is in it by its radius
    # or more: the shortest way out is sideways or upwards.
    assert -0.06 < found["swing clearance"].worst < -0.01


def test_a_foot_that_stands_in_a_higher_column_beside_its_own(wang: Quadruped) -> None:
    """A column that is 100 mm higher, 30 mm away from the middle of the one that RF stands on."""
    columns = gaitopt.s_columns(3, columns=2)
    assert judged(gaitopt.plan_crawl(wang, columns, timing="velocity"))[FEET].worst < 1e-4
    points = {leg: p.copy() for leg, p in columns.points.items()}
    points["RF"][0] = points["RH"][1] + np.array([0.3, 0.0, -0.1])
    points["LH"][1] = points["RF"][0] + np.array([0.0, 0.03, 0.1])
    standing = Pillars.of(columns.with_(points=points), wang.foot_radius)
    # The ball has 15 mm and the column 20 mm, so 5 mm of the ball are in the column.
    off = standing.off(np.array([points["RF"][0], points["LH"][1]]), wang.foot_radius)
    np.testing.assert_allclose(off, [0.005, 0.0], atol=1e-12)


def test_a_landing_radius_of_ten_metres_certifies_nothing(wang: Quadruped, walk: Plan) -> None:
    for wide in (on(walk, None, radius=10.0), on(walk, flat(), radius=10.0)):
        found = judged(wide)["settings"]
        assert found.status == "unchecked"
        assert "feet may land 10 m from their footholds" in found.note


def test_a_shank_that_hits_a_column(wang: Quadruped) -> None:
    columns = gaitopt.s_columns(3, columns=3)
    plan = gaitopt.plan_crawl(wang, columns, timing="velocity")
    at, _ = shank_at(plan, plan.swings[3].start)
    points = {leg: p.copy() for leg, p in columns.points.items()}
    points["RH"][2] = at.translation + np.array([0.0, 0.0, wang.foot_radius])
    found = judged(dataclasses.replace(plan, footholds=columns.with_(points=points)))[LIMBS]
    assert found.status == "violated"
    assert "LF" in found.where


def test_a_walk_goes_clear_of_a_column_in_the_way_of_a_shank(wang: Quadruped) -> None:
    """Where the body height is given nothing else can be tried: it is told, and it is violated.

    LH ends on a column where LF's shank stands before.
    """
    columns = gaitopt.s_columns(3, columns=3)
    plan = gaitopt.plan_crawl(wang, columns, timing="velocity")
    at, _ = shank_at(plan, plan.swings[3].start)
    points = {leg: p.copy() for leg, p in columns.points.items()}
    points["LH"][2] = at.translation
    moved = columns.with_(points=points)
    height = plan.settings.body_height
    with pytest.warns(gaitopt.FootholdsWarning, match="shank of LF goes .* into a column of LH"):
        through = gaitopt.plan_crawl(wang, moved, timing="velocity", body_height=height)
    found = judged(through)
    assert found[FEET].status == "ok"
    assert found[LIMBS].status == "violated" and "LF_SHANK" in found[LIMBS].where
    assert found[LIMBS].worst < -0.01
    clear = gaitopt.plan_crawl(wang, moved, timing="velocity")
    assert clear.settings.body_height > height
    assert judged(clear)[LIMBS].status == "ok"


def test_of_feet_without_a_radius_nobody_knows_where_legs_end(wang: Quadruped) -> None:
    """A point on a ramp: its normal is the ramp's, and the shank reaches to it or beyond."""
    ball = r'<collision>\s*<origin[^>]*>\s*<geometry><sphere radius="0.015"/>.*\s*</collision>'
    robot = Quadruped.from_urdf(re.sub(ball, "", wang.urdf), "points")
    assert robot.foot_radius == 0.0
    slope = 0.2
    x = flat().x
    ground = HeightMap(np.broadcast_to(slope * x[:, None], (len(x), len(x))), CELL, (-0.6, -0.6))
    points = {leg: np.column_stack([p[:, :2], slope * p[:, 0]])
              for leg, p in gaitopt.s_columns(3, columns=2).points.items()}  # fmt: skip
    normal = np.array([-slope, 0.0, 1.0]) / np.hypot(slope, 1.0)
    normals = {leg: np.tile(normal, (2, 1)) for leg in LEGS}
    found = judged(gaitopt.plan_crawl(
        robot, Footholds(points, ground=ground, normals=normals), timing="velocity"
    ))  # fmt: skip
    assert found.ok
    assert found[NORMALS].worst < 1e-6 and found[FEET].worst < 1e-4
    assert found[LIMBS].status == "unchecked" and "foot_radius=" in found[LIMBS].note
