"""Layers of a height map: slope, roughness, distance to an edge, and where a foot may stand."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gaitopt.conventions import BoolArray, ByValue, FloatArray, TextEnum, frozen
from gaitopt.inputs import check_kind, check_number, check_shape
from gaitopt.robots.quadruped import Quadruped
from gaitopt.terrain.height_map import HeightMap

FOOT_RADIUS = 0.015
"""Radius of the feet where no robot is given, or where its feet are points [m]: wang2020's."""
STANDING_HEIGHT = 0.40
"""Height of the hips where no robot is given [m]: wang2020's."""
STANCE_SIZE = (0.40, 0.30)
"""Length and width of the stance where no robot is given [m]: wang2020's."""
FRICTION = 0.6
"""Coefficient of friction that the planner assumes by default (:class:`gaitopt.ForceLimits`)."""
EDGE_MARGIN = 0.02
"""Least distance of a foothold from an edge [m]. Chosen: three times the 6 mm by which bodies are
off their plan in physics."""
PIT_SHARE = 0.7
"""Depth of a pit as a share of the standing height. Chosen: stairs of usual height are no pits, and
a leg that stands so much lower than the others leaves no room for the knees."""
ROOM = 1.25
"""Size of a hollow that a robot fits into, as a multiple of its stance. Chosen: feet stand beside
the places below their hips, too."""


class Footing(TextEnum):
    """Whether a foot may stand at a place, or why not."""

    STEPPABLE = "steppable"
    OFF_MAP = "off the map"
    UNKNOWN = "unknown"
    PIT = "in a pit"
    EDGE = "too near an edge"
    STEEP = "too steep"
    ROUGH = "too rough"


FOOTINGS: tuple[Footing, ...] = tuple(Footing)
"""The footings, in the order of the codes of :attr:`GroundLayers.codes`."""


@dataclass(frozen=True, eq=False)
class GroundLayers(ByValue):
    """What a height map is like, at each point of its grid.

    Attributes:
        ground: the height map.
        slope: of the plane that fits best to the ground under the foot ``(nx, ny)`` [rad]; NaN
            where a part of it is unknown.
        roughness: largest distance of that ground from the plane, vertically ``(nx, ny)`` [m].
        edge_distance: horizontal distance to the nearest edge ``(nx, ny)`` [m]; infinite where
            there is none.
        depth: how deep the point lies in a hollow ``(nx, ny)`` [m]; 0 where it is in none.
        codes: index in :data:`FOOTINGS` ``(nx, ny)``; 0 where a foot may stand.
        limits: the limits that the codes keep, by name: ``foot_radius``, ``friction``, ``patch``,
            ``max_roughness``, ``edge_height``, ``edge_margin``, ``pit_depth``, ``pit_length``,
            ``pit_width``.
    """

    ground: HeightMap
    slope: FloatArray
    roughness: FloatArray
    edge_distance: FloatArray
    depth: FloatArray
    codes: NDArray[np.uint8]
    limits: dict[str, float]

    @cached_property
    def steppable(self) -> BoolArray:
        """Where a foot may stand ``(nx, ny)``."""
        out: BoolArray = np.equal(self.codes, 0)
        out.setflags(write=False)
        return out

    @property
    def counts(self) -> dict[Footing, int]:
        """How many points of the grid have each footing."""
        found = np.bincount(self.codes.ravel(), minlength=len(FOOTINGS))
        return dict(zip(FOOTINGS, found.tolist(), strict=True))

    def footing(self, place: ArrayLike) -> Footing:
        """Whether a foot may stand at the point of the grid nearest to ``place (2,)`` [m]."""
        at = check_shape("place", place, 2)
        cell = np.rint((at - self.ground.origin) / self.ground.resolution)
        if not ((cell >= 0) & (cell < self.ground.shape)).all():
            return Footing.OFF_MAP
        return FOOTINGS[int(self.codes[int(cell[0]), int(cell[1])])]


