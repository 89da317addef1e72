"""Ways round what the robot cannot cross: holes, blocks, steep and unknown ground.

On a coarse grid the shortest way is looked for [Dijkstra1959]. From each of its points there are
sixteen directions. In each of them the tracks of the left and of the right feet need footholds, so
that a way over two beams is one, and the trunk needs room.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import distance_transform_edt
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import dijkstra

from gaitopt.conventions import BoolArray, FloatArray
from gaitopt.planners.over_terrain.judge import Judge
from gaitopt.planners.over_terrain.surfaces import Stands
from gaitopt.terrain.height_map import HeightMap

SPACING = 0.25
"""Distance between the points of the coarse grid, as a share of the standing height."""
MOST_POINTS = 200_000
"""Most points of the coarse grid; it is coarser on larger maps."""
STEEPEST = 1.4
"""Steepest mean slope that the robot is led over, as a tangent. Chosen: hills and stairs of the
hardest kind that is walked over have 0.9 and less."""
TALLEST = 0.6
"""Height of ground above the mean of the footholds around, as a share of the body's height, from
which on the trunk is not led over it. Chosen: trunks reach down to about two thirds."""
FOOTHOLD = 1.0
"""How far from a track the next foothold may be, as a share of a step's freedom."""
BEYOND = 0.05
"""Room beside the trunk beyond its feet, as a share of the standing height."""
STEPS = ((1, 0), (1, 1), (2, 1), (1, 2))
"""Steps on the grid in the first quadrant; turned by quarters they are sixteen directions."""


@dataclass(frozen=True, eq=False)
class Passage:
    """Where a robot passes.

    Attributes:
        ground: the map.
        footing: which points of the grid have a foothold near them ``(nx, ny)``.
        room: distance of each point from what the trunk cannot be above ``(nx, ny)`` [m].
        aside: how far the tracks of the feet are from the middle [m].
        spacing: of the coarse grid [m].
    """

    ground: HeightMap
    footing: BoolArray
    room: FloatArray
    aside: float
    spacing: float

    @classmethod
    def of(cls, judge: Judge, stands: Stands) -> Passage:
        """Where a robot passes on a map."""
        ground, settings = judge.surfaces.ground, judge.settings
        cell = ground.resolution
        some = stands.index >= 0
        footing = distance_transform_edt(~some) * cell <= FOOTHOLD * settings.freedom
        mean = stands.mean_heights(settings.freedom / cell)
        known = np.isfinite(mean)
        if not known.all() and known.any():
            nearest = distance_transform_edt(~known, return_distances=False, return_indices=True)
            mean = mean[tuple(nearest)]
        slope = np.hypot(*np.gradient(mean, cell))
        with np.errstate(invalid="ignore"):
            low = ground.z - mean <= TALLEST * settings.body_height
        # A comparison with NaN is false: nothing is above unknown ground, or off the map.
        free = np.pad(low & (slope <= STEEPEST), 1)
        room = distance_transform_edt(free)[1:-1, 1:-1] * cell
        aside = float(np.abs(judge.hips[:, 1]).max())
        spacing = max(SPACING * judge.robot.standing_height, cell)
        spacing = max(spacing, float(np.prod(ground.shape) * cell**2 / MOST_POINTS) ** 0.5)
        return cls(ground, footing, room, aside, spacing)

    def passable(self, starts: FloatArray, ends: FloatArray, room: float) -> BoolArray:
        """Whether the robot passes along straight lines ``(n, 2)``, with room at each side [m]."""
        way = ends - starts
        length = np.linalg.norm(way, axis=1)
        count = int(np.ceil(length.max(initial=0.0) / self.spacing)) * 2 + 1
        side = np.stack([-way[:, 1], way[:, 0]], axis=1) / np.maximum(length, 1e-9)[:, None]
        kept = np.ones(len(starts), dtype=np.bool_)
        for share in np.linspace(0.0, 1.0, count):
            places = starts + share * way
            kept &= self._at(self.room, places) > room
            for sign in (-1.0, 1.0):
                kept &= self._at(self.footing, places + sign * self.aside * side) > 0
        return kept

    def around(self, start: FloatArray, end: FloatArray) -> list[FloatArray] | None:
        """Corners of a way from one place to another ``(2,)``, with the end, without the start.

        The straight line, where it is passable; ``None`` where no way is found.
        """
        narrow = self.aside + BEYOND * self.spacing / SPACING
        if self.passable(start[None], end[None], narrow)[0]:
            return [end]
        for room in (2.0 * narrow, 1.5 * narrow, narrow):
            way = self._shortest(start, end, room)
            if way is not None:
                return self._straightened(way, room)
        return None

    def _at(self, layer: np.ndarray, places: FloatArray) -> np.ndarray:
        """Values of a layer at places ``(n, 2)``; 0 off the map."""
        at = np.round((places - self.ground.origin) / self.ground.resolution).astype(int)
        inside = ((at >= 0) & (at < self.ground.shape)).all(axis=1)
        i, j = np.clip(at, 0, np.subtract(self.ground.shape, 1)).T
        return np.where(inside, layer[i, j], 0)

    def _shortest(self, start: FloatArray, end: FloatArray, room: float) -> FloatArray | None:
        """The shortest way on the coarse grid ``(n, 2)``; ``None`` for none."""
        (x0, x1), (y0, y1) = self.ground.extent
        axes = [np.arange(a, b + 1e-9, self.spacing) for a, b in ((x0, x1), (y0, y1))]
        shape = tuple(len(axis) for axis in axes)
        places = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2)
        number = np.arange(len(places)).reshape(shape)
        rows, columns = [], []
        for a, b in STEPS:
            for di, dj in ((a, b), (-b, a)):
                own = number[max(-di, 0) : shape[0] - max(di, 0), : max(shape[1] - dj, 0)]
                other = number[max(di, 0) : shape[0] - max(-di, 0), dj:]
                kept = self.passable(places[own.ravel()], places[other.ravel()], room)
                rows.append(own.ravel()[kept])
                columns.append(other.ravel()[kept])
        one, two = np.concatenate(rows), np.concatenate(columns)
        lengths = np.linalg.norm(places[one] - places[two], axis=1)
        edges = coo_matrix((lengths, (one, two)), shape=(len(places), len(places))).tocsr()
        reached = np.unique(np.concatenate([one, two]))
        if not len(reached):
            return None
        first, last = (
            int(reached[np.linalg.norm(places[reached] - place, axis=1).argmin()])
            for place in (start, end)
        )
        near = max(np.linalg.norm(places[k] - p) for k, p in ((first, start), (last, end)))
        if near > 2.0 * (room + self.spacing):
            return None
        far, before = dijkstra(edges, directed=False, indices=first, return_predecessors=True)
        if not np.isfinite(far[last]):
            return None
        way = [last]
        while way[-1] != first:
            way.append(int(before[way[-1]]))
        return np.concatenate([start[None], places[way[::-1]], end[None]])

    def _straightened(self, way: FloatArray, room: float) -> list[FloatArray]:
        """Corners of a way ``(n, 2)`` with straight lines between them where these are passable."""
        out, at = [], 0
        while at < len(way) - 1:
            later = np.arange(at + 1, len(way))
            straight = self.passable(np.tile(way[at], (len(later), 1)), way[later], room)
            at = int(later[straight][-1]) if straight.any() else at + 1
            out.append(way[at])
        return out
