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
from gaitopt.robots.collisions.along_paths import close_pairs
from gaitopt.robots.collisions.pairs import CollisionPairs

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
FIRST_EVERY = 16
"""Every how many of the knots and places between them distances are measured first: a power of 2,
and a multiple of those from one knot to the next."""
Kind = TypeVar("Kind", bound=RouteProblem)


class ClosePairs(NamedTuple):
    """Pairs of shapes that come close to each other, and how close.

    Attributes:
        pairs: numbers of the pairs.
        at_knots: distance of each pair at every knot ``(K, pairs)`` [m]; infinite at knots at which
            none can be below :data:`ROW_DISTANCE`.
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
    each = PLACES_BETWEEN + 1
    share = np.arange(each)[:, None] / each
    along = (joints[:-1, None] + np.diff(joints, axis=0)[:, None] * share).reshape(-1, JOINTS)
    found = _distances_where_close(shapes, np.concatenate([along, joints[-1:]]), pairs)
    at_knots = found[::each]
    between = found[:-1].reshape(-1, each, len(pairs))[:, 1:].min(axis=1)
    if min(at_knots.min(), between.min()) >= ACCEPTED_SHARE * LEAST_DISTANCE:
        return None
    close = np.isfinite(between)
    closer = np.minimum(at_knots[1:], at_knots[:-1])
    closer = np.maximum(np.where(close, closer, 0.0) - np.where(close, between, 0.0), 0.0)
    closer_beside = np.zeros_like(at_knots)
    closer_beside[:-1] = closer
    closer_beside[1:] = np.maximum(closer_beside[1:], closer)
    return ClosePairs(pairs, at_knots, closer_beside)


def _distances_where_close(
    shapes: CollisionPairs, joints: FloatArray, pairs: list[int]
) -> FloatArray:
    """Distances of pairs at places along a path ``(N, pairs)`` [m].

    They are infinite where what joints turn between two places beside one shows that no pair, or
    not this one all along the path, is closer than :data:`ROW_DISTANCE` there.

    Args:
        shapes: of the robot.
        joints: angles of the legs' joints along the path ``(N, 12)`` [rad].
        pairs: numbers of the pairs.
    """
    change = np.abs(np.diff(joints, axis=0)) @ shapes.levers[pairs].T
    most = np.concatenate([np.zeros((1, len(pairs))), np.cumsum(change, axis=0)])
    out, last, every = np.full_like(most, np.inf), len(joints) - 1, FIRST_EVERY
    places, close = np.unique(np.append(np.arange(0, last, every), last)), np.arange(len(pairs))
    while len(close):
        chosen = [pairs[n] for n in close.tolist()]
        out[places[:, None], close] = shapes.distances(joints[places], chosen)
        if every == 1:
            break
        every //= 2
        places = np.arange(every, last, 2 * every)
        before, after = places - every, np.minimum(places + every, last)
        # From both ends a distance falls by no more than what the joints turn on the way.
        least = (out[before] + out[after] - (most[after] - most[before])) / 2.0
        places = places[(least < ROW_DISTANCE).any(axis=1)]
        close = np.flatnonzero((least < ROW_DISTANCE).any(axis=0))
    return out


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