def ground_layers(
    ground: HeightMap,
    *,
    robot: Quadruped | None = None,
    friction: float = FRICTION,
    foot_radius: float | None = None,
    patch: float | None = None,
    max_roughness: float | None = None,
    edge_height: float | None = None,
    edge_margin: float = EDGE_MARGIN,
    pit_depth: float | None = None,
    pit_length: float | None = None,
    pit_width: float | None = None,
) -> GroundLayers:
    """Slope, roughness, distance to an edge, and where a foot may stand, on a height map.

    A foot may stand at a point of the grid, with the first of these reasons against it:

    - *off the map*, *unknown*: a triangle of the ground within ``foot_radius``, or a point within
      ``patch``, is off the map or unknown;
    - *in a pit*: the ground there is more than ``pit_depth`` below the rim of a hollow that a
      rectangle of ``pit_length`` by ``pit_width`` does not fit into, neither along x nor along y.
      (The floor of a hole is flat, and no place to stand.)
    - *too near an edge*: within ``edge_margin`` of two neighbouring points of the grid whose
      heights differ by more than ``edge_height``, and which are steeper than ``friction``;
    - *too steep*: the plane that fits best to the ground within ``patch`` is steeper than
      ``friction``, so that a foot under a vertical load slips;
    - *too rough*: a point within ``patch`` is more than ``max_roughness`` from that plane.

    Args:
        ground: the height map.
        robot: lengths that are not given fit its size; by default wang2020's.
        friction: coefficient of friction.
        foot_radius: of the foot's ball [m]; the robot's by default.
        patch: radius of the ground under the foot that slope and roughness are taken from [m]; by
            default the foot radius, at least one cell.
        max_roughness: [m]; by default the foot radius.
        edge_height: [m]; by default the foot radius: over lower ones the ball rolls.
        edge_margin: [m].
        pit_depth: [m]; by default 0.7 of the robot's standing height.
        pit_length, pit_width: [m]; by default 1.25 of the robot's stance: it does not fit into
            what is smaller.

    Raises:
        InputError: a parameter is out of range.
    """
    check_kind("ground", ground, HeightMap)
    limits = _limits(
        ground, robot,
        {"foot_radius": foot_radius, "friction": friction, "patch": patch,
         "max_roughness": max_roughness, "edge_height": edge_height, "edge_margin": edge_margin,
         "pit_depth": pit_depth, "pit_length": pit_length, "pit_width": pit_width},
    )  # fmt: skip
    slope, roughness = _plane(ground, limits["patch"])
    edges = _edge_distance(ground, limits["edge_height"], limits["friction"])
    depth = _depth(ground, limits["pit_length"], limits["pit_width"])
    off_map, unknown = _missing(ground, slope, limits)
    reasons = {
        Footing.OFF_MAP: off_map,
        Footing.UNKNOWN: unknown,
        Footing.PIT: depth > limits["pit_depth"],
        Footing.EDGE: edges < limits["edge_margin"] - 1e-9,
        Footing.STEEP: np.tan(slope) > limits["friction"],
        Footing.ROUGH: roughness > limits["max_roughness"],
    }
    codes = np.select(list(reasons.values()), [FOOTINGS.index(r) for r in reasons], 0)
    codes = codes.astype(np.uint8)
    codes.setflags(write=False)
    slope, roughness, edges, depth = map(frozen, (slope, roughness, edges, depth))
    return GroundLayers(ground, slope, roughness, edges, depth, codes, limits)


def _limits(
    ground: HeightMap, robot: Quadruped | None, given: dict[str, float | None]
) -> dict[str, float]:
    """The limits that were given, and those that fit the robot, checked."""
    radius, height, stance = FOOT_RADIUS, STANDING_HEIGHT, STANCE_SIZE
    if robot is not None:
        check_kind("robot", robot, Quadruped)
        radius = robot.foot_radius or FOOT_RADIUS
        height, stance = robot.standing_height, robot.stance_size
    if given["foot_radius"] is not None:
        most = 50.0 * ground.resolution
        radius = check_number("foot_radius", given["foot_radius"], 0.0, most, "m")
    fitted = {
        "foot_radius": radius, "patch": max(radius, ground.resolution),
        "max_roughness": max(radius, 1e-3), "edge_height": max(radius, 1e-3),
        "pit_depth": PIT_SHARE * height,
        "pit_length": ROOM * stance[0], "pit_width": ROOM * stance[1],
    }  # fmt: skip
    out = {name: fitted[name] if value is None else value for name, value in given.items()}
    ranges = {
        "friction": (1e-3, 10.0), "patch": (ground.resolution, 50.0 * ground.resolution),
    }  # fmt: skip
    for name, value in out.items():
        low, high = ranges.get(name, (0.0, 1e3))
        out[name] = check_number(name, value, low, high, "" if name == "friction" else "m")
    return out


