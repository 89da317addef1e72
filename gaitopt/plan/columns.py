"""The columns under the footholds of a plan, as upright pillars that go down without end."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from gaitopt.conventions import LEGS, FloatArray
from gaitopt.plan.plan import Plan


def stands_on_columns(plan: Plan) -> bool:
    """Whether all that is known of a plan's ground are columns."""
    return plan.footholds.radius is not None and plan.footholds.ground is None


class Columns(NamedTuple):
    """Upright pillars.

    Attributes:
        tops: middles of their tops ``(n, 3)``, from the least x on [m].
        owners: leg of whose footholds each is.
        radius: of all of them [m].
    """

    tops: FloatArray
    owners: tuple[str, ...]
    radius: float

    @classmethod
    def of(cls, plan: Plan) -> Columns:
        """Those of a plan that stands on columns."""
        points = plan.footholds.points
        tops = np.concatenate([points[leg] for leg in LEGS])
        tops = tops - np.array([0.0, 0.0, plan.robot.foot_radius])
        owners = [leg for leg in LEGS for _ in range(len(points[leg]))]
        order = np.argsort(tops[:, 0], kind="stable")
        sorted_owners = tuple([owners[k] for k in order.tolist()])
        return cls(tops[order], sorted_owners, plan.footholds.landing_radius)

    @property
    def spread(self) -> float:
        """How much higher the highest one is than the lowest one [m]."""
        return float(np.ptp(self.tops[:, 2]))

    def distances(self, points: FloatArray) -> FloatArray:
        """Distances of points ``(..., 3)`` from all of them, negative within: ``(..., n)`` [m]."""
        away = points[..., None, :] - self.tops
        aside = np.hypot(away[..., 0], away[..., 1]) - self.radius
        above = away[..., 2]
        outside = np.hypot(np.maximum(aside, 0.0), np.maximum(above, 0.0))
        return np.asarray(outside + np.minimum(np.maximum(aside, above), 0.0))

    def highest(self, low: FloatArray, high: FloatArray) -> FloatArray:
        """Height of the highest one under rectangles ``(N,)``; minus infinity without one [m].

        Args:
            low, high: corners of the rectangles ``(2, N)`` [m].
        """
        line, out = self.tops[:, 0], np.full(low.shape[1], -np.inf)
        first = np.searchsorted(line, low[0] - self.radius)
        last = np.searchsorted(line, high[0] + self.radius, side="right")
        for k in range(int((last - first).max(initial=0))):
            some = np.flatnonzero(first + k < last)
            tops = self.tops[first[some] + k].T
            away = tops[:2] - np.clip(tops[:2], low[:, some], high[:, some])
            over = (away**2).sum(axis=0) <= self.radius**2
            out[some] = np.maximum(out[some], np.where(over, tops[2], -np.inf))
        return out
