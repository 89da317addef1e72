"""Obstacles across the robot's way: prisms of round, rectangular or triangular section.

A section is the set of all points within a certain radius of a convex polygon, its core. A board
has a rectangle as core and the radius 0, a log a single point and the log's radius; a safety margin
only adds to the radius. So one formula gives the distance from all of them, and an obstacle that is
enlarged by a margin is again an obstacle.

Source of the three sections: [Shao2011], Section III.A and Fig. 3.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from gaitopt.conventions import BoolArray, FloatArray, rotation_z
from gaitopt.errors import InputError
from gaitopt.inputs import (
    as_text,
    check_array,
    check_choice,
    check_count,
    check_leads,
    check_shape,
    is_real,
)

SHAPES = ("round", "rectangular", "triangular")
DEFAULT_LENGTH = 1.5
"""Length across the way of the paper's board [m]."""
FARTHEST = 1e6
"""Positions and lengths beyond this are taken for a mistake [m]."""
SMALLEST = 1e-6
"""Lengths below this are taken for a mistake [m]."""

Corners = tuple[tuple[float, float], ...]
MOST_SIDES = 100_000
"""Most sides of an outline. Chosen: far more than a picture shows."""
MOST_TURNS = 1e6
"""Largest angle that is taken for one [rad]."""


