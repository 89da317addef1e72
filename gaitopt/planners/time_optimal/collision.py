"""Keeps the legs of a time-optimal route apart: distances, and cuts that restore them.

Legs come close only at a few knots. There the distance of two shapes is linearised about the last
solution, and joins the problem as a row; a few rounds of solving and looking again are enough.
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

APART = 2e-3
"""Distance that shapes of different legs keep at knots of the problem [m]."""
NEAR = 6e-3
"""Distance below which a knot gets a row [m]."""
Kind = TypeVar("Kind", bound=RouteProblem)
_STEP = 1e-5
_LOOKS = 3
"""Places between two knots at which shapes are looked at."""


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


def touching(shapes: CollisionPairs, problem: RouteProblem, poses: FloatArray) -> Near | None:
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
    shapes: CollisionPairs,
    problem: Kind,
    poses: FloatArray,
    found: FloatArray,
    dip: FloatArray,
    pairs: list[int],
) -> Kind:
    """The problem with rows that hold close shapes apart, linearised about ``poses``.

    Args:
        shapes, problem, poses: of the robot, the walk, and the last solution.
        found, dip, pairs: what :func:`touching` gave.
    """
    kinematics = problem.legs.kinematics(poses, problem.feet, problem.swing)
    joints = kinematics.joints.reshape(-1, JOINTS)
    slopes = kinematics.joints_by_pose()
    near = [(k, pair) for k, pair in np.argwhere(found - dip < NEAR).tolist() if k > 0]
    linear, offset = np.zeros((len(near), POSE)), np.zeros(len(near))
    for i, (k, pair) in enumerate(near):
        moved = joints[k] + _STEP * np.concatenate([np.eye(JOINTS), -np.eye(JOINTS)])
        ahead, behind = shapes.distances(moved, [pairs[pair]])[:, 0].reshape(2, JOINTS)
        linear[i] = (ahead - behind) / (2.0 * _STEP) @ slopes[k]
        offset[i] = found[k, pair] - dip[k, pair] - APART - linear[i] @ poses[k]
    knot = np.array([k for k, _ in near], dtype=int)
    added = Rows(knot, linear, np.zeros_like(linear), offset)
    return replace(problem, rows=Rows.joined([problem.rows, added]))
