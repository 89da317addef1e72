"""Parts of the search over terrain: balls that cover links, tables of the ground, courses."""

from __future__ import annotations

import itertools

import numpy as np
import pinocchio as pin
import pytest

import gaitopt
from gaitopt import LEGS, HeightMap, InputError
from gaitopt.motion.rolling import rolled_away
from gaitopt.planners.over_terrain.course import course_through
from gaitopt.planners.over_terrain.detour import Passage
from gaitopt.planners.over_terrain.footing import turns_beside
from gaitopt.planners.over_terrain.links.link_spheres import (
    Placements,
    covering_balls,
    link_spheres,
)
from gaitopt.planners.over_terrain.links.rolling import at_rest, feet_angles, half_ways, rolled_on
from gaitopt.planners.over_terrain.settings import TerrainSettings
from gaitopt.planners.over_terrain.setup import default_start, search_for, side_pose
from gaitopt.planners.over_terrain.surfaces import RADIUS_STEP, Surfaces
from gaitopt.planners.over_terrain.triangles import into_triangles, shrunken_triangles
from gaitopt.robots.rotations import rpy_to_matrix

RNG = np.random.default_rng(5)


def test_balls_cover_a_hull_and_reach_little_beyond_it() -> None:
    corners = RNG.uniform([-0.15, -0.03, -0.02], [0.15, 0.03, 0.02], (60, 3))
    balls = covering_balls(corners, 0.1)
    weights = RNG.dirichlet(np.full(len(corners), 0.05), 500)
    on_surface = np.concatenate([corners, weights @ corners])
    # Points deep inside need no ball: the surface is what touches the ground.
    away = np.linalg.norm(corners[:, None] - balls.centres, axis=2) - balls.radii
    assert away.min(axis=1).max() <= 1e-9
    beyond = (balls.centres - balls.radii[:, None]).min(axis=0) - on_surface.min(axis=0)
    assert beyond.min() > -0.03


@pytest.mark.parametrize("name", ["go2", "wang2020", "anymal_c"])
def test_balls_move_with_their_links(name: str) -> None:
    robot = gaitopt.load_robot(name)
    spheres, model = link_spheres(robot), robot.model
    zero, moved = model.createData(), model.createData()
    q = pin.neutral(model)
    q[7:] = robot.neutral_joints()
    for columns in robot.leg_columns.values():
        q[7:][list(columns)] = 0.0
    pin.forwardKinematics(model, zero, q)
    angles = RNG.uniform(-1.0, 1.0, (4, 3))
    for leg, own in zip(LEGS, angles, strict=True):
        q[7:][list(robot.leg_columns[leg])] = own
    pin.forwardKinematics(model, moved, q)
    body = Placements(np.eye(3)[None], np.zeros((1, 3)))
    for i, leg in enumerate(LEGS):
        placed = spheres.placements(i, angles[i : i + 1], body)
        for joint, place, balls in zip(
            robot.legs[leg].joints, placed, spheres.legs[i], strict=True
        ):
            k = model.getJointId(joint)
            motion = moved.oMi[k] * zero.oMi[k].inverse()
            for centre, found in zip(balls.centres, place.moved(balls.centres)[0], strict=True):
                there = robot.body_axes.T @ motion.act(robot.body_axes @ centre)
                assert np.allclose(found, there, atol=1e-12)


def test_tables_are_never_below_the_exact_height() -> None:
    ground = HeightMap(RNG.uniform(0.0, 0.05, (30, 30)), 0.02)
    surfaces = Surfaces.of(ground, [0.012, 0.03])
    places = RNG.uniform(0.08, 0.5, (400, 2))
    for radius in (0.012, 0.03):
        exact = ground.ball(places, radius).centres[:, 2]
        found = surfaces.clear_heights(places, surfaces.sizes(np.full(400, radius)))
        assert (found >= exact - 1e-9).mean() > 0.97
        assert (found - exact).min() > -0.004


def test_tables_are_exact_on_level_ground_and_infinite_off_it() -> None:
    surfaces = Surfaces.of(HeightMap(np.full((20, 20), 0.3), 0.02), [0.021])
    size = surfaces.sizes([0.021])
    step = np.ceil(0.021 / RADIUS_STEP) * RADIUS_STEP
    assert surfaces.clear_heights(np.array([[0.2, 0.2]]), size) == pytest.approx([0.3 + step])
    assert np.isinf(surfaces.clear_heights(np.array([[-0.5, 0.2], [0.2, 9.0]]), size)).all()
    z = np.zeros((20, 20))
    z[10, 10] = np.nan
    unknown = Surfaces.of(HeightMap(z, 0.02), [0.02])
    assert np.isinf(unknown.clear_heights(np.array([[0.21, 0.2]]), unknown.sizes([0.02]))).all()


