"""Whether limbs and trunk are clear of the ground, for many postures at once."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gaitopt.conventions import LEGS, BoolArray, FloatArray
from gaitopt.planners.over_terrain.link_spheres import LinkSpheres
from gaitopt.planners.over_terrain.pairs import Pairs
from gaitopt.planners.over_terrain.surfaces import Surfaces
from gaitopt.robots.quadruped import Quadruped
from gaitopt.robots.rotations import rpy_to_matrix

NEAR_FOOT = 2.0
"""Balls of the shank as near as this to the foot, in radii of the foot, count as the foot."""


@dataclass(frozen=True, eq=False)
class Limbs:
    """A robot's links over the ground.

    Attributes:
        robot: the robot.
        surfaces: the ground.
        clearance: that limbs and trunk keep from the ground [m].
        spheres: the robot's links.
    """

    robot: Quadruped
    surfaces: Surfaces
    clearance: float
    spheres: LinkSpheres

    def local(self, feet: FloatArray, poses: FloatArray) -> FloatArray:
        """Places in the world ``(K, n, 3)`` in the body frame, for body poses ``(K, 6)``."""
        turn = rpy_to_matrix(poses[:, 3:])
        return np.asarray((feet - poses[:, None, :3]) @ turn + self.robot.centre)

    def trunk_clear(self, pairs: Pairs, poses: FloatArray) -> BoolArray:
        """Whether the trunk is clear of the ground, at its place and halfway to it ``(K,)``."""
        balls, kept = self.spheres.trunk, np.ones(len(poses), dtype=np.bool_)
        if not len(balls.radii):
            return kept
        for pose in (poses, (poses + pairs.body) / 2.0):
            kept &= self._gaps(balls.centres[None], balls.radii, pose).min(axis=1) >= 0.0
        return kept

    def limbs_clear(self, pairs: Pairs, poses: FloatArray, paths: FloatArray) -> BoolArray:
        """Whether all legs are clear of the ground, as they stand and along the swing ``(K,)``."""
        kept = np.ones(len(poses), dtype=np.bool_)
        halfway = (poses + pairs.body) / 2.0
        for leg in range(4):
            for pose in (poses, halfway):
                kept &= self.leg_clear(leg, pairs.feet[:, leg][:, None], pose)
        flying = np.concatenate([paths, pairs.target[:, None]], axis=1)
        return kept & self.leg_clear(pairs.leg, flying, poses)

    def leg_clear(self, leg: int, feet: FloatArray, poses: FloatArray) -> BoolArray:
        """Whether a leg is clear of the ground with its foot at all of ``feet (K, n, 3)``."""
        count, places = feet.shape[:2]
        angles = self.robot.legs[LEGS[leg]].inverse(self.local(feet, poses).reshape(-1, 3))
        kept = self._links_clear(leg, angles, np.repeat(poses, places, axis=0))
        return np.asarray(kept.reshape(count, places).all(axis=1), dtype=np.bool_)

    def clear(self, poses: FloatArray, joints: FloatArray) -> BoolArray:
        """Whether limbs and trunk are clear of the ground ``(K,)``.

        Args:
            poses: x, y, z, roll, pitch, yaw of the body centre ``(K, 6)``.
            joints: angles of the legs ``(K, 4, 3)`` [rad].
        """
        balls = self.spheres.trunk
        kept = np.ones(len(poses), dtype=np.bool_)
        if len(balls.radii):
            kept &= self._gaps(balls.centres[None], balls.radii, poses).min(axis=1) >= 0.0
        for leg in range(4):
            kept &= self._links_clear(leg, joints[:, leg], poses)
        return kept

    def _links_clear(self, leg: int, angles: FloatArray, poses: FloatArray) -> BoolArray:
        """Whether the links of a leg with joint angles ``(N, 3)`` are clear of the ground."""
        kept = np.ones(len(poses), dtype=np.bool_)
        near = NEAR_FOOT * self.robot.foot_radius
        links = self.spheres.in_body(leg, angles)
        for link, (centres, balls) in enumerate(zip(links, self.spheres.legs[leg], strict=True)):
            if not len(balls.radii):
                continue
            gaps = self._gaps(centres, balls.radii, poses)
            if link == 2:
                foot = self.robot.legs[LEGS[leg]].forward(angles)
                away = np.linalg.norm(centres - foot[:, None], axis=2)
                gaps = np.where(away < near + balls.radii, np.inf, gaps)
            kept &= gaps.min(axis=1) >= 0.0
        return kept

    def _gaps(self, centres: FloatArray, radii: FloatArray, poses: FloatArray) -> FloatArray:
        """How far balls at ``centres (K or 1, n, 3)``, body frame, are clear ``(K, n)`` [m]."""
        turn = rpy_to_matrix(poses[:, 3:])
        world = (centres - self.robot.centre) @ np.swapaxes(turn, -1, -2) + poses[:, None, :3]
        radius = float(radii.max())
        clear = self.surfaces.clear_height(world[..., :2], radius)
        return np.asarray(world[..., 2] - clear - self.clearance)
