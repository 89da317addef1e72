"""Least distances of a robot's collision shapes at many poses at once, by boxes around them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from gaitopt.conventions import FloatArray
from gaitopt.robots.at_many_poses.chain import Chain, product, turned

PARALLEL = 1e-6
"""Sine of the angle between two directions below which they count as parallel."""


class Gaps(NamedTuple):
    """How far ``k`` pairs of shapes are apart at least, at ``N`` poses.

    Attributes:
        balls: between the balls around them at the nearest pose ``(k,)`` [m]; less where it is
            enough.
        near: numbers of the pairs that were looked at closer ``(n,)``.
        boxes: between the boxes around these at all poses ``(n, N)`` [m].
    """

    balls: FloatArray
    near: np.ndarray
    boxes: FloatArray


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
        """Rotations ``(3, 3, s, N)`` and centres ``(3, s, N)`` [m] of some boxes."""
        rotations, places = self.chain.rows_of_places(joints)
        own = rotations[:, :, self.joint[shapes]]
        centres = turned(own, self.centre[shapes].T[..., None]) + places[:, self.joint[shapes]]
        return product(own, np.moveaxis(self.turn[shapes], 0, 2)[..., None]), centres

    def least_gaps(
        self, joints: FloatArray, pairs: np.ndarray, enough: float = np.inf, close: float = 0.0
    ) -> FloatArray:
        """No pair is closer than this at any of some poses ``(k,)`` [m]: :meth:`gaps`."""
        found = self.gaps(joints, pairs, enough, close)
        least: FloatArray = found.balls.copy()
        least[found.near] = found.boxes.min(axis=1)
        return least

    def gaps(
        self, joints: FloatArray, pairs: np.ndarray, enough: float = np.inf, close: float = 0.0
    ) -> Gaps:
        """How far pairs of shapes are apart at least.

        It is the larger one of two distances: from the box of one shape to the sides of the other
        shape along that box's axes, and the same with the shapes exchanged. Where balls around
        the shapes, or around all of their places, are ``enough`` apart, it is a bound on their
        distance. Not a number where an angle is none.

        Args:
            joints: angles in Pinocchio's order ``(N, nj)`` [rad], ``N >= 1``.
            pairs: numbers of shapes ``(k, 2)``.
            enough: [m].
            close: where the distance is less, that across the longest sides of both boxes counts
                as well [m]. Links that cross are apart along this direction alone.
        """
        is_used = np.zeros(len(self.joint), dtype=np.bool_)
        is_used[pairs] = True
        used = np.flatnonzero(is_used)
        turns, centres = self._placed(joints, used)
        # Numbers among the used ones.
        ends = (np.cumsum(is_used) - 1)[pairs].T
        radii = self._radius[pairs].sum(axis=1)
        least = self._swept(centres, ends) - radii
        near = np.flatnonzero(~(least >= enough))
        between = centres[:, ends[1, near]] - centres[:, ends[0, near]]
        least[near] = np.sqrt(np.square(between).sum(axis=0).min(axis=1)) - radii[near]
        closer = ~(least[near] >= enough)
        near, between = near[closer], between[:, closer]
        (a, b), (first, second) = (turns[:, :, end[near]] for end in ends), pairs[near].T
        # |cosines| of the angles between the axes of the boxes ``(3, 3, k, N)``.
        cosines = np.abs(a[0][:, None] * b[0] + a[1][:, None] * b[1] + a[2][:, None] * b[2])
        one = self._squares(a, between, cosines, first, second)
        two = self._squares(b, between, cosines.swapaxes(0, 1), second, first)
        rounding = (self.rounding[first] + self.rounding[second])[:, None]
        boxes = np.sqrt(np.maximum(one, two)) - rounding
        pair, pose = np.nonzero(boxes < close)
        if len(pair):
            crossing = self._crossing(
                (a[:, :, pair, pose], b[:, :, pair, pose]), between[:, pair, pose],
                (first[pair], second[pair]),
            )  # fmt: skip
            boxes[pair, pose] = np.maximum(boxes[pair, pose], crossing)
        return Gaps(least, near, boxes)

    def _crossing(
        self, turns: tuple[FloatArray, FloatArray], between: FloatArray,
        shapes: tuple[np.ndarray, np.ndarray],
    ) -> FloatArray:  # fmt: skip
        """Distances across the longest sides of two boxes ``(m,)`` [m].

        Minus infinity where these sides are parallel.

        Args:
            turns: of the boxes, each ``(3, 3, m)``.
            between: from one centre to the other ``(3, m)`` [m].
            shapes: their numbers, each ``(m,)``.
        """
        every = np.arange(between.shape[1])
        one, other = (
            turn[:, self._longest[shape], every] for turn, shape in zip(turns, shapes, strict=True)
        )
        across = np.cross(one, other, axis=0)
        length = np.sqrt(np.square(across).sum(axis=0))
        parallel = length < PARALLEL
        across = across / np.where(parallel, 1.0, length)
        gap = np.abs((across * between).sum(axis=0))
        for turn, shape in zip(turns, shapes, strict=True):
            cosines = np.abs((turn * across[:, None]).sum(axis=0))
            gap -= (self.straight[shape].T * cosines).sum(axis=0) + self.rounding[shape]
            gap -= np.sqrt(np.maximum(1.0 - np.square(cosines[2]), 0.0)) * self.disc[shape]
        return np.where(parallel, -np.inf, gap)

    @cached_property
    def _radius(self) -> FloatArray:
        """Radius of the balls around the shapes ``(n,)`` [m]."""
        return np.asarray(np.linalg.norm(self.half, axis=1) + self.rounding)

    @cached_property
    def _longest(self) -> np.ndarray:
        """Number of the longest side of each box ``(n,)``."""
        return np.asarray(self.half.argmax(axis=1))

    @staticmethod
    def _swept(centres: FloatArray, ends: np.ndarray) -> FloatArray:
        """Distances of the boxes along the axes in which centres are at all poses ``(k,)`` [m].

        Args:
            centres: ``(3, s, N)`` [m].
            ends: numbers of the two of each pair ``(2, k)``.
        """
        low, high = centres.min(axis=2), centres.max(axis=2)
        first, second = ends
        apart = np.maximum(low[:, second] - high[:, first], low[:, first] - high[:, second])
        return np.asarray(np.sqrt(np.square(np.maximum(apart, 0.0)).sum(axis=0)))

    def _squares(
        self, turns: FloatArray, between: FloatArray, cosines: FloatArray,
        mine: np.ndarray, other: np.ndarray,
    ) -> FloatArray:  # fmt: skip
        """Squares of distances along the axes of the boxes ``mine`` ``(k, N)`` [m²].

        Args:
            turns: of these boxes ``(3, 3, k, N)``.
            between: from one centre to the other ``(3, k, N)`` [m].
            cosines: of angles between the axes of these and the other boxes ``(3, 3, k, N)``.
            mine, other: numbers of the shapes ``(k,)``.
        """
        gap = np.abs(turns[0] * between[0] + turns[1] * between[1] + turns[2] * between[2])
        gap -= self.half[mine].T[..., None]
        for axis in range(3):
            gap -= cosines[:, axis] * self.straight[other, axis, None]
        gap -= np.sqrt(np.maximum(1.0 - np.square(cosines[:, 2]), 0.0)) * self.disc[other, None]
        squares: FloatArray = np.square(np.maximum(gap, 0.0)).sum(axis=0)
        return squares
