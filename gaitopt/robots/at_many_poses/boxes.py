"""Least distances of a robot's collision shapes at many poses at once, by boxes around them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.robots.at_many_poses.chain import Chain


@dataclass(frozen=True, eq=False)
class ShapeBoxes:
    """Boxes around the shapes of a robot, in the frames of the joints that move them.

    A ball is a point with a radius. A cylinder is its axis with a disc across it, since the box
    around it would turn with it.

    Attributes:
        chain: of the robot's joints.
        joint: numbers of the joints that move the shapes ``(n,)``.
        turn: of the boxes ``(n, 3, 3)``.
        centre: ``(n, 3)`` [m].
        half: half of the sides of the boxes ``(n, 3)`` [m].
        straight: of ``half``, what is no disc ``(n, 3)`` [m].
        disc: radius of the disc across the third axis ``(n,)`` [m].
        rounding: radius of balls ``(n,)`` [m].
    """

    chain: Chain
    joint: np.ndarray
    turn: FloatArray
    centre: FloatArray
    half: FloatArray
    straight: FloatArray
    disc: FloatArray
    rounding: FloatArray

    @classmethod
    def of(cls, model: Any, geometry: Any) -> ShapeBoxes | None:
        """The boxes around the shapes of a geometry model; ``None`` where a joint is no hinge."""
        from pinocchio import coal

        chain = Chain.of(model)
        if chain is None:
            return None
        shapes = list(geometry.geometryObjects)
        half, centre = np.zeros((len(shapes), 3)), np.zeros((len(shapes), 3))
        disc, rounding = np.zeros(len(shapes)), np.zeros(len(shapes))
        for k, shape in enumerate(shapes):
            solid = shape.geometry
            solid.computeLocalAABB()
            box = solid.aabb_local
            centre[k] = shape.placement.act((box.max_ + box.min_) / 2.0)
            half[k] = (box.max_ - box.min_) / 2.0
            if isinstance(solid, coal.Sphere):
                half[k], rounding[k] = 0.0, solid.radius
            elif isinstance(solid, coal.Cylinder):
                disc[k] = solid.radius
        across = np.outer(disc, [1.0, 1.0, 0.0])
        turn = np.array([shape.placement.rotation for shape in shapes]).reshape(-1, 3, 3)
        joint = np.array([int(shape.parentJoint) for shape in shapes], dtype=int)
        straight = np.where(across > 0.0, 0.0, half)
        return cls(chain, joint, turn, centre, half, straight, disc, rounding)

    def _placed(self, joints: FloatArray, shapes: np.ndarray) -> tuple[FloatArray, FloatArray]:
        """Rotations ``(3, 3, N, s)`` and centres ``(3, N, s)`` [m] of some boxes."""
        rotations, places = self.chain.places(joints)
        moved = self.joint[shapes]
        own = rotations[:, moved]
        centres = (own @ self.centre[shapes, :, None])[..., 0] + places[:, moved]
        turns = np.moveaxis(own @ self.turn[shapes], (2, 3), (0, 1))
        return np.ascontiguousarray(turns), np.ascontiguousarray(np.moveaxis(centres, 2, 0))

    def least_gaps(
        self, joints: FloatArray, pairs: np.ndarray, enough: float = np.inf
    ) -> FloatArray:
        """No pair is closer than this at any of some poses ``(k,)`` [m].

        It is the larger one of two distances: from the box of one shape to the sides of the other
        shape along that box's axes, and the same with the shapes exchanged. Where balls around
        the shapes are ``enough`` apart, it is their distance. Not a number where an angle is none.

        Args:
            joints: angles in Pinocchio's order ``(N, nj)`` [rad], ``N >= 1``.
            pairs: numbers of shapes ``(k, 2)``.
            enough: [m].
        """
        used, numbers = np.unique(pairs, return_inverse=True)
        turns, centres = self._placed(joints, used)
        places = numbers.reshape(-1, 2)
        between = centres[..., places[:, 1]] - centres[..., places[:, 0]]
        radii = np.linalg.norm(self.half, axis=1) + self.rounding
        least: FloatArray = np.sqrt(np.square(between).sum(axis=0).min(axis=0)) - radii[pairs].sum(
            axis=1
        )
        near = ~(least >= enough)
        (a, b), (first, second) = (turns[..., places[near].T[k]] for k in (0, 1)), pairs[near].T
        # |cosines| of the angles between the axes of the boxes ``(3, 3, N, k)``.
        cosines = np.abs(a[0][:, None] * b[0] + a[1][:, None] * b[1] + a[2][:, None] * b[2])
        one = self._squares(a, between[..., near], cosines, first, second)
        two = self._squares(b, between[..., near], cosines.swapaxes(0, 1), second, first)
        least[near] = np.sqrt(np.maximum(one, two).min(axis=0))
        least[near] -= self.rounding[first] + self.rounding[second]
        return least

    def _squares(
        self, turns: FloatArray, between: FloatArray, cosines: FloatArray,
        mine: np.ndarray, other: np.ndarray,
    ) -> FloatArray:  # fmt: skip
        """Squares of distances along the axes of the boxes ``mine`` ``(N, k)`` [m²].

        Args:
            turns: of these boxes ``(3, 3, N, k)``.
            between: from one centre to the other ``(3, N, k)`` [m].
            cosines: of angles between the axes of these and the other boxes ``(3, 3, N, k)``.
            mine, other: numbers of the shapes ``(k,)``.
        """
        gap = np.abs(turns[0] * between[0] + turns[1] * between[1] + turns[2] * between[2])
        gap -= self.half[mine].T[:, None]
        for axis in range(3):
            gap -= cosines[:, axis] * self.straight[other, axis]
        gap -= np.sqrt(np.maximum(1.0 - np.square(cosines[:, 2]), 0.0)) * self.disc[other]
        squares: FloatArray = np.square(np.maximum(gap, 0.0)).sum(axis=0)
        return squares
