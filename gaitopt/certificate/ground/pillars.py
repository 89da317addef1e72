"""Columns as the ground that they are: upright round pillars that go down without end."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from pinocchio import coal

from gaitopt.certificate.ground.solids import Solid
from gaitopt.certificate.ground.unknown import Footprints
from gaitopt.conventions import BoolArray, FloatArray
from gaitopt.terrain.footholds import Footholds

ROUNDING = 1e-6
"""How much farther pillars are looked for than they count [m]: far more than rounding."""


@dataclass(frozen=True, eq=False)
class Pillars:
    """Upright pillars.

    Attributes:
        tops: middles of their tops ``(n, 3)`` [m].
        radius: of all of them [m].
    """

    tops: FloatArray
    radius: float

    @classmethod
    def of(cls, footholds: Footholds, foot: float) -> Pillars:
        """The columns under footholds, which are centres of foot balls.

        Args:
            footholds: with a radius.
            foot: radius of the feet [m].
        """
        places = np.concatenate(list(footholds.points.values())) - np.array([0.0, 0.0, foot])
        return cls(np.unique(places, axis=0), footholds.landing_radius)

    @property
    def top(self) -> float:
        """Height of the highest pillar [m]."""
        return float(self.tops[:, 2].max())

    def highest(self, low: FloatArray, high: FloatArray) -> FloatArray:
        """Height of the highest pillar under rectangles ``(N,)``; minus infinity without one [m].

        Args:
            low, high: corners of the rectangles ``(N, 2)`` [m].
        """
        out = np.full(len(low), -np.inf)
        for some, tops in self._beside(low, high, self.radius):
            away = tops[:, :2] - np.clip(tops[:, :2], low[some], high[some])
            over = (away**2).sum(axis=1) <= self.radius**2
            out[some] = np.maximum(out[some], np.where(over, tops[:, 2], -np.inf))
        return out

    def _beside(
        self, low: FloatArray, high: FloatArray, reach: float
    ) -> Iterator[tuple[np.ndarray, FloatArray]]:
        """Numbers of rectangles ``(n,)``, and tops ``(n, 3)`` [m] of a pillar of each.

        Every pillar whose axis is within ``reach`` of a rectangle comes once, and some others.

        Args:
            low, high: corners of the rectangles ``(N, 2)`` [m].
            reach: in metres.
        """
        axis, sorted_tops = self._line
        line, reach = sorted_tops[:, axis], reach + ROUNDING
        first = np.searchsorted(line, low[:, axis] - reach, side="left")
        last = np.searchsorted(line, high[:, axis] + reach, side="right")
        for k in range(int((last - first).max(initial=0))):
            some = np.flatnonzero(first + k < last)
            yield some, sorted_tops[first[some] + k]

    @cached_property
    def _line(self) -> tuple[int, FloatArray]:
        """The axis along which the pillars are spread farthest, and their tops sorted along it."""
        axis = int(np.ptp(self.tops[:, :2], axis=0).argmax())
        return axis, self.tops[np.argsort(self.tops[:, axis], kind="stable")]

    def unknown_under(self, boxes: Footprints) -> BoolArray:
        """Whether ground under boxes is unknown ``(N,)``: that of pillars never is."""
        return np.zeros(len(boxes.middles), dtype=np.bool_)

    def distances(self, points: FloatArray, reach: float) -> FloatArray:
        """Distance of points ``(N, 3)`` to the nearest pillar, negative within one ``(N,)`` [m].

        Args:
            points: from which.
            reach: farthest distance that is of interest [m]; larger ones are told as this.
        """
        out = np.full(len(points), reach)
        for some, tops in self._beside(points[:, :2], points[:, :2], self.radius + reach):
            out[some] = np.minimum(out[some], self._from(points[some], tops))
        return out

    def off(self, middles: FloatArray, radius: float) -> FloatArray:
        """How far balls are from touching a pillar, or reach into one ``(N,)`` [m]."""
        return np.asarray(np.abs(self._each(middles).min(axis=1) - radius))

    def _each(self, points: FloatArray) -> FloatArray:
        """Distance of points ``(N, 3)`` to each pillar, negative within it ``(N, n)`` [m]."""
        return self._from(points[:, None], self.tops)

    def _from(self, points: FloatArray, tops: FloatArray) -> FloatArray:
        """Distance of points ``(..., 3)`` to pillars with these ``tops (..., 3)`` [m]."""
        aside = np.linalg.norm(points[..., :2] - tops[..., :2], axis=-1) - self.radius
        above = points[..., 2] - tops[..., 2]
        outside = np.hypot(np.maximum(aside, 0.0), np.maximum(above, 0.0))
        return np.asarray(outside + np.minimum(np.maximum(aside, above), 0.0))

    def gap(self, solid: Solid, rotation: FloatArray, origin: FloatArray) -> float:
        """Distance of a solid to the nearest pillar, negative where it reaches into it [m].

        Args:
            solid: the solid.
            rotation, origin: of its joint's frame ``(3, 3)`` and ``(3,)``.
        """
        middle = rotation @ solid.centre + origin
        at_least = self._each(middle[None])[0] - solid.radius
        place, found = solid.transform(rotation, origin), np.inf
        for k in np.argsort(at_least):
            if at_least[k] >= found:
                break
            # The lowest point of the solid lies above the lower end of the cylinder.
            depth = self.tops[k, 2] - (middle[2] - solid.radius) + 2.0 * self.radius
            depth = max(float(depth), 2.0 * self.radius)
            top = coal.Transform3s(np.eye(3), self.tops[k] - np.array([0.0, 0.0, depth / 2.0]))
            distance = coal.distance(
                solid.shape, place, coal.Cylinder(self.radius, depth), top,
                coal.DistanceRequest(), coal.DistanceResult(),
            )  # fmt: skip
            found = min(found, float(distance))
        return found
