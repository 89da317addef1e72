"""The surface of a height map, with exact distances: the certificate's own geometry.

Planners have theirs in :mod:`gaitopt.terrain`. Shared is what a map is: heights at the points of a
grid, and each cell between four of them divided by the diagonal from its lowest x and y.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from pinocchio import coal

from gaitopt.certificate.ground.block_maxima import BlockMaxima
from gaitopt.certificate.ground.solids import Solid
from gaitopt.certificate.ground.unknown import Footprints, over_cells
from gaitopt.conventions import BoolArray, FloatArray
from gaitopt.terrain.height_map import HeightMap

ON_EDGE = 1e-9
"""How far outside of a triangle a point counts as inside, and how far a place may lie off the map,
as a share of a cell: rounding of places 1 km away is a hundredth of it."""
AT_ONCE = 400_000
"""Most cells that are looked at in one call of NumPy: some 100 MB."""


class Nearest(NamedTuple):
    """The nearest points of the ground.

    Attributes:
        distances: to the ground, negative below it ``(N,)`` [m]; not more than was asked for.
        points: the nearest points of it ``(N, 3)`` [m]; NaN where none is near enough.
    """

    distances: FloatArray
    points: FloatArray


@dataclass(frozen=True, eq=False)
class Surface:
    """A part of a height map.

    Attributes:
        z: heights ``(nx, ny)`` [m]; NaN where unknown.
        resolution: distance between neighbouring points [m].
        origin: x and y of ``z[0, 0]`` ``(2,)`` [m].
        cut_short: whether the map ends where more of it was asked for.
    """

    z: FloatArray
    resolution: float
    origin: FloatArray
    cut_short: bool

    @classmethod
    def around(cls, ground: HeightMap, low: FloatArray, high: FloatArray) -> Surface:
        """The part of a map between two corners ``(2,)`` [m], as far as it goes."""
        origin, most = np.array(ground.origin), np.array(ground.z.shape) - 1
        first = np.clip(np.floor((low - origin) / ground.resolution) - 1, 0, most - 1).astype(int)
        last = np.clip(np.ceil((high - origin) / ground.resolution) + 1, first + 1, most)
        end = last.astype(int) + 1
        z = ground.z[first[0] : end[0], first[1] : end[1]]
        ends = origin + ground.resolution * most
        short = not ((low >= origin).all() and (high <= ends).all())
        return cls(z, ground.resolution, origin + ground.resolution * first, short)

    @cached_property
    def _maxima(self) -> BlockMaxima:
        return BlockMaxima.of(np.where(np.isnan(self.z), np.inf, self.z))

    @property
    def top(self) -> float:
        """Height of the highest point; infinite where some are unknown or missing [m]."""
        return np.inf if self.cut_short else float(self._maxima.levels[0].max())

    def highest(self, low: FloatArray, high: FloatArray) -> FloatArray:
        """Upper bound on the height of the ground under rectangles ``(N,)`` [m].

        Infinite where ground under a rectangle, or in a cell that it touches, is unknown or off
        the map.

        Args:
            low, high: corners of the rectangles ``(N, 2)`` [m].
        """
        first = np.floor((low - self.origin) / self.resolution + ON_EDGE)
        last = np.ceil((high - self.origin) / self.resolution - ON_EDGE)
        most = np.array(self.z.shape) - 1
        # A comparison with NaN is false.
        inside = ((first >= 0) & (last <= most)).all(axis=1)
        out = np.full(len(low), np.inf)
        begin = np.minimum(first[inside].astype(int), most - 1)
        end = np.maximum(last[inside].astype(int), begin + 1)
        out[inside] = self._maxima.over(begin, end + 1)
        return out

    def unknown_under(self, boxes: Footprints) -> BoolArray:
        """Whether ground under boxes is unknown, or off the map ``(N,)``."""
        most = np.array(self.z.shape) - 1
        reach = np.abs(boxes.axes).sum(axis=1) + boxes.margins[:, None]
        low = (boxes.middles - reach - self.origin) / self.resolution
        high = (boxes.middles + reach - self.origin) / self.resolution
        off = ((low < -ON_EDGE) | (high > most + ON_EDGE)).any(axis=1)
        dark = np.isnan(self.z)
        cells = dark[:-1, :-1] | dark[1:, :-1] | dark[:-1, 1:] | dark[1:, 1:]
        return np.asarray(off | over_cells(boxes, cells, self.resolution, self.origin))

    def heights(self, places: FloatArray) -> FloatArray:
        """Height of the ground at places ``(N, 2)`` [m]; NaN off the map and where unknown."""
        at = (places - self.origin) / self.resolution
        most = np.array(self.z.shape) - 1
        inside = ((at >= -ON_EDGE) & (at <= most + ON_EDGE)).all(axis=1)
        out = np.full(len(places), np.nan)
        cell = np.clip(np.floor(at[inside]).astype(int), 0, most - 1)
        i, j = cell.T
        u, v = np.clip(at[inside] - cell, 0.0, 1.0).T
        z00, z11 = self.z[i, j], self.z[i + 1, j + 1]
        below, above = self.z[i + 1, j], self.z[i, j + 1]
        lower = (1.0 - u) * z00 + (u - v) * below + v * z11
        upper = (1.0 - v) * z00 + (v - u) * above + u * z11
        out[inside] = np.where(u >= v, lower, upper)
        return out

    def nearest(self, points: FloatArray, reach: float) -> Nearest:
        """The nearest points of the ground, exactly.

        Distances are negative for points below the ground. Unknown ground is nowhere near.

        Args:
            points: from which ``(N, 3)`` [m].
            reach: farthest distance that is of interest [m]; larger ones are told as this.
        """
        cells = int(np.ceil(2.0 * reach / self.resolution)) + 1
        many = max(AT_ONCE // cells**2, 1)
        parts = [
            self._nearest(points[k : k + many], reach, cells) for k in range(0, len(points), many)
        ]
        if not parts:
            return Nearest(np.empty(0), np.empty((0, 3)))
        distances, places = (np.concatenate(each) for each in zip(*parts, strict=True))
        under = points[:, 2] < self.heights(points[:, :2])
        return Nearest(np.where(under, -distances, distances), places)

    def _nearest(self, points: FloatArray, reach: float, cells: int) -> Nearest:
        corners = self._corners_near(points, reach, cells)
        away = np.concatenate([_on_faces(corners, self.resolution), _on_edges(corners)], axis=1)
        lengths = np.linalg.norm(away, axis=2)
        lengths = np.where(np.isnan(lengths), np.inf, lengths)
        rows = np.arange(len(points))
        best = lengths.argmin(axis=1)
        least = lengths[rows, best]
        places = np.where((least <= reach)[:, None], points + away[rows, best], np.nan)
        return Nearest(np.minimum(least, reach), places)

    def distances(self, points: FloatArray, reach: float) -> FloatArray:
        """Distances of points ``(N, 3)`` to the ground; see :meth:`nearest` ``(N,)`` [m]."""
        return self.nearest(points, reach).distances

    def gap(self, solid: Solid, rotation: FloatArray, origin: FloatArray) -> float:
        """Distance of a solid to the known ground, negative where it reaches into it [m].

        Args:
            solid: the solid.
            rotation, origin: of its joint's frame ``(3, 3)`` and ``(3,)``.
        """
        found = float(
            coal.distance(
                solid.shape, solid.transform(rotation, origin), self.solid, coal.Transform3s(),
                coal.DistanceRequest(), coal.DistanceResult(),
            )
        )  # fmt: skip
        # The mesh is a skin: what lies wholly below it is away from it as well.
        middle = rotation @ solid.centre + origin
        return -abs(found) if middle[2] < self.heights(middle[None, :2])[0] else found

    def contacts(self, point: FloatArray, reach: float) -> FloatArray:
        """From a point to its nearest point of every face and edge within a reach ``(k, 3)`` [m].

        Args:
            point: from which ``(3,)`` [m].
            reach: how far they may be away [m].
        """
        cells = int(np.ceil(2.0 * reach / self.resolution)) + 1
        corners = self._corners_near(point[None], reach, cells)
        away = np.concatenate([_on_faces(corners, self.resolution), _on_edges(corners)], axis=1)[0]
        return np.asarray(away[np.linalg.norm(away, axis=1) <= reach])

    def _corners_near(self, points: FloatArray, reach: float, cells: int) -> FloatArray:
        """From points to those of the grid that are near ``(N, cells + 1, cells + 1, 3)`` [m]."""
        first = np.floor((points[:, :2] - reach - self.origin) / self.resolution)
        # Points far off the map, or no numbers, have nothing near them.
        first = np.clip(np.nan_to_num(first), -(cells + 2), max(self.z.shape) + 2).astype(int)
        steps = np.arange(cells + 1)
        i, j = (first[:, k, None] + steps for k in (0, 1))
        x = self.origin[0] + self.resolution * i - points[:, :1]
        y = self.origin[1] + self.resolution * j - points[:, 1:2]
        (nx, ny), row, column = self.z.shape, i[:, :, None], j[:, None, :]
        inside = (row >= 0) & (row < nx) & (column >= 0) & (column < ny)
        z = self.z[np.clip(row, 0, nx - 1), np.clip(column, 0, ny - 1)]
        z = np.where(inside, z, np.nan) - points[:, 2, None, None]
        return np.stack(np.broadcast_arrays(x[:, :, None], y[:, None, :], z), axis=-1)

    @cached_property
    def solid(self) -> Any:
        """The known triangles as a mesh of coal's, in the world."""
        corners, triangles = self.triangles()
        used, numbers = np.unique(triangles, return_inverse=True)
        mesh = coal.BVHModelOBBRSS()
        mesh.beginModel(len(triangles), len(used))
        mesh.addVertices(np.ascontiguousarray(corners[used]))
        mesh.addTriangles(numbers.reshape(-1, 3).astype(np.int32))
        mesh.endModel()
        return mesh

    def triangles(self) -> tuple[FloatArray, np.ndarray]:
        """Points of the grid ``(n, 3)`` [m], and those of each known triangle ``(m, 3)``."""
        nx, ny = self.z.shape
        i, j = np.meshgrid(np.arange(nx), np.arange(ny), indexing="ij")
        x, y = self.origin[0] + self.resolution * i, self.origin[1] + self.resolution * j
        corners = np.stack([x, y, self.z], axis=-1).reshape(-1, 3)
        a = (i * ny + j)[:-1, :-1].ravel()
        faces = np.concatenate([
            np.stack([a, a + ny, a + ny + 1], axis=1), np.stack([a, a + ny + 1, a + 1], axis=1)
        ])  # fmt: skip
        known: BoolArray = ~np.isnan(corners[faces, 2]).any(axis=1)
        return corners, faces[known]