@dataclass(frozen=True)
class Obstacle:
    """A prism that lies across the way.

    Make one with :func:`round_obstacle`, :func:`rectangular_obstacle` or
    :func:`triangular_obstacle`. The obstacle's own frame has its origin at :attr:`position`, x
    across the obstacle (the way a robot strides), y along it and z up; :attr:`yaw` turns it about
    z.

    Attributes:
        shape: ``"round"``, ``"rectangular"`` or ``"triangular"``.
        core: corners ``(x, z)`` of the section's core in the obstacle's frame, counter-clockwise
            with x to the right and z up [m]; one corner for a round section.
        rounding: distance from the core up to which points belong to the section [m].
        length: extent along y, half of it to either side [m].
        position: ``(x, y, z)`` of the origin in the world; z is the ground's height [m].
        yaw: angle from the world's x to the obstacle's x [rad].

    Raises:
        InputError: a number is not finite or has no sensible size, or the core is not convex.
    """

    shape: str
    core: Corners
    rounding: float
    length: float = DEFAULT_LENGTH
    position: tuple[float, float, float] = (0.0, 0.0, 0.0)
    yaw: float = 0.0

    def __post_init__(self) -> None:
        check_choice("shape", self.shape, SHAPES)
        _check("rounding", self.rounding, zero=True)
        _check("length", self.length)
        place = _triple(self.position)
        # Whole numbers may be larger than any float.
        if not (is_real(self.yaw) and abs(self.yaw) <= MOST_TURNS):
            raise InputError(f"yaw must be a finite angle in radians, got {as_text(self.yaw)}")
        object.__setattr__(self, "core", _corners(self.shape, self.core))
        object.__setattr__(self, "position", place)
        for name in ("rounding", "length", "yaw"):
            object.__setattr__(self, name, float(getattr(self, name)))

    @property
    def height(self) -> float:
        """Height of the section's top over the origin [m]."""
        return max(z for _, z in self.core) + self.rounding

    @property
    def extent(self) -> tuple[float, float]:
        """Least and greatest x of the section in the obstacle's frame [m]."""
        across = [x for x, _ in self.core]
        return min(across) - self.rounding, max(across) + self.rounding

    @property
    def width(self) -> float:
        """Extent of the section across the obstacle [m]."""
        low, high = self.extent
        return high - low

    def inflated(self, margin: float) -> Obstacle:
        """The obstacle enlarged by all points within ``margin`` [m] of it.

        The section is exact. The length grows by ``margin`` at each end, and the ends stay flat,
        so that beyond their edges a little more is covered.

        Raises:
            InputError: ``margin`` is negative or not finite.
        """
        _check("margin", margin, zero=True)
        grown = self.length + 2.0 * float(margin)
        return replace(self, rounding=self.rounding + float(margin), length=grown)

    def to_local(self, points: ArrayLike) -> FloatArray:
        """World points ``(..., 3)`` [m] in the obstacle's frame."""
        away = check_shape("points", points, 3) - np.array(self.position)
        return np.asarray(away @ rotation_z(self.yaw))

    def to_world(self, points: ArrayLike) -> FloatArray:
        """Points ``(..., 3)`` [m] of the obstacle's frame in the world."""
        turned = check_shape("points", points, 3) @ rotation_z(self.yaw).T
        return np.asarray(turned + np.array(self.position))

    def distance(self, points: ArrayLike) -> FloatArray:
        """Signed distance of world points ``(..., 3)`` from the obstacle ``(...)`` [m].

        Exact: the least distance to the surface, negative inside. Points between the planes of
        the two ends have the distance to the section.
        """
        local = self.to_local(points)
        section = self.section_distance(local[..., 0], local[..., 2])
        end = np.abs(local[..., 1]) - self.length / 2.0
        outside = np.hypot(np.maximum(section, 0.0), np.maximum(end, 0.0))
        return np.asarray(outside + np.minimum(np.maximum(section, end), 0.0))

    def section_distance(self, x: ArrayLike, z: ArrayLike) -> FloatArray:
        """Signed distance ``(...)`` [m] of ``(x, z)`` in the obstacle's frame from the section."""
        across, above = check_array("x", x), check_array("z", z)
        lead = check_leads(x=across.shape, z=above.shape)
        both = [np.broadcast_to(each, lead) for each in (across, above)]
        point = np.stack(both, axis=-1)[..., None, :]
        start = np.array(self.core)
        side = np.roll(start, -1, axis=0) - start
        square = np.maximum((side**2).sum(axis=-1), np.finfo(float).tiny)
        along = np.clip(((point - start) * side).sum(axis=-1) / square, 0.0, 1.0)
        away = np.linalg.norm(point - start - along[..., None] * side, axis=-1).min(axis=-1)
        if len(start) > 1:
            outward = np.stack([side[:, 1], -side[:, 0]], axis=-1) / np.sqrt(square)[:, None]
            beyond = ((point - start) * outward).sum(axis=-1).max(axis=-1)
            away = np.where(beyond < 0.0, beyond, away)
        return np.asarray(away - self.rounding)

    def contains(self, points: ArrayLike) -> BoolArray:
        """Whether world points ``(..., 3)`` lie in the obstacle or on its surface ``(...)``."""
        return np.asarray(self.distance(points) <= 0.0)

    def height_at(self, places: ArrayLike) -> FloatArray:
        """Height ``(...)`` of the surface at ``places (..., 2)`` or ``(..., 3)`` in the world [m].

        Beside the obstacle it is the ground's height, which is that of the obstacle's origin.
        """
        flat = check_array("places", places)
        if flat.ndim == 0 or flat.shape[-1] not in (2, 3):
            raise InputError(f"places must be (..., 2) or (..., 3), got {flat.shape}")
        flat = flat[..., :2]
        ground = np.broadcast_to(self.position[2], (*flat.shape[:-1], 1))
        local = self.to_local(np.concatenate([flat, ground], axis=-1))
        top = self._top(local[..., 0])
        off = (np.abs(local[..., 1]) > self.length / 2.0) | ~np.isfinite(top)
        return np.asarray(np.where(off, 0.0, np.maximum(top, 0.0)) + self.position[2])

    def _top(self, x: FloatArray) -> FloatArray:
        """Greatest z of the section above ``x (...)``, ``-inf`` beside it: arcs and flat sides."""
        top = np.full(x.shape, -np.inf)
        for corner_x, corner_z in self.core:
            arc = np.sqrt(np.maximum(self.rounding**2 - (x - corner_x) ** 2, 0.0))
            over = np.abs(x - corner_x) <= self.rounding
            top = np.where(over, np.maximum(top, corner_z + arc), top)
        for start, end in pairwise((*self.core, self.core[0])):
            run, rise = end[0] - start[0], end[1] - start[1]
            if run >= 0.0:  # corners are counter-clockwise: upper sides lead to the left
                continue
            size = float(np.hypot(run, rise))
            shift = self.rounding * np.array([rise, -run]) / size
            on = (x <= start[0] + shift[0]) & (x >= end[0] + shift[0])
            line = start[1] + shift[1] + (x - start[0] - shift[0]) * rise / run
            top = np.where(on, np.maximum(top, line), top)
        return top

    def outline(self, sides: int = 32) -> FloatArray:
        """A convex polygon ``(n, 2)`` around the section, counter-clockwise, as ``(x, z)`` [m].

        Without rounding it is the section itself. Arcs are replaced by tangents, ``sides`` for a
        full turn, so that the polygon contains the section.

        Raises:
            InputError: fewer than 3 sides, or more than :data:`MOST_SIDES`.
        """
        check_count("sides", sides, 3, MOST_SIDES)
        if self.rounding == 0.0:
            return np.array(self.core)
        normals = [2.0 * np.pi * k / sides for k in range(sides)]
        corners = np.array(self.core)
        steps = np.roll(corners, -1, axis=0) - corners if len(corners) > 1 else np.zeros((0, 2))
        normals += [float(np.arctan2(-dx, dz)) % (2.0 * np.pi) for dx, dz in steps]
        # Normals of sides and of tangents may agree but for rounding.
        turns = np.unique(np.round(normals, 12))
        facing = np.column_stack([np.cos(turns), np.sin(turns)])
        reach = (facing @ corners.T).max(axis=1) + self.rounding
        return _meeting_points(facing, reach)

    def mesh(self, sides: int = 32) -> tuple[FloatArray, np.ndarray]:
        """The prism over :meth:`outline`, for viewers and for collision checks.

        Returns:
            Vertices ``(2 n, 3)`` in the world [m], one end after the other, and triangles
            ``(4 n - 4, 3)``, counter-clockwise as seen from outside.
        """
        rim = self.outline(sides)
        n, half = len(rim), self.length / 2.0
        ends = [np.column_stack([rim[:, 0], np.full(n, y), rim[:, 1]]) for y in (-half, half)]
        here, there = np.arange(n), np.roll(np.arange(n), -1)
        rest = np.arange(1, n - 1)
        fan = np.column_stack([np.zeros_like(rest), rest, rest + 1])
        faces = [
            np.column_stack([here, here + n, there]),
            np.column_stack([there, here + n, there + n]),
            # Seen along +y, with x to the right and z up, the corners are counter-clockwise. The
            # near end keeps this order.
            fan,
            fan[:, ::-1] + n,
        ]
        return self.to_world(np.concatenate(ends)), np.concatenate(faces)