def test_triangles_shrink_as_polygons_do() -> None:
    corners = RNG.uniform(-1.0, 1.0, (40, 3, 2))
    found, some = shrunken_triangles(corners, 0.05)
    for triangle, own, left in zip(corners, found, some, strict=True):
        polygon = gaitopt.shrunken_polygon(triangle, 0.05)
        assert left == (len(polygon) >= 3)
        if left:
            gaps = np.linalg.norm(own[:, None] - polygon, axis=2)
            assert gaps.min(axis=1).max() < 1e-9


def test_nearest_places_in_triangles_are_nearest() -> None:
    corners, points = RNG.uniform(-1.0, 1.0, (30, 3, 2)), RNG.uniform(-2.0, 2.0, (30, 2))
    nearest = into_triangles(corners, points)
    weights = RNG.dirichlet(np.ones(3), 4000)
    for triangle, point, own in zip(corners, points, nearest, strict=True):
        others = np.linalg.norm(weights @ triangle - point, axis=1).min()
        assert np.linalg.norm(own - point) <= others + 1e-9


def test_a_course_faces_its_way_and_turns_on_the_spot_first() -> None:
    course = course_through((0.0, 0.0, 0.0), (0.0, 2.0), feet=0.3, smoothing=0.6)
    assert np.allclose(course.poses[0], 0.0)
    assert np.allclose(course.poses[-1], [0.0, 2.0, np.pi / 2.0])
    assert course.length == pytest.approx(2.0 + 0.3 * np.pi / 2.0, rel=1e-3)
    assert np.allclose(course.at(0.3 * np.pi / 4.0)[:2], 0.0, atol=1e-9)


def test_a_course_of_poses_keeps_their_yaws() -> None:
    course = course_through((0.0, 0.0, 0.0), (0.0, 1.0, 0.0), feet=0.3, smoothing=0.6)
    assert np.allclose(course.poses[:, 2], 0.0) and course.length == pytest.approx(1.0)
    spin = course_through((0.0, 0.0, 0.0), [(0.0, 0.0, 2.0), (0.0, 0.0, 4.0)], feet=0.3,
                          smoothing=0.6)  # fmt: skip
    assert spin.poses[-1, 2] == pytest.approx(4.0) and np.allclose(spin.poses[:, :2], 0.0)


@pytest.mark.parametrize(
    ("goal", "words"),
    [
        ((0.0, 0.0), "where the walk starts"),
        ((0.0, 0.0, 0.0), "the pose at which the walk starts"),
        ((1.0,), "goal must be a place"),
        ("far", "goal must be numbers"),
        ((np.nan, 1.0), "finite"),
        ((1e9, 1.0), "at most"),
    ],
)
def test_goals_that_are_none_are_refused(goal: object, words: str) -> None:
    with pytest.raises(InputError, match=words):
        course_through((0.0, 0.0, 0.0), goal, feet=0.3, smoothing=0.6)  # type: ignore[arg-type]


def test_poses_of_rotations() -> None:
    turn = rpy_to_matrix([[0.1, -0.2, 0.3]])
    body = Placements(turn, np.array([[1.0, 2.0, 3.0]]))
    assert np.allclose(body.moved(np.eye(3))[0], turn[0].T + np.arange(1.0, 4.0))


def test_a_foothold_right_below_a_stair_is_of_less_use_than_one_farther_on() -> None:
    """The shank of a go2 leans back from its foot, to where the stair is."""
    robot = gaitopt.load_robot("go2")
    z = np.zeros((120, 60))
    z[60:] = -0.12  # goes down at x = 0.6 m
    ground = HeightMap(z, 0.02, (-0.6, -0.6))
    settings = TerrainSettings.for_robot(robot)
    search = search_for(robot, ground, (1.2, 0.0), (0.0, 0.0, 0.0), settings)
    hip = search.judge.hips[0]
    cycle = 5  # the usual place is at 0.86 m
    near = np.array([search.stands.index[round((x + 0.6) / 0.02), round((hip[1] + 0.6) / 0.02)]
                     for x in (0.64, 0.76)])  # fmt: skip
    beside, beyond = search.candidates.outlook.of(0, 4 * cycle - 1, near)
    assert beside > beyond + 0.3
    level = search_for(robot, HeightMap(0.0 * z, 0.02, (-0.6, -0.6)), (1.2, 0.0),
                       (0.0, 0.0, 0.0), settings)  # fmt: skip
    near = level.stands.near(ground, level.usual(0, 2), 0.02)
    assert level.candidates.outlook.of(0, 7, near).max() == 0.0