def _plane(ground: HeightMap, patch: float) -> tuple[FloatArray, FloatArray]:
    """Slope [rad] and roughness [m] of the ground within ``patch`` [m] of each point ``(nx, ny)``.

    The points within the patch lie evenly around its middle, so the plane of least squares has the
    slopes ``sum(x z) / sum(x^2)`` and ``sum(y z) / sum(y^2)``.
    """
    cell = ground.resolution
    reach = int(patch / cell + 1e-9)
    steps = np.arange(-reach, reach + 1)
    points = [(i, j) for i in steps for j in steps if np.hypot(i, j) * cell <= patch + 1e-9]
    padded = np.pad(ground.z, reach, constant_values=np.nan)
    nx, ny = ground.shape
    near = [padded[reach + i : reach + i + nx, reach + j : reach + j + ny] for i, j in points]
    spread = sum(i * i for i, _ in points) * cell
    mean = sum(near) / len(near)
    along_x = sum(i * z for (i, _), z in zip(points, near, strict=True)) / spread
    along_y = sum(j * z for (_, j), z in zip(points, near, strict=True)) / spread
    rough = np.zeros(ground.shape)
    for (i, j), z in zip(points, near, strict=True):
        np.maximum(rough, np.abs(z - mean - cell * (i * along_x + j * along_y)), out=rough)
    return np.arctan(np.hypot(along_x, along_y)), rough


def _edge_distance(ground: HeightMap, height: float, friction: float) -> FloatArray:
    """Distance of each point from the nearest end of an edge ``(nx, ny)`` [m]."""
    from scipy.ndimage import distance_transform_edt

    z, cell = ground.z, ground.resolution
    ends = np.zeros(ground.shape, dtype=np.bool_)
    pairs = (
        ((slice(1, None), slice(None)), (slice(None, -1), slice(None))),
        ((slice(None), slice(1, None)), (slice(None), slice(None, -1))),
    )
    for one, other in pairs:
        rise = np.abs(z[one] - z[other])
        # A comparison with NaN is false.
        edge = (rise > height) & (rise > friction * cell)
        ends[one] |= edge
        ends[other] |= edge
    if not ends.any():
        return np.full(ground.shape, np.inf)
    return np.asarray(distance_transform_edt(~ends, sampling=cell))


def _depth(ground: HeightMap, length: float, width: float) -> FloatArray:
    """How deep each point lies in a hollow that a rectangle does not fit into ``(nx, ny)`` [m].

    It is the difference from the morphological closing by the rectangle, which fills all hollows
    that it does not fit into; the smaller one of the rectangle along x and along y.
    """
    from scipy.ndimage import maximum_filter, minimum_filter

    known = np.nan_to_num(ground.z, nan=-np.inf)
    depth = np.full(ground.shape, np.inf)
    for sides in ((length, width), (width, length)):
        # Half of it on each side; it fits into a hollow that is as large.
        half = [max(int(np.ceil(side / (2.0 * ground.resolution) - 1e-9)) - 1, 0) for side in sides]
        window = [2 * k + 1 for k in half]
        raised = maximum_filter(known, window, mode="constant", cval=-np.inf)
        closed = minimum_filter(raised, window, mode="constant", cval=np.inf)
        depth = np.fmin(depth, closed - ground.z)
    return np.asarray(np.where(ground.known, np.maximum(depth, 0.0), 0.0))


def _missing(
    ground: HeightMap, slope: FloatArray, limits: dict[str, float]
) -> tuple[BoolArray, BoolArray]:
    """Points whose foot would be partly off the map, and those over unknown ground."""
    reach = max(limits["foot_radius"] - 1e-9, limits["patch"]) / ground.resolution
    i, j = (np.minimum(np.arange(n), n - 1 - np.arange(n)) for n in ground.shape)
    off_map = np.minimum(i[:, None], j[None, :]) < reach - 1e-9
    unknown = np.isnan(slope)
    if not ground.known.all():
        unknown |= _blind(ground, limits["foot_radius"])
    return off_map, unknown


def _blind(ground: HeightMap, radius: float) -> BoolArray:
    """Points above which a ball of that radius has unknown ground below."""
    from scipy.ndimage import binary_dilation

    window = int(np.ceil(radius / ground.resolution)) + 1
    square = np.ones((2 * window + 1, 2 * window + 1), dtype=np.bool_)
    near = binary_dilation(~ground.known, square)
    i, j = np.nonzero(near)
    contact = ground.ball(np.column_stack([ground.x[i], ground.y[j]]), radius)
    out = np.zeros(ground.shape, dtype=np.bool_)
    out[i, j] = np.isnan(contact.centres[:, 2])
    return out