def _on_faces(corners: FloatArray, size: float) -> FloatArray:
    """Where perpendiculars from the origin meet the faces ``(N, 2 * cells^2, 3)``; else NaN.

    Args:
        corners: of a grid, seen from the origin ``(N, n, n, 3)``.
        size: length of a cell.
    """
    low, high = corners[:, :-1, :-1], corners[:, 1:, 1:]
    found = []
    for below in (True, False):
        third = (corners[:, 1:, :-1] if below else corners[:, :-1, 1:])[..., 2]
        ahead, aside = (third - low[..., 2]) / size, (high[..., 2] - third) / size
        slope_x, slope_y = (ahead, aside) if below else (aside, ahead)
        level = low[..., 2] - slope_x * low[..., 0] - slope_y * low[..., 1]
        share = level / (1.0 + slope_x**2 + slope_y**2)
        foot = np.stack([-slope_x * share, -slope_y * share, share], axis=-1)
        u, v = ((foot[..., k] - low[..., k]) / size for k in (0, 1))
        small, large = (v, u) if below else (u, v)
        inside = (small >= -ON_EDGE) & (large <= 1.0 + ON_EDGE) & (large - small >= -ON_EDGE)
        found.append(np.where(inside[..., None], foot, np.nan).reshape(len(corners), -1, 3))
    return np.concatenate(found, axis=1)


def _on_edges(corners: FloatArray) -> FloatArray:
    """The points of all edges of a grid that are nearest to the origin ``(N, edges, 3)``."""
    found = []
    for start, end in (
        (corners[:, :-1], corners[:, 1:]),
        (corners[:, :, :-1], corners[:, :, 1:]),
        (corners[:, :-1, :-1], corners[:, 1:, 1:]),
    ):
        edge = end - start
        share = -(start * edge).sum(axis=-1) / (edge**2).sum(axis=-1)
        point = start + np.clip(share, 0.0, 1.0)[..., None] * edge
        found.append(point.reshape(len(corners), -1, 3))
    return np.concatenate(found, axis=1)
