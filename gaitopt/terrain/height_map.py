"""The ground as a height map: a surface that is piecewise linear between points of a grid."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from gaitopt.conventions import BoolArray, FloatArray, frozen
from gaitopt.errors import GroundError
from gaitopt.inputs import check_number, check_shape
from gaitopt.terrain.ball_contact import BallContact, rest_balls

MOST_POINTS = 16_000_000
"""Most points of a map: 80 m by 80 m at 2 cm, 128 MB."""
FARTHEST = 1e6
"""Coordinates beyond this are taken for a mistake [m]."""
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
    """

    z: FloatArray
    resolution: float
    origin: tuple[float, float]

    def __init__(self, z: ArrayLike, resolution: float, origin: ArrayLike = (0.0, 0.0)) -> None:
        object.__setattr__(self, "z", _heights(z))
        size = check_number("resolution", resolution, 1e-6, 1e3, "m")
        object.__setattr__(self, "resolution", size)
        object.__setattr__(self, "origin", _place(origin))

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
        """Height of the ground at places ``(..., 2)`` [m]; NaN off the map and where unknown."""
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
        cells = (at.reshape(-1, 2) - self.origin) / self.resolution
        z, touches = rest_balls(self.z / self.resolution, cells, radius / self.resolution)
        touches = touches * self.resolution + np.append(self.origin, 0.0)
        centres = np.column_stack([at.reshape(-1, 2), z * self.resolution])
        centres[np.isnan(z)] = np.nan
        whole = (*at.shape[:-1], 3)
        centres, touches = centres.reshape(whole), touches.reshape(whole)
        return BallContact(centres, touches, (centres - touches) / radius)

    def with_heights(self, z: ArrayLike) -> HeightMap:
        """The same grid with other heights ``(nx, ny)`` [m]."""
        return HeightMap(z, self.resolution, self.origin)

    def _surface(self, places: ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Heights ``(...)`` and gradients ``(..., 2)`` at places ``(..., 2)``."""
        at = (np.asarray(places, dtype=np.float64) - self.origin) / self.resolution
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


def _heights(z: ArrayLike) -> FloatArray:
    """The heights of a map as a read-only array.

    Raises:
        GroundError: they are no array ``(nx, ny)`` of numbers, or no height is known.
    """
    try:
        array = np.asarray(z)
    except (TypeError, ValueError) as error:
        raise GroundError(f"heights of a map are no array of numbers: {error}") from error
    if array.dtype.kind not in "iuf":
        raise GroundError(f"heights of a map are no array of numbers, but of {array.dtype}")
    if array.ndim != 2 or min(array.shape) < 2 or array.size > MOST_POINTS:
        raise GroundError(
            f"heights of a map must have the shape (nx, ny), each at least 2 and at most "
            f"{MOST_POINTS:,} points in all, got {array.shape}"
        )
    heights = frozen(array)
    if not np.isfinite(heights).any():
        raise GroundError("no height of the map is known: all are NaN or infinite")
    far = np.argwhere(np.abs(heights) > FARTHEST)
    if far.size:
        i, j = (int(k) for k in far[0])
        raise GroundError(
            f"z[{i}, {j}] is {heights[i, j]:g}; heights must be below {FARTHEST:g} m, and NaN "
            "where they are unknown"
        )
    return heights


def _place(origin: ArrayLike) -> tuple[float, float]:
    """The origin of a map.

    Raises:
        GroundError: it is no pair of finite numbers.
    """
    try:
        place = np.asarray(origin, dtype=np.float64)
    except (TypeError, ValueError):
        place = np.empty(0)
    if place.shape != (2,) or not (np.abs(place) <= FARTHEST).all():
        raise GroundError(
            f"origin must be two numbers (x, y) in metres below {FARTHEST:g}, got {origin!r}"
        )
    return float(place[0]), float(place[1])
