"""Distances of many points from the convex hulls of up to four feet, all at once.

A line through two feet is a side of their hull where no other foot lies beyond it. So the sides are
found among twelve, two for each pair of feet, without an order of the feet. Three feet in one line,
and two feet, have two sides with opposite directions; the inside is then empty.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import permutations

import numpy as np

from gaitopt.conventions import BoolArray, FloatArray

ON_BORDER = 1e-9
"""Distance inside of a border that still counts as on it [m]."""
ON_LINE = 1e-12
"""How far beyond a side another foot may lie, times the side's length, that still counts as on it
[m^2]. A line that is taken for a side on top of others makes margins smaller, by some 1e-12 m."""


@dataclass(frozen=True, eq=False)
class Polygons:
    """The hulls of ``G`` sets of feet, with twelve candidates of sides each.

    Attributes:
        feet: all four feet of each set ``(G, 4, 2)`` [m].
        standing: which of them belong to the hull ``(G, 4)``.
        starts, along: begin of each candidate and the vector to its end ``(12, G, 2)`` [m].
        is_side: whether it is a side of the hull ``(12, G)``.
        outward: unit vectors away from the hull ``(12, G, 2)``; zero for what is no side.
    """

    feet: FloatArray
    standing: BoolArray
    starts: FloatArray
    along: FloatArray
    is_side: BoolArray
    outward: FloatArray

    @classmethod
    def of(cls, feet: FloatArray, standing: BoolArray) -> Polygons:
        """The hulls of standing feet."""
        pairs = list(permutations(range(4), 2))
        starts = np.stack([feet[:, i] for i, _ in pairs])
        along = np.stack([feet[:, j] for _, j in pairs]) - starts
        lengths = np.linalg.norm(along, axis=2)
        others = feet[None] - starts[:, :, None]
        beyond = along[..., 1, None] * others[..., 0] - along[..., 0, None] * others[..., 1]
        is_side = ~((beyond > ON_LINE) & standing).any(axis=2) & (lengths > 0.0)
        is_side &= np.stack([standing[:, i] & standing[:, j] for i, j in pairs])
        normals = np.stack([along[..., 1], -along[..., 0]], axis=2)
        scale = np.where(is_side, 1.0 / np.where(lengths > 0.0, lengths, 1.0), 0.0)
        return cls(feet, standing, starts, along, is_side, normals * scale[..., None])

    def outside(self, points: FloatArray, owner: np.ndarray) -> FloatArray:
        """Distances of points from their hulls, negative inside of them ``(..., P)`` [m].

        Args:
            points: ``(..., P, 2)`` [m].
            owner: whose hull counts for each of them ``(P,)``. Some foot must stand.
        """
        out = np.full(points.shape[:-1], -np.inf)
        for start, outward, is_side in zip(self.starts, self.outward, self.is_side, strict=True):
            offset = (start * outward).sum(axis=1)
            beyond = points[..., 0] * outward[owner, 0] + points[..., 1] * outward[owner, 1]
            beyond -= np.where(is_side, offset, np.inf)[owner]
            np.maximum(out, beyond, out=out)
        # On the border, too: it is all there is of hulls without inside, and of longer lines.
        place = np.nonzero(~(out < -ON_BORDER) | np.isneginf(out))
        if place[0].size:
            out[place] = self._nearest(points[place], owner[place[-1]])
        return out

    def _nearest(self, points: FloatArray, owner: np.ndarray) -> FloatArray:
        """Distances of points ``(N, 2)`` outside their hulls from the sides, or a single foot."""
        foot = self.feet[owner, self.standing.argmax(axis=1)[owner]]
        sides = self.is_side[:, owner]
        nearest = np.linalg.norm(points - foot, axis=1)
        nearest[sides.any(axis=0)] = np.inf
        for start, along, is_side in zip(self.starts, self.along, sides, strict=True):
            away, side = points - start[owner], along[owner]
            length = np.maximum((side**2).sum(axis=1), np.finfo(float).tiny)
            share = np.clip((away * side).sum(axis=1) / length, 0.0, 1.0)
            gap = np.linalg.norm(away - share[:, None] * side, axis=1)
            # NaN stays NaN.
            nearest = np.where(is_side, np.minimum(nearest, gap), nearest)
        return np.asarray(nearest)
