"""Where a ball rests on the ground: exact, on a surface that is flat on each of its triangles.

The centre of a ball of radius ``r`` that rests at ``p`` is at the height::

    max over q with |q - p| <= r  of  h(q) + sqrt(r^2 - |q - p|^2)

where ``h`` is the height of the ground. On one triangle, and on one edge, this is the maximum of a
concave function, which has a formula. Lengths are in cells here: :meth:`gaitopt.HeightMap.ball` has
metres.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gaitopt.conventions import BoolArray, FloatArray

EDGE = 1e-9
"""How much nearer than the radius unknown ground must be before it counts, in cells: a place at
exactly the radius may come out nearer by rounding."""
CHUNK = 16_384
"""Places at a time: their arrays stay in the cache of a core."""

IndexArray = NDArray[np.int64]
_Corner = tuple[int, int]

_EDGES = (((0, 0), (1, 0)), ((0, 0), (0, 1)), ((0, 0), (1, 1)))
"""Edges of a cell from corner to corner; its two others belong to cells with higher indices."""
_TRIANGLES = (((0, 0), (1, 0), (1, 1)), ((0, 0), (1, 1), (0, 1)))


@dataclass(frozen=True, eq=False)
class BallContact:
    """Balls that rest on the ground; NaN where the ground within their radius is not known.

    Attributes:
        centres: of the balls ``(..., 3)`` [m].
        touches: where each touches the ground ``(..., 3)`` [m]; one of the points where there are
            several, as in a furrow.
        normals: from the ground to the centre, of the length 1 ``(..., 3)``.
    """

    centres: FloatArray
    touches: FloatArray
    normals: FloatArray


def resting_balls(
    z: FloatArray, resolution: float, origin: tuple[float, float], at: FloatArray, radius: float
) -> BallContact:
    """Balls of a radius above 0 [m] that rest on a map at places ``(..., 2)`` [m]."""
    flat = at.reshape(-1, 2)
    cells = (flat - origin) / resolution
    heights, touches = rest_balls(z / resolution, cells, radius / resolution)
    touches = touches * resolution + np.append(origin, 0.0)
    centres = np.column_stack([flat, heights * resolution])
    centres[np.isnan(heights)] = np.nan
    whole = (*at.shape[:-1], 3)
    centres, touches = centres.reshape(whole), touches.reshape(whole)
    return BallContact(centres, touches, (centres - touches) / radius)


def rest_balls(z: FloatArray, at: FloatArray, radius: float) -> tuple[FloatArray, FloatArray]:
    """Heights of the centres of balls ``(n,)``, and where the balls touch the ground ``(n, 3)``.

    Args:
        z: heights of the points of the grid ``(nx, ny)``, NaN where unknown.
        at: places of the centres ``(n, 2)``, where the grid's points are whole numbers.
        radius: of the balls, above 0.

    All lengths are in cells. NaN where a triangle nearer than the radius is unknown or off the map.
    """
    reach = int(np.ceil(radius))
    padded = np.pad(z, reach + 1, constant_values=np.nan)
    corners = np.stack([padded[:-1, :-1], padded[1:, :-1], padded[:-1, 1:], padded[1:, 1:]])
    tops = np.fmax.reduce(corners)
    unknown = np.asarray(np.isnan(corners).any(axis=0))
    centres, touches = np.full(len(at), np.nan), np.full((len(at), 3), np.nan)
    # Places that are no numbers, or farther than the ball from the map, stay NaN.
    near = ((at > -radius - 1.0) & (at < np.array(z.shape) + radius)).all(axis=1)
    for part in np.array_split(np.flatnonzero(near), near.sum() // CHUNK + 1):
        search = _Search(padded, tops, unknown, at[part] + (reach + 1), radius)
        for offset in _offsets(reach):
            search.visit(*offset)
        centres[part], touches[part] = search.result(reach + 1)
    return centres, touches


def _offsets(reach: int) -> Iterator[tuple[int, int]]:
    """Cells around a cell, the nearest first: most of the far ones need no work then."""
    steps = [(i, j) for i in range(-reach, reach + 1) for j in range(-reach, reach + 1)]
    yield from sorted(steps, key=lambda step: step[0] ** 2 + step[1] ** 2)


class _Search:
    """The highest support of some balls so far, while their cells are visited one after another."""

    def __init__(
        self, z: FloatArray, tops: FloatArray, unknown: BoolArray, at: FloatArray, radius: float
    ) -> None:
        self.z, self.tops, self.unknown, self.at, self.radius = z, tops, unknown, at, radius
        self.cell = np.clip(np.floor(at), 0, np.array(tops.shape) - 1).astype(np.int64)
        self.best = np.full(len(at), -np.inf)
        self.touch = np.full((len(at), 2), np.nan)
        self.blind = np.zeros(len(at), dtype=np.bool_)

    def visit(self, di: int, dj: int) -> None:
        """Take account of the cell at this offset from the cell of each place."""
        i, j = self.cell[:, 0] + di, self.cell[:, 1] + dj
        there = (i >= 0) & (j >= 0) & (i < self.tops.shape[0]) & (j < self.tops.shape[1])
        i, j = np.where(there, i, 0), np.where(there, j, 0)
        u, v = self.at[:, 0] - i, self.at[:, 1] - j
        across = np.maximum(np.maximum(-u, u - 1.0), 0.0) ** 2
        across += np.maximum(np.maximum(-v, v - 1.0), 0.0) ** 2
        left = self.radius**2 - across
        near = np.flatnonzero(there & (left >= 0.0))
        blind = near[self.unknown[i[near], j[near]] & ~self.blind[near]]
        if blind.size:
            self._look(blind, i[blind], j[blind], u[blind], v[blind])
        # What the highest corner of the cell could reach at most.
        most = self.tops[i[near], j[near]] + np.sqrt(left[near])
        here = near[most > self.best[near]]
        if here.size:
            self._support(here, i[here], j[here], u[here], v[here])

    def result(self, shift: int) -> tuple[FloatArray, FloatArray]:
        """Heights of the centres and points of contact, on the grid without its border."""
        known = ~self.blind & np.isfinite(self.best)
        down = np.sqrt(np.maximum(self.radius**2 - ((self.touch - self.at) ** 2).sum(axis=1), 0.0))
        touch = np.column_stack([self.touch - shift, self.best - down])
        touch[~known] = np.nan
        return np.where(known, self.best, np.nan), touch

    def _look(
        self, k: IndexArray, i: IndexArray, j: IndexArray, u: FloatArray, v: FloatArray
    ) -> None:
        """Whether the ball is over a triangle that is unknown."""
        for triangle in _TRIANGLES:
            corners = [self.z[i + a, j + b] for a, b in triangle]
            missing = np.isnan(corners).any(axis=0)
            nearer = _distance(u, v, triangle) < self.radius - EDGE
            self.blind[k[missing & nearer]] = True

    def _support(
        self, k: IndexArray, i: IndexArray, j: IndexArray, u: FloatArray, v: FloatArray
    ) -> None:
        """Raise the balls over the faces and edges of one cell each; ``u, v`` are within it."""
        z = {(a, b): self.z[i + a, j + b] for a in (0, 1) for b in (0, 1)}
        faces = [_on_face(z, u, v, lower, self.radius) for lower in (True, False)]
        edges = [_on_edge(z, u, v, start, end, self.radius) for start, end in _EDGES]
        for height, tu, tv in faces + edges:
            # A comparison with NaN is false.
            higher = height > self.best[k]
            who = k[higher]
            self.best[who] = height[higher]
            self.touch[who] = np.column_stack([(i + tu)[higher], (j + tv)[higher]])


def _on_face(
    z: Mapping[_Corner, FloatArray], u: FloatArray, v: FloatArray, lower: bool, radius: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Heights of balls on one triangle of a cell, and where they touch it; NaN where elsewhere."""
    if lower:
        along_u, along_v = z[1, 0] - z[0, 0], z[1, 1] - z[1, 0]
    else:
        along_u, along_v = z[1, 1] - z[0, 1], z[0, 1] - z[0, 0]
    stretch = np.sqrt(1.0 + along_u**2 + along_v**2)
    tu, tv = u + radius * along_u / stretch, v + radius * along_v / stretch
    low, high = (tv, tu) if lower else (tu, tv)
    inside = (low >= 0.0) & (low <= high) & (high <= 1.0)
    height = z[0, 0] + u * along_u + v * along_v + radius * stretch
    return np.where(inside, height, np.nan), tu, tv


