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
from gaitopt.certificate.ground.nearest_points import ON_EDGE, on_edges, on_faces
from gaitopt.certificate.ground.solids import Solid
from gaitopt.certificate.ground.unknown import Footprints, over_cells
from gaitopt.conventions import BoolArray, FloatArray
from gaitopt.terrain.height_map import HeightMap

SMALL = 200_000
"""Points of a map up to which all of its triangles are used: 8 m by 10 m of a map of 2 cm. Chosen:
their mesh takes a second."""
REACH = 0.05
"""How far beyond a foot's radius the ground is looked for [m]. Chosen: far above all limits."""
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
        near: points that are near enough for their triangles to matter ``(nx, ny)``.
    """

    z: FloatArray
    resolution: float
    origin: FloatArray
    cut_short: bool
    near: BoolArray

    @classmethod
    def around(cls, ground: HeightMap, places: FloatArray, far: float) -> Surface:
        """The part of a map that lies around places, as far as it goes.

        Args:
            ground: the map.
            places: seen from above ``(N, 2)`` [m].
            far: how far from them the ground matters [m].
        """
        low, high = places.min(axis=0) - far, places.max(axis=0) + far
        origin, most = np.array(ground.origin), np.array(ground.z.shape) - 1
        first = np.clip(np.floor((low - origin) / ground.resolution) - 1, 0, most - 1).astype(int)
        last = np.clip(np.ceil((high - origin) / ground.resolution) + 1, first + 1, most)
        end = last.astype(int) + 1
        z = ground.z[first[0] : end[0], first[1] : end[1]]
        ends = origin + ground.resolution * most
        short = not ((low >= origin).all() and (high <= ends).all())
        begin = origin + ground.resolution * first
        near = _near(z.shape, (places - begin) / ground.resolution, far / ground.resolution)
        return cls(z, ground.resolution, begin, short, near)

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
        # Rows of coordinates are faster than pairs of them: (2, N).
        origin = self.origin[:, None]
        first = np.floor((low.T - origin) / self.resolution + ON_EDGE)
        last = np.ceil((high.T - origin) / self.resolution - ON_EDGE)
        most = np.array(self.z.shape)[:, None] - 1
        # A comparison with NaN is false.
        inside = (first[0] >= 0) & (first[1] >= 0) & (last[0] <= most[0]) & (last[1] <= most[1])
        out = np.full(len(low), np.inf)
        begin = np.minimum(first[:, inside].astype(int), most - 1)
        end = np.maximum(last[:, inside].astype(int), begin + 1)
        out[inside] = self._maxima.over(begin.T, end.T + 1)
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
        away = np.concatenate([on_faces(corners, self.resolution), on_edges(corners)], axis=1)
        lengths = np.linalg.norm(away, axis=2)
        lengths = np.where(np.isnan(lengths), np.inf, lengths)
        rows = np.arange(len(points))
        best = lengths.argmin(axis=1)
        least = lengths[rows, best]
        places = np.where((least <= reach)[:, None], points + away[rows, best], np.nan)
        return Nearest(np.minimum(least, reach), places)

    def off(self, middles: FloatArray, radius: float) -> FloatArray:
        """How far balls are from touching the ground; infinite where it is unknown ``(N,)`` [m]."""
        near = self.nearest(middles, radius + REACH)
        known = ~np.isnan(self.heights(middles[:, :2]))
        known &= ~np.isnan(self.heights(near.points[:, :2]))
        return np.where(known, np.abs(near.distances - radius), np.inf)

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

    def contacts(self, points: FloatArray, reaches: FloatArray) -> list[FloatArray]:
        """From points to their nearest points of every face and edge within a reach [m].

        Args:
            points: from which ``(N, 3)`` [m].
            reaches: how far these may be away ``(N,)`` [m].

        Returns:
            For each point ``(k, 3)``.
        """
        reach = float(reaches.max(initial=0.0))
        cells = int(np.ceil(2.0 * reach / self.resolution)) + 1
        many, out = max(AT_ONCE // cells**2, 1), []
        for k in range(0, len(points), many):
            corners = self._corners_near(points[k : k + many], reach, cells)
            away = np.concatenate([on_faces(corners, self.resolution), on_edges(corners)], axis=1)
            near = np.linalg.norm(away, axis=2) <= reaches[k : k + many, None]
            out += [each[mine] for each, mine in zip(away, near, strict=True)]
        return out

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
        """The triangles that are known and near as a mesh of coal's, in the world."""
        corners, triangles = self.triangles()
        used, numbers = np.unique(triangles, return_inverse=True)
        mesh = coal.BVHModelOBBRSS()
        mesh.beginModel(len(triangles), len(used))
        mesh.addVertices(np.ascontiguousarray(corners[used]))
        mesh.addTriangles(numbers.reshape(-1, 3).astype(np.int32))
        mesh.endModel()
        return mesh

    def triangles(self) -> tuple[FloatArray, np.ndarray]:
        """Points of the grid ``(n, 3)`` [m]; the triangles that are known and near ``(m, 3)``."""
        nx, ny = self.z.shape
        i, j = np.meshgrid(np.arange(nx), np.arange(ny), indexing="ij")
        x, y = self.origin[0] + self.resolution * i, self.origin[1] + self.resolution * j
        corners = np.stack([x, y, self.z], axis=-1).reshape(-1, 3)
        a = (i * ny + j)[:-1, :-1].ravel()
        faces = np.concatenate([
            np.stack([a, a + ny, a + ny + 1], axis=1), np.stack([a, a + ny + 1, a + 1], axis=1)
        ])  # fmt: skip
        used = (self.near & ~np.isnan(self.z)).ravel()
        return corners, faces[used[faces].all(axis=1)]


def _near(shape: tuple[int, ...], places: FloatArray, far: float) -> BoolArray:
    """Which points of a grid are near to places ``(N, 2)``, all in units of its cells.

    Those of a small grid all are: to look for them is not worth the time.
    """
    out = np.ones(shape, dtype=np.bool_)
    if out.size <= SMALL:
        return out
    from scipy.ndimage import distance_transform_edt  # late: it is only for large maps

    cells = np.clip(np.round(places), 0, np.array(shape) - 1).astype(int)
    out[tuple(np.unique(cells, axis=0).T)] = False
    # Rounding moves a place by less than a cell; a triangle goes less than two cells beyond it.
    return np.asarray(distance_transform_edt(out) <= far + 3.0)