def test_beside_a_crest_the_ground_is_turned_and_elsewhere_it_is_not() -> None:
    x = 0.02 * np.arange(40) - 0.4
    slope = 0.4
    ground = HeightMap(np.tile(-slope * np.abs(x)[:, None], (1, 20)), 0.02, (-0.4, 0.0))
    turned = turns_beside(ground, 0.02, np.ones(ground.shape, dtype=bool))[2:-2, 10]
    away = np.abs(x[2:-2])
    # A ball touches beside its lowest point by the sine of the slope times its radius.
    assert (turned[away > 0.019] < 1e-6).all()
    # On the crest the contact 1 cm beside is where the ball, 1 cm beside, touches the crest.
    crest = float(turned[away < 1e-9][0])
    assert crest == pytest.approx(min(np.arcsin(0.01 / 0.02), np.arctan(slope)), abs=1e-9)


@pytest.mark.parametrize("name", ["go2", "anymal_c"])
def test_feet_roll_in_the_search_as_pinocchio_lets_them_roll(name: str) -> None:
    robot = gaitopt.load_robot(name)
    limbs = search_for(robot, gaitopt.make_ground("flat", robot=robot, length=2.0), (2.0, 0.0),
                       (0.0, 0.0, 0.0), TerrainSettings.for_robot(robot)).limbs  # fmt: skip
    height = robot.standing_height
    feet = np.array([robot.legs[leg].forward(robot.standing_joints()[list(columns)])
                     for leg, columns in robot.leg_columns.items()]) - robot.centre  # fmt: skip
    before = np.zeros((1, 6))
    after = np.array([[0.2, 0.05, -0.15, 0.3, 0.2, 0.5]]) * [*[height] * 3, *[0.3] * 3]
    angles = feet_angles(limbs, feet[None], before, after)
    rolled = rolled_on(limbs, angles, before, after, at_rest(1))
    # The same move in small steps, with Pinocchio's Jacobians of the contacts.
    poses = before + np.linspace(0.0, 1.0, 201)[:, None] * (after - before)
    local = limbs.local(np.broadcast_to(feet, (201, 4, 3)), poses)
    q = np.zeros((201, robot.model.nq))
    for k, leg in enumerate(LEGS):
        q[:, 7:][:, list(robot.leg_columns[leg])] = robot.legs[leg].inverse(local[:, k])
    turns = rpy_to_matrix(poses[:, 3:]) @ robot.body_axes.T
    for i, turn in enumerate(turns):
        q[i, :3] = poses[i, :3] - turn @ robot.body_axes @ robot.centre
        q[i, 3:7] = pin.Quaternion(turn).coeffs()
    v = np.array([pin.difference(robot.model, a, b) for a, b in itertools.pairwise(q)])
    way = rolled_away(robot, (q[:-1]), v, np.ones((200, 4), dtype=bool), 1.0)[-1]
    assert np.abs(rolled[0, :, 0] - way[:, :2]).max() < 0.07 * np.abs(way).max()
    assert np.abs(way).max() > 0.1 * robot.foot_radius
    assert half_ways(rolled) == pytest.approx(0.5 * np.linalg.norm(rolled[:, :, 0], axis=2))


def test_finer_tables_are_not_below_the_exact_height_beside_a_step() -> None:
    x = 0.02 * np.arange(60)
    ground = HeightMap(np.where(x < 0.6, 0.0, -0.12)[:, None] * np.ones(40), 0.02)
    places = RNG.uniform([0.5, 0.2], [0.7, 0.6], (2000, 2))
    exact = ground.ball(places, 0.025).centres[:, 2]
    for foot, cell in ((np.inf, 0.02), (0.023, 0.01)):
        surfaces = Surfaces.of(ground, [0.025], foot)
        assert surfaces.cell == pytest.approx(cell)
        found = surfaces.clear_heights(places, surfaces.sizes([0.025])) - exact
        assert (found.min() >= -1e-9) == (cell < 0.02)


def _passage(z: np.ndarray) -> Passage:
    robot = gaitopt.load_robot("go2")
    settings = TerrainSettings.for_robot(robot)
    search = search_for(robot, HeightMap(z, 0.02, (-0.6, -1.0)), (1.2, 0.0), (0.0, 0.0, 0.0),
                        settings)  # fmt: skip
    return Passage.of(search.judge, search.stands)