def _on_edge(
    z: Mapping[_Corner, FloatArray], u: FloatArray, v: FloatArray,
    start: _Corner, end: _Corner, radius: float,
) -> tuple[FloatArray, FloatArray, FloatArray]:  # fmt: skip
    """Heights of balls on one edge of a cell or on its ends; NaN where it is out of reach."""
    length = float(np.hypot(end[0] - start[0], end[1] - start[1]))
    du, dv = (end[0] - start[0]) / length, (end[1] - start[1]) / length
    along, beside = (u - start[0]) * du + (v - start[1]) * dv, (u - start[0]) * dv
    beside = beside - (v - start[1]) * du
    slope = (z[end] - z[start]) / length
    # The ball cut by the upright plane through the edge is a circle, or nothing.
    left = np.maximum(radius**2 - beside**2, 0.0)
    at = np.clip(along + np.sqrt(left) * slope / np.sqrt(1.0 + slope**2), 0.0, length)
    rise = radius**2 - beside**2 - (along - at) ** 2
    height = z[start] + slope * at + np.sqrt(np.where(rise >= 0.0, rise, np.nan))
    return height, start[0] + at * du, start[1] + at * dv


def _distance(u: FloatArray, v: FloatArray, triangle: tuple[_Corner, ...]) -> FloatArray:
    """Horizontal distance of places from a triangle of a cell, 0 above it."""
    lower = triangle[1] == (1, 0)
    low, high = (v, u) if lower else (u, v)
    sides = []
    for start, end in zip(triangle, (*triangle[1:], triangle[0]), strict=True):
        du, dv = end[0] - start[0], end[1] - start[1]
        share = ((u - start[0]) * du + (v - start[1]) * dv) / (du**2 + dv**2)
        share = np.clip(share, 0.0, 1.0)
        sides.append(np.hypot(u - start[0] - share * du, v - start[1] - share * dv))
    inside = (low >= 0.0) & (low <= high) & (high <= 1.0)
    return np.where(inside, 0.0, np.minimum.reduce(sides))
