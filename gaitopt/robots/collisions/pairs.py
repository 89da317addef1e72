"""Pairs of a robot's own links that must not touch: their distances at poses of the legs."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple
from weakref import WeakKeyDictionary

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.robots.at_many_poses.boxes import ShapeBoxes
from gaitopt.robots.collisions.shapes import HULL, collision_geometry
from gaitopt.robots.quadruped import Quadruped

TOUCHING = 1e-4
"""Distance below which two shapes count as touching [m]: that of the certificate."""
BETWEEN = 2.0
"""Distance at the poses of a path below which links may touch between them, as a multiple of
:data:`TOUCHING`. Chosen: the poses are close to one another."""
ROUGH = 2e-3
"""Distance below which a convex hull counts as touching when the robot stands [m]: that of the
certificate."""
NEARER = ((16, 0.006), (4, 0.001))
"""Every how many poses the pairs are looked at that are close, and which of them go on to the next
line [m]; the last ones are looked at at every pose. Chosen: on walks of eleven robots no pair that
comes closer than 20 mm was farther than 24 mm at the first poses, and shapes came closer by 1.2 mm
at most between every sixteenth pose, and by 0.2 mm between every fourth."""
APART = 1e-3
"""Distance of the boxes around two shapes from which on they do not touch at a pose of a path [m].
Chosen: five times what :data:`BETWEEN` asks for, far above the error of a distance."""


@dataclass(frozen=True, eq=False)
class CollisionPairs:
    """Pairs of a robot's own shapes that must not touch.

    These are shapes of different legs, and the trunk's with those of a leg beyond its first joint.
    Pairs that overlap when the robot stands are left out: there the file's shapes are too large.

    Attributes:
        model, geometry: Pinocchio's.
        columns: of the legs' joints, :attr:`Quadruped.leg_joint_columns`.
        neutral: a configuration with the base at the origin ``(nq,)``.
    """

    model: Any
    geometry: Any
    columns: np.ndarray
    neutral: FloatArray

    @classmethod
    def of(cls, robot: Quadruped) -> CollisionPairs | None:
        """The pairs of a robot; ``None`` where shapes are missing, or hulls of meshes are."""
        if robot not in _KNOWN:
            _KNOWN[robot] = cls._read(robot)
        return _KNOWN[robot]

    @classmethod
    def _read(cls, robot: Quadruped) -> CollisionPairs | None:
        """The pairs of a robot, from its URDF's text."""
        import pinocchio as pin

        geometry = collision_geometry(robot)
        if geometry is None:
            return None
        model = robot.model
        legs = [_first_joint(model, shape.parentJoint) for shape in geometry.geometryObjects]
        for i, first in enumerate(legs):
            for j in range(i):
                apart = first > 1 and legs[j] > 1 and first != legs[j]
                if apart or _trunk_and_limb(geometry, legs, i, j):
                    geometry.addCollisionPair(pin.CollisionPair(j, i))
        neutral = pin.neutral(model)
        neutral[7:] = robot.neutral_joints()
        found = cls(model, geometry, robot.leg_joint_columns, neutral)
        found._leave_out_touching(robot.standing_joints())
        return found if len(geometry.collisionPairs) else None

    def _leave_out_touching(self, joints: FloatArray) -> None:
        """Remove the pairs that touch at the angles ``(nj,)`` of all joints [rad]."""
        import pinocchio as pin

        gaps = self.distances(joints[None, self.columns])[0]
        numbers = [(pair.first, pair.second) for pair in self.geometry.collisionPairs]
        hull = [HULL in str(shape.name) for shape in self.geometry.geometryObjects]
        for gap, (first, second) in zip(gaps, numbers, strict=True):
            if gap < (ROUGH if hull[first] or hull[second] else TOUCHING):
                self.geometry.removeCollisionPair(pin.CollisionPair(first, second))

    def distances(self, joints: FloatArray, pairs: list[int] | None = None) -> FloatArray:
        """Distances of pairs ``(N, k)`` [m].

        Args:
            joints: angles of the legs' joints ``(N, 12)`` [rad].
            pairs: indices of ``k`` pairs; all by default.
        """
        import pinocchio as pin

        chosen = list(range(len(self.geometry.collisionPairs))) if pairs is None else pairs
        data, placed = self.model.createData(), self.geometry.createData()
        for k in set(range(len(self.geometry.collisionPairs))) - set(chosen):
            placed.deactivateCollisionPair(k)
        # Views of the results of all pairs, which are computed by one call: a call for each pair
        # takes twice as long.
        found = [placed.distanceResults[k] for k in chosen]
        out = np.empty((len(joints), len(chosen)))
        q = self.neutral.copy()
        for row, angles in zip(out, joints, strict=True):
            q[7:][self.columns] = angles
            pin.computeDistances(self.model, data, self.geometry, placed, q)
            row[:] = [result.min_distance for result in found]
        return out

    def near(self, joints: FloatArray, distance: float) -> list[int]:
        """Indices of the pairs whose bounding balls come nearer than a distance at any pose.

        No other pair does, as a shape lies within its ball. It takes a tenth to a third of
        the time of :meth:`distances`.

        Args:
            joints: angles of the legs' joints ``(N, 12)`` [rad].
            distance: [m].
        """
        import pinocchio as pin

        data, balls, pairs = self.model.createData(), self._balls, self._numbers
        moved = sorted({int(joint) for joint in balls.joint})
        places = np.empty((len(joints), len(moved), 4, 4))
        q = self.neutral.copy()
        for row, angles in zip(places, joints, strict=True):
            q[7:][self.columns] = angles
            pin.forwardKinematics(self.model, data, q)
            for place, joint in zip(row, moved, strict=True):
                place[:] = data.oMi[joint].homogeneous
        own = places[:, np.searchsorted(moved, balls.joint)]
        centres = (own[..., :3, :3] @ balls.centre[..., None])[..., 0] + own[..., :3, 3]
        between = np.linalg.norm(centres[:, pairs[:, 0]] - centres[:, pairs[:, 1]], axis=2)
        least = between.min(axis=0, initial=np.inf) - balls.radius[pairs].sum(axis=1)
        # So written, a ball counts whose place is not a number.
        return [int(k) for k in np.flatnonzero(~(least >= distance))]

    def touch(self, joints: FloatArray, stages: tuple[tuple[int, float], ...]) -> bool:
        """Whether a pair comes nearer than :data:`BETWEEN` times :data:`TOUCHING` at a pose.

        Args:
            joints: angles of the legs' joints ``(N, 12)`` [rad], ``N >= 1``.
            stages: every how many poses pairs are looked at, and which go on to the next stage [m].
        """
        left = np.arange(len(self._numbers))
        for every, near in stages:
            if not len(left):
                break
            least = self._least_distances(joints[::every], left, near)
            if (least < BETWEEN * TOUCHING).any():
                return True
            left = left[least < near]
        return False

    def _least_distances(self, joints: FloatArray, pairs: np.ndarray, near: float) -> FloatArray:
        """Lower bounds on the distances of pairs at some poses ``(k,)`` [m].

        Where boxes around two shapes do not show that they are apart, it is the distance itself.

        Args:
            joints: angles of the legs' joints ``(N, 12)`` [rad].
            pairs: indices of pairs ``(k,)``.
            near: from this distance on it need not be a close bound [m].
        """
        if self._boxes is None:
            least = np.full(len(pairs), np.inf)
            close = np.isin(pairs, self.near(joints, near))
            if close.any():
                least[close] = self.distances(joints, pairs[close].tolist()).min(axis=0)
            return least
        angles = np.tile(self.neutral[7:], (len(joints), 1))
        angles[:, self.columns] = joints
        apart = max(APART, min(near, NEARER[0][1]))
        found = self._boxes.gaps(angles, self._numbers[pairs], near, apart)
        # So written, a pair counts whose distance is not a number.
        close = ~(found.boxes >= apart)
        for pose in np.flatnonzero(close.any(axis=0)):
            some = np.flatnonzero(close[:, pose])
            found.boxes[some, pose] = self._distances_at(joints[pose], pairs[found.near[some]])
        found.balls[found.near] = found.boxes.min(axis=1)
        return found.balls

    def _distances_at(self, angles: FloatArray, pairs: np.ndarray) -> list[float]:
        """Distances of a few pairs at one pose ``(k,)`` [m].

        Pinocchio's memory for all pairs takes longer to make than a dozen distances to find.

        Args:
            angles: of the legs' joints ``(12,)`` [rad].
            pairs: their indices ``(k,)``.
        """
        import pinocchio as pin
        from pinocchio import coal

        data, q = self.model.createData(), self.neutral.copy()
        q[7:][self.columns] = angles
        pin.forwardKinematics(self.model, data, q)
        request, out = coal.DistanceRequest(), []
        for numbers in self._numbers[pairs].tolist():
            one, other = (self.geometry.geometryObjects[k] for k in numbers)
            places = (data.oMi[x.parentJoint].act(x.placement) for x in (one, other))
            here, there = (coal.Transform3s(x.rotation, x.translation) for x in places)
            result = coal.DistanceResult()
            out.append(coal.distance(one.geometry, here, other.geometry, there, request, result))
        return out

    @cached_property
    def levers(self) -> FloatArray:
        """Longest lever of each joint for each pair ``(k, 12)`` [m].

        When the legs' joints turn by ``dq``, the distance of pair ``k`` changes by at most
        ``levers[k] . |dq|``: a shape moves by at most a joint's angle times its farthest distance
        from the joint, which is at most the length of the chain of links between them.
        """
        model, balls = self.model, self._balls
        of_shapes = np.zeros((len(balls.joint), model.nv))
        ends = np.linalg.norm(balls.centre, axis=1) + balls.radius
        for lever, end, last in zip(of_shapes, ends.tolist(), balls.joint.tolist(), strict=True):
            joint, length = last, end
            while joint > 1:
                lever[model.idx_vs[joint]] = length
                length += float(np.linalg.norm(model.jointPlacements[joint].translation))
                joint = int(model.parents[joint])
        by_leg_joint = of_shapes[:, 6:][:, self.columns]
        return np.asarray(by_leg_joint[self._numbers].sum(axis=1))

    @cached_property
    def _boxes(self) -> ShapeBoxes | None:
        """Boxes around all shapes; ``None`` where a joint is no hinge."""
        return ShapeBoxes.of(self.model, self.geometry)

    @cached_property
    def _numbers(self) -> np.ndarray:
        """Numbers of the shapes of all pairs ``(k, 2)``."""
        pairs = self.geometry.collisionPairs
        return np.array([(pair.first, pair.second) for pair in pairs], dtype=int).reshape(-1, 2)

    @cached_property
    def _balls(self) -> _Balls:
        """Balls around all shapes."""
        centres, radii, joints = [], [], []
        for shape in self.geometry.geometryObjects:
            shape.geometry.computeLocalAABB()
            centres.append(shape.placement.act(shape.geometry.aabb_center))
            radii.append(float(shape.geometry.aabb_radius))
            joints.append(int(shape.parentJoint))
        return _Balls(np.array(centres).reshape(-1, 3), np.array(radii), np.array(joints))


class _Balls(NamedTuple):
    """Balls around shapes.

    Attributes:
        centre: in the frames of the joints that move the shapes ``(n, 3)`` [m].
        radius: ``(n,)`` [m].
        joint: numbers of these joints ``(n,)``.
    """

    centre: FloatArray
    radius: FloatArray
    joint: np.ndarray


_KNOWN: WeakKeyDictionary[Quadruped, CollisionPairs | None] = WeakKeyDictionary()
"""The pairs of robots, which take longer to read than a walk of eight steps to plan."""


def _trunk_and_limb(geometry: Any, legs: list[int], i: int, j: int) -> bool:
    """Whether one shape is the trunk's, and the other on a leg beyond its first joint."""
    if (legs[i] > 1) == (legs[j] > 1):
        return False
    limb = i if legs[i] > 1 else j
    return bool(geometry.geometryObjects[limb].parentJoint != legs[limb])


def _first_joint(model: Any, joint: int) -> int:
    """The joint next to the body on the way from the body to ``joint``; 1 for the body itself."""
    while joint > 1 and model.parents[joint] > 1:
        joint = model.parents[joint]
    return int(joint)
