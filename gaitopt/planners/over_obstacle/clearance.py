"""Distances between all parts of the robot and an obstacle, by Pinocchio's collision shapes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from gaitopt.conventions import LEGS, FloatArray
from gaitopt.errors import InputError
from gaitopt.motion.bounds import largest_sizes
from gaitopt.motion.path import BASE_COLUMNS, MotionPath
from gaitopt.robots.collisions.shapes import robot_shapes
from gaitopt.robots.quadruped import Quadruped
from gaitopt.robots.whole_body import configuration
from gaitopt.terrain.obstacles import Obstacle

LEAST_STEP = 1e-3
"""Least motion of the fastest part between two configurations that are checked [m]; chosen here."""
MOST_CHECKED = 1_000_000
"""Most configurations that are checked; a longer motion is refused."""


class Nearest(NamedTuple):
    """The part of a robot that is nearest to an obstacle.

    Attributes:
        distance: from the obstacle [m].
        leg: the leg that it belongs to, ``""`` for the body.
        shape: its name.
        place: index of the configuration.
    """

    distance: float
    leg: str
    shape: str
    place: int


class Approach(NamedTuple):
    """How near a motion comes to an obstacle.

    Attributes:
        seen: the nearest part in all configurations that were checked.
        proven: distance that no part falls short of at any instant [m].
        time: of ``seen`` [s].
        checked: how many configurations were checked.
    """

    seen: Nearest
    proven: float
    time: float
    checked: int


@dataclass(frozen=True, eq=False)
class Surroundings:
    """The robot's collision shapes and one obstacle.

    Attributes:
        robot: the robot.
        geometry: Pinocchio's geometry with a pair of each shape and the obstacle.
        names: name of each pair's shape.
        owners: leg of each pair's shape, ``""`` for the body.
        stand_ins: names of the shapes that replace meshes.
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
        """The shapes of a robot, paired with an obstacle."""
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
        """Distances of all shapes at path values ``(N, 6 + nj)``: ``(N, shapes)`` [m]."""
        import pinocchio as pin

        model = self.robot.model
        data, placed = model.createData(), self.geometry.createData()
        q = configuration(
            self.robot, values[:, :3], values[:, 3:BASE_COLUMNS], values[:, BASE_COLUMNS:]
        )
        # Views: to take them anew at every posture takes longer than to compute the distances.
        found = list(placed.distanceResults)
        out = np.empty((len(q), len(self.names)))
        for row, one in zip(out, q, strict=True):
            pin.updateGeometryPlacements(model, data, self.geometry, placed, one)
            pin.computeDistances(self.geometry, placed)
            row[:] = [result.min_distance for result in found]
        return out

    def nearest(self, values: FloatArray) -> Nearest:
        """The nearest part at path values ``(N, 6 + nj)``."""
        found = self.distances(values)
        k, shape = np.unravel_index(int(found.argmin()), found.shape)
        return Nearest(float(found[k, shape]), self.owners[shape], self.names[shape], int(k))

    def along(self, path: MotionPath, wanted: float) -> Approach:
        """How near a motion comes to the obstacle at any instant, by conservative advancement.

        The velocities of body and joints bound the speed of every part [Mirtich1996]. So when the
        distance exceeds ``wanted`` by some length, no part can be nearer than ``wanted`` before the
        fastest has moved by that length: there the next configuration is checked, or after
        :data:`LEAST_STEP` where that is longer.

        Args:
            path: body and joints over time.
            wanted: the distance that is to be kept [m].

        Raises:
            InputError: more than :data:`MOST_CHECKED` configurations would have to be checked.
        """
        times, way = _travelled(path, self.speeds(path))
        seen, proven, when, checked = Nearest(np.inf, "", "", 0), np.inf, 0.0, 0
        at = 0.0
        while True:
            now = float(np.interp(at, way, times)) if way[-1] > 0.0 else 0.0
            here = self.nearest(path.evaluate([now]))
            if here.distance < seen.distance:
                seen, when = here._replace(place=checked), now
            checked += 1
            step = max(here.distance - wanted, LEAST_STEP)
            # Until the next configuration no part comes nearer by more than it moves.
            proven = min(proven, max(here.distance - step, wanted) if step > LEAST_STEP
                         else here.distance - min(step, way[-1] - at))  # fmt: skip
            if at >= way[-1] or checked > MOST_CHECKED:
                break
            at = min(at + step, float(way[-1]))
        if checked > MOST_CHECKED:
            raise InputError(f"a motion of {way[-1]:.4g} m near an obstacle is too long to check")
        return Approach(seen, float(proven), when, checked)

    def speeds(self, path: MotionPath) -> FloatArray:
        """Bound on the speed of any part on each segment of a path ``(K - 1,)`` [m/s]."""
        rates = largest_sizes(path)
        base = np.linalg.norm(rates[:, :3], axis=1)
        turning = rates[:, 3:6].sum(axis=1) * self.reach
        joints = rates[:, BASE_COLUMNS:]
        legs = [joints[:, self.robot.leg_columns[leg]].sum(axis=1) for leg in LEGS]
        return np.asarray(base + turning + self.lever * np.max(legs, axis=0))


def _travelled(path: MotionPath, speeds: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Times of all knots ``(K,)``, and a bound on the distance moved up to each ``(K,)`` [m]."""
    way = np.concatenate([[0.0], np.cumsum(speeds * np.diff(path.times))])
    return np.asarray(path.times), way


def _span(robot: Quadruped, solid: Any, depth: int) -> float:
    """Bound on the distance of a shape's points from the base, or from the hinges of its leg [m].

    The bound is a sum of distances between successive hinges, so it holds for hinges farther out,
    too.

    Args:
        robot: the robot.
        solid: the shape.
        depth: 1 for the distance from the base's origin, 2 from the first hinge of the leg.
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
"""Tangents for a full turn of a round obstacle: the hull's corners are 0.12 % outside it."""


def obstacle_solid(obstacle: Obstacle) -> Any:
    """The obstacle as a convex solid of coal; the hull of a round one is just outside it."""
    from pinocchio import coal

    vertices, faces = obstacle.mesh(SIDES)
    points, triangles = coal.StdVec_Vec3s(), coal.StdVec_Triangle()
    points.extend(list(vertices))
    triangles.extend([coal.Triangle(*face) for face in faces.tolist()])
    return coal.Convex(points, triangles)
