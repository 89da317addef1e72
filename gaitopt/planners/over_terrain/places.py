"""Places that the body may go to for a step, so that the centre of mass keeps its margin."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gaitopt.conventions import LEGS, OTHER_LEGS, BoolArray, FloatArray
from gaitopt.optimize.route.centre_of_mass import MassDistribution
from gaitopt.planners.over_terrain.links.limbs import Limbs
from gaitopt.planners.over_terrain.pairs import Pairs
from gaitopt.planners.over_terrain.settings import TerrainSettings
from gaitopt.planners.over_terrain.triangles import into_triangles, shrunken_triangles
from gaitopt.robots.quadruped import Quadruped
from gaitopt.robots.rotations import rpy_to_matrix
from gaitopt.stability.support import triangle_half_planes

COM_RESERVE = 0.15
"""Margin beyond the one that is asked for, as a share of it: the centre of mass is looked at for
one place of the body and three of the flying foot, and forces may ask for more."""


@dataclass(frozen=True, eq=False)
class BodyPlaces:
    """The places for one robot.

    Attributes:
        robot, limbs, settings: whose steps, its links, and what is asked for.
        masses: where the robot's mass is.
        com: the centre of mass from the body centre of the standing robot, body frame ``(3,)`` [m].
        hips: usual places of the feet from the body centre, body frame ``(4, 2)`` [m].
    """

    robot: Quadruped
    limbs: Limbs
    settings: TerrainSettings
    masses: MassDistribution
    com: FloatArray
    hips: FloatArray

    @classmethod
    def of(
        cls, robot: Quadruped, limbs: Limbs, settings: TerrainSettings, hips: FloatArray
    ) -> BodyPlaces:
        """The places for a robot and what its search asks for."""
        standing = robot.standing_joints()[robot.leg_joint_columns].reshape(1, 4, 3)
        masses = MassDistribution.of(robot)
        return cls(robot, limbs, settings, masses, masses.com_in_body(standing)[0], hips)

    def of_pairs(
        self, pairs: Pairs, posture: FloatArray, grid: int = 0
    ) -> tuple[FloatArray, BoolArray]:
        """Places that the body may go to ``(K, P, 3)`` [m], nearest first, and if there are any.

        Args:
            pairs: steps.
            posture: height, roll, pitch and yaw of the body ``(K, 4)``.
            grid: further places along each side of the triangle, of a grid that fills it.
        """
        standing = pairs.feet[:, OTHER_LEGS[pairs.leg], :2]
        turn = rpy_to_matrix(posture[:, 1:])
        margin = self.settings.stability_margin * (1.0 + COM_RESERVE)
        # First as if the legs were those of the standing robot, then with their angles there.
        offset = (turn @ self.com)[:, None, :2]
        for _ in range(2):
            corners, some = _room(standing, offset, margin)
            nearest = into_triangles(corners, pairs.body[:, :2])
            if offset.shape[1] == 1:
                offset = self._offsets(pairs, posture, turn, nearest)
        best = into_triangles(corners, self._usual(pairs, turn))
        shares = np.array([0.0, 0.33, 0.67, 1.0])[:, None]
        blend = nearest[:, None] + shares * (best - nearest)[:, None]
        middle = corners.mean(axis=1)
        # Where the hip is above the foothold: legs reach farthest down there.
        over = pairs.target[:, :2] - turn[:, :2, :2] @ self.hips[pairs.leg]
        over = into_triangles(corners, over)
        further = [middle, (middle + best) / 2.0, over, (over + best) / 2.0]
        places = np.concatenate([blend, np.stack(further, axis=1)], axis=1)
        if grid:
            places = np.concatenate([places, grid_shares(grid) @ corners], axis=1)
        height = np.broadcast_to(posture[:, None, :1], (*places.shape[:2], 1))
        return np.concatenate([places, height], axis=2), some

    def _offsets(
        self, pairs: Pairs, posture: FloatArray, turn: FloatArray, place: FloatArray
    ) -> FloatArray:
        """Horizontal places of the centre of mass from the body's ``(K, 3, 2)`` [m].

        The flying foot is where it lifts off, highest, and where it lands.
        """
        poses = np.concatenate([place, posture], axis=1)
        start = pairs.feet[:, pairs.leg]
        top = (start + pairs.target) / 2.0
        top[:, 2] = np.maximum(start[:, 2], pairs.target[:, 2]) + self.settings.swing_height
        flown = np.stack([start, top, pairs.target], axis=1)
        local = self.limbs.local(np.concatenate([pairs.feet, flown], axis=1), poses)
        joints = np.empty((len(poses), 3, 4, 3))
        for k, leg in enumerate(LEGS):
            asked = local[:, 4:] if k == pairs.leg else local[:, k : k + 1]
            joints[:, :, k] = self.robot.legs[leg].inverse(asked)
        com = self.masses.com_in_body(joints.reshape(-1, 4, 3)).reshape(-1, 3, 3)
        offsets = (com @ np.swapaxes(turn, -1, -2))[..., :2]
        # Legs that do not reach their feet have no angles: such steps are refused later.
        return np.nan_to_num(offsets)

    def _usual(self, pairs: Pairs, turn: FloatArray) -> FloatArray:
        """The middle of where the body would be for each foot to be below its hip ``(K, 2)``."""
        before = pairs.feet[..., :2].sum(axis=1)
        mean = (before + pairs.target[:, :2]) / 5.0
        weight = np.ones(4)
        weight[pairs.leg] = 2.0
        hip = (weight[:, None] * self.hips).sum(axis=0) / 5.0
        return np.asarray(mean - turn[:, :2, :2] @ hip)


def grid_shares(count: int) -> FloatArray:
    """Shares of the corners ``(n, 3)`` at a grid over a triangle with a number along each side."""
    one, two = np.meshgrid(np.arange(count), np.arange(count), indexing="ij")
    inside = one + two < count
    shares = np.column_stack([one[inside], two[inside]]) / max(count - 1, 1)
    return np.column_stack([shares, 1.0 - shares.sum(axis=1)])


def _room(standing: FloatArray, offsets: FloatArray, margin: float) -> tuple[FloatArray, BoolArray]:
    """Triangles in which the body keeps the margin ``(K, 3, 2)``, and which are left ``(K,)``.

    Args:
        standing: the three feet that stand ``(K, 3, 2)`` [m].
        offsets: places of the centre of mass from the body's ``(K, n, 2)`` [m].
        margin: that each of them keeps [m].
    """
    normals, _ = triangle_half_planes(standing)
    nearest = np.einsum("kij,knj->kin", normals, offsets).min(axis=2)
    return shrunken_triangles(standing, margin - nearest)