def round_obstacle(
    diameter: float,
    *,
    length: float = DEFAULT_LENGTH,
    position: tuple[float, float, float] = (0.0, 0.0, 0.0),
    yaw: float = 0.0,
) -> Obstacle:
    """A log or pipe on the ground.

    Args:
        diameter: of the section [m].
        length, position, yaw: as in :class:`Obstacle`; the position is below the axis.

    Raises:
        InputError: a number has no sensible size; the message names it.
    """
    _check("diameter", diameter)
    radius = float(diameter) / 2.0
    return Obstacle("round", ((0.0, radius),), radius, length, position, yaw)


def rectangular_obstacle(
    height: float,
    width: float,
    *,
    length: float = DEFAULT_LENGTH,
    position: tuple[float, float, float] = (0.0, 0.0, 0.0),
    yaw: float = 0.0,
) -> Obstacle:
    """A board or beam; that of [Shao2011] is 0.11 m high, 0.04 m wide and 1.5 m long.

    Args:
        height, width: of the section [m].
        length, position, yaw: as in :class:`Obstacle`; the position is below the middle.

    Raises:
        InputError: a number has no sensible size; the message names it.
    """
    _check("height", height)
    _check("width", width)
    half, top = float(width) / 2.0, float(height)
    core = ((-half, 0.0), (half, 0.0), (half, top), (-half, top))
    return Obstacle("rectangular", core, 0.0, length, position, yaw)


