"""A feasible region, and how to ask it questions."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum
from functools import cached_property
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from gaitopt.conventions import BoolArray, FloatArray, frozen
from gaitopt.dynamics.region.polygon import polygon_area, polygon_half_planes, polygon_margin
from gaitopt.errors import InputError
from gaitopt.inputs import check_array
from gaitopt.stability.support import HalfPlanes

ON_BORDER: Final = 1e-12
"""A place this far outside the region still counts as inside it [m]: rounding."""


class RegionStatus(Enum):
    """What was found; the value tells what to do."""

    SOLVED = "solved"
    SEGMENT = (
        "the region is a segment or a point, without area; let a third foot stand outside the line "
        "through the others"
    )
    FORCE_LIMITED = (
        "feet press against each other with ten times the weight, and more force would enlarge the "
        "region; give torque limits, which bound it"
    )
    NO_FORCES = (
        "the robot can rest nowhere: no contact forces keep friction and least normal forces; "
        "move the feet, or ask for more friction or a smaller reserve"
    )
    NO_TORQUES = (
        "the robot can rest nowhere: contact forces need larger joint torques than allowed; "
        "give another posture, move the feet, or allow a larger torque_share"
    )

    def __str__(self) -> str:
        return self.value


@dataclass(frozen=True, eq=False)
class FeasibleRegion:
    """The horizontal places of the COM at which a robot can rest; arrays are read-only.

    The region lies between two polygons. Every place in the inner one is feasible, proven by the
    forces at its vertices: between them, forces in between do.

    Attributes:
        status: what was found.
        legs: the legs that stand, ``m`` of them.
        vertices: of the inner polygon, counter-clockwise ``(k, 2)`` [m]. Two of a segment, one of a
            point, none of an empty region.
        outer_vertices: of the outer polygon, counter-clockwise [m]. No place outside is feasible.
        gap: largest distance of an outer vertex from the inner polygon [m].
        tolerance: largest gap that was asked for [m].
        points: contact points ``(m, 3)`` [m].
        forces: contact forces that hold the robot with its COM at each vertex, in the world's axes
            ``(k, m, 3)`` [N].
        residual: largest error of the equations of rest at a vertex: of force, as a share of the
            weight, and of torque, divided by the weight [m].
        violation: largest violation of a limit at a vertex, as a share of the weight or of the
            joint's torque limit; 0 or less, but for rounding, when all hold.
        posture: x, y, z [m], roll, pitch, yaw [rad] of the base for which torque limits hold
            ``(6,)``; ``None`` without torque limits.
        posture_com: horizontal place of the COM in this posture ``(2,)`` [m], or ``None``.
    """

    status: RegionStatus
    legs: tuple[str, ...]
    vertices: FloatArray
    outer_vertices: FloatArray
    gap: float
    tolerance: float
    points: FloatArray = field(repr=False)
    forces: FloatArray = field(repr=False)
    residual: float
    violation: float
    posture: FloatArray | None = field(default=None, repr=False)
    posture_com: FloatArray | None = field(default=None, repr=False)

    @property
    def empty(self) -> bool:
        """Whether the robot can rest nowhere."""
        return len(self.vertices) == 0

    @cached_property
    def area(self) -> float:
        """Area of the inner polygon [m^2]."""
        return polygon_area(self.vertices)

    @cached_property
    def outer_area(self) -> float:
        """Area of the outer polygon [m^2]; what the inner one loses is less than the difference."""
        return polygon_area(self.outer_vertices)

    @cached_property
    def half_planes(self) -> HalfPlanes:
        """Half-planes of the inner polygon, with normals that point inward.

        Raises:
            InputError: the region is empty.
        """
        if self.empty:
            raise InputError(f"an empty region has no half-planes: {self.status}")
        planes = polygon_half_planes(self.vertices)
        return HalfPlanes(frozen(planes.normals), frozen(planes.offsets), planes.edges)

    def margin(self, place: ArrayLike) -> FloatArray:
        """Signed distance of ``place`` from the border of the inner polygon ``(...)`` [m].

        Positive inside; outside it is minus the distance from the polygon. A segment has no
        inside, and the margin of an empty region is minus infinity.

        Args:
            place: of the COM ``(..., 2)`` or ``(..., 3)`` [m]; only x and y count.

        Raises:
            InputError: it has another shape.
        """
        return polygon_margin(self.vertices, _horizontal(place))

    def contains(self, place: ArrayLike) -> BoolArray:
        """Whether the inner polygon contains ``place (..., 2)`` or ``(..., 3)`` [m]: ``(...)``.

        Raises:
            InputError: it has another shape.
        """
        return np.asarray(self.margin(place) >= -ON_BORDER)

    def distance_from_posture(self, place: ArrayLike) -> FloatArray:
        """How far ``place`` is from where the COM is in the posture of the torque limits [m].

        Zero without torque limits: the region is then exact for every posture.

        Args:
            place: of the COM ``(..., 2)`` or ``(..., 3)`` [m].

        Raises:
            InputError: it has another shape.
        """
        places = _horizontal(place)
        if self.posture_com is None:
            return np.zeros(places.shape[:-1])
        return np.asarray(np.linalg.norm(places - self.posture_com, axis=-1))


def _horizontal(place: ArrayLike) -> FloatArray:
    """x and y of ``place (..., 2)`` or ``(..., 3)``."""
    places = check_array("place", place)
    if places.ndim == 0 or places.shape[-1] not in (2, 3):
        raise InputError(f"place must be (..., 2) or (..., 3), got {places.shape}")
    return places[..., :2]
