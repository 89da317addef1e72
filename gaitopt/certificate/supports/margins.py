"""How deep a moving point lies within the polygon of the standing feet, at every instant.

At first one polygon stands for a whole phase, and whatever its feet move is taken off all of the
phase's margins. That is quick, and enough where margins are larger than they have to be. Where a
margin is short of what is asked, and no sample says so, each piece gets the polygon of its own
feet, and is cut further until a bound or a sample settles it.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np

from gaitopt.certificate.closer import looked_at_closely
from gaitopt.certificate.supports.polygons import Polygons
from gaitopt.certificate.trace import Motion
from gaitopt.conventions import BoolArray, FloatArray
from gaitopt.plan.plan import Plan


class Point(Protocol):
    """A point that the body moves."""

    def __call__(self, motion: Motion, owner: np.ndarray, /) -> tuple[FloatArray, FloatArray]:
        """Places at both ends of pieces ``(2, P, 2)`` or ``(2, P, 3)``, and bounds ``(P,)`` [m].

        A bound says how far the point leaves the chord between the two places.

        Args:
            motion: pieces, or parts of pieces.
            owner: the pieces of the whole motion that they belong to ``(P,)``.
        """


def margins(
    plan: Plan, motion: Motion, point: Point, asked: FloatArray, in_flight: float
) -> FloatArray:
    """Lower bound of a point's margin on every piece ``(P,)`` [m].

    The signed distance from a convex polygon is a convex function along a chord, so it is largest
    at one of the chord's ends.

    Args:
        plan: the motion's plan.
        motion: the motion.
        point: the moving point.
        asked: the margin that is asked for on each piece ``(P,)``; where a bound is below it, it is
            looked at closely.
        in_flight: the margin where no foot stands [m].
    """
    out = _by_phase(motion, *point(motion, np.arange(len(motion.phase))), in_flight)
    short = np.flatnonzero((out < asked) & motion.standing.any(axis=1))
    if not len(short):
        return out

    def look(part: Motion, owner: np.ndarray) -> tuple[FloatArray, BoolArray]:
        bounds, samples = _by_piece(part, *point(part, owner))
        # A sample that is short settles a piece.
        return bounds, np.asarray((bounds < asked[owner]) & (samples >= asked[owner]))

    out[short] = np.maximum(out[short], looked_at_closely(plan, motion, short, look))
    return out


def _by_phase(
    motion: Motion, points: FloatArray, deviations: FloatArray, in_flight: float
) -> FloatArray:
    """Lower bounds with the polygon of the feet at the start of each phase ``(P,)`` [m]."""
    _, first, owner = np.unique(motion.phase, return_index=True, return_inverse=True)
    feet, standing = motion.feet[0, first][..., :2], motion.standing[first]
    stands = standing.any(axis=1)
    moved = np.linalg.norm(motion.feet[..., :2] - feet[owner], axis=-1).max(axis=0)
    most = np.zeros(len(first))
    np.maximum.at(most, owner, np.where(motion.standing, moved, 0.0).max(axis=1))
    shift = most[owner] + np.where(motion.standing, motion.feet_deviation, 0.0).max(axis=1)
    on_ground = np.flatnonzero(np.asarray(stands)[owner])
    outside = Polygons.of(feet, standing).outside(points[:, on_ground, :2], owner[on_ground])
    out = np.full(len(deviations), in_flight)
    out[on_ground] = -outside.max(axis=0) - deviations[on_ground] - shift[on_ground]
    return out


def _by_piece(
    motion: Motion, points: FloatArray, deviations: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Lower bounds of margins on pieces, and the least of the margins at their ends ``(P,)`` [m].

    The bounds are about the polygon of each piece's feet at its start.
    """
    count = np.arange(len(deviations))
    samples = np.stack([
        -Polygons.of(feet[..., :2], motion.standing).outside(place[:, :2], count)
        for feet, place in zip(motion.feet, points, strict=True)
    ]).min(axis=0)  # fmt: skip
    moved = np.linalg.norm((motion.feet[1] - motion.feet[0])[..., :2], axis=-1)
    shift = np.where(motion.standing, moved + motion.feet_deviation, 0.0).max(axis=1)
    start = Polygons.of(motion.feet[0, ..., :2], motion.standing)
    inside = -start.outside(points[..., :2], count).max(axis=0)
    return inside - deviations - shift, samples
