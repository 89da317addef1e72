"""Whether limbs and trunk are clear of the ground, for many postures at once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gaitopt.conventions import LEGS, BoolArray, FloatArray
from gaitopt.planners.over_terrain.links.link_spheres import LinkSpheres, Placements, link_spheres
from gaitopt.planners.over_terrain.links.near_foot import CLEAR
from gaitopt.planners.over_terrain.pairs import Pairs
from gaitopt.planners.over_terrain.surfaces import Surfaces
from gaitopt.robots.quadruped import Quadruped
from gaitopt.robots.rotations import rpy_to_matrix


@dataclass(frozen=True, eq=False)
class Limbs:
    """A robot's links over the ground.

    Attributes:
        robot: the robot.
        surfaces: the ground.
        clearance: that limbs and trunk keep from the ground [m].
        spheres: the robot's links.
        trunk_sizes, leg_sizes: the numbers of the tables of :class:`Surfaces` for the balls.
    """

    robot: Quadruped
    surfaces: Surfaces
    clearance: float
    spheres: LinkSpheres
    trunk_sizes: np.ndarray
    leg_sizes: tuple[np.ndarray, ...]

    @classmethod
    def of(cls, robot: Quadruped, surfaces: Surfaces, clearance: float) -> Limbs:
        """The links of a robot over a map."""
        spheres = link_spheres(robot)
        radii = [np.concatenate([balls.radii for balls in leg]) for leg in spheres.legs]
        sizes = tuple(surfaces.sizes(each) for each in radii)
        return cls(robot, surfaces, clearance, spheres, surfaces.sizes(spheres.trunk.radii), sizes)

    def local(self, feet: FloatArray, poses: FloatArray) -> FloatArray:
        """Places in the world ``(K, n, 3)`` in the body frame, for body poses ``(K, 6)``."""
        turn = rpy_to_matrix(poses[:, 3:])
        return np.asarray((feet - poses[:, None, :3]) @ turn + self.robot.centre)

    def trunk_clear(self, pairs: Pairs, poses: FloatArray) -> BoolArray:
        """Whether the trunk is clear of the ground, at its place and halfway to it ``(K,)``."""
        halfway = (poses + pairs.body) / 2.0
        return self._trunk(self.body(poses)) & self._trunk(self.body(halfway))

    def trunk_stands_clear(self, poses: FloatArray) -> BoolArray:
        """Whether the trunk is clear of the ground at poses ``(K, 6)``: ``(K,)``."""
        return self._trunk(self.body(poses))

    def limbs_clear(self, pairs: Pairs, poses: FloatArray, paths: FloatArray) -> BoolArray:
        """Whether all legs are clear of the ground, as they stand and along the swing ``(K,)``."""
        halfway = (poses + pairs.body) / 2.0
        # What touches most often is asked first: the leg at its foothold, then those that stand.
        asked = [(pairs.leg, pairs.target[:, None], poses)]
        asked += [(k, pairs.feet[:, k, None], at) for at in (poses, halfway) for k in range(4)]
        asked += [(pairs.leg, paths, poses)]
        left = np.arange(len(poses))
        for leg, feet, at in asked:
            if len(left):
                left = left[self.leg_clear(leg, feet[left], at[left])]
        after = pairs.feet[left]
        after[:, pairs.leg] = pairs.target[left]
        kept = np.zeros(len(poses), dtype=np.bool_)
        kept[left] = self.stands_clear(after, poses[left])
        return kept

    def leg_clear(self, leg: int, feet: FloatArray, poses: FloatArray) -> BoolArray:
        """Whether a leg is clear of the ground with its foot at all of ``feet (K, n, 3)``."""
        count, places = feet.shape[:2]
        angles = self.robot.legs[LEGS[leg]].inverse(self.local(feet, poses).reshape(-1, 3))
        body = self.body(poses)
        repeated = Placements(*(np.repeat(part, places, axis=0) for part in body))
        kept = self._leg(leg, angles, repeated)
        return np.asarray(kept.reshape(count, places).all(axis=1), dtype=np.bool_)

    def leg_stands_clear(self, leg: int, feet: FloatArray, poses: FloatArray) -> BoolArray:
        """Whether a whole leg is clear of the ground with its foot at ``feet (K, 3)``: ``(K,)``."""
        angles = self.robot.legs[LEGS[leg]].inverse(self.local(feet[:, None], poses)[:, 0])
        body = self.body(poses)
        near = self._near_foot_clear(leg, self.spheres.near_feet, angles, body)
        return np.asarray(near & self._leg(leg, angles, body))

    def near_feet_clear(self, poses: FloatArray, joints: FloatArray) -> BoolArray:
        """Whether the shanks are clear of the ground next to their feet ``(K, 4)``.

        Args:
            poses, joints: as for :meth:`clear`.
        """
        body = self.body(poses)
        each = [self._near_foot_clear(leg, self.spheres.near_feet, joints[:, leg], body)
                for leg in range(len(LEGS))]  # fmt: skip
        return np.stack(each, axis=1)

    def stands_clear(self, feet: FloatArray, poses: FloatArray) -> BoolArray:
        """Whether shanks are clear next to feet that stand at ``feet (K, 4, 3)`` [m]: ``(K,)``.

        Few points are looked at: the plan is looked at once more.
        """
        local, body = self.local(feet, poses), self.body(poses)
        out = np.ones(len(feet), dtype=np.bool_)
        for k, leg in enumerate(LEGS):
            angles = self.robot.legs[leg].inverse(local[:, k])
            out &= self._near_foot_clear(k, self.spheres.few_near_feet, angles, body)
        return out

    def clear(self, poses: FloatArray, joints: FloatArray) -> BoolArray:
        """Whether limbs and trunk are clear of the ground ``(K,)``.

        Args:
            poses: x, y, z, roll, pitch, yaw of the body centre ``(K, 6)``.
            joints: angles of the legs ``(K, 4, 3)`` [rad].
        """
        body = self.body(poses)
        kept = self._trunk(body)
        for leg in range(4):
            kept &= self._leg(leg, joints[:, leg], body)
        return kept

    def body(self, poses: FloatArray) -> Placements:
        """Where the body frame is."""
        turn = rpy_to_matrix(poses[:, 3:])
        return Placements(turn, poses[:, :3] - turn @ self.robot.centre)

    def _trunk(self, body: Placements) -> BoolArray:
        return self._are_clear(body.moved(self.spheres.trunk.centres), self.trunk_sizes)

    def _leg(self, leg: int, angles: FloatArray, body: Placements) -> BoolArray:
        """Whether the links of a leg with joint angles ``(N, 3)`` are clear of the ground."""
        links = self.spheres.placements(leg, angles, body)
        centres = [
            place.moved(balls.centres)
            for place, balls in zip(links, self.spheres.legs[leg], strict=True)
        ]
        return self._are_clear(np.concatenate(centres, axis=1), self.leg_sizes[leg])

    def _near_foot_clear(
        self, leg: int, points: Sequence[FloatArray], angles: FloatArray, body: Placements
    ) -> BoolArray:
        """Whether a shank, with points for each leg, is clear next to its foot ``(N,)``."""
        shank = self.spheres.placements(leg, angles, body)[-1]
        there = shank.moved(points[leg])
        above = there[..., 2] - self.surfaces.ground.height(there[..., :2])
        # A comparison with NaN, which is unknown ground, is false.
        return np.asarray((above >= CLEAR).all(axis=1))

    def _are_clear(self, centres: FloatArray, sizes: np.ndarray) -> BoolArray:
        """Whether all balls at ``centres (N, n, 3)`` [m] are clear of the ground ``(N,)``."""
        if not len(sizes):
            return np.ones(len(centres), dtype=np.bool_)
        gaps = centres[..., 2] - self.surfaces.clear_heights(centres[..., :2], sizes)
        return np.asarray(gaps.min(axis=1) >= self.clearance, dtype=np.bool_)
