"""What a search over a map begins with, and what becomes of what it found."""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from gaitopt.conventions import LEGS, FloatArray
from gaitopt.dynamics.contacts import ForceLimits
from gaitopt.errors import InputError
from gaitopt.inputs import check_array, check_kind
from gaitopt.planners.over_terrain.course import Course, course_through
from gaitopt.planners.over_terrain.detour import Passage
from gaitopt.planners.over_terrain.footing import layers_for, stands_of, start_stands
from gaitopt.planners.over_terrain.judge import Judge
from gaitopt.planners.over_terrain.last_look import LastLook
from gaitopt.planners.over_terrain.links.limbs import Limbs
from gaitopt.planners.over_terrain.links.link_spheres import link_spheres
from gaitopt.planners.over_terrain.links.rolling import at_rest
from gaitopt.planners.over_terrain.planned_forces import usual_forces
from gaitopt.planners.over_terrain.result import TerrainSearch
from gaitopt.planners.over_terrain.search import Search
from gaitopt.planners.over_terrain.settings import TerrainSettings
from gaitopt.planners.over_terrain.states import Found, Layer
from gaitopt.planners.over_terrain.surfaces import Stands, Surfaces
from gaitopt.robots.quadruped import Quadruped
from gaitopt.terrain.footholds import Footholds
from gaitopt.terrain.height_map import HeightMap
from gaitopt.terrain.known_ground import on_known_ground, unknown_near

_IN_PLANES = ", straight ahead, in the planes of the legs (s_columns(robot=robot) makes such)"
ROOM = 0.8
"""Ground behind the stance at the usual start, as a share of the standing height: trunk and knees
are above it."""


def search_for(
    robot: Quadruped, ground: HeightMap, goal: ArrayLike, start: ArrayLike | None,
    settings: TerrainSettings, forces: ForceLimits | None = None,
) -> Search:  # fmt: skip
    """The search that a robot, a map and a goal ask for, with limits of contact forces.

    Raises:
        InputError: an argument is something else, the goal lies beyond the map, or the robot has
            other than three joints a leg.
    """
    check_kind("robot", robot, Quadruped)
    check_kind("ground", ground, HeightMap)
    for leg in robot.legs.values():
        flat = len(leg.joints) != 3
        if flat or leg.is_general:
            what = "has no roll joint" if flat else "is not roll-pitch-pitch"
            raise InputError(
                f"{robot.name}: leg {leg.name} {what}; footholds on a map are searched for robots "
                "with roll-pitch-pitch legs only; plan_crawl (gaitopt walk) walks over footholds "
                f"that you give{_IN_PLANES if flat else ''}"
            )
    layers = layers_for(robot, ground, settings)
    radii = np.append(link_spheres(robot).radii, robot.foot_radius)
    surfaces = Surfaces.of(ground, radii, robot.foot_radius)
    judge = Judge.of(robot, settings, surfaces.narrowed())
    stands = stands_of(robot, layers)
    course = course_of(robot, ground, start, goal, judge, stands)
    limbs = Limbs.of(robot, surfaces, settings.limb_clearance)
    if forces is None:
        forces = usual_forces(settings.friction)
    last = LastLook.of(robot, limbs, stands.normals, forces)
    cycles = cycles_of(course, settings)
    return Search(judge, stands, layers, course, cycles, frozenset(), limbs, last)


def with_settings(search: Search, settings: TerrainSettings) -> Search:
    """The same search with other settings, which the ground and the start do not depend on."""
    judge = replace(search.judge, settings=settings)
    return replace(search, judge=judge, cycles=cycles_of(search.course, settings))


def along(search: Search, course: Course) -> Search:
    """The same search along another course."""
    cycles = cycles_of(course, search.judge.settings)
    return replace(search, course=course, cycles=cycles)


def cycles_of(course: Course, settings: TerrainSettings) -> int:
    """How often each leg steps along a course."""
    if course.marks is not None:
        return len(course.marks) - 1
    return max(int(np.ceil(course.length / settings.step_length - 1e-9)), 1)


