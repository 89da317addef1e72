"""What touches an obstacle is found, be it a foot, a knee or the body, and be it for a millisecond;
and the distance that is stated is neither above nor far below the true one.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import pinocchio as pin
import pytest
from numpy.typing import NDArray
from pinocchio import coal

from gaitopt import LEGS, Footholds, MotionPath, Plan, Quadruped, load_robot, plan_crawl
from gaitopt.certificate.check import Check
from gaitopt.certificate.collisions.obstacles import (
    RESOLUTION,
    ROUNDING,
    SIDES,
    SLACK,
    THIN,
    distance_moved,
    obstacle_solid,
    obstacles_cleared,
    robot_shapes,
    without_meshes,
)
from gaitopt.certificate.enclosure import Pieces
from gaitopt.certificate.placements import configurations
from gaitopt.plan.settings.crawl import CrawlSettings
from gaitopt.terrain.obstacles import (
    Obstacle,
    rectangular_obstacle,
    round_obstacle,
    triangular_obstacle,
)

Array = NDArray[np.float64]
STEP = 0.1
BOARD_X = 0.25
"""Between a front foothold at 0.20 m and the next one; hind feet get no farther than 0 m."""


@dataclass(frozen=True)
class AwareSettings(CrawlSettings):
    """Settings that know of obstacles, as those of any planner may."""

    obstacles: tuple[Obstacle, ...] = ()
    clearance: float = 0.0

    @property
    def obstacle_clearance(self) -> float:
        return self.clearance


def straight_walk(robot: Quadruped, step: float, **settings: float) -> Plan:
    """Eight steps straight ahead on level ground, which is at ``z = -foot_radius``."""
    length, width = robot.stance_size
    first = {
        leg: np.array([length if leg[1] == "F" else -length, width if leg[0] == "L" else -width])
        for leg in LEGS
    }
    points = {leg: [[p[0] / 2 + k * step, p[1] / 2, 0] for k in range(3)]
              for leg, p in first.items()}  # fmt: skip
    return plan_crawl(robot, Footholds(points), **settings, timing="velocity")


def beside(plan: Plan, *obstacles: Obstacle, clearance: float = 0.0) -> Plan:
    """The same plan, told of obstacles, and of what it promises to keep from them."""
    known = {f.name: getattr(plan.settings, f.name) for f in dataclasses.fields(CrawlSettings)}
    return dataclasses.replace(
        plan, settings=AwareSettings(**known, obstacles=obstacles, clearance=clearance)
    )


def judge(plan: Plan, *obstacles: Obstacle) -> Check:
    check = obstacles_cleared(beside(plan, *obstacles))
    assert check is not None
    return check


def board(height: float, x: float = BOARD_X, z: float = -0.015, **other: float) -> Obstacle:
    return rectangular_obstacle(height, 0.01, position=(x, 0.0, z), **other)


@pytest.fixture(scope="module")
def walk(wang: Quadruped) -> Plan:
    return straight_walk(wang, STEP)


@pytest.fixture(scope="module")
def tumbling(walk: Plan) -> Plan:
    """A base that goes and turns about all axes, and joints that move, by cubics."""
    rng = np.random.default_rng(3)
    coefficients = rng.uniform(-0.6, 0.6, (4, 6, 18))
    coefficients[3, 0] = walk.path.knots()[0]
    for i in range(1, 6):  # no jumps: each segment starts where the one before ends
        coefficients[3, i] = coefficients[:, i - 1].sum(axis=0)
    return dataclasses.replace(walk, phases=(), path=MotionPath(np.arange(7.0), coefficients))


def sampled_distances(plan: Plan, obstacle: Obstacle, times: Array) -> Array:
    """The robot's distance from an obstacle at ``times``: every shape of its URDF, one by one."""
    model = plan.robot.model
    shapes = pin.buildGeomFromUrdfString(model, plan.robot.urdf, pin.GeometryType.COLLISION)
    data, placed = model.createData(), shapes.createData()
    solid, here = obstacle_solid(obstacle), coal.Transform3s()
    out = np.empty(len(times))
    for i, q in enumerate(configurations(plan.path.evaluate(times))):
        pin.updateGeometryPlacements(model, data, shapes, placed, q)
        out[i] = min(
            coal.distance(
                solid, here, shape.geometry, coal.Transform3s(m.rotation, m.translation),
                coal.DistanceRequest(), coal.DistanceResult(),
            )
            for shape, m in zip(shapes.geometryObjects, placed.oMg, strict=True)
        )  # fmt: skip
    return out


