"""How near any part of the robot comes to an obstacle, by Pinocchio's collision shapes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from gaitopt.conventions import LEGS, FloatArray
from gaitopt.errors import InputError
from gaitopt.motion.bounds import largest_sizes
from gaitopt.motion.path import BASE_COLUMNS, MotionPath
from gaitopt.robots.collision_shapes import robot_shapes
from gaitopt.robots.quadruped import Quadruped
from gaitopt.robots.rotations import rpy_to_quaternion
from gaitopt.terrain.obstacles import Obstacle

LEAST_STEP = 1e-3
"""Way of the fastest part between two looks where the robot is nearest to the obstacle [m]."""
MOST_LOOKS = 1_000_000


class Nearest(NamedTuple):
    """The nearest part of a robot.

    Attributes:
        distance: from the obstacle [m].
        leg: the leg that it belongs to, ``""`` for the body.
        shape: its name.
        place: which configuration, or look.
    """

    distance: float
    leg: str
    shape: str
    place: int


class Approach(NamedTuple):
    """How near a motion comes to an obstacle.

    Attributes:
        seen: the nearest part that was looked at.
        proven: no part is nearer at any instant [m].
        time: of ``seen`` [s].
        looks: how many configurations were looked at.
    """

    seen: Nearest
    proven: float
    time: float
    looks: int


@dataclass(frozen=True, eq=False)
class Surroundings:
    """The robot's collision shapes and one obstacle.

    Attributes:
        robot: the robot.
        geometry: Pinocchio's geometry with a pair of every shape and the obstacle.
        names: name of each pair's shape.
        owners: leg of each pair's shape, ``""`` for the body.
        stand_ins: names of shapes that stand for meshes.
        reach: bound on the distance of any point of the robot from the base's origin [m].
        lever: bound on the distance of any point of a leg from any of the leg's hinges [m].
    """

    robot: Quadruped
    geometry: Any
    names: tuple[str, ...]
    owners: tuple[str, ...]
    stand_ins: tuple[str, ...]
    reach: float
    lever: float

    @classmethod
    def of(cls, robot: Quadruped, obstacle: Obstacle) -> Surroundings:
        """Read the shapes, and put the obstacle beside them."""
        import pinocchio as pin

        shapes = robot_shapes(robot)
        solids = list(shapes.geometry.geometryObjects)
        board = pin.GeometryObject("obstacle", 0, pin.SE3.Identity(), obstacle_solid(obstacle))
        index = shapes.geometry.addGeometryObject(board)
        for k in range(len(solids)):
            shapes.geometry.addCollisionPair(pin.CollisionPair(k, index))
        return cls(
            robot, shapes.geometry, shapes.names, shapes.owners, shapes.stand_ins,
            max(_span(robot, solid, 1) for solid in solids),
            max(_span(robot, solid, 2) for solid in solids),
        )  # fmt: skip

    def distances(self, values: FloatArray) -> FloatArray:
        """Distance of every shape at path values ``(N, 6 + nj)``: ``(N, shapes)`` [m]."""
        import pinocchio as pin

        model = self.robot.model
        data, placed = model.createData(), self.geometry.createData()
        q = np.concatenate(
            [values[:, :3], rpy_to_quaternion(values[:, 3:6]), values[:, 6:]], axis=1
        )
        out = np.empty((len(q), len(self.names)))
        for row, one in zip(out, q, strict=True):
            pin.updateGeometryPlacements(model, data, self.geometry, placed, one)
            pin.computeDistances(self.geometry, placed)
            row[:] = [result.min_distance for result in placed.distanceResults]
        return out

    def nearest(self, values: FloatArray) -> Nearest:
        """The nearest part at path values ``(N, 6 + nj)``."""
        found = self.distances(values)
        k, shape = np.unravel_index(int(found.argmin()), found.shape)
        return Nearest(float(found[k, shape]), self.owners[shape], self.names[shape], int(k))

    def along(self, path: MotionPath, wanted: float) -> Approach:
        """How near a motion comes, at every instant.

        No part is faster than a bound from the rates of body and joints. So after a look nothing
        can be nearer than ``wanted`` before the robot has moved by what was left of the distance;
        where nothing is left, by :data:`LEAST_STEP`.

        Args:
            path: body and joints over time.
            wanted: the distance that is to be kept [m].

        Raises:
            InputError: that takes more than a million looks.
        """
        times, way = _travelled(path, self.speeds(path))
        seen, proven, when, looks = Nearest(np.inf, "", "", 0), np.inf, 0.0, 0
        at = 0.0
        while True:
            now = float(np.interp(at, way, times)) if way[-1] > 0.0 else 0.0
            look = self.nearest(path.evaluate([now]))
            if look.distance < seen.distance:
                seen, when = look._replace(place=looks), now
            looks += 1
            free = max(look.distance - wanted, LEAST_STEP)
            # Until the next look no part comes nearer by more than it moves.
            proven = min(proven, max(look.distance - free, wanted) if free > LEAST_STEP
                         else look.distance - min(free, way[-1] - at))  # fmt: skip
            if at >= way[-1] or looks > MOST_LOOKS:
                break
            at = min(at + free, float(way[-1]))
        if looks > MOST_LOOKS:
            raise InputError(f"a motion of {way[-1]:.4g} m near an obstacle is too long to check")
        return Approach(seen, float(proven), when, looks)

    def speeds(self, path: MotionPath) -> FloatArray:
        """Bound on the speed of any part on each piece of the path ``(K - 1,)`` [m/s]."""
        rates = largest_sizes(path)
        base = np.linalg.norm(rates[:, :3], axis=1)
        turning = rates[:, 3:6].sum(axis=1) * self.reach
        joints = rates[:, BASE_COLUMNS:]
        legs = [joints[:, self.robot.leg_columns[leg]].sum(axis=1) for leg in LEGS]
        return np.asarray(base + turning + self.lever * np.max(legs, axis=0))


def _travelled(path: MotionPath, speeds: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Times of all knots, and bounds on the way up to each [m]."""
    way = np.concatenate([[0.0], np.cumsum(speeds * np.diff(path.times))])
    return np.asarray(path.times), way


def _span(robot: Quadruped, solid: Any, depth: int) -> float:
    """Bound on the distance of a shape's points from the hinge that is ``depth`` joints out [m].

    From the base's origin for a depth of 1, from the first hinge of its branch for 2; along the
    way, so from any hinge farther out it is no more.
    """
    model, joint = robot.model, int(solid.parentJoint)
    if joint < depth:
        return 0.0
    solid.geometry.computeLocalAABB()
    centre = solid.placement.act(np.array(solid.geometry.aabb_center))
    size = float(np.linalg.norm(centre)) + float(solid.geometry.aabb_radius)
    while joint > 1 and (depth == 1 or model.parents[joint] > 1):
        size += float(np.linalg.norm(model.jointPlacements[joint].translation))
        joint = int(model.parents[joint])
    return size


SIDES = 64
"""Tangents that stand for a full turn of a rounded obstacle."""


def obstacle_solid(obstacle: Obstacle) -> Any:
    """The obstacle as a convex solid of coal's; a round one with a hull just outside it."""
    from pinocchio import coal

    vertices, faces = obstacle.mesh(SIDES)
    points, triangles = coal.StdVec_Vec3s(), coal.StdVec_Triangle()
    points.extend(list(vertices))
    triangles.extend([coal.Triangle(*face) for face in faces.tolist()])
    return coal.Convex(points, triangles)
