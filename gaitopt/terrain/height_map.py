"""The ground as a height map: a surface that is piecewise linear between points of a grid."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from gaitopt.arguments import checked
from gaitopt.conventions import BoolArray, FloatArray, frozen
from gaitopt.files import StrPath, written_whole
from gaitopt.inputs import check_number, check_shape
from gaitopt.terrain.ball_contact import BallContact, resting_balls
from gaitopt.terrain.gridding.filling import filled_heights
from gaitopt.terrain.gridding.grid import grid_places, points_within
from gaitopt.terrain.gridding.points import heights_of_points
from gaitopt.terrain.gridding.surfaces import Columns, heights_of_columns, heights_of_triangles
from gaitopt.terrain.height_map_checks import checked_heights, checked_place

MOST_CELLS_A_RADIUS = 50
"""Largest radius of a ball, in cells: the time grows with its square."""
EDGE = 1e-9
"""How far outside of the map a place may come out by rounding, in cells."""


@dataclass(frozen=True, eq=False)
class HeightMap:
    """Heights at the points of a grid, and a surface between them.

    Each cell between four points is divided into two triangles by the diagonal from its lowest x
    and y to its highest x and y, and the surface is flat on each of them. MuJoCo's height fields
    are divided in the same way, so planner, certificate, physics and replay see the same surface.

    Args:
        z: heights ``(nx, ny)`` [m], at least 2 by 2; ``z[i, j]`` is the height at
            ``x = origin[0] + i * resolution`` and ``y = origin[1] + j * resolution``. NaN where it
            is not known: no foot may stand there, and nothing is certified above it.
        resolution: distance between neighbouring points [m].
        origin: x and y of ``z[0, 0]`` [m].

    Raises:
        GroundError: heights are no array of numbers of this shape, or too high, or none is known,
            or the origin is no place.
        InputError: the resolution is out of range.

    :func:`gaitopt.load_ground` reads files, :func:`gaitopt.make_ground` makes test grounds, and
    ``from_points``, ``from_triangles`` and ``from_columns`` put other data on a grid.
    """

    z: FloatArray
    resolution: float
    origin: tuple[float, float]

    def __init__(self, z: ArrayLike, resolution: float, origin: ArrayLike = (0.0, 0.0)) -> None:
        object.__setattr__(self, "z", checked_heights(z))
        size = check_number("resolution", resolution, 1e-6, 1e3, "m")
        object.__setattr__(self, "resolution", size)
        object.__setattr__(self, "origin", checked_place(origin))

    @classmethod
    def from_points(
        cls, points: ArrayLike, resolution: float, *, method: str = "highest"
    ) -> HeightMap:
        """The map of a cloud of points.

        Args:
            points: ``(n, 3)`` [m]; those that are not finite are left out.
            resolution: distance of the grid's points [m]; the grid's coordinates are whole
                multiples of it.
            method: height of a point of the grid, from the points of the cloud that are nearer to
                it than to others: the ``"highest"`` or the ``"median"`` one. It is unknown where
                there is none.

        Raises:
            GroundError: there are no points, or the map would have too few or too many.
            InputError: the method is unknown, or the resolution is out of range.
        """
        resolution = check_number("resolution", resolution, 1e-6, 1e3, "m")
        return cls(*heights_of_points(points, resolution, method))

    @classmethod
    def from_triangles(cls, triangles: ArrayLike, resolution: float) -> HeightMap:
        """The map of the top of triangles, as of a mesh; unknown where there is none.

        Args:
            triangles: their corners ``(n, 3, 3)`` [m], as of trimesh's ``mesh.triangles``.
            resolution: distance of the grid's points [m]; the grid's coordinates are whole
                multiples of it.

        Raises:
            GroundError: corners are not finite, or the map would have too few or too many points.
            InputError: the resolution is out of range.
        """
        resolution = check_number("resolution", resolution, 1e-6, 1e3, "m")
        return cls(*heights_of_triangles(triangles, resolution))

    @classmethod
    @checked
    def from_columns(
        cls, footholds: Columns, foot_radius: float, resolution: float, *, depth: float = 0.3
    ) -> HeightMap:
        """The map of the columns that footholds stand on, with a floor around them.

        Where columns overlap, the higher one counts. Between a column's last point of the grid and
        the floor the map slopes down over one cell, so the resolution must be a small share of the
        columns' radius.

        Args:
            footholds: :class:`gaitopt.Footholds` with a radius.
            foot_radius: of the feet, whose centres the footholds are [m].
            resolution: distance of the grid's points [m].
            depth: how far the floor is below the lowest top [m].

        Raises:
            GroundError: the footholds are on open ground, or the map would have too many points.
            InputError: a number is out of range.
        """
        resolution = check_number("resolution", resolution, 1e-6, 1e3, "m")
        depth = check_number("depth", depth, 0.0, 1e3, "m")
        foot = check_number("foot_radius", foot_radius, 0.0, 10.0, "m")
        return cls(*heights_of_columns(footholds, foot, resolution, depth))

    def __eq__(self, other: object) -> bool:
        """Whether resolution, origin and all heights are the same."""
        return (
            isinstance(other, HeightMap)
            and self.resolution == other.resolution
            and self.origin == other.origin
            and np.array_equal(self.z, other.z, equal_nan=True)
        )

    __hash__ = None  # type: ignore[assignment]

    def __reduce__(self) -> tuple[object, ...]:
        return (HeightMap, (self.z, self.resolution, self.origin))

    def __repr__(self) -> str:
        (x0, x1), (y0, y1) = self.extent
        low, high = self.height_range
        unknown = np.count_nonzero(np.isnan(self.z)) / self.z.size
        return (
            f"HeightMap({self.shape[0]} x {self.shape[1]} points every "
            f"{1e3 * self.resolution:g} mm, x {x0:g} to {x1:g} m, y {y0:g} to {y1:g} m, heights "
            f"{low:.3f} to {high:.3f} m" + (f", {unknown:.1%} unknown)" if unknown else ")")
        )

    @property
    def shape(self) -> tuple[int, int]:
        """Number of points along x and along y."""
        return self.z.shape[0], self.z.shape[1]

    @property
    def extent(self) -> tuple[tuple[float, float], tuple[float, float]]:
        """Lowest and highest x, lowest and highest y [m]."""
        (x, y), (nx, ny) = self.origin, self.shape
        return (x, x + (nx - 1) * self.resolution), (y, y + (ny - 1) * self.resolution)

    @cached_property
    def height_range(self) -> tuple[float, float]:
        """Lowest and highest known height [m]."""
        return float(np.nanmin(self.z)), float(np.nanmax(self.z))

    @cached_property
    def x(self) -> FloatArray:
        """Places of the points along x ``(nx,)`` [m]."""
        return frozen(self.origin[0] + self.resolution * np.arange(self.shape[0]))

    @cached_property
    def y(self) -> FloatArray:
        """Places of the points along y ``(ny,)`` [m]."""
        return frozen(self.origin[1] + self.resolution * np.arange(self.shape[1]))

    @cached_property
    def known(self) -> BoolArray:
        """Whether the height of each point is known ``(nx, ny)``."""
        out = ~np.isnan(self.z)
        out.setflags(write=False)
        return out

    def height(self, places: ArrayLike) -> FloatArray:
        """Height of the ground at places ``(..., 2)`` [m]; NaN off the map and where unknown.

        A place that is NaN is off the map.
        """
        return self._surface(places)[0]

    def gradient(self, places: ArrayLike) -> FloatArray:
        """Slope along x and along y at places ``(..., 2)``; NaN where the height is.

        On an edge between triangles it is that of one of them.
        """
        return self._surface(places)[1]

    def normal(self, places: ArrayLike) -> FloatArray:
        """Unit normals of the ground, which point up, at places ``(..., 2)``: ``(..., 3)``."""
        slope = self.gradient(places)
        out = np.concatenate([-slope, np.ones_like(slope[..., :1])], axis=-1)
        return np.asarray(out / np.linalg.norm(out, axis=-1, keepdims=True))

    def ball(self, places: ArrayLike, radius: float) -> BallContact:
        """Balls that rest on the ground: the foothold of a ball foot, and where it touches.

        On a slope a ball touches the ground beside its lowest point, and on rough ground it may
        rest on an edge or a point of the grid. The result is exact for this surface.

        Args:
            places: x and y of the centres ``(..., 2)`` [m].
            radius: of the balls [m]; with 0 the result is the ground itself and its normals.

        Returns:
            Centres, points of contact and normals ``(..., 3)``; ``normals = (centres - touches) /
            radius``. NaN where a triangle of the ground within the radius is unknown or off the
            map.

        Raises:
            InputError: places have another shape, or the radius is negative or larger than
                50 cells.
        """
        at = check_shape("places", places, 2)
        most = MOST_CELLS_A_RADIUS * self.resolution
        radius = check_number("radius", radius, 0.0, most, "m")
        if radius == 0.0:
            touches = np.concatenate([at, self.height(at)[..., None]], axis=-1)
            touches[np.isnan(touches[..., 2])] = np.nan
            return BallContact(touches, touches, self.normal(at))
        return resting_balls(self.z, self.resolution, self.origin, at, radius)

    def with_heights(self, z: ArrayLike) -> HeightMap:
        """The same grid with other heights ``(nx, ny)`` [m]."""
        return HeightMap(z, self.resolution, self.origin)

    def filled(self, method: str = "nearest") -> HeightMap:
        """The same map with no unknown heights.

        A map from sensors has holes, where something hid the ground. What they are filled with is a
        guess: walk on it only where that is right.

        Args:
            method: ``"nearest"``: the height of the nearest known point of the grid; ``"highest"``
                or ``"lowest"``: that of the known points around each patch of unknown ground.

        Raises:
            InputError: the method is unknown.
        """
        return self.with_heights(filled_heights(self.z, method))

    def cropped(
        self, x: tuple[float, float] | None = None, y: tuple[float, float] | None = None
    ) -> HeightMap:
        """The part of the map within ``x`` and ``y``, each lowest and highest [m].

        Raises:
            GroundError: there are fewer than 2 by 2 points.
        """
        i = points_within(self.x, x, self.resolution)
        j = points_within(self.y, y, self.resolution)
        return HeightMap(self.z[i][:, j], self.resolution, (self.x[i][0], self.y[j][0]))

    def resampled(self, resolution: float) -> HeightMap:
        """The same ground on a grid of another resolution [m], within the extent of this one.

        With a coarser one, tops and hollows between its points are lost.

        Raises:
            GroundError: the map would have too few or too many points.
            InputError: the resolution is out of range.
        """
        resolution = check_number("resolution", resolution, 1e-6, 1e3, "m")
        places = grid_places(self.shape, self.resolution, self.origin, resolution)
        return HeightMap(self.height(places), resolution, self.origin)

    def save(self, path: StrPath) -> None:
        """Write the map to an ``.npz`` file, without loss; :func:`gaitopt.load_ground` reads it.

        Raises:
            InputError: the file cannot be written.
        """
        with written_whole(path, binary=True) as stream:
            np.savez_compressed(stream, z=self.z, resolution=self.resolution, origin=self.origin)

    def _surface(self, places: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Heights ``(...)`` and gradients ``(..., 2)`` at places ``(..., 2)``."""
        at = (check_shape("places", places, 2) - self.origin) / self.resolution
        most = np.array(self.shape) - 1
        # A place on the border that comes out outside of it by rounding belongs to the map.
        inside = ((at >= -EDGE) & (at <= most + EDGE)).all(axis=-1)
        cell = np.clip(np.nan_to_num(np.floor(at)), 0, most - 1).astype(np.int64)
        u, v = np.moveaxis(np.clip(at - cell, 0.0, 1.0), -1, 0)
        i, j = cell[..., 0], cell[..., 1]
        z, across = self.z, u >= v
        low, high = z[i, j], z[i + 1, j + 1]
        corner = np.where(across, z[i + 1, j], z[i, j + 1])
        along_x = np.where(across, corner - low, high - corner)
        along_y = np.where(across, high - corner, corner - low)
        height = np.where(inside, low + u * along_x + v * along_y, np.nan)
        slope = np.stack([along_x, along_y], axis=-1) / self.resolution
        return height, np.where(np.expand_dims(inside, -1), slope, np.nan)