def knot_at(plan: Plan, leg: str, share: float) -> int:
    """Index of a knot in the first swing of ``leg``."""
    swing = next(s for s in plan.swings if s.leg == leg)
    return int(np.searchsorted(plan.path.times, swing.start + share * (swing.end - swing.start)))


def with_foot_at(plan: Plan, leg: str, times: Array, place: Array) -> Plan:
    """The plan with three knots at ``times (3,)``: at the second the foot is at ``place (3,)``."""
    values = plan.path.evaluate(times).copy()
    here = plan.at([times[1]])
    local = plan.robot.legs[leg].inverse(place - (here.cog[0] - plan.robot.centre))
    columns = [6 + c for c in plan.robot.leg_columns[leg]]
    values[1, columns] = local
    known = plan.path.times
    keep = (known < times[0]) | (known > times[2])
    at = int(np.searchsorted(known[keep], times[0]))
    return dataclasses.replace(
        plan,
        path=MotionPath.polyline(
            np.insert(known[keep], at, times), np.insert(plan.path.knots()[keep], at, values, 0)
        ),
    )


def test_a_plan_without_obstacles_has_no_such_check(walk: Plan) -> None:
    assert obstacles_cleared(walk) is None
    assert obstacles_cleared(beside(walk)) is None


def test_a_low_board_between_the_feet_is_cleared(walk: Plan) -> None:
    check = judge(walk, board(0.02))
    assert check.status == "ok" and check.sense == ">="
    assert check.worst > check.limit > 0.0 and check.note == ""
    assert 0.0 <= check.bound <= RESOLUTION + ROUNDING


@pytest.fixture(scope="module")
def least(walk: Plan) -> float:
    """The walk's least distance from a low board, by samples every 5 us around it [m]."""
    around = judge(walk, board(0.02)).when + np.linspace(-5e-3, 5e-3, 2001)
    return float(sampled_distances(walk, board(0.02), around).min())


@pytest.mark.parametrize("short", [-1e-3, -1e-5, 0.0, 1e-5, 1e-3])
def test_a_promise_is_held_to_the_hundredth_of_a_millimetre(
    walk: Plan, least: float, short: float
) -> None:
    check = obstacles_cleared(beside(walk, board(0.02), clearance=least + short))
    assert check is not None
    assert check.limit == pytest.approx(least + short - SLACK)
    assert check.status == ("violated" if short > SLACK else "ok")
    assert (check.worst >= check.limit) == (check.status == "ok")


@pytest.mark.parametrize("obstacle", [
    board(0.02), board(0.02, yaw=0.15),
    triangular_obstacle(0.03, 0.03, position=(0.25, 0, -0.015)),
    round_obstacle(0.02, position=(0.25, 0, -0.015)),
    board(0.4, x=1.0),
], ids=["board", "turned", "triangle", "round", "far"])  # fmt: skip
def test_the_distance_is_that_of_dense_samples(walk: Plan, obstacle: Obstacle) -> None:
    check = judge(walk, obstacle)
    near = np.clip(check.when + np.linspace(-0.05, 0.05, 200), 0.0, walk.duration)
    times = np.append(np.linspace(0.0, walk.duration, 800), near)
    sampled = sampled_distances(walk, obstacle, times)
    around = sampled_distances(walk, obstacle, np.array([check.when]))[0]
    seen = check.worst + check.bound
    assert seen == pytest.approx(around, abs=ROUNDING)
    assert check.worst <= sampled.min()
    assert seen <= sampled.min() + RESOLUTION