def triangular_obstacle(
    height: float,
    width: float,
    *,
    apex: float = 0.0,
    length: float = DEFAULT_LENGTH,
    position: tuple[float, float, float] = (0.0, 0.0, 0.0),
    yaw: float = 0.0,
) -> Obstacle:
    """A ridge.

    Args:
        height, width: of the section [m].
        apex: x of the top in the obstacle's frame [m]; 0 is over the middle of the base.
        length, position, yaw: as in :class:`Obstacle`; the position is the middle of the base.

    Raises:
        InputError: a number has no sensible size; the message names it.
    """
    _check("height", height)
    _check("width", width)
    if not (is_real(apex) and abs(apex) < FARTHEST):
        raise InputError(f"apex must be a finite length in metres, got {as_text(apex)}")
    half = float(width) / 2.0
    core = ((-half, 0.0), (half, 0.0), (float(apex), float(height)))
    return Obstacle("triangular", core, 0.0, length, position, yaw)


def _check(name: str, value: float, *, zero: bool = False) -> None:
    """Refuse what is no length from :data:`SMALLEST` (or zero) to :data:`FARTHEST`."""
    least = 0.0 if zero else SMALLEST
    if not (is_real(value) and least <= value < FARTHEST):
        raise InputError(
            f"{name} must be a finite length of at least {least:g} m, got {as_text(value)}"
        )


def _triple(position: object) -> tuple[float, float, float]:
    """The position as three plain numbers [m]."""
    try:
        place = check_array("position", position)
    except InputError:
        place = np.empty(0)
    if place.shape != (3,) or not (np.abs(place) < FARTHEST).all():
        raise InputError(
            f"position must be three finite lengths in metres, got {as_text(position)}"
        )
    x, y, z = place.astype(np.float64).tolist()
    return x, y, z


def _corners(shape: str, core: Corners) -> Corners:
    """The core as plain numbers.

    Raises:
        InputError: it is no convex polygon with the shape's number of corners.
    """
    wanted = {"round": 1, "rectangular": 4, "triangular": 3}[shape]
    corners = check_array("core", core)
    if corners.shape != (wanted, 2) or not (np.abs(corners) < FARTHEST).all():
        raise InputError(
            f"core of a {shape} section needs {wanted} finite corners (x, z), got {as_text(core)}"
        )
    if wanted > 1:
        side = np.roll(corners, -1, axis=0) - corners
        after = np.roll(side, -1, axis=0)
        turn = side[:, 0] * after[:, 1] - side[:, 1] * after[:, 0]
        if not turn.min() > 0.0:
            raise InputError(f"core must be convex and counter-clockwise, got {as_text(core)}")
    return tuple((float(x), float(z)) for x, z in corners)


def _meeting_points(facing: FloatArray, reach: FloatArray) -> FloatArray:
    """Points ``(n, 2)`` in which each line ``facing_i . p = reach_i`` meets the next one."""
    after, reach_after = np.roll(facing, -1, axis=0), np.roll(reach, -1)
    turn = facing[:, 0] * after[:, 1] - facing[:, 1] * after[:, 0]
    x = (reach * after[:, 1] - reach_after * facing[:, 1]) / turn
    z = (facing[:, 0] * reach_after - after[:, 0] * reach) / turn
    return np.column_stack([x, z])
