"""Whether the body has room anywhere along a course, by random poses: a quick look for walls.

Each leg is looked at by itself: whether it reaches some foothold and is clear of the ground there.
Margins, forces and the steps before and after are left out. So a place where poses stand
proves nothing: on stones, rubble, hills and stairs where every search ended many of them stand.
In a wall none does.
"""

from __future__ import annotations

import numpy as np

from gaitopt.conventions import LEGS, BoolArray, FloatArray
from gaitopt.planners.over_terrain.course import Course
from gaitopt.planners.over_terrain.judge import Judge
from gaitopt.planners.over_terrain.surfaces import Stands
from gaitopt.robots.rotations import rpy_to_matrix
from gaitopt.terrain.height_map import HeightMap

POSES = (32, 128, 512, 1024)
"""Poses that are tried at each place, and at places where none of them stands."""
FOOTHOLDS = 24
"""Footholds that are tried for each leg and pose."""
SPACING = 0.1
"""Distance of the places along the course, as a share of the standing height. Chosen: a wall is
thicker than that when its sides are kept clear of."""
ASIDE, HEIGHTS, ROLLED, PITCHED, TURNED = 0.5, (0.45, 1.25), 0.25, 0.7, 0.2
"""Ranges of the poses: to either side of the course in standing heights, shares of the body's
height, and angles to either side [rad]."""
REACH = 0.6
"""Distance of footholds from below the hip, as a share of the leg's reach."""


def no_room(judge: Judge, stands: Stands, course: Course) -> FloatArray | None:
    """The first place of a course ``(2,)`` [m] at which no pose stands; ``None`` for none.

    Args:
        judge: of the search's steps.
        stands: where feet may stand.
        course: of the body.
    """
    count = int(np.ceil(course.length / (SPACING * judge.robot.standing_height))) + 1
    places = course.at(np.linspace(0.0, course.length, count))
    # The same poses each time, so that the same map gives the same answer.
    random = np.random.default_rng(0)
    for poses in POSES:
        places = places[standing_shares(judge, stands, places, poses, random) == 0.0]
        if not len(places):
            return None
    return np.asarray(places[0, :2])


def standing_shares(
    judge: Judge, stands: Stands, places: FloatArray, poses: int, random: np.random.Generator
) -> FloatArray:
    """Which share of random poses stands at each of some poses of a course ``(n, 3)``: ``(n,)``."""
    there = np.repeat(places, poses, axis=0)
    standing = _standing(judge, stands, _poses(judge, stands, there, random), random)
    return np.asarray(standing.reshape(len(places), poses).mean(axis=1))


def _poses(judge: Judge, stands: Stands, at: FloatArray, random: np.random.Generator) -> FloatArray:
    """A random pose of the body about each place ``(n, 3)``: ``(n, 6)``."""
    ground, robot, size = judge.surfaces.ground, judge.robot, (len(at),)
    mean = stands.mean_heights(float(np.hypot(*robot.stance_size)) / 2.0 / ground.resolution)
    i, j = _on_grid(ground, at[:, :2])
    z = np.nan_to_num(mean[i, j])
    aside = random.uniform(-ASIDE, ASIDE, size) * robot.standing_height
    height = random.uniform(*HEIGHTS, size) * judge.settings.body_height
    return np.column_stack([
        at[:, 0] - np.sin(at[:, 2]) * aside, at[:, 1] + np.cos(at[:, 2]) * aside, z + height,
        random.uniform(-ROLLED, ROLLED, size), random.uniform(-PITCHED, PITCHED, size),
        at[:, 2] + random.uniform(-TURNED, TURNED, size),
    ])  # fmt: skip


def _on_grid(ground: HeightMap, places: FloatArray) -> tuple[np.ndarray, np.ndarray]:
    """Numbers of the points of the grid that are nearest to places ``(n, 2)``."""
    at = np.round((places - ground.origin) / ground.resolution).astype(int)
    i, j = np.clip(at, 0, np.subtract(ground.shape, 1)).T
    return i, j


def _standing(
    judge: Judge, stands: Stands, poses: FloatArray, random: np.random.Generator
) -> BoolArray:
    """Which poses ``(n, 6)`` have a clear trunk, and a foothold for each leg by itself ``(n,)``."""
    ground = judge.surfaces.ground
    left = np.flatnonzero(judge.limbs.trunk_stands_clear(poses))
    for leg, name in enumerate(LEGS):
        hip = np.append(judge.hips[leg], 0.0)
        below = poses[:, :2] + (rpy_to_matrix(poses[:, 3:]) @ hip)[:, :2]
        good = np.zeros(len(poses), dtype=np.bool_)
        for _ in range(FOOTHOLDS):
            asked = left[~good[left]]
            angle = random.uniform(0.0, 2.0 * np.pi, len(asked))
            away = REACH * judge.robot.legs[name].reach * np.sqrt(random.uniform(size=len(asked)))
            place = below[asked] + away[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
            number = stands.index[_on_grid(ground, place)]
            some = number >= 0
            asked, feet = asked[some], stands.centres[number[some]][:, None]
            reached = judge.within(leg, judge.limbs.local(feet, poses[asked])[:, 0])[1]
            asked, feet = asked[reached], feet[reached]
            good[asked[judge.limbs.leg_clear(leg, feet, poses[asked])]] = True
        left = left[good[left]]
    out = np.zeros(len(poses), dtype=np.bool_)
    out[left] = True
    return out
