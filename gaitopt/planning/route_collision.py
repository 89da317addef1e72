"""Keeps the legs of a time-optimal route apart: distances, and cuts that restore them.

Legs come close only at a few knots. There the distance of two shapes is linearised about the last
answer, and joins the problem as a row; a few rounds of solving and looking again are enough.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, NamedTuple, TypeVar

import numpy as np

from gaitopt.conventions import LEGS, FloatArray
from gaitopt.optimize.route_legs import JOINTS, POSE
from gaitopt.optimize.route_problem import RouteProblem, Rows
from gaitopt.robots.quadruped import Quadruped

APART = 2e-3
"""Distance that shapes of different legs keep at knots of the problem [m]."""
NEAR = 6e-3
"""Distance below which a knot gets a row [m]."""
Kind = TypeVar("Kind", bound=RouteProblem)
_TOUCH = 1e-4
_STEP = 1e-5
_EVERY = 4
_FAR = 0.08
_LOOKS = 3
"""Places between two knots at which shapes are looked at."""


@dataclass(frozen=True, eq=False)
class Shapes:
    """The robot's collision shapes, when all are primitives.

    Attributes:
        model, geometry: Pinocchio's.
        columns: the twelve leg joints in Pinocchio's order of joints.
        neutral: a configuration with the base at the origin.
    """

    model: Any
    geometry: Any
    columns: list[int]
    neutral: FloatArray

    @classmethod
    def of(cls, robot: Quadruped) -> Shapes | None:
        """The pairs of shapes on different legs, and of the trunk and a leg beyond its first joint.

        ``None`` where shapes are meshes or missing.
        """
        import pinocchio as pin

        if "<mesh" in robot.urdf:
            return None
        model = robot.model
        geometry = pin.buildGeomFromUrdfString(model, robot.urdf, pin.GeometryType.COLLISION)
        legs = [_first_joint(model, shape.parentJoint) for shape in geometry.geometryObjects]
        for i, first in enumerate(legs):
            for j in range(i):
                apart = first > 1 and legs[j] > 1 and first != legs[j]
                if apart or _trunk_and_limb(geometry, legs, i, j):
                    geometry.addCollisionPair(pin.CollisionPair(j, i))
        if not len(geometry.collisionPairs):
            return None
        neutral = pin.neutral(model)
        neutral[7:] = robot.neutral_joints()
        return cls(model, geometry, [c for x in LEGS for c in robot.leg_columns[x]], neutral)

    def distances(self, joints: FloatArray, pairs: list[int] | None = None) -> FloatArray:
        """Distances of pairs at joint angles ``(N, 12)``: ``(N, pairs)`` [m]."""
        import pinocchio as pin

        chosen = range(len(self.geometry.collisionPairs)) if pairs is None else pairs
        data, placed = self.model.createData(), self.geometry.createData()
        out = np.empty((len(joints), len(chosen)))
        q = self.neutral.copy()
        for row, angles in zip(out, joints, strict=True):
            q[7:][self.columns] = angles
            pin.updateGeometryPlacements(self.model, data, self.geometry, placed, q)
            for n, k in enumerate(chosen):
                row[n] = pin.computeDistance(self.geometry, placed, k).min_distance
        return out


def _trunk_and_limb(geometry: Any, legs: list[int], i: int, j: int) -> bool:
    """Whether one shape is the trunk's, and the other on a leg beyond its first joint."""
    if (legs[i] > 1) == (legs[j] > 1):
        return False
    limb = i if legs[i] > 1 else j
    return bool(geometry.geometryObjects[limb].parentJoint != legs[limb])


def _first_joint(model: Any, joint: int) -> int:
    while joint > 1 and model.parents[joint] > 1:
        joint = model.parents[joint]
    return int(joint)


def close_pairs(shapes: Shapes, joints: FloatArray) -> list[int]:
    """The pairs that come near one another at any of a few sampled knots."""
    sampled = shapes.distances(joints[::_EVERY])
    return [int(k) for k in np.flatnonzero(sampled.min(axis=0) < _FAR)]


class Near(NamedTuple):
    """How near the shapes of close pairs come.

    Attributes:
        found: at every knot ``(K, pairs)`` [m].
        dip: how much nearer they come in the intervals beside each knot ``(K, pairs)`` [m].
        pairs: which pairs.
    """

    found: FloatArray
    dip: FloatArray
    pairs: list[int]


def path_touches(robot: Quadruped, joints: FloatArray) -> bool:
    """Whether links touch at any of many poses along a path; no, where shapes are meshes.

    Args:
        robot: whose links.
        joints: angles in Pinocchio's order ``(N, nj)`` [rad], close to one another.
    """
    shapes = Shapes.of(robot)
    if shapes is None:
        return False
    legs = joints[:, shapes.columns]
    pairs = close_pairs(shapes, legs)
    return bool(pairs) and bool(shapes.distances(legs, pairs).min() < _TOUCH)


def touching(shapes: Shapes, problem: RouteProblem, poses: FloatArray) -> Near | None:
    """How near close pairs come, when any comes closer than it may; knots and between them."""
    joints = problem.legs.joints(poses, problem.feet, problem.swing).reshape(-1, JOINTS)
    pairs = close_pairs(shapes, joints)
    if not pairs:
        return None
    found = shapes.distances(joints, pairs)
    share = np.arange(1, _LOOKS + 1)[:, None, None] / (_LOOKS + 1.0)
    inner = joints[:-1] + np.diff(joints, axis=0) * share
    between = shapes.distances(inner.reshape(-1, JOINTS), pairs)
    between = between.reshape(_LOOKS, -1, len(pairs)).min(axis=0)
    if min(found.min(), between.min()) >= 0.5 * APART:
        return None
    sag = np.maximum(np.minimum(found[1:], found[:-1]) - between, 0.0)
    dip = np.zeros_like(found)
    dip[:-1] = sag
    dip[1:] = np.maximum(dip[1:], sag)
    return Near(found, dip, pairs)


def kept_apart(
    shapes: Shapes,
    problem: Kind,
    poses: FloatArray,
    found: FloatArray,
    dip: FloatArray,
    pairs: list[int],
) -> Kind:
    """The problem with rows that hold close shapes apart, linearised about ``poses``.

    Args:
        shapes, problem, poses: of the robot, the walk, and the last answer.
        found, dip, pairs: what :func:`touching` gave.
    """
    bent = problem.legs.bend(poses, problem.feet, problem.swing)
    joints = bent.joints.reshape(-1, JOINTS)
    slopes = bent.gradients()
    near = [(k, pair) for k, pair in np.argwhere(found - dip < NEAR).tolist() if k > 0]
    linear, offset = np.zeros((len(near), POSE)), np.zeros(len(near))
    for i, (k, pair) in enumerate(near):
        moved = joints[k] + _STEP * np.concatenate([np.eye(JOINTS), -np.eye(JOINTS)])
        ahead, behind = shapes.distances(moved, [pairs[pair]])[:, 0].reshape(2, JOINTS)
        linear[i] = (ahead - behind) / (2.0 * _STEP) @ slopes[k]
        offset[i] = found[k, pair] - dip[k, pair] - APART - linear[i] @ poses[k]
    rows = problem.rows
    knot = np.concatenate([rows.knot, np.array([k for k, _ in near], dtype=int)])
    order = np.argsort(knot, kind="stable")
    return replace(
        problem,
        rows=Rows(
            knot[order],
            np.concatenate([rows.linear, linear])[order],
            np.concatenate([rows.square, np.zeros_like(linear)])[order],
            np.concatenate([rows.offset, offset])[order],
        ),
    )
