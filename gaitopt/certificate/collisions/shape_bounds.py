"""Lower bounds on the distances of many pairs of shapes at once.

Each shape lies within a box with rounded edges. Two convex bodies are at least as far apart as
their shadows on any line are. So a direction need only be a good guess, and whatever it is, the
bound holds; the guess is the direction between the nearest points of the boxes' longest axes.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from pinocchio import coal

from gaitopt.certificate.placements import Placements, times
from gaitopt.conventions import FloatArray


@dataclass(frozen=True, eq=False)
class RoundedBoxes:
    """Boxes around ``S`` shapes at ``U`` samples.

    Attributes:
        centres: ``(S, U, 3)`` [m].
        sides: vectors from the centre to the middles of three faces, of the box without its
            rounding, as columns ``(S, U, 3, 3)`` [m].
        longest: the longest one of them ``(S, U, 3)`` [m].
        roundings: radii of the balls that the boxes are rounded with ``(S,)`` [m].
    """

    centres: FloatArray
    sides: FloatArray
    longest: FloatArray
    roundings: FloatArray

    @classmethod
    def of(cls, shapes: list[Any], placed: Placements) -> RoundedBoxes:
        """The boxes around Pinocchio's geometry objects."""
        samples = len(placed.origins[1])
        centres, sides = np.empty((len(shapes), samples, 3)), np.empty((len(shapes), samples, 3, 3))
        longest = np.empty((len(shapes), samples, 3))
        roundings = np.empty(len(shapes))
        for s, shape in enumerate(shapes):
            centre, half, roundings[s] = rounded_box(shape.geometry)
            joint = int(shape.parentJoint)
            centres[s] = placed.points(joint, shape.placement.act(centre))
            sides[s] = times(placed.rotations[joint], shape.placement.rotation * half)
            longest[s] = sides[s, :, :, int(np.argmax(half))]
        return cls(centres, sides, longest, roundings)

    def apart(
        self, first: np.ndarray, second: np.ndarray, samples: np.ndarray
    ) -> tuple[FloatArray, FloatArray]:
        """Lower and upper bounds on the distances of shapes ``(N,)`` [m]; below 0 nothing is known.

        Args:
            first, second: numbers of the shapes ``(N,)``.
            samples: at which they are looked at ``(N,)``.
        """
        between = self.centres[first, samples] - self.centres[second, samples]
        one, other = self.longest[first, samples], self.longest[second, samples]
        away = between + nearest_on_lines(between, one, other)
        most = np.sqrt(dot(away, away))
        direction = away / np.maximum(most, 1e-12)[:, None]
        found = dot(between, direction) - self.roundings[first] - self.roundings[second]
        for shape in (first, second):
            reach = np.einsum("ni,nik->nk", direction, self.sides[shape, samples])
            found -= np.abs(reach).sum(axis=1)
        return np.asarray(found), most


def rounded_box(geometry: Any) -> tuple[FloatArray, FloatArray, float]:
    """Centre ``(3,)``, halves of the sides ``(3,)`` and rounding of a box around one of coal's
    shapes, in the shape's own frame [m]."""
    if isinstance(geometry, coal.Sphere):
        return np.zeros(3), np.zeros(3), float(geometry.radius)
    if isinstance(geometry, (coal.Cylinder, coal.Capsule)):
        half = np.array([0.0, 0.0, float(geometry.halfLength)])
        return np.zeros(3), half, float(geometry.radius)
    geometry.computeLocalAABB()
    low, high = np.array(geometry.aabb_local.min_), np.array(geometry.aabb_local.max_)
    return (low + high) / 2.0, (high - low) / 2.0, 0.0


def nearest_on_lines(between: FloatArray, one: FloatArray, other: FloatArray) -> FloatArray:
    """``s one - t other``, with ``s`` and ``t`` within -1 and 1, that about ends ``-between``.

    Args:
        between: from the middles of second lines to those of first ones ``(N, 3)`` [m].
        one, other: halves of the lines, as vectors from their middles ``(N, 3)`` [m].

    The distance is a convex quadratic of both. It is minimised over ``s``, then ``t``, then ``s``.
    """
    aa, bb, ab = dot(one, one), dot(other, other), dot(one, other)
    a, b = dot(between, one), dot(between, other)
    s = np.clip((ab * b - a * bb) / np.maximum(aa * bb - ab**2, 1e-18), -1.0, 1.0)
    t = np.clip((ab * s + b) / np.maximum(bb, 1e-18), -1.0, 1.0)
    s = np.clip((ab * t - a) / np.maximum(aa, 1e-18), -1.0, 1.0)
    return np.asarray(s[:, None] * one - t[:, None] * other)


def dot(one: FloatArray, other: FloatArray) -> FloatArray:
    """Products of vectors ``(N, 3)`` and ``(N, 3)``: ``(N,)``."""
    return np.asarray(np.einsum("ni,ni->n", one, other))
