"""Keeps the legs of a time-optimal walk apart: distances of their shapes, and rows that bound them.

Legs come close to each other at few knots. There the distance of two shapes is linearised about the
last solution and becomes a row of the problem, which is solved again. A few rounds are enough.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple, TypeVar

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.optimize.route.layout import Rows
from gaitopt.optimize.route.legs import JOINTS, POSE
from gaitopt.optimize.route.problem import RouteProblem
from gaitopt.robots.collision_shapes import CollisionPairs, close_pairs

LEAST_DISTANCE = 2e-3
"""Distance that rows ask shapes of different legs to keep at knots and between them [m]."""
ACCEPTED_SHARE = 0.5
"""Share of this distance with which a walk is accepted: rows are linearised, so they miss a little.
"""
ROW_DISTANCE = 6e-3
"""A pair of shapes that comes closer than this at a knot, or beside it, gets a row there [m]."""
DIFFERENCE_STEP = 1e-5
"""Change of a joint angle for central differences of distances [rad]."""
PLACES_BETWEEN = 3
"""Places between two knots at which distances are measured."""
Kind = TypeVar("Kind", bound=RouteProblem)


class ClosePairs(NamedTuple):
    """Pairs of shapes that come close to each other, and how close.

    Attributes:
        pairs: numbers of the pairs.
        at_knots: distance of each pair at every knot ``(K, pairs)`` [m].
        closer_beside: by how much each pair is closer on the intervals beside a knot than at
            either end of them ``(K, pairs)`` [m].
    """

    pairs: list[int]
    at_knots: FloatArray
    closer_beside: FloatArray

    @property
    def least(self) -> FloatArray:
        """Least distance at a knot and beside it, as rows at this knot see it ``(K, pairs)``."""
        return self.at_knots - self.closer_beside


def touching_pairs(
    shapes: CollisionPairs, problem: RouteProblem, poses: FloatArray
) -> ClosePairs | None:
    """The pairs that come close; ``None`` where all shapes keep their distance.

    Args:
        shapes: of the robot.
        problem: whose feet stand where it says.
        poses: at all knots ``(K, 9)``.
    """
    joints = problem.legs.joints(poses, problem.feet, problem.swing).reshape(-1, JOINTS)
    pairs = close_pairs(shapes, joints)
    if not pairs:
        return None
    at_knots = shapes.distances(joints, pairs)
    share = np.arange(1, PLACES_BETWEEN + 1)[:, None, None] / (PLACES_BETWEEN + 1.0)
    inner = joints[:-1] + np.diff(joints, axis=0) * share
    between = shapes.distances(inner.reshape(-1, JOINTS), pairs)
    between = between.reshape(PLACES_BETWEEN, -1, len(pairs)).min(axis=0)
    if min(at_knots.min(), between.min()) >= ACCEPTED_SHARE * LEAST_DISTANCE:
        return None
    closer = np.maximum(np.minimum(at_knots[1:], at_knots[:-1]) - between, 0.0)
    closer_beside = np.zeros_like(at_knots)
    closer_beside[:-1] = closer
    closer_beside[1:] = np.maximum(closer_beside[1:], closer)
    return ClosePairs(pairs, at_knots, closer_beside)


def with_distance_rows(
    shapes: CollisionPairs, problem: Kind, poses: FloatArray, close: ClosePairs
) -> Kind:
    """The problem with rows that keep close shapes apart, linearised about ``poses``.

    Args:
        shapes: of the robot.
        problem: the walk's.
        poses: of its last solution ``(K, 9)``.
        close: from :func:`touching_pairs` at these poses.
    """
    kinematics = problem.legs.kinematics(poses, problem.feet, problem.swing)
    joints = kinematics.joints.reshape(-1, JOINTS)
    joints_by_pose = kinematics.joints_by_pose()
    # At the first knot nothing can be chosen.
    near = [(k, n) for k, n in np.argwhere(close.least < ROW_DISTANCE).tolist() if k > 0]
    linear, offset = np.zeros((len(near), POSE)), np.zeros(len(near))
    changes = DIFFERENCE_STEP * np.concatenate([np.eye(JOINTS), -np.eye(JOINTS)])
    for i, (k, n) in enumerate(near):
        found = shapes.distances(joints[k] + changes, [close.pairs[n]])[:, 0]
        ahead, behind = found.reshape(2, JOINTS)
        linear[i] = (ahead - behind) / (2.0 * DIFFERENCE_STEP) @ joints_by_pose[k]
        offset[i] = (
            close.at_knots[k, n] - close.closer_beside[k, n] - LEAST_DISTANCE
            - linear[i] @ poses[k]
        )  # fmt: skip
    knot = np.array([k for k, _ in near], dtype=int)
    added = Rows(knot, linear, np.zeros_like(linear), offset)
    return replace(problem, rows=Rows.joined([problem.rows, added]))