def test_a_tumbling_robot_is_bounded_as_well(tumbling: Plan) -> None:
    obstacle = board(0.05, x=1.5, yaw=0.3)
    check = judge(tumbling, obstacle)
    sampled = sampled_distances(tumbling, obstacle, np.linspace(0.0, tumbling.duration, 1000))
    assert check.worst <= sampled.min()
    assert check.worst + check.bound <= sampled.min() + RESOLUTION


@pytest.mark.parametrize("moving", [*range(6), 6, 7, 8, 17, None])
def test_no_point_of_a_shape_goes_beyond_its_bound(tumbling: Plan, moving: int | None) -> None:
    """Base and joints, one at a time and all together."""
    coefficients = tumbling.path.coefficients.copy()
    if moving is not None:
        others = np.arange(18) != moving
        coefficients[:, :, others] = 0.0
        coefficients[-1, :, others] = tumbling.path.knots()[0][others, None]
    path = MotionPath(tumbling.path.times, coefficients)
    pieces = Pieces.of(path)
    model, shapes = tumbling.robot.model, robot_shapes(tumbling.robot).geometry
    data, placed = model.createData(), shapes.createData()
    times = np.linspace(0.0, path.duration, 121)
    poses = []
    for q in configurations(path.evaluate(times)):
        pin.updateGeometryPlacements(model, data, shapes, placed, q)
        poses.append([m.homogeneous.copy() for m in placed.oMg])
    around = np.random.default_rng(0).normal(size=(20, 3))
    around /= np.linalg.norm(around, axis=1, keepdims=True)
    for i, shape in enumerate(shapes.geometryObjects):
        bound = np.interp(
            times, path.times, distance_moved(model, shape, pieces.largest(1), pieces)
        )
        rim = np.array(shape.geometry.aabb_center) + shape.geometry.aabb_radius * around
        turn = np.array([p[i] for p in poses])
        points = rim @ turn[:, :3, :3].transpose(0, 2, 1) + turn[:, None, :3, 3]
        gone = np.linalg.norm(np.diff(points, axis=0), axis=2).max(axis=1)
        assert (gone <= np.diff(bound) + 1e-12).all()
        if moving in (0, 1, 2):  # a straight line at the largest speed of each piece
            assert gone.sum() > 0.2 * bound[-1]


def test_no_foot_is_nearer_than_stated_by_the_obstacles_own_measure(walk: Plan) -> None:
    feet = walk.at(np.linspace(0.0, walk.duration, 5000)).feet
    for obstacle in (board(0.02), triangular_obstacle(0.03, 0.03, position=(0.25, 0, -0.015))):
        nearest = obstacle.distance(feet).min() - walk.robot.foot_radius
        assert judge(walk, obstacle).worst <= nearest


def test_swelling_the_obstacle_takes_as_much_off_the_distance(walk: Plan) -> None:
    thin = judge(walk, board(0.005))
    seen = thin.worst + thin.bound
    for swell in (0.002, 0.9 * seen):
        check = judge(walk, board(0.005).inflated(swell))
        assert check.worst + check.bound == pytest.approx(seen - swell, abs=1.1 * RESOLUTION)
        assert check.status == "ok"
    assert judge(walk, board(0.005).inflated(seen + 1e-4)).status == "violated"


def test_what_moves_with_the_obstacle_keeps_its_distance(walk: Plan) -> None:
    shift = np.array([0.7, -0.3, 0.2])
    coefficients = walk.path.coefficients.copy()
    coefficients[-1, :, :3] += shift
    moved = dataclasses.replace(walk, path=MotionPath(walk.path.times, coefficients))
    there = rectangular_obstacle(0.02, 0.01, position=tuple(np.array([0.25, 0, -0.015]) + shift))
    assert judge(moved, there).worst == pytest.approx(judge(walk, board(0.02)).worst, abs=1e-6)


