"""Which links of a robot come close to one another, or touch, along a path."""

from __future__ import annotations

from gaitopt.conventions import FloatArray
from gaitopt.robots.collisions.pairs import BETWEEN, NEARER, TOUCHING, CollisionPairs
from gaitopt.robots.quadruped import Quadruped

EVERY = 4
"""One of so many knots is looked at to find the pairs that come close."""
CLOSE = 0.08
"""Distance below which a pair is looked at at all knots [m]. Chosen: about twice what a foot moves
in :data:`EVERY` knots of a walk of [Wang2020]."""
FIRST_CLOSE = 0.04
"""Distance at the first poses of a path from which on a pair is not looked at again [m]. Chosen:
on walks of eleven robots no pair that comes closer than 20 mm was farther than 24 mm there."""
FIRST_POSES = 50
"""Poses of a path, at least, at which all pairs are looked at, where their number is not given.
Chosen: about one for each step."""


def close_pairs(shapes: CollisionPairs, joints: FloatArray) -> list[int]:
    """Indices of the pairs that come close at any of some knots.

    Args:
        shapes: the pairs.
        joints: angles of the legs' joints at all knots ``(N, 12)`` [rad].
    """
    sampled = joints[::EVERY]
    near = shapes.near(sampled, CLOSE)
    least = shapes.distances(sampled, near).min(axis=0)
    return [pair for pair, gap in zip(near, least.tolist(), strict=True) if gap < CLOSE]


def path_touches(robot: Quadruped, joints: FloatArray, first: int = FIRST_POSES) -> bool:
    """Whether links touch at a pose of a path; false where their shapes are not known.

    Pairs of shapes are looked at more often the closer they come, because a path has thousands of
    poses and a robot hundreds of pairs. So this is no proof; the certificate has one.

    Args:
        robot: the robot.
        joints: angles in Pinocchio's order ``(N, nj)`` [rad], close to one another.
        first: poses, at least, at which all pairs are looked at. A pair that is far apart at all of
            these is not looked at again.
    """
    shapes = CollisionPairs.of(robot)
    if shapes is None or not len(joints):
        return False
    few = max(len(joints) // max(first, 1), 1)
    last = (1, BETWEEN * TOUCHING)
    stages = tuple((min(every, few), near) for every, near in ((few, FIRST_CLOSE), *NEARER, last))
    return shapes.touch(joints[:, shapes.columns], stages)