def course_of(
    robot: Quadruped, ground: HeightMap, start: ArrayLike | None, goal: ArrayLike, judge: Judge,
    stands: Stands,
) -> Course:  # fmt: skip
    """The course from the start to the goal, round what the robot cannot cross.

    Raises:
        InputError: the goal is none, lies beyond the map, or is where the walk starts.
    """
    if start is None:
        start = default_start(robot, ground, goal)
    feet = float(np.hypot(*judge.hips.T).mean())
    course = course_through(start, goal, feet=feet, smoothing=2.0 * feet)
    places = np.atleast_2d(np.asarray(goal, dtype=np.float64))
    _check_on_map(ground, places)
    if not judge.settings.detours or places.shape[1] != 2 or not len(stands.centres):
        return course
    passage, way, blocked = Passage.of(judge, stands), [course.poses[0, :2]], False
    for place in places:
        around = passage.around(way[-1], place)
        blocked |= around is None
        way += [place] if around is None else around
    if len(way) > len(places) + 1:
        course = course_through(start, way[1:], feet=feet, smoothing=2.0 * feet)
    return replace(course, blocked=blocked)


def _check_on_map(ground: HeightMap, places: FloatArray) -> None:
    """Refuse goals beyond the map: a long search would end at its edge.

    Raises:
        InputError: names the first such place, and how far the map reaches.
    """
    (x0, x1), (y0, y1) = ground.extent
    for x, y in places[:, :2].tolist():
        # The map's far ends are rounded sums.
        if max(x0 - x, x - x1, y0 - y, y - y1) > 1e-9:
            raise InputError(
                f"the goal ({x:.4g}, {y:.4g}) is beyond the map, which reaches from {x0:.4g} to "
                f"{x1:.4g} m in x and from {y0:.4g} to {y1:.4g} m in y; what lies beyond is "
                "unknown ground, which the body may not be above: give a goal on the map with "
                "room for the robot, or a larger map"
            )


def far_side(robot: Quadruped, ground: HeightMap) -> tuple[float, float]:
    """The middle of the far side of the map in x, with room for the robot ``(x, y)`` [m]."""
    (_, x1), (y0, y1) = ground.extent
    room = robot.stance_size[0] / 2.0 + ROOM * robot.standing_height
    return round(float(x1 - room), 3), round(float(y0 + y1) / 2.0, 3)


def default_start(robot: Quadruped, ground: HeightMap, goal: ArrayLike) -> FloatArray:
    """The pose that a walk to a goal begins in if none is given ``(3,)``, facing the goal.

    It is at x = y = 0, as on ground that is made, where the map has room for the robot around it
    and the goal is elsewhere; and otherwise on the side that is farthest from the goal. Where
    points of the map near there are unknown, it is at the nearest place with room among known ones.
    """
    side = side_pose(robot, ground, goal)
    x, y = np.atleast_2d(np.asarray(goal, dtype=np.float64))[0, :2]
    (x0, x1), (y0, y1) = ground.extent
    length, width = robot.stance_size
    # Made ground ends at a whole number of cells.
    room = length / 2.0 + ROOM * robot.standing_height - ground.resolution
    there = x0 <= -room and x1 >= room and y0 <= -width and y1 >= width
    if there and np.hypot(x, y) > length and not unknown_near(ground, length / 2.0, (0.0, 0.0)):
        return np.array([0.0, 0.0, np.arctan2(y, x)])
    return side


def side_pose(robot: Quadruped, ground: HeightMap, goal: ArrayLike) -> FloatArray:
    """The pose in the middle of the side of the map that is farthest from the goal ``(3,)``."""
    places = np.atleast_2d(check_array("goal", goal, "m, rad"))
    length, _ = robot.stance_size
    room = length / 2.0 + ROOM * robot.standing_height
    (x0, x1), (y0, y1) = ground.extent
    middle = np.array([(x0 + x1) / 2.0, (y0 + y1) / 2.0])
    sides = np.array([[x0 + room, middle[1]], [x1 - room, middle[1]],
                      [middle[0], y0 + room], [middle[0], y1 - room]])  # fmt: skip
    far = sides[int(np.linalg.norm(sides - places[0, :2], axis=1).argmax())]
    far = on_known_ground(ground, room - ground.resolution, far)
    towards = places[0, :2] - far
    return np.append(far, np.arctan2(towards[1], towards[0]))