def test_ways_lead_round_holes_and_are_straight_elsewhere() -> None:
    start, end = np.zeros(2), np.array([1.2, 0.0])
    flat = np.zeros((110, 100))
    assert np.array_equal(_passage(flat).around(start, end) or [], [end])
    hole = flat.copy()
    hole[48:68, 45:90] = -0.6  # 0.4 m by 0.9 m: no leg reaches across
    around = _passage(hole).around(start, end)
    assert around is not None
    way = np.array([start, *around])
    assert len(way) > 2 and np.allclose(way[-1], end)
    places = np.concatenate([a + np.linspace(0.0, 1.0, 50)[:, None] * (b - a)
                             for a, b in itertools.pairwise(way)])  # fmt: skip
    ahead = (places[:, 0] > 0.4) & (places[:, 0] < 0.7)
    assert places[ahead, 1].max() < -0.2  # the shorter of the two ways round
    two = np.full((110, 100), -0.6)
    two[:20] = two[90:] = 0.0
    two[:, 38:46] = two[:, 54:62] = 0.0  # beams, with the pit between them under the trunk
    assert np.array_equal(_passage(two).around(start, end) or [], [end])


def test_where_something_lies_across_the_whole_map_there_is_no_way_round() -> None:
    closed = np.zeros((110, 100))
    closed[58:62] = 0.6
    end = np.array([1.2, 0.0])
    assert _passage(closed).around(np.zeros(2), end) is None


@pytest.mark.parametrize(("goal", "told"), [
    ((3.0, 0.0), r"goal \(3, 0\)"), ([(0.5, 0.0), (0.0, -0.9)], r"goal \(0, -0.9\)"),
    ((1.41, 0.0, 0.0), r"goal \(1.41, 0\)"),
])  # fmt: skip
def test_goals_beyond_the_map_are_refused_at_once(goal: object, told: str) -> None:
    """Nothing is searched: the map's reach is told, so that a wrong unit is seen."""
    robot, flat = gaitopt.load_robot("go2"), HeightMap(np.zeros((101, 81)), 0.02, (-0.6, -0.8))
    reach = r"reaches from -0.6 to 1.4 m in x and from -0.8 to 0.8 m in y"
    with pytest.raises(InputError, match=rf"the {told} is beyond the map, which {reach}"):
        gaitopt.search_terrain(robot, flat, goal, start=(0.0, 0.0, 0.0))  # type: ignore[arg-type]
    search_for(robot, flat, (1.4, 0.8), (0.0, 0.0, 0.0), TerrainSettings.for_robot(robot))


def test_walks_begin_at_the_origin_where_there_is_room_and_else_at_the_far_side() -> None:
    robot = gaitopt.load_robot("go2")
    made = gaitopt.make_ground("flat", robot=robot, length=1.5)
    assert default_start(robot, made, (0.5, 0.5)) == pytest.approx([0.0, 0.0, np.pi / 4.0])
    # The goal is there itself: it is walked to from a side.
    assert abs(default_start(robot, made, (0.1, 0.0))[0]) > 1.0
    corner = HeightMap(np.zeros((100, 80)), 0.02)
    x, y, yaw = default_start(robot, corner, (1.9, 0.8))
    assert 0.3 < x < 0.5 and y == pytest.approx(0.79) and abs(yaw) < 0.01


def test_walks_begin_on_known_ground() -> None:
    """A map with an unknown border and a corner cut off, as of a scan: start and goal keep off."""
    robot = gaitopt.load_robot("go2")
    z = np.zeros((150, 100))
    z[:25] = z[-5:] = z[:, :5] = np.nan
    z[:60, :60] = np.nan
    scan = HeightMap(z, 0.02)
    x, y, yaw = default_start(robot, scan, (2.5, 1.0))
    unknown = np.argwhere(~scan.known) * 0.02
    room = robot.stance_size[0] / 2.0 + 0.8 * robot.standing_height
    assert np.hypot(*(unknown - [x, y]).T).min() > room - 0.041
    assert np.tan(yaw) == pytest.approx((1.0 - y) / (2.5 - x))
    # The middle of the side is unknown itself.
    assert np.isnan(scan.height([[room, 0.99]])).all()


@pytest.mark.parametrize("share", [0.003, 0.01, 0.03])
@pytest.mark.parametrize("seed", range(3))
def test_unknown_points_everywhere_do_not_move_the_start_to_the_goal(
    share: float, seed: int
) -> None:
    z = np.zeros((200, 75))
    z[np.random.default_rng(seed).random(z.shape) < share] = np.nan
    scan = HeightMap(z, 0.02)
    robot = gaitopt.load_robot("go2")
    whole = side_pose(robot, HeightMap(np.zeros_like(z), 0.02), (3.5, 0.74))
    x, y, _ = side_pose(robot, scan, (3.5, 0.74))
    assert np.hypot(x - whole[0], y - whole[1]) < 0.7
    # It is as far from the edges as without them, but for a point of the map.
    assert min(x, y, 1.48 - y) > whole[0] - 0.021