def test_of_several_obstacles_the_nearest_counts(walk: Plan) -> None:
    near, far = board(0.02), board(0.3, x=1.0)
    alone = judge(walk, near)
    both = judge(walk, far, near)
    assert both.worst == pytest.approx(alone.worst, abs=RESOLUTION)
    assert both.where == f"{alone.where} and obstacle 2"


def test_a_foot_lowered_into_the_board_is_found(walk: Plan) -> None:
    obstacle = board(0.02)
    knot = knot_at(walk, "RF", 0.5)
    inside = np.array([BOARD_X, walk.footholds["RF"][0, 1], -0.01])
    times = walk.path.times[[knot - 2, knot, knot + 2]]
    check = judge(with_foot_at(walk, "RF", times, inside), obstacle)
    assert check.status == "violated" and check.worst < -0.01
    assert check.where in ("RF_FOOT", "RF_SHANK")
    assert times[0] < check.when < times[2]


def test_a_foot_that_dips_for_two_milliseconds_is_found(walk: Plan) -> None:
    obstacle = board(0.02)
    middle = 0.5 * sum((walk.swings[1].start, walk.swings[1].end))
    assert walk.swings[1].leg == "RF"
    times = middle + np.array([-1e-3, 0.0, 1e-3])
    inside = np.array([BOARD_X, walk.footholds["RF"][0, 1], -0.01])
    faulty = with_foot_at(walk, "RF", times, inside)
    every_hundredth = np.arange(0.0, walk.duration, 0.01)
    apart = every_hundredth[np.abs(every_hundredth - middle) > 1.1e-3]
    assert sampled_distances(faulty, obstacle, apart).min() > 0.0
    check = judge(faulty, obstacle)
    assert check.status == "violated" and check.when == pytest.approx(middle, abs=1e-3)


@pytest.mark.parametrize("leg", LEGS)
def test_a_knee_through_the_board_is_found_though_the_foot_is_clear(walk: Plan, leg: str) -> None:
    model = walk.robot.model
    data = model.createData()
    time = 0.5 * walk.duration
    pin.framesForwardKinematics(model, data, configurations(walk.path.evaluate([time]))[0])
    knee = data.oMi[model.getJointId(walk.robot.legs[leg].joints[-1])].translation
    beam = rectangular_obstacle(
        0.004, 0.004, length=0.1, position=(knee[0], knee[1], knee[2] - 0.002)
    )
    check = judge(walk, beam)
    assert check.status == "violated"
    # On each side the hind knee comes to where the front knee was.
    assert check.where[0] == leg[0] and check.where[2:] in ("_SHANK", "_THIGH")
    feet = walk.at(np.linspace(0.0, walk.duration, 2000)).feet
    assert beam.distance(feet).min() > 0.05


@pytest.mark.parametrize("leg", LEGS)
def test_a_board_moved_under_a_leg_is_found(walk: Plan, leg: str) -> None:
    x, y, _ = walk.footholds[leg][1]
    slat = rectangular_obstacle(0.02, 0.01, length=0.05, position=(x, y, -0.015))
    check = judge(walk, slat)
    assert check.status == "violated" and check.where.startswith(leg)


def test_a_body_that_sits_on_a_tall_board_is_found(walk: Plan) -> None:
    tall = board(0.40, x=0.0, length=0.1)
    assert judge(walk, tall).where == "base"
    assert judge(walk, tall).status == "violated"


@pytest.mark.parametrize("obstacle", [
    rectangular_obstacle(0.11, 0.04, position=(1.0, 0.2, 0.05), yaw=0.4),
    triangular_obstacle(0.2, 0.3, apex=0.1, yaw=-1.0),
    round_obstacle(0.2, yaw=1.0),
    rectangular_obstacle(0.11, 0.04).inflated(0.03),
])  # fmt: skip
def test_the_solid_is_the_obstacle_or_a_little_more(obstacle: Obstacle) -> None:
    solid, here = obstacle_solid(obstacle), coal.Transform3s()
    ball = coal.Sphere(0.01)
    for place in np.random.default_rng(0).uniform(-1.0, 1.5, (200, 3)):
        found = coal.distance(
            solid, here, ball, coal.Transform3s(np.eye(3), place),
            coal.DistanceRequest(), coal.DistanceResult(),
        )  # fmt: skip
        truth = obstacle.distance(place) - 0.01
        excess = obstacle.rounding * (1.0 / np.cos(np.pi / SIDES) - 1.0)
        assert truth - 2.0 * excess - 1e-6 <= found <= truth + 1e-6