def first_layer(search: Search) -> Layer:
    """The state at the start: every foot as near to its usual place as it may stand.

    Where its leg would touch the ground at the nearest place, it stands at the next one.

    Raises:
        InputError: for a foot there is none.
    """
    ground, judge = search.judge.surfaces.ground, search.judge
    if not len(search.stands.centres):
        raise InputError(
            "no foot may stand anywhere on the map: all of it is unknown, too steep or too near to "
            "an edge; look at its scale (resolution, heights, unit), or give a smaller edge_margin"
        )
    usual = np.array([search.usual(leg, 0) for leg in range(4)])
    near = start_stands(search.stands, ground, usual, judge.settings.freedom)
    for leg, some, place in zip(LEGS, near, usual, strict=True):
        if not some.size:
            coarse = ground.resolution > judge.settings.freedom
            raise InputError(
                f"at the start there is no ground to stand on for {leg} within "
                f"{judge.settings.freedom:g} m of {np.round(place, 3).tolist()}; choose another "
                "start, or a larger freedom" + (_coarse(ground) if coarse else "")
            )
    stands, pose = [int(some[0]) for some in near], search.course.at(0.0)
    feet = search.stands.centres[stands][None]
    posture = judge.posture_over(feet, pose[2:])
    over = np.concatenate([feet[0, :, :2].mean(axis=0), posture[0]])
    stands = [_clear_stand(search, leg, some, over) for leg, some in enumerate(near)]
    feet = search.stands.centres[stands][None]
    posture = judge.posture_over(feet, pose[2:])
    middle = feet[0, :, :2].mean(axis=0)
    none = np.array([-1])
    return Layer(
        feet, np.array([stands]), np.concatenate([middle, posture[0]])[None],
        np.zeros((1, 4), dtype=int), np.zeros(1), none, none, np.zeros(1), at_rest(1),
        np.zeros(1),
    )  # fmt: skip


def _coarse(ground: HeightMap) -> str:
    """What is said where points of the map are farther apart than a foot may be put aside."""
    return (
        f"; feet stand on the map's points, which are {ground.resolution:g} m apart, farther than "
        "that: look at its scale (resolution, heights, unit), or put it on a finer grid (resampled)"
    )


def _clear_stand(search: Search, leg: int, near: np.ndarray, pose: FloatArray) -> int:
    """The first of some stands at which a leg is clear of the ground; the first one for none."""
    feet = search.stands.centres[near]
    poses = np.broadcast_to(pose, (len(near), len(pose)))
    clear = search.limbs.leg_stands_clear(leg, feet, poses)
    clear &= search.judge.within(leg, search.limbs.local(feet[:, None], poses)[:, 0])[1]
    return int(near[int(clear.argmax())])


def footholds_of(search: Search, found: Found) -> Footholds:
    """The footholds of the cheapest way."""
    states = [(layer, k) for layer, k in found.best()]
    first, at = states[0]
    stands, ground = search.stands, search.judge.surfaces.ground
    numbers: dict[str, list[int]] = {
        leg: [int(n)] for leg, n in zip(LEGS, first.stands[at], strict=True)
    }
    rises: dict[str, list[float]] = {leg: [] for leg in LEGS}
    order = []
    for layer, k in states[1:]:
        leg = LEGS[int(layer.leg[k])]
        order.append(leg)
        numbers[leg].append(int(layer.stands[k, LEGS.index(leg)]))
        rises[leg].append(float(layer.rise[k]))
    return Footholds(
        {leg: stands.centres[n] for leg, n in numbers.items()},
        normals={leg: stands.normals[n] for leg, n in numbers.items()},
        friction=search.judge.settings.friction,
        ground=ground, order=order, swing_heights=rises,
        postures=np.array([layer.body[k, 2:] for layer, k in states]),
        body_places=np.array([layer.body[k, :2] for layer, k in states]),
    )  # fmt: skip


def result_of(search: Search, found: Found, begin: float) -> TerrainSearch:
    return TerrainSearch(
        footholds=footholds_of(search, found),
        complete=found.complete,
        settings=search.judge.settings,
        course=search.course,
        layers=search.layers,
        tried=search.stands.centres[found.tried],
        width=found.width,
        steps=found.steps,
        stands=np.array([layer.stands[k] for layer, k in found.best()]),
        next_leg=""
        if found.complete
        else LEGS[search.legs(found.layers[-1].made[int(found.layers[-1].cost.argmin())])[0]],
        refused=found.refused,
        cost=float(found.layers[-1].cost.min()),
        estimate=float(found.layers[-1].seconds[int(found.layers[-1].cost.argmin())]),
        seconds=time.perf_counter() - begin,
        ended=found.ended,
        fine=search.fine,
    )
