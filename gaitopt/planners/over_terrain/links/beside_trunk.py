"""How near the thighs come to the trunk, as a table over the angles of the first two joints.

A hip that turns inward or far back may put its thigh into the trunk long before the joint is at its
limit. That depends on two angles alone, so a table tells it at once for all postures that the
search asks about.
"""

from __future__ import annotations

from dataclasses import dataclass
from weakref import WeakKeyDictionary

import numpy as np

from gaitopt.conventions import LEGS, BoolArray, FloatArray
from gaitopt.robots.collisions.pairs import CollisionPairs
from gaitopt.robots.quadruped import Quadruped

RANGE, SPACING = 1.3, 0.1
"""How far from the standing angles the table reaches, and its spacing [rad]. Chosen: of 800 angles
bilinear interpolation misjudges 3 at most on six robots, whose distances are within 2 mm of what is
asked; what is kept in the end is looked at exactly. Farther away the border of the table counts."""
BETWEEN_LINKS = 5e-3
"""Distance that links keep from one another [m]. Chosen: the plan's body may be some millimetres
from where the search puts it."""
STANDING_SHARE = 0.5
"""The same as a share of the distance in which they are when the robot stands, for links that are
nearer to each other then."""


def gaps_to_keep(robot: Quadruped, shapes: CollisionPairs) -> FloatArray:
    """Distances that a robot's links have to keep, for each pair ``(k,)`` [m]."""
    standing = robot.standing_joints()[None, robot.leg_joint_columns]
    gaps = STANDING_SHARE * shapes.distances(standing)[0]
    return np.asarray(np.minimum(BETWEEN_LINKS, gaps))


@dataclass(frozen=True, eq=False)
class BesideTrunk:
    """The thighs of a robot beside its trunk.

    Attributes:
        first: the least angles of each leg's table ``(4, 2)`` [rad].
        spare: distance beyond what is to be kept, at the points of the tables ``(4, n, n)`` [m];
            ``None`` where the shapes are not known.
    """

    first: FloatArray
    spare: FloatArray | None

    @classmethod
    def of(cls, robot: Quadruped) -> BesideTrunk:
        """The tables of a robot."""
        if robot not in _KNOWN:
            _KNOWN[robot] = cls._made(robot)
        return _KNOWN[robot]

    @classmethod
    def _made(cls, robot: Quadruped) -> BesideTrunk:
        shapes = CollisionPairs.of(robot)
        standing = robot.standing_joints()[robot.leg_joint_columns].reshape(len(LEGS), -1)
        first = standing[:, :2] - RANGE
        if shapes is None:
            return cls(first, None)
        steps = SPACING * np.arange(round(2.0 * RANGE / SPACING) + 1)
        count, kept = len(steps), gaps_to_keep(robot, shapes)
        spare = np.full((len(LEGS), count, count), BETWEEN_LINKS)
        for k in range(len(LEGS)):
            pairs = _thigh_and_trunk(robot, shapes, k)
            if not pairs:
                continue
            angles = np.tile(standing, (count * count, 1, 1))
            angles[:, k, 0] = np.repeat(first[k, 0] + steps, count)
            angles[:, k, 1] = np.tile(first[k, 1] + steps, count)
            gaps = shapes.distances(angles.reshape(count * count, -1), pairs) - kept[pairs]
            spare[k] = gaps.min(axis=1).reshape(count, count)
        return cls(first, spare)

    def clear(self, leg: int, angles: FloatArray) -> BoolArray:
        """Whether a leg's thigh is clear of the trunk at angles ``(..., 3)`` [rad]: ``(...)``."""
        if self.spare is None:
            return np.ones(angles.shape[:-1], dtype=np.bool_)
        last = self.spare.shape[1] - 1
        at = np.clip((np.nan_to_num(angles[..., :2]) - self.first[leg]) / SPACING, 0.0, last)
        low = np.minimum(at.astype(int), last - 1)
        i, j = np.moveaxis(low, -1, 0)
        u, v = np.moveaxis(at - low, -1, 0)
        table = self.spare[leg]
        near = (1.0 - v) * table[i, j] + v * table[i, j + 1]
        far = (1.0 - v) * table[i + 1, j] + v * table[i + 1, j + 1]
        return np.asarray((1.0 - u) * near + u * far >= 0.0)


def _thigh_and_trunk(robot: Quadruped, shapes: CollisionPairs, leg: int) -> list[int]:
    """Numbers of the pairs of a leg's thigh and the trunk."""
    model, solids = robot.model, shapes.geometry.geometryObjects
    thigh = int(model.getJointId(robot.legs[LEGS[leg]].joints[1]))
    out = []
    for k, pair in enumerate(shapes.geometry.collisionPairs):
        joints = {int(solids[n].parentJoint) for n in (pair.first, pair.second)}
        if joints == {1, thigh}:
            out.append(k)
    return out


_KNOWN: WeakKeyDictionary[Quadruped, BesideTrunk] = WeakKeyDictionary()
"""The tables of robots, which take longer to make than a step to find."""