def test_visual_meshes_are_no_hindrance() -> None:
    robot = load_robot("a1")
    assert "<mesh" in robot.urdf
    walk = straight_walk(robot, 0.08, body_height=0.25, swing_height=0.04)
    shapes = robot_shapes(robot)
    assert shapes.stand_ins == () and len(shapes.links) == 22
    x = float(walk.footholds["LF"][0, 0]) + 0.04
    assert judge(walk, board(0.005, x=x, z=-0.02)).status == "ok"


def test_lines_stand_for_meshes_and_the_check_says_so() -> None:
    robot = load_robot("solo12")
    walk = straight_walk(robot, 0.06, body_height=robot.standing_height, swing_height=0.03)
    shapes = robot_shapes(robot)
    assert len(shapes.stand_ins) == 1 + 12
    far = judge(walk, board(0.02, x=1.0))
    assert far.status == "ok" and "lines stand for" in far.note and far.note in far.where
    x, y, z = walk.footholds["RH"][1]
    under = rectangular_obstacle(0.02, 0.01, length=0.02, position=(x, y, z - 0.03))
    assert judge(walk, under).status == "violated"


def test_only_what_has_no_shape_of_its_own_gets_a_line() -> None:
    robot = load_robot("hyq")
    text, meshed = without_meshes(robot.urdf)
    assert "trunk" in meshed and "lf_upperleg" in meshed and "lf_lowerleg" not in meshed
    assert "<collision" in text
    assert set(robot_shapes(robot).stand_ins) == {"the body", *meshed} - {"trunk"}


def test_a_mesh_beside_a_primitive_is_not_passed_over(wang: Quadruped) -> None:
    link = '<link name="LF_THIGH">'
    mesh = '<collision><geometry><mesh filename="thigh.stl"/></geometry></collision>'
    assert wang.urdf.count(link) == 1
    robot = Quadruped.from_urdf(wang.urdf.replace(link, link + mesh))
    assert robot_shapes(robot).stand_ins == ("LF_THIGH",)
    assert robot_shapes(wang).stand_ins == ()


def test_lines_reach_from_joint_to_joint_and_to_the_foot() -> None:
    robot = load_robot("solo12")
    walk = straight_walk(robot, 0.06, body_height=robot.standing_height, swing_height=0.03)
    shapes, model = robot_shapes(robot).geometry, robot.model
    data, placed = model.createData(), shapes.createData()
    q = configurations(walk.path.evaluate([1e-3]))[0]
    pin.updateGeometryPlacements(model, data, shapes, placed, q)
    pin.framesForwardKinematics(model, data, q)
    radius = robot.foot_radius or THIN
    thick = coal.Sphere(radius - 1e-6)
    for leg in robot.legs.values():
        marks = [np.array(data.oMi[model.getJointId(j)].translation) for j in leg.joints]
        marks.append(np.array(data.oMf[model.getFrameId(leg.foot)].translation))
        for near, far in pairwise(marks):
            for share in (0.0, 0.25, 0.5, 0.75, 1.0):
                place = coal.Transform3s(np.eye(3), near + share * (far - near))
                # A ball of the line's thickness on it is wholly inside: all but a diameter deep.
                deepest = min(
                    coal.distance(
                        thick, place, shape.geometry, coal.Transform3s(m.rotation, m.translation),
                        coal.DistanceRequest(), coal.DistanceResult(),
                    )
                    for shape, m in zip(shapes.geometryObjects, placed.oMg, strict=True)
                )  # fmt: skip
                assert deepest < -1.99 * radius
